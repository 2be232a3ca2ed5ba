//! Pictures of several channels, as the layers read and write them.

use std::cell::RefCell;
use std::mem;

use multiversion::multiversion;

/// Number of channels that the networks read: red, green, blue, a depth, and whether it is known.
pub(super) const CHANNELS: usize = 5;
/// Number of colour channels; they come first.
pub(super) const COLOURS: usize = 3;

/// The number of pixels that layers compute of a channel is a multiple of one of these: of three or
/// of two registers of the widest kind (16 numbers).
pub(super) const LONG_STEP: usize = 48;
const SHORT_STEP: usize = 32;

/// Largest number of maps whose memory is kept: of all layers, for the sizes of a few windows.
const MAX_FREE: usize = 100;

thread_local! {
    /// Memory of maps that are no longer used: new memory would cost more than the layers.
    static FREE: RefCell<Vec<Vec<f32>>> = const { RefCell::new(Vec::new()) };
}

/// A picture of several channels.
///
/// A convolution reads beyond the border of the picture. Each channel therefore has as many rows
/// more above and below, and as many columns between the end of a row and the start of the next
/// one, as `border` says.
#[derive(Debug, PartialEq)]
pub(in super::super) struct Map {
    pub(in super::super) rows: usize,
    pub(in super::super) columns: usize,
    pub(super) border: usize,
    /// The channels, each of [`Map::stride`] values.
    pub(super) values: Vec<f32>,
}

impl Drop for Map {
    fn drop(&mut self) {
        let values = mem::take(&mut self.values);
        FREE.with_borrow_mut(|free| {
            if free.len() == MAX_FREE {
                free.clear();
            }
            free.push(values);
        });
    }
}

impl Map {
    /// Makes the input of a network. The colours have any finite values, which the caller replaces;
    /// depth and whether it is known are 0, or missing if no pixel has depth: a layer takes missing
    /// channels for zeros.
    pub(in super::super) fn input(rows: usize, columns: usize, has_depth: bool) -> Self {
        let count = if has_depth { CHANNELS } else { COLOURS };
        let mut map = Self::unset(rows, columns, 0, count);
        let depth = COLOURS * map.stride();
        map.values[depth..].fill(0.0);
        map
    }

    /// Makes a map of any finite values, which the caller replaces.
    pub(super) fn unset(rows: usize, columns: usize, border: usize, channels: usize) -> Self {
        let mut map = Self { rows, columns, border, values: Vec::new() };
        let count = map.stride() * channels;
        // Memory of another size would have to be set first.
        let values = FREE.with_borrow_mut(|free| {
            let place = free.iter().rposition(|values| values.len() == count)?;
            Some(free.swap_remove(place))
        });
        map.values = values.unwrap_or_else(|| vec![0.0; count]);
        map
    }

    /// Returns a map of numbers from -1 to 1, in the border too.
    #[cfg(test)]
    pub(super) fn pattern(
        [rows, columns]: [usize; 2],
        border: usize,
        channels: usize,
        seed: usize,
    ) -> Self {
        let mut map = Self::unset(rows, columns, border, channels);
        for (i, value) in map.values.iter_mut().enumerate() {
            *value = ((i + seed) * 37 % 101) as f32 / 50.0 - 1.0;
        }
        map
    }

    /// Returns the distance of the first pixels of two rows.
    #[inline]
    pub(super) fn width(&self) -> usize {
        self.columns + self.border
    }

    /// Returns the place of the first pixel in a channel.
    #[inline]
    pub(super) fn start(&self) -> usize {
        self.border * (self.width() + 1)
    }

    /// Returns the number of values, from the first pixel of a channel on, that layers compute: the
    /// rows with the columns between them, and a few values more.
    #[inline]
    pub(super) fn span(&self) -> usize {
        let pixels = self.rows * self.width();
        pixels.next_multiple_of(LONG_STEP).min(pixels.next_multiple_of(SHORT_STEP))
    }

    /// Returns the number of values of a channel.
    #[inline]
    pub(super) fn stride(&self) -> usize {
        self.start() + self.span() + self.start()
    }

    /// Returns the number of channels.
    pub(super) fn channels(&self) -> usize {
        self.values.len() / self.stride()
    }

    /// Returns the rows of a channel.
    pub(in super::super) fn rows_of(&self, channel: usize) -> impl Iterator<Item = &[f32]> {
        let values = &self.values[channel * self.stride() + self.start()..];
        values.chunks(self.width()).take(self.rows).map(|row| &row[..self.columns])
    }

    /// Returns the value of a channel at column `x`, row `y`.
    pub(in super::super) fn at(&self, channel: usize, x: usize, y: usize) -> f32 {
        self.values[channel * self.stride() + self.start() + y * self.width() + x]
    }

    /// Returns the first `N` channels of a map without a border, row by row, to be changed; of a
    /// missing channel none.
    pub(in super::super) fn channels_mut<const N: usize>(&mut self) -> [&mut [f32]; N] {
        let (stride, pixels) = (self.stride(), self.rows * self.columns);
        let mut channels = self.values.chunks_exact_mut(stride);
        std::array::from_fn(|_| channels.next().map_or(&mut [][..], |values| &mut values[..pixels]))
    }

    /// Mirrors a map without a border: left becomes right.
    pub(in super::super) fn mirror(&mut self) {
        let (stride, pixels) = (self.stride(), self.rows * self.columns);
        for channel in self.values.chunks_exact_mut(stride) {
            channel[..pixels].chunks_exact_mut(self.columns).for_each(<[f32]>::reverse);
        }
    }

    /// Sets all values but the pixels to 0.
    pub(super) fn clear_border(&mut self) {
        let (stride, start, width) = (self.stride(), self.start(), self.width());
        for channel in self.values.chunks_exact_mut(stride) {
            channel[..start].fill(0.0);
            let (pixels, below) = channel[start..].split_at_mut(self.rows * width);
            below.fill(0.0);
            // For each row a call of `fill` would cost more than the few values do.
            for column in self.columns..width {
                pixels.iter_mut().skip(column).step_by(width).for_each(|value| *value = 0.0);
            }
        }
    }

    /// Returns the map at half the size and with this border, with four channels for each of
    /// `self`: the pixels of each square of 2x2, row by row. The border has any finite values.
    pub(super) fn folded(&self, border: usize) -> Self {
        let (rows, columns) = (self.rows / 2, self.columns / 2);
        let mut folded = Self::unset(rows, columns, border, 4 * self.channels());
        let (start, width, stride) = (folded.start(), folded.width(), folded.stride());
        for (half, target) in folded.values.chunks_exact_mut(2 * stride).enumerate() {
            let (source, dy) = (half / 2, half % 2);
            let values = &self.values[source * self.stride() + self.start() + dy * self.width()..];
            let (even, odd) = target.split_at_mut(stride);
            let targets = [&mut even[start..], &mut odd[start..]];
            split(values, 2 * self.width(), targets, width, [rows, columns]);
        }
        folded
    }
}

/// Splits the pixels of rows, which are `distance` apart in `values`, in the even and the odd ones,
/// whose rows are `width` apart.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn split(
    values: &[f32],
    distance: usize,
    [even, odd]: [&mut [f32]; 2],
    width: usize,
    [rows, columns]: [usize; 2],
) {
    let halves = even.chunks_mut(width).zip(odd.chunks_mut(width)).take(rows);
    for (line, (even, odd)) in values.chunks(distance).zip(halves) {
        let pairs = line[..2 * columns].as_chunks::<2>().0.iter();
        let places = even[..columns].iter_mut().zip(&mut odd[..columns]);
        for (pair, (even, odd)) in pairs.zip(places) {
            (*even, *odd) = (pair[0], pair[1]);
        }
    }
}
