//! Motions of the ball that a rig allows, as far as its file tells.

use nalgebra::{Point3, Vector3};
use plumb_config::quantity::Coordinate;
use plumb_protocol::units::Point;

use super::motion_error::{MistakenUnit, MotionError, Outside, Side, WrongTarget};
use super::picture::RigPicture;
use super::size::{Box3, RoughSize};
use crate::rounding::round;

/// Names of the motors.
const MOTORS: [char; 3] = ['A', 'B', 'C'];

/// Names of the axes of the rig frame.
const AXES: [char; 3] = ['x', 'y', 'z'];

/// Distance beyond the border of the workspace at which a target still is inside, metres: half of
/// the board's unit.
const ROUNDING_M: f64 = 0.5e-6;

/// Largest coordinate of a place from which on it may be in another unit than metres: a workspace
/// reaches to 4 m.
const LEAST_IN_OTHER_UNIT: f64 = 10.0;

/// Rules for a motion of the ball, from the rig file.
#[derive(Debug, Clone)]
pub struct MotionRules {
    pub(super) workspace: Box3,
    /// Rough size, if it is known.
    pub(super) size: Option<RoughSize>,
    /// Highest rate of the motors, full steps/s.
    pub(super) max_rate: f64,
    /// The picture of two motors, where it is measured.
    pub(super) picture: Option<RigPicture>,
}

impl MotionRules {
    /// Returns the picture of two motors, where it is measured.
    pub fn picture(&self) -> Option<&RigPicture> {
        self.picture.as_ref()
    }

    /// Checks a place of the ball, metres, and its velocity there, m/s.
    ///
    /// # Errors
    /// The first rule that the motion breaks.
    pub fn check(&self, place: Point3<f64>, velocity: Vector3<f64>) -> Result<(), MotionError> {
        self.check_picture(place)?;
        self.check_workspace(place, 0.0)?;
        self.check_triangle(place)?;
        for (rate, motor) in self.rates(place, velocity).zip(MOTORS) {
            if rate > self.max_rate {
                return Err(MotionError::MotorRate { motor, rate, limit: self.max_rate });
            }
        }
        Ok(())
    }

    /// Returns the rates of the motors for a motion of the ball, full steps/s; none where nothing
    /// tells where they are.
    fn rates(&self, place: Point3<f64>, velocity: Vector3<f64>) -> impl Iterator<Item = f64> {
        self.size.iter().flat_map(move |size| {
            size.motors.iter().map(move |position| {
                // The speed of the cable is the ball's along it.
                let cable = place - position;
                (cable.dot(&velocity) / cable.norm()).abs() / size.cable_per_step
            })
        })
    }

    /// Returns a target (metres) in the board's units.
    ///
    /// # Errors
    /// Where it is outside the workspace or the triangle of the motors.
    pub(crate) fn target(&self, target: [f64; 3]) -> Result<Point, MotionError> {
        self.check_picture(target.into())?;
        self.check_workspace(target.into(), ROUNDING_M)?;
        self.check_triangle(target.into())?;
        // A workspace reaches to 4 m, the board's units to 2147 m.
        Ok(Point::from_metres(target).unwrap_or_default())
    }

    /// Returns the targets (metres) that the rules do not allow, in their order.
    pub(crate) fn wrong_targets(
        &self,
        targets: impl IntoIterator<Item = [f64; 3]>,
    ) -> Vec<WrongTarget> {
        let wrong = |(number, target)| {
            let error = self.target(target).err()?;
            Some(WrongTarget { number, target, error })
        };
        (1..).zip(targets).filter_map(wrong).collect()
    }

    /// Returns whether the rules know where the motors are. Else they know the workspace only.
    pub fn know_the_motors(&self) -> bool {
        self.size.is_some()
    }

    /// Returns the distance of a place (metres) from the border of the workspace, metres; negative
    /// outside. A plane has no border along x.
    pub(super) fn room(&self, place: [f64; 3]) -> f64 {
        let Box3 { min, max } = &self.workspace;
        let room = |i: usize| (place[i] - min[i].get()).min(max[i].get() - place[i]);
        (self.is_flat().into()..place.len()).map(room).fold(f64::INFINITY, f64::min)
    }

    /// Checks that a place is inside the workspace, or beyond its border by at most `margin`; both
    /// in metres.
    fn check_workspace(&self, place: Point3<f64>, margin: f64) -> Result<(), MotionError> {
        let Some((index, side)) = self.outside(place, margin) else { return Ok(()) };
        let Box3 { min, max } = &self.workspace;
        let mut axes = usize::from(self.is_flat())..3;
        if let Some(axis) = axes.find(|axis| min[*axis].get() >= max[*axis].get()) {
            return Err(MotionError::NoRoom { axis: AXES[axis] });
        }
        let limit = if side == Side::Below { min } else { max }[index];
        Err(MotionError::Workspace(Outside {
            axis: AXES[index],
            value_m: place[index],
            side,
            limit_m: limit.get(),
            unit: self.other_unit(place),
        }))
    }

    /// Returns whether the workspace is in the plane x = 0, as that of two motors.
    fn is_flat(&self) -> bool {
        [&self.workspace.min, &self.workspace.max].iter().all(|corner| corner[0].get() == 0.0)
    }

    /// Returns the first axis along which a place is outside the workspace by more than `margin`,
    /// and its side.
    fn outside(&self, place: Point3<f64>, margin: f64) -> Option<(usize, Side)> {
        let Box3 { min, max } = &self.workspace;
        (0..3).find_map(|index| match place[index] {
            value if value < min[index].get() - margin => Some((index, Side::Below)),
            value if value <= max[index].get() + margin => None,
            _ => Some((index, Side::Above)),
        })
    }

    /// Returns the unit in which a place (metres) is inside the workspace; `None` where there is
    /// none, or the place could be one of a rig.
    fn other_unit(&self, place: Point3<f64>) -> Option<MistakenUnit> {
        let is_inside = |per_metre: f64| self.outside(place / per_metre, 0.0).is_none();
        let all_below = |most_m: f64| place.iter().all(|coordinate| coordinate.abs() < most_m);
        if all_below(LEAST_IN_OTHER_UNIT) {
            let is_tiny = all_below(LEAST_IN_OTHER_UNIT / 1000.0) && is_inside(1e-3);
            return is_tiny.then_some(MistakenUnit::Metres);
        }
        match (is_inside(1000.0), is_inside(100.0)) {
            (true, false) => Some(MistakenUnit::Millimetres),
            (false, true) => Some(MistakenUnit::Centimetres),
            (true, true) => Some(MistakenUnit::Either),
            // No rig is so far from its origin.
            (false, false) => {
                let is_far = |it: &f64| it.is_finite() && !Coordinate::RANGE.contains(*it);
                place.iter().any(is_far).then_some(MistakenUnit::Millimetres)
            }
        }
    }

    /// Checks that a place is in the part of the picture where targets may be.
    fn check_picture(&self, place: Point3<f64>) -> Result<(), MotionError> {
        let Some(picture) = &self.picture else { return Ok(()) };
        let pixel = picture.pixel(place.into());
        match picture.allows(pixel) {
            true => Ok(()),
            false => Err(MotionError::Picture { pixel: pixel.map(|it| round(it, 10.0)) }),
        }
    }

    fn check_triangle(&self, place: Point3<f64>) -> Result<(), MotionError> {
        match &self.size {
            Some(size) if size.is_line() => Err(MotionError::Line),
            Some(size) if !size.contains(place) => Err(MotionError::Triangle),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::quantity::Corner;
    use super::*;
    use crate::rig::Rig;

    fn check(rig: &Rig, place: [f64; 3], speed: f64) -> Result<(), MotionError> {
        rig.motion_rules().check(place.into(), Vector3::new(0.0, 0.0, -speed))
    }

    #[test]
    fn workspace_triangle_and_motors_are_checked() {
        let rig = Rig::paper().unwrap();
        assert_eq!(check(&rig, [0.54, 0.22, 0.4], 0.1), Ok(()));
        let error = check(&rig, [0.54, 0.22, 0.7], 0.1).unwrap_err().to_string();
        let named = "that is outside the workspace of the rig file: z = 0.7 m is above the 0.6 m \
                     of `workspace.max`";
        assert_eq!(error, named);
        // In the workspace, beside the line from C to A.
        assert_eq!(check(&rig, [0.1, 0.5, 0.4], 0.1), Err(MotionError::Triangle));
        let error = check(&rig, [0.54, 0.22, 0.1], 1.0).unwrap_err();
        assert!(matches!(error, MotionError::MotorRate { motor: 'A', .. }), "{error}");
    }

    #[test]
    fn the_room_of_a_place_is_its_distance_from_the_border() {
        let rules = Rig::paper().unwrap().motion_rules();
        for (place, room) in [([0.54, 0.22, 0.59], 0.01), ([0.54, 0.22, 0.63], -0.03)] {
            assert!((rules.room(place) - room).abs() < 1e-9, "{place:?}: {}", rules.room(place));
        }
    }

    #[test]
    fn a_place_in_another_unit_is_asked_for() {
        let rig = Rig::paper().unwrap();
        for (place, unit) in [
            ([420.0, 240.0, 300.0], "; is it in millimetres?"),
            ([42.0, 24.0, 30.0], "; is it in centimetres?"),
            // 0.42 m is inside, and 900 m are no rig's.
            ([900.0, 240.0, 300.0], "; is it in millimetres?"),
            ([90.0, 24.0, 30.0], "`workspace.max`"),
            ([2.0, 0.3, 0.3], "`workspace.max`"),
            ([0.00042, 0.00024, 0.0003], "; is it in metres, where the file says millimetres?"),
            ([0.0, 0.0, 0.0], "`workspace.min`"),
            ([f64::NAN, 0.3, 0.3], "`workspace.max`"),
        ] {
            let error = check(&rig, place, 0.0).unwrap_err().to_string();
            assert!(error.ends_with(unit), "{place:?}: {error}");
        }
        let [min, max] = [-4.0, 4.0].map(|border| [Corner::constant(border); 3]);
        let wide = Rig { workspace: Box3 { min, max }, ..rig };
        let error = check(&wide, [42.0, 24.0, 30.0], 0.0).unwrap_err().to_string();
        assert!(error.ends_with("; is it in millimetres or centimetres?"), "{error}");
    }

    #[test]
    fn a_rig_of_unknown_size_has_a_workspace_only() {
        let rig = Rig { simulation: None, ..Rig::paper().unwrap() };
        assert_eq!(check(&rig, [0.1, 0.5, 0.4], 9.0), Ok(()));
        let error = check(&rig, [0.0, 0.5, 0.4], 0.0).unwrap_err().to_string();
        assert!(error.ends_with("x = 0 m is below the 0.1 m of `workspace.min`"), "{error}");
    }
}
