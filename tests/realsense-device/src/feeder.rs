//! Thread that feeds a software camera in real time.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::camera::{SoftwareCamera, Stamp, UNIT};
use plumb_openni_driver::Control;

/// Thread that sends pictures of a scene in real time, until it is dropped. Of the scene it uses
/// the ball, the rate, the offset of the depth time stamps, and the lack of all or of the depth
/// pictures.
pub struct Feeder {
    scene: Arc<Mutex<Option<Control>>>,
    thread: Option<JoinHandle<()>>,
}

impl Feeder {
    /// Starts to send pictures of `scene` through `camera`. The camera's clock starts at 1000 s.
    pub fn start(camera: Arc<SoftwareCamera>, scene: Control) -> Self {
        let shared = Arc::new(Mutex::new(Some(scene)));
        let scene = Arc::clone(&shared);
        let thread = thread::spawn(move || {
            let (start, mut due) = (Instant::now(), Instant::now());
            let shown = || *scene.lock().unwrap_or_else(PoisonError::into_inner);
            while let Some(scene) = shown() {
                send(&camera, &scene, 1000.0 + start.elapsed().as_secs_f64());
                due += Duration::from_secs_f64(1.0 / scene.rate);
                // A picture that is overdue is left out.
                due = due.max(Instant::now());
                thread::sleep(due - Instant::now());
            }
        });
        Self { scene: shared, thread: Some(thread) }
    }

    /// Shows another scene.
    pub fn show(&self, scene: Control) {
        *self.scene.lock().unwrap_or_else(PoisonError::into_inner) = Some(scene);
    }
}

/// Sends both pictures of a moment. A sensor that is not started drops them.
fn send(camera: &SoftwareCamera, scene: &Control, time: f64) {
    if scene.silent {
        return;
    }
    let _ = camera.send_colour(scene, Stamp::at(time));
    if !scene.blind {
        let _ = camera.send_depth(scene, Stamp::at(time + scene.depth_late), UNIT);
    }
}

impl Drop for Feeder {
    fn drop(&mut self) {
        *self.scene.lock().unwrap_or_else(PoisonError::into_inner) = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
