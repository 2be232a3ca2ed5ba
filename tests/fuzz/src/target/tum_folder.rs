//! Recordings as TUM RGB-D folders.

use std::fs;

use plumb_cameras::tum::TumFolder;
use tempfile::TempDir;

use super::Target;
use crate::recording;

/// This target.
pub const TARGET: Target = Target {
    name: "tum_folder",
    input: "the files of a folder after each other, with a byte 255 between: rgb.txt, depth.txt, \
            1.png, 2.png",
    run,
    max_length: 4000,
    smoke: 300,
    words: &["1.png", "2.png", "0.1 ", "1e10 ", "nan ", "-inf ", "#", "\n", "../", "\u{feff}"],
};

/// Files of the folder, in their order in the input.
const FILES: [&str; 4] = ["rgb.txt", "depth.txt", "1.png", "2.png"];

/// Column and row in the middle of the corpus's pictures, which have 4x3 pixels.
const MIDDLE: (f64, f64) = (1.5, 1.0);

thread_local! {
    /// The folder, whose files each input replaces.
    static FOLDER: Option<TempDir> = tempfile::tempdir().ok();
}

/// Reads every frame of the folder.
pub fn run(input: &[u8]) {
    let _frames = frames(input);
}

/// Returns the number of frames without an error; `None` where the folder cannot be opened.
fn frames(input: &[u8]) -> Option<usize> {
    FOLDER.with(|folder| {
        let folder = folder.as_ref()?.path();
        // The bytes of a PNG file may contain 255; they are the last of the four.
        let mut contents = input.splitn(FILES.len(), |byte| *byte == 255);
        for name in FILES {
            fs::write(folder.join(name), contents.next().unwrap_or_default()).ok()?;
        }
        let intrinsics = recording::intrinsics(MIDDLE)?;
        Some(recording::whole_frames(TumFolder::open(folder, intrinsics).ok()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_in_the_corpus_has_two_frames() {
        assert_eq!(frames(include_bytes!("../../corpus/tum_folder/two")), Some(2));
    }
}
