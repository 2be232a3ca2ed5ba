//! What a camera would see of the workspace. Each value of its file may be possible, and all of
//! them together not. These are warnings: `plumb check` also finds a wrong pose by jogs.

use nalgebra::{Isometry3, Point3, Translation3};
use plumb_frame::camera::{CalibratedFor, Camera};

use crate::rig::Rig;
use crate::rig::document::{Document, Finding, Severity};
use crate::rig::quantity::Corner;

/// Fields of view of lenses, degrees.
const FIELDS_OF_VIEW: std::ops::RangeInclusive<f64> = 3.0..=150.0;
/// Ratios of the two focal lengths.
const ASPECTS: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Largest distance of a camera from the workspace, metres. Depth cameras reach 10 m.
const FARTHEST_M: f64 = 30.0;
/// Least diameter of the ball in the picture, pixels. The detector seldom finds smaller ones.
const LEAST_PIXELS: f64 = 4.0;
/// Values of the depth picture at the workspace. Fewer units are too coarse, and it has 16 bits.
const DEPTHS: std::ops::RangeInclusive<f64> = 100.0..=65_534.0;

/// View of a camera on the workspace of a rig.
struct View<'a> {
    document: &'a Document<'a>,
    camera: &'a Camera,
    /// Size of the pictures, pixels.
    size: [f64; 2],
    /// Corners of the workspace, the middles between them, and its middle, metres.
    places: Vec<Point3<f64>>,
    /// Middle of the workspace, metres.
    middle: Point3<f64>,
}

/// Returns what is not plausible about the camera of `document` and the workspace of `rig`; nothing
/// where the intrinsics are to be estimated yet, or jogs are to find the pose.
pub(super) fn findings(document: &Document<'_>, camera: &Camera, rig: &Rig) -> Vec<Finding> {
    if camera.calibrated_for == CalibratedFor::Nothing || rig.plane.is_some() {
        return Vec::new();
    }
    let view = View::new(document, camera, rig);
    // The rest follows from a wrong lens or place.
    let mut findings = view.lens();
    if findings.is_empty() {
        findings.extend(view.place());
    }
    if findings.is_empty() {
        findings.extend(view.ball());
        findings.extend(view.depth());
    }
    findings
}

impl<'a> View<'a> {
    fn new(document: &'a Document<'a>, camera: &'a Camera, rig: &Rig) -> Self {
        let intrinsics = &camera.intrinsics;
        let size = match camera.calibrated_for {
            CalibratedFor::Size(size) => [size.width as f64, size.height as f64],
            _ => [2.0 * intrinsics.cx + 1.0, 2.0 * intrinsics.cy + 1.0],
        };
        let corner = |corner: [Corner; 3]| Point3::from(corner.map(Corner::get));
        let (min, max) = (corner(rig.workspace.min), corner(rig.workspace.max));
        // Each digit of the number, in base 3, is the place along an axis.
        let along = |number: usize, axis: usize| {
            let share = (number / 3_usize.pow(axis as u32) % 3) as f64 / 2.0;
            min[axis] + (max[axis] - min[axis]) * share
        };
        let places = (0..27).map(|number| Point3::from([0, 1, 2].map(|axis| along(number, axis))));
        let middle = nalgebra::center(&min, &max);
        Self { document, camera, size, places: places.collect(), middle }
    }

    fn warning(&self, keys: &[&str], problem: String) -> Finding {
        self.document.finding(Severity::Warning, keys, problem)
    }

    /// Checks the fields of view and the shape of the pixels.
    fn lens(&self) -> Vec<Finding> {
        let intrinsics = &self.camera.intrinsics;
        let axes = [("intrinsics.fx", intrinsics.fx), ("intrinsics.fy", intrinsics.fy)];
        let mut found = Vec::new();
        for ((key, focal), size) in axes.into_iter().zip(self.size) {
            let angle = 2.0 * (size / (2.0 * focal)).atan().to_degrees();
            if !FIELDS_OF_VIEW.contains(&angle) {
                let problem = format!(
                    "makes a field of view of {angle:.1}° of a picture of {size:.0} pixels: is it \
                     in pixels?"
                );
                found.push(self.warning(&[key], problem));
            }
        }
        let aspect = intrinsics.fx / intrinsics.fy;
        if found.is_empty() && !ASPECTS.contains(&aspect) {
            let problem = format!("have the ratio {aspect:.2}: the pixels are not square");
            found.push(self.warning(&["intrinsics.fx", "intrinsics.fy"], problem));
        }
        found.extend(self.upright());
        found
    }

    /// Warns of a middle of the lens that belongs to a picture higher than wide. Where the file
    /// says the size of its pictures, they may be so.
    fn upright(&self) -> Option<Finding> {
        let [width, height] = self.size;
        let is_known = matches!(self.camera.calibrated_for, CalibratedFor::Size(_));
        (!is_known && height > width).then(|| {
            let problem = format!(
                "are the middle of a picture of about {width:.0} x {height:.0} pixels, higher than \
                 wide: are they exchanged?"
            );
            self.warning(&["intrinsics.cx", "intrinsics.cy"], problem)
        })
    }

    /// Returns the pixel of a place in the rig frame for a camera with this pose; `None` behind it.
    fn pixel(&self, pose: &Isometry3<f64>, place: &Point3<f64>) -> Option<(f64, f64)> {
        self.camera.intrinsics.project(&pose.inverse_transform_point(place))
    }

    /// Returns whether a camera with this pose sees a place in the rig frame.
    fn sees(&self, pose: &Isometry3<f64>, place: &Point3<f64>) -> bool {
        let [width, height] = self.size;
        self.pixel(pose, place).is_some_and(|(u, v)| {
            (-0.5..width - 0.5).contains(&u) && (-0.5..height - 0.5).contains(&v)
        })
    }

    /// Checks that the workspace is near and in the picture.
    fn place(&self) -> Option<Finding> {
        let pose = &self.camera.pose;
        let distance = (self.middle.coords - pose.translation.vector).norm();
        if distance > FARTHEST_M {
            let problem =
                format!("is {distance:.0} m from the middle of the workspace: is it in metres?");
            return Some(self.warning(&["pose.translation"], problem));
        }
        let seen = self.places.iter().filter(|place| self.sees(pose, place)).count();
        if seen > 0 {
            return self.partly(seen);
        }
        let [width, height] = self.size;
        let middle = match self.pixel(pose, &self.middle) {
            None => "is behind the camera".to_owned(),
            Some((u, v)) => {
                format!("would be at ({u:.0}, {v:.0}) of a picture of {width:.0} x {height:.0}")
            }
        };
        let problem = format!(
            "do not see the workspace: its middle is {distance:.2} m away, and {middle}{}",
            self.advice()
        );
        Some(self.warning(&["pose.translation", "pose.quaternion"], problem))
    }

    /// Warns where less than half of the workspace is in the picture, which shows `seen` of its
    /// places.
    fn partly(&self, seen: usize) -> Option<Finding> {
        let all = self.places.len();
        (seen * 2 < all).then(|| {
            let percent = 100 * seen / all;
            let problem = format!(
                "see {percent} % of the workspace, and the ball must be seen everywhere in it: \
                 turn the camera, move it back, or make the workspace smaller"
            );
            self.warning(&["pose.translation", "pose.quaternion"], problem)
        })
    }

    /// Returns the end of a sentence about a pose that would see the workspace; empty where none of
    /// the usual ones does.
    fn advice(&self) -> &'static str {
        let pose = &self.camera.pose;
        let sees = |pose: &Isometry3<f64>| self.sees(pose, &self.middle);
        let thousandth = Translation3::from(pose.translation.vector / 1000.0);
        if sees(&pose.inverse()) {
            "; the inverse of this pose sees it: the file needs the camera in the rig frame, not \
             the rig in camera axes"
        } else if sees(&Isometry3::from_parts(thousandth, pose.rotation)) {
            "; is the translation in metres?"
        } else {
            ""
        }
    }

    /// Returns the distance of the middle of the workspace along the optical axis, metres; `None`
    /// where it is not in front of the camera.
    fn range(&self) -> Option<f64> {
        Some(self.camera.depth_of(&self.middle)).filter(|range| *range > 0.0)
    }

    /// Checks the size of the ball in the picture.
    fn ball(&self) -> Option<Finding> {
        let range = self.range()?;
        let radius = self.camera.ball_diameter / 2.0;
        let pixels = 2.0 * self.camera.intrinsics.radius_at(radius, range);
        (!(LEAST_PIXELS..=self.size[1]).contains(&pixels)).then(|| {
            let problem = format!(
                "makes a ball of {pixels:.1} pixels in the middle of the workspace, {range:.2} m \
                 away: is it in metres?"
            );
            self.warning(&["ball.diameter_m"], problem)
        })
    }

    /// Checks the values of the depth picture at the workspace.
    fn depth(&self) -> Option<Finding> {
        let (range, scale) = (self.range()?, self.camera.intrinsics.depth_scale);
        let units = range * scale;
        (self.camera.intrinsics.has_depth() && !DEPTHS.contains(&units)).then(|| {
            let problem = format!(
                "makes {units:.1} units of the {range:.2} m to the middle of the workspace, and a \
                 depth picture has up to 65535: 1000 is for millimetres"
            );
            self.warning(&["intrinsics.depth_scale"], problem)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plumb_cameras::camera_file;

    use super::*;

    /// Returns the findings about the paper's rig with its camera file, in which each first text is
    /// replaced by the second.
    fn found(replaced: &[(&str, &str)]) -> Vec<String> {
        let (path, mut text) = (Path::new("camera.toml"), camera_file::PAPER.to_owned());
        for (from, to) in replaced {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let camera = camera_file::parse(path, &text).unwrap();
        let document = Document::new(path, &text, camera_file::REFERENCE);
        let findings = findings(&document, &camera, &Rig::paper().unwrap());
        findings.iter().map(Finding::to_string).collect()
    }

    #[test]
    fn the_paper_s_camera_is_plausible() {
        assert_eq!(found(&[]), [""; 0]);
        assert_eq!(found(&[("5000.0", "\"none\"")]), [""; 0]);
        assert_eq!(found(&[("5000.0", "1000"), ("0.08", "0.03")]), [""; 0]);
    }

    #[test]
    fn implausible_values_are_named_with_what_the_camera_would_see() {
        for (replaced, named) in [
            (&[("fx = 525.0", "fx = 5")][..], "`intrinsics.fx = 5` makes a field of view of 17"),
            (&[("fy = 525.0", "fy = 300.0")], "have the ratio 1.75"),
            (&[("cx = 319.5", "cx = 239.5"), ("cy = 239.5", "cy = 319.5")], "are they exchanged?"),
            (&[("1.737, 0.286, 0.225", "90, 0.286, 0.225")], "is it in metres?"),
            (&[("1.737, 0.286, 0.225", "1.737, 5, 0.225")], "do not see the workspace"),
            (&[("1.737, 0.286, 0.225", "1.737, 1.286, 0.225")], "of the workspace, and the ball"),
            (&[("[-0.5, -0.5, 0.5, 0.5]", "[0.5, 0.5, 0.5, 0.5]")], "is behind the camera"),
            (&[("0.08", "8")], "pixels in the middle of the workspace, 1.29 m away: is it in"),
            (&[("0.08", "0.002")], "`ball.diameter_m = 0.002` makes a ball of 0.8 pixels"),
            (&[("5000.0", "5.0")], "makes 6.4 units of the 1.29 m"),
            (&[("5000.0", "1e6")], "`intrinsics.depth_scale = 1e6` makes"),
        ] {
            let found = found(replaced);
            assert!(found.len() == 1 && found[0].contains(named), "{replaced:?}: {found:?}");
        }
    }

    #[test]
    fn the_inverse_of_a_pose_is_named() {
        let inverse = [
            ("[1.737, 0.286, 0.225]", "[-0.286, 0.225, 1.737]"),
            ("[-0.5, -0.5, 0.5, 0.5]", "[0.5, 0.5, -0.5, 0.5]"),
        ];
        let found = found(&inverse);
        assert!(found[0].contains("the inverse of this pose sees it"), "{found:?}");
    }
}
