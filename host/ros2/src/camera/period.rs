//! Time between two pictures, from their stamps.

use std::collections::VecDeque;

/// Number of differences of stamps that are kept.
const KEPT: usize = 16;

/// Time between two pictures.
///
/// It is the lower quartile of the last differences of stamps: lost pictures make some differences
/// longer, and a node that stamps its pictures late makes some shorter.
#[derive(Debug, Default)]
pub(super) struct Period {
    last: Option<f64>,
    differences: VecDeque<f64>,
}

impl Period {
    /// Adds the stamp of the next picture, seconds. A stamp that does not grow begins anew.
    pub(super) fn add(&mut self, stamp: f64) {
        let difference = self.last.replace(stamp).map(|last| stamp - last);
        let Some(difference) = difference.filter(|difference| *difference > 0.0) else { return };
        if self.differences.len() == KEPT {
            self.differences.pop_front();
        }
        self.differences.push_back(difference);
    }

    /// Returns the period, seconds; `None` before two pictures.
    pub(super) fn seconds(&self) -> Option<f64> {
        let mut sorted = Vec::from(self.differences.clone());
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 4).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the period of pictures with these stamps.
    fn period(stamps: impl IntoIterator<Item = f64>) -> Option<f64> {
        let mut period = Period::default();
        stamps.into_iter().for_each(|stamp| period.add(stamp));
        period.seconds()
    }

    #[test]
    fn the_period_is_known_from_the_second_picture_on() {
        assert_eq!(period([]), None);
        assert_eq!(period([5.0]), None);
        assert_eq!(period([5.0, 5.25]), Some(0.25));
        // A clock that was set.
        assert_eq!(period([5.0, 5.25, 1.0, 1.25]), Some(0.25));
    }

    #[test]
    fn lost_pictures_and_late_stamps_do_not_change_it() {
        let near = |period: Option<f64>| (period.unwrap() - 0.1).abs() < 1e-9;
        // Two of three pictures are lost, now and then.
        let lost = (0..100).filter(|k| k % 10 < 4 || k % 3 == 0);
        assert!(near(period(lost.map(|k| f64::from(k) * 0.1))));
        // Every fifth picture is stamped 80 ms late.
        let late = |k: i32| if k % 5 == 0 { 0.08 } else { 0.0 };
        assert!(near(period((0..100).map(|k| f64::from(k) * 0.1 + late(k)))));
    }
}
