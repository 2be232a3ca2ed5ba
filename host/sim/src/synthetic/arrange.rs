//! What a scene consists of and in which order it is drawn.

use nalgebra::{Isometry3, Point3, Vector3};

use super::ball::BallToDraw;
use super::light::Material;
use super::scene::{Scene, Strand};
use super::strand::StrandToDraw;

/// Something to draw and how far away it is, metres along the optical axis.
pub(super) struct Item {
    distance: f64,
    pub(super) what: What,
}

/// A thing to draw.
pub(super) enum What {
    Ball(BallToDraw),
    Strand(StrandToDraw),
}

/// Diameter of what turns a cable at a motor, metres.
const PULLEY: f64 = 0.03;
/// Diameter and length of the rod that a motor hangs on, metres.
const ROD: (f64, f64) = (0.016, 1.5);

/// What `scene` consists of in camera axes, the farthest first.
pub(super) fn items(scene: &Scene, to_camera: &Isometry3<f64>, diameter: f64) -> Vec<Item> {
    let ball = |centre: &Point3<f64>, diameter: f64, material: Material| {
        let centre = to_camera * centre;
        let ball = BallToDraw { centre, radius: diameter / 2.0, material };
        Item { distance: centre.z, what: What::Ball(ball) }
    };
    let strand = |strand: &Strand| {
        let (from, to) = (to_camera * strand.from, to_camera * strand.to);
        let drawn = StrandToDraw { from, to, diameter: strand.diameter, material: strand.material };
        Item { distance: (from.z + to.z) / 2.0, what: What::Strand(drawn) }
    };
    let mut items: Vec<Item> =
        scene.others.iter().map(|o| ball(&o.centre, o.diameter, o.material)).collect();
    items.extend(scene.strands.iter().map(strand));
    items.extend(scene.ball.map(|centre| ball(&centre, diameter, scene.ball_material)));
    let metal = Material::from_srgb(150, 152, 155).matt();
    for motor in scene.motors.iter().flatten() {
        let top = motor + Vector3::new(0.0, 0.0, ROD.1);
        let rod = strand(&Strand { from: *motor, to: top, diameter: ROD.0, material: metal });
        let pulley = ball(motor, PULLEY, Material::from_srgb(60, 60, 64));
        items.push(Item { distance: pulley.distance + 1e-3, ..rod });
        items.push(pulley);
        if let Some(centre) = scene.ball {
            items.push(cable(scene, &centre, motor, diameter, &strand, to_camera));
        }
    }
    items.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    items
}

/// The cable from the ball's surface to `motor`: before the ball where it leaves the side one sees,
/// else behind it.
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
