//! Reading the depth of a frame at many places.

use crate::camera::Intrinsics;
use crate::frame::RgbdFrame;

/// The depth image of a frame.
pub(crate) struct DepthView<'a> {
    raw: &'a [u16],
    width: i32,
    height: i32,
    intrinsics: &'a Intrinsics,
}

impl<'a> DepthView<'a> {
    /// Borrows the depth image of `frame`.
    pub(crate) fn new(frame: &'a RgbdFrame) -> Self {
        let depth = frame.depth();
        let (width, height) = (depth.width() as i32, depth.height() as i32);
        Self { raw: depth.pixels(), width, height, intrinsics: frame.intrinsics() }
    }

    /// Returns the intrinsics of the image.
    #[inline]
    pub(crate) fn intrinsics(&self) -> &Intrinsics {
        self.intrinsics
    }

    /// Checks whether (`u`, `v`) is in the image.
    #[inline]
    pub(crate) fn contains(&self, u: f64, v: f64) -> bool {
        u >= -0.5
            && v >= -0.5
            && u < f64::from(self.width) - 0.5
            && v < f64::from(self.height) - 0.5
    }

    /// Returns the raw depths of a row, 0 where the depth is unknown; none outside the image.
    pub(crate) fn row(&self, row: usize) -> &'a [u16] {
        self.raw.chunks_exact(self.width.max(1) as usize).nth(row).unwrap_or_default()
    }

    /// Returns the depth in metres at the pixel nearest to (`u`, `v`); `None` outside the image or
    /// where the depth is unknown.
    #[inline]
    pub(crate) fn at(&self, u: f64, v: f64) -> Option<f64> {
        if !self.contains(u, v) {
            return None;
        }
        // Both are at least 0: a cast rounds down without a call of the C library's floor.
        let [column, row] = [u, v].map(|k| (k + 0.5) as u32 as usize);
        let width = self.width as usize;
        // In an image of one column the sum may be rounded up to the next one.
        let raw = self.raw.get(row * width + column).filter(|_| column < width)?;
        self.metres(*raw)
    }

    /// Returns a raw depth in metres; `None` if it is unknown.
    #[inline]
    pub(crate) fn metres(&self, raw: u16) -> Option<f64> {
        (raw != 0).then(|| f64::from(raw) / self.intrinsics.depth_scale)
    }
}
