//! Calibration files of other programs.

use plumb_import::{Choice, Content, ImportedLens, ImportedPose, read};

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "calibration",
    input: "the text of a calibration file",
    run,
    max_length: 3000,
    smoke: 2_000,
    words: &[
        "camera_matrix:\n",
        "distortion_coefficients:\n",
        "distortion_model: plumb_bob\n",
        "data: [",
        "rows: 3\n",
        "cam0:\n  ",
        "transformation:\n  ",
        "!!opencv-matrix",
        "&a ",
        "*a ",
        "---\n",
        ".nan",
        "1e308",
        ", ",
        "]\n",
    ],
};

/// Reads the text. What is read is a lens or a pose that a camera can have.
pub fn run(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    for choice in [Choice::Only, Choice::Named("cam0")] {
        match read(&text, choice, None).map(|imported| imported.content) {
            Ok(Content::Lens(lens)) => check_lens(&lens),
            Ok(Content::Pose(pose)) => check_pose(&pose),
            Err(error) => assert!(!error.to_string().is_empty(), "{error:?}"),
        }
    }
}

fn check_lens(lens: &ImportedLens) {
    let numbers = [lens.fx, lens.fy, lens.cx, lens.cy];
    assert!(numbers.iter().all(|number| number.is_finite()), "{lens:?}");
    assert!(lens.fx > 0.0 && lens.fy > 0.0, "{lens:?}");
    let coefficients = lens.distortion.map(|it| it.coefficients().to_array());
    assert!(coefficients.unwrap_or_default().iter().all(|it| it.is_finite()), "{lens:?}");
}

fn check_pose(found: &ImportedPose) {
    let (place, rotation) = (found.pose.translation.vector, found.pose.rotation.coords);
    assert!(place.iter().chain(rotation.iter()).all(|number| number.is_finite()), "{found:?}");
    assert!((rotation.norm() - 1.0).abs() < 1e-9, "{found:?}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_in_the_corpus_are_calibrations() {
        for text in [
            include_str!("../../corpus/calibration/ros"),
            include_str!("../../corpus/calibration/opencv"),
            include_str!("../../corpus/calibration/kalibr"),
            include_str!("../../corpus/calibration/handeye"),
        ] {
            assert!(read(text, Choice::Only, None).is_ok(), "{text}");
        }
    }
}
