//! What the whole-system tests in `tests/` share: a board in virtual time, rigs that misbehave, links that damage.

pub mod bench;
pub mod damage;
pub mod plants;
