//! Numbers of motors and of axes, and what has an entry for each.

use core::fmt;
use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, NamedType};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Most motors in a message or in a stored configuration. How many of them a board can step is the
/// board's: see [`MOTORS`].
pub const MAX_MOTORS: usize = 4;

/// Most motors that a board of this version steps, each with a cable: A, B and C.
pub const MOTORS: usize = 3;

/// Least motors of a rig: A and B, whose ball moves in a plane.
pub const LEAST_MOTORS: usize = 2;

/// Number of axes of the rig frame: x, y and z.
pub const AXES: usize = 3;

/// An entry for each motor that a board can step, in the order A, B, C. What a rig has not is at
/// rest.
pub type PerMotor<T> = [T; MOTORS];

/// An entry for each axis of the rig frame, in the order x, y, z.
pub type PerAxis<T> = [T; AXES];

/// A list with an entry for each motor of a rig, in the order A, B, C, D: up to [`MAX_MOTORS`].
/// On the wire a number and as many entries, one at least.
#[derive(Clone, Copy)]
pub struct MotorList<T> {
    count: u8,
    /// What is behind the first `count` entries has no meaning.
    entries: [T; MAX_MOTORS],
}

impl<T: Copy> MotorList<T> {
    /// Returns the list of these entries: 1 to [`MAX_MOTORS`]. Another number does not compile.
    pub const fn new<const N: usize>(list: [T; N]) -> Self {
        const { assert!(0 < N && N <= MAX_MOTORS) };
        let mut entries = [list[0]; MAX_MOTORS];
        let mut i = 1;
        while i < N {
            entries[i] = list[i];
            i += 1;
        }
        Self { count: N as u8, entries }
    }

    /// Returns `count` entries, 1 to [`MAX_MOTORS`], each the `value` of its motor's index. Another
    /// count is the next of these.
    pub fn from_fn(count: usize, mut value: impl FnMut(usize) -> T) -> Self {
        let count = count.clamp(1, MAX_MOTORS);
        let mut entries = [value(0); MAX_MOTORS];
        for (i, entry) in entries[..count].iter_mut().enumerate().skip(1) {
            *entry = value(i);
        }
        Self { count: count as u8, entries }
    }

    /// Returns the list of what `change` makes of each entry.
    pub fn map<U: Copy>(self, change: impl FnMut(T) -> U) -> MotorList<U> {
        MotorList { count: self.count, entries: self.entries.map(change) }
    }

    /// Returns the first `count` entries, or all if there are fewer.
    #[must_use]
    pub fn up_to(self, count: usize) -> Self {
        Self { count: self.count.min(count.min(MAX_MOTORS) as u8), ..self }
    }

    /// Returns an entry for each motor that a board can step: `absent` for those that the rig has
    /// not.
    pub fn steppable(&self, absent: T) -> PerMotor<T> {
        core::array::from_fn(|i| self.get(i).copied().unwrap_or(absent))
    }
}

impl<T: Copy, const N: usize> From<[T; N]> for MotorList<T> {
    fn from(list: [T; N]) -> Self {
        Self::new(list)
    }
}

impl<T> Deref for MotorList<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.entries[..usize::from(self.count)]
    }
}

impl<T> DerefMut for MotorList<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.entries[..usize::from(self.count)]
    }
}

impl<'a, T> IntoIterator for &'a MotorList<T> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut MotorList<T> {
    type Item = &'a mut T;
    type IntoIter = core::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: Default + Copy> Default for MotorList<T> {
    /// Returns an empty list.
    fn default() -> Self {
        Self { count: 0, entries: [T::default(); MAX_MOTORS] }
    }
}

impl<T: PartialEq> PartialEq for MotorList<T> {
    // The comparison of slices is a function of `core`, which a chip would run from flash.
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.count == other.count && self.iter().zip(other).all(|(one, other)| one == other)
    }
}

impl<T: PartialEq, const N: usize> PartialEq<[T; N]> for MotorList<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: Eq> Eq for MotorList<T> {}

impl<T: fmt::Debug> fmt::Debug for MotorList<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: Serialize> Serialize for MotorList<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&**self)
    }
}

impl<'de, T: Deserialize<'de> + Copy> Deserialize<'de> for MotorList<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(List(PhantomData))
    }
}

impl<T: Schema> Schema for MotorList<T> {
    const SCHEMA: &'static NamedType =
        &NamedType { name: "MotorList", ty: &DataModelType::Seq(T::SCHEMA) };
}

/// Reads a list.
struct List<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de> + Copy> Visitor<'de> for List<T> {
    type Value = MotorList<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list with an entry for each motor, {MAX_MOTORS} at most")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<MotorList<T>, A::Error> {
        let wrong = |count| A::Error::invalid_length(count, &self);
        let first = sequence.next_element()?.ok_or_else(|| wrong(0))?;
        let mut list = MotorList::new([first]);
        while let Some(entry) = sequence.next_element()? {
            let place = list.entries.get_mut(usize::from(list.count));
            *place.ok_or_else(|| wrong(MAX_MOTORS + 1))? = entry;
            list.count += 1;
        }
        Ok(list)
    }
}
