//! Many runs on several processors.

use std::sync::Mutex;
use std::thread;

/// Returns the number of processors, at least 1.
pub fn processors() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Applies `work` to each item, on `threads` threads (at least one). Returns the results in the
/// order of the items.
///
/// # Panics
/// If `work` panics.
pub fn map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T, IntoIter: Send>,
    threads: usize,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let queue = Mutex::new(items.into_iter().enumerate());
    let done = Mutex::new(Vec::new());
    let worker = || {
        loop {
            let next = queue.lock().expect("no run panics").next();
            let Some((index, item)) = next else { return };
            let result = work(item);
            done.lock().expect("no run panics").push((index, result));
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(worker);
        }
    });
    let mut done = done.into_inner().expect("no run panics");
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        let squares: Vec<u32> = (0..100).map(|number| number * number).collect();
        for threads in [0, 1, 3] {
            assert_eq!(map(0..100, threads, |number| number * number), squares);
        }
    }
}
