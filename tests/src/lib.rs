//! Whole-system tests of Plumb; they live in `tests/`.
