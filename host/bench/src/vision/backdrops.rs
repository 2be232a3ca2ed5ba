//! The backgrounds of rendered scenes.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use plumb_sim::synthetic::{
    Background, Material, Object, Pattern, RenderOptions, Room, Shape, SyntheticCamera,
};
use plumb_vision::camera::Camera;
use plumb_vision::frame::RgbdFrame;

use super::scene_kind::Backdrop;
use super::{BoxedError, VisionOptions};

/// Returns `camera` at the pose that the scenes assume: level, at (1.737, 0.286, 0.225) m of the
/// rig frame, looking along -x.
pub(super) fn placed(camera: &Camera) -> Camera {
    let axes = Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let pose = Isometry3::from_parts(Translation3::new(1.737, 0.286, 0.225), rotation);
    Camera { pose, ..camera.clone() }
}

/// Returns the cameras of a background: one, or one for each recorded frame.
pub(super) fn cameras(
    backdrop: Backdrop,
    camera: &Camera,
    recorded: &[RgbdFrame],
    options: &VisionOptions,
) -> Result<Vec<SyntheticCamera>, BoxedError> {
    let camera = placed(camera);
    let rendering =
        RenderOptions { width: options.width, height: options.height, ..RenderOptions::default() };
    let grey = Room::bare(Material::from_srgb(104, 102, 97));
    let room = match backdrop {
        Backdrop::GreyWall => grey,
        Backdrop::WhiteWall => Room::bare(Material::from_srgb(250, 249, 246)),
        Backdrop::LampAndWindow => lamp_and_window(grey),
        Backdrop::RedPaper => red_paper(grey),
        Backdrop::RedThings => red_things(grey),
        Backdrop::Furnished => Room::furnished(),
        Backdrop::Recorded => {
            let camera_of = |frame: &RgbdFrame| {
                let background = Background::Frame(frame.clone());
                SyntheticCamera::new(camera.clone(), background, rendering, options.seed)
            };
            return Ok(recorded.iter().map(camera_of).collect::<Result<_, _>>()?);
        }
    };
    Ok(vec![SyntheticCamera::new(camera, Background::Room(room), rendering, options.seed)?])
}

/// Adds a glowing window and lamp.
fn lamp_and_window(room: Room) -> Room {
    let block = |centre: [f64; 3], half: [f64; 3]| Shape::Block {
        centre: centre.into(),
        half: half.into(),
        yaw: 0.0,
    };
    let frame = Material::from_srgb(236, 236, 232);
    let pane = Object::new(
        block([-2.19, -0.6, 0.5], [0.01, 0.55, 0.6]),
        Material::from_srgb(228, 238, 255),
    );
    let lamp = Shape::Sphere { centre: Point3::new(0.2, 0.8, 0.35), radius: 0.06 };
    let pole = Shape::Cylinder { base: Point3::new(0.2, 0.8, -0.75), radius: 0.008, height: 1.05 };
    room.with(pane.with_pattern(Pattern::Sky).glowing(1.3))
        .with(Object::new(block([-2.17, -0.6, 0.5], [0.03, 0.02, 0.6]), frame))
        .with(Object::new(block([-2.17, -0.6, 0.7], [0.03, 0.55, 0.02]), frame))
        .with(Object::new(lamp, Material::from_srgb(255, 244, 222)).glowing(1.6))
        .with(Object::new(pole, Material::from_srgb(90, 90, 94)))
}

/// Adds a red sheet of A4 paper in the left part of the frame at a distance of 1.3 m.
fn red_paper(room: Room) -> Room {
    let half = Vector3::new(0.001, 0.105, 0.148);
    let sheet = Shape::Block { centre: Point3::new(0.437, -0.18, 0.225), half, yaw: 0.15 };
    room.with(Object::new(sheet, Material::from_srgb(205, 40, 44).matt()))
}

/// Adds red cans, boxes and a cushion at 1.3 to 1.8 m, behind any ball.
fn red_things(room: Room) -> Room {
    let red = |r, g, b| Material::from_srgb(r, g, b);
    let can = |base: [f64; 3]| {
        let shape = Shape::Cylinder { base: base.into(), radius: 0.033, height: 0.115 };
        Object::new(shape, red(190, 24, 30)).with_pattern(Pattern::Label([0.75, 0.75, 0.75]))
    };
    let block = |centre: [f64; 3], half: [f64; 3], yaw: f64| {
        let shape = Shape::Block { centre: centre.into(), half: half.into(), yaw };
        Object::new(shape, red(176, 30, 40).matt())
    };
    let cushion = Shape::Sphere { centre: Point3::new(-0.1, -0.28, 0.36), radius: 0.16 };
    room.with(can([0.4, 0.45, 0.1]))
        .with(can([0.25, 0.1, 0.3]))
        .with(can([0.05, 0.62, 0.35]))
        .with(
            block([0.3, 0.3, 0.02], [0.04, 0.06, 0.09], 0.5)
                .with_pattern(Pattern::Print([0.6, 0.6, 0.6])),
        )
        .with(block([0.1, -0.05, 0.02], [0.05, 0.04, 0.05], 0.9))
        .with(Object::new(cushion, red(150, 28, 36).matt()))
}
