//! Colour pictures of a recording with the depth of the same moment.

use std::collections::VecDeque;

use plumb_cameras::tum::MAX_TIME_DIFFERENCE;

use crate::camera::picture::Picture;

/// Most pictures of one kind that wait for the other: two seconds at 30 Hz. Recorders write depth
/// later than its colour.
const WAITING: usize = 60;

/// Colour picture with its depth; `None` where there is none within [`MAX_TIME_DIFFERENCE`].
pub(super) type Pair = (Picture, Option<Picture>);

/// Pictures that wait. Every colour picture comes out, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Frames {
    colours: VecDeque<Picture>,
    depths: VecDeque<Picture>,
    /// Whether the recording has ended: nothing more comes.
    pub(super) has_ended: bool,
}

impl Frames {
    /// Adds a colour picture.
    pub(super) fn add_colour(&mut self, picture: Picture) {
        self.colours.push_back(picture);
    }

    /// Adds a depth picture.
    pub(super) fn add_depth(&mut self, picture: Picture) {
        self.depths.push_back(picture);
    }

    /// Removes the first colour picture, where it is certain which depth picture is nearest to it:
    /// a later one has come, or none will.
    pub(super) fn take(&mut self, has_depth: bool) -> Option<Pair> {
        let first = self.colours.front()?;
        if !has_depth {
            return self.colours.pop_front().map(|colour| (colour, None));
        }
        let stamp = first.header().seconds();
        let is_certain = self.depths.iter().any(|depth| depth.header().seconds() >= stamp)
            || self.has_ended
            || self.colours.len() > WAITING;
        if !is_certain {
            return None;
        }
        let apart = |depth: &Picture| (depth.header().seconds() - stamp).abs();
        let nearest = (0..self.depths.len())
            .min_by(|&a, &b| apart(&self.depths[a]).total_cmp(&apart(&self.depths[b])))
            .filter(|&index| apart(&self.depths[index]) <= MAX_TIME_DIFFERENCE);
        let depth = nearest.and_then(|index| self.depths.remove(index));
        while self.depths.len() > WAITING {
            self.depths.pop_front();
        }
        self.colours.pop_front().map(|colour| (colour, depth))
    }
}
