//! Recordings as `.oni` files.

use plumb_openni::fuzzing;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "oni_file",
    input: "an .oni file",
    run,
    max_length: 3000,
    smoke: 20_000,
    words: &[
        "NI10",
        "NIR\0",
        "xnMapOutputMode\0",
        "oniRequiredFrameSize\0",
        "JPEG",
        "16zT",
        "NONE",
    ],
};

/// Checks the file. What is accepted ends within the input.
pub fn run(input: &[u8]) {
    if let Some((_, length)) = fuzzing::oni_file(input) {
        assert!(length <= input.len() as u64, "{length} bytes of {}", input.len());
    }
}

#[cfg(test)]
mod tests {
    use plumb_openni::fuzzing;

    #[test]
    fn the_recording_in_the_corpus_is_accepted() {
        let recording = include_bytes!("../../corpus/oni_file/depth.oni");
        assert_eq!(fuzzing::oni_file(recording), Some((2, recording.len() as u64)));
    }
}
