//! The primitives of a scene in drawing order.

use nalgebra::{Isometry3, Point3, Vector3};

use super::ball::CameraBall;
use super::light::Material;
use super::scene::{Scene, Strand};
use super::strand::CameraStrand;

/// A primitive and its distance along the optical axis, metres.
pub(super) struct Item {
    distance: f64,
    pub(super) primitive: Primitive,
}

/// A primitive to draw.
pub(super) enum Primitive {
    Ball(CameraBall),
    Strand(CameraStrand),
}

/// Diameter of a pulley, metres.
const PULLEY_DIAMETER: f64 = 0.03;
/// Diameter of the rod that holds a motor, metres.
const ROD_DIAMETER: f64 = 0.016;
/// Length of that rod, metres.
const ROD_LENGTH: f64 = 1.5;

/// Returns the primitives of `scene` in camera axes, the farthest first.
pub(super) fn items(scene: &Scene, to_camera: &Isometry3<f64>, diameter: f64) -> Vec<Item> {
    let ball = |centre: &Point3<f64>, diameter: f64, material: Material| {
        let centre = to_camera * centre;
        let ball = CameraBall { centre, radius: diameter / 2.0, material };
        Item { distance: centre.z, primitive: Primitive::Ball(ball) }
    };
    let strand = |strand: &Strand| {
        let (from, to) = (to_camera * strand.from, to_camera * strand.to);
        let drawn = CameraStrand { from, to, diameter: strand.diameter, material: strand.material };
        Item { distance: (from.z + to.z) / 2.0, primitive: Primitive::Strand(drawn) }
    };
    let mut items: Vec<Item> =
        scene.others.iter().map(|o| ball(&o.centre, o.diameter, o.material)).collect();
    items.extend(scene.strands.iter().map(strand));
    items.extend(scene.ball.map(|centre| ball(&centre, diameter, scene.ball_material)));
    let metal = Material::from_srgb(150, 152, 155).matt();
    for motor in scene.motors.iter().flatten() {
        let top = motor + Vector3::new(0.0, 0.0, ROD_LENGTH);
        let rod =
            strand(&Strand { from: *motor, to: top, diameter: ROD_DIAMETER, material: metal });
        let pulley = ball(motor, PULLEY_DIAMETER, Material::from_srgb(60, 60, 64));
        items.push(Item { distance: pulley.distance + 1e-3, ..rod });
        items.push(pulley);
        if let Some(centre) = scene.ball {
            items.push(cable(scene, &centre, motor, diameter, &strand, to_camera));
        }
    }
    items.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    items
}

/// Returns the cable from the ball's surface to `motor`: in front of the ball if it leaves the
/// visible side, else behind it.
fn cable(
    scene: &Scene,
    centre: &Point3<f64>,
    motor: &Point3<f64>,
    diameter: f64,
    strand: &impl Fn(&Strand) -> Item,
    to_camera: &Isometry3<f64>,
) -> Item {
    let away = (motor - centre).try_normalize(1e-12).unwrap_or_else(Vector3::z);
    let from = centre + away * (diameter / 2.0);
    let item = strand(&Strand {
        from,
        to: *motor,
        diameter: scene.cable_diameter,
        material: scene.cable_material,
    });
    let (knot, ball) = (to_camera * from, to_camera * centre);
    let seen = (ball - knot).dot(&knot.coords) > 0.0;
    Item { distance: if seen { ball.z - 1e-6 } else { ball.z + 1e-6 }, ..item }
}
