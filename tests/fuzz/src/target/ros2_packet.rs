//! Packets of ROS 2.

use plumb_ros2::fuzzing;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "ros2_packet",
    input: "packets of RTPS, each after its length",
    run,
    max_length: 2000,
    smoke: 10_000,
    words: &["RTPS\x02\x03\x01\x10", "\x15\x05", "\x16\x01"],
};

/// Judges the packets. Those that pass claim no more memory than they may; the last one has some
/// bytes beside its sample.
pub fn run(input: &[u8]) {
    let (_admitted, claimed) = fuzzing::packets(input);
    assert!(claimed < 1.01, "{claimed}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_packets_in_the_corpus_pass() {
        let (admitted, claimed) = fuzzing::packets(include_bytes!("../../corpus/ros2_packet/peer"));
        assert_eq!(admitted, 4);
        assert!(claimed > 0.1, "{claimed}");
    }
}
