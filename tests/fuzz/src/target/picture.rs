//! Pictures of other programs: PNG, JPEG, PGM and PPM.

use plumb_pictures::decode;

use super::Target;

/// Most pixels of a picture that is decoded. Larger ones only take longer.
const MAX_PIXELS: usize = 100_000;

/// This target.
pub const TARGET: Target = Target {
    name: "picture",
    input: "a picture file",
    run,
    max_length: 4000,
    smoke: 5_000,
    words: &["P2 ", "P3 ", "P5 ", "P6 ", "255\n", "65535 ", "# ", "IHDR", "IDAT", "IEND", "PLTE"],
};

/// Decodes a picture as colour and as depth. Its size is the one that its header states.
pub fn run(input: &[u8]) {
    let (colour, depth) = match decode::size(input) {
        Some(size) if size.width.saturating_mul(size.height) > MAX_PIXELS => return,
        _ => (decode::colour(input), decode::depth(input)),
    };
    for size in [colour.map(|image| image.size()), depth.map(|image| image.size())] {
        assert!(size.is_err() || size.ok() == decode::size(input));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corpus;

    #[test]
    fn the_pictures_in_the_corpus_are_decoded() {
        let pictures = corpus::read(&corpus::folder(), &TARGET).unwrap();
        assert!(pictures.iter().all(|picture| decode::colour(picture).is_ok()));
        let depths = pictures.iter().filter(|picture| decode::depth(picture).is_ok()).count();
        assert_eq!(depths, 2);
    }
}
