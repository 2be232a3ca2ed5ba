//! Time stamps of the messages.

use foxglove::messages::Timestamp;

const NANOSECONDS: u64 = 1_000_000_000;

/// Converts a stamp for a message of Foxglove's.
pub(crate) fn timestamp(stamp: u64) -> Option<Timestamp> {
    let seconds = u32::try_from(stamp / NANOSECONDS).ok()?;
    Timestamp::new_checked(seconds, (stamp % NANOSECONDS) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_keeps_its_nanoseconds() {
        let stamp = timestamp(1_800_000_000_123_456_789).unwrap();
        assert_eq!((stamp.sec(), stamp.nsec()), (1_800_000_000, 123_456_789));
        assert_eq!(timestamp(u64::MAX), None);
    }
}
