//! Measurement of computing time, and the reference that times are compared with.

use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use opencv::boxed_ref::BoxedRef;
use opencv::core::{
    CV_32F, Mat, MatTraitConst, Point, Size, Vec3b, extract_channel, get_num_threads, min_max_loc,
    set_num_threads, subtract_def,
};
use opencv::imgproc::gaussian_blur_def;
use plumb_vision::detect::red::RedParameters;
use plumb_vision::frame::RgbdFrame;
use plumb_vision::image::ColourImage;

/// Returns the CPU time of this thread, which other programs do not affect.
pub(super) fn computed() -> Duration {
    // Without such a clock (Linux has one) every time is 0.
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map(Duration::from).unwrap_or_default()
}

/// Returns the CPU time of this thread since `since`, milliseconds.
pub(super) fn milliseconds(since: Duration) -> f64 {
    (computed() - since).as_secs_f64() * 1e3
}

/// Radius of the ball of the reference, pixels.
const RADIUS: f64 = 20.0;

/// Borrows a colour image as an OpenCV matrix of type `CV_8UC3`.
fn borrow_colour(image: &ColourImage) -> opencv::Result<BoxedRef<'_, Mat>> {
    let [rows, columns] = [image.height() as i32, image.width() as i32];
    Mat::new_rows_cols_with_bytes::<Vec3b>(rows, columns, image.channels())
}

/// Computes the reference that times are compared with: the difference of Gaussians of the detector
/// `red` at full size. Returns its highest point.
pub(super) fn red_difference_of_gaussians(frame: &RgbdFrame) -> opencv::Result<Point> {
    let (mut red, mut wide, mut narrow, mut map) =
        (Mat::default(), Mat::default(), Mat::default(), Mat::default());
    extract_channel(&borrow_colour(frame.colour())?, &mut map, 2)?;
    map.convert_to_def(&mut red, CV_32F)?;
    let RedParameters { narrow_sigma, wide_sigma, .. } = RedParameters::DEFAULT;
    gaussian_blur_def(&red, &mut narrow, Size::default(), narrow_sigma * RADIUS)?;
    gaussian_blur_def(&red, &mut wide, Size::default(), wide_sigma * RADIUS)?;
    subtract_def(&narrow, &wide, &mut map)?;
    let mut place = Point::default();
    min_max_loc(&map, None, None, None, Some(&mut place), &Mat::default())?;
    Ok(place)
}

/// Guard that limits OpenCV to one thread during its life.
pub(super) struct OneThread(i32);

impl OneThread {
    /// Limits OpenCV to one thread.
    pub(super) fn new() -> opencv::Result<Self> {
        let before = get_num_threads()?;
        set_num_threads(1)?;
        Ok(Self(before))
    }
}

impl Drop for OneThread {
    fn drop(&mut self) {
        // A failure only costs speed.
        let _ = set_num_threads(self.0);
    }
}
