//! The furnished room: a workshop with a bench, a window and the objects that lie about in one.

use std::ops::RangeInclusive;

use nalgebra::{Point3, Vector3};

use super::pattern::hash_noise;
use super::{AreaLight, Object, Pattern, Room, Shape};
use crate::synthetic::light::Material;

/// Hues that a detector does not tell from an orange, degrees.
const ORANGE_HUES: RangeInclusive<f64> = 5.0..=60.0;

impl Room {
    /// Creates a furnished room for the paper's rig. It contains objects that a detector on the red
    /// channel confuses with the ball: a white ball, a lamp, a window, a white piece of wall, balls
    /// in the colours of skin and oranges, red paper, a red can. As seen from the paper's camera,
    /// all of them are behind or beside the ball's workspace. The top of the bench is the rig
    /// frame's z = 0.
    pub fn furnished() -> Self {
        let mut room = Room::bare(Material::from_srgb(196, 190, 174));
        room.paint[4] = Material::from_srgb(150, 112, 80);
        room.paint[5] = Material::from_srgb(235, 233, 228).matt();
        room.floor = Pattern::Boards;
        room.panels.push(AreaLight {
            centre: Point3::new(-2.12, -0.75, 0.55),
            a: Vector3::new(0.0, 0.5, 0.0),
            b: Vector3::new(0.0, 0.0, 0.55),
            power: [2.4, 2.15, 1.95],
        });
        room.objects.extend(bench());
        room.objects.extend(distractors());
        room.objects.extend(on_the_bench());
        room.objects.extend(window());
        room.objects.extend(walls());
        room.objects.extend(shelf());
        room.objects.extend(chair());
        room.objects.extend(plant());
        room
    }

    /// Returns the furnished room of a rig with a ball of this hue, degrees: without the orange
    /// that lies in it where that is of the same colour.
    pub fn furnished_for(ball_hue: f64) -> Self {
        let mut room = Self::furnished();
        if ORANGE_HUES.contains(&ball_hue) {
            let orange = orange();
            room.objects.retain(|object| *object != orange);
        }
        room
    }
}

fn block(centre: [f64; 3], half: [f64; 3], yaw: f64) -> Shape {
    Shape::Block { centre: centre.into(), half: half.into(), yaw }
}

fn sphere(centre: [f64; 3], radius: f64) -> Shape {
    Shape::Sphere { centre: centre.into(), radius }
}

fn cylinder(base: [f64; 3], radius: f64, height: f64) -> Shape {
    Shape::Cylinder { base: base.into(), radius, height }
}

fn bench() -> Vec<Object> {
    let leg = |x, y| {
        Object::new(
            block([x, y, -0.395], [0.03, 0.03, 0.355], 0.0),
            Material::from_srgb(70, 72, 76),
        )
    };
    vec![
        Object::new(
            block([0.475, 0.325, -0.02], [0.825, 0.85, 0.02], 0.0),
            Material::from_srgb(206, 176, 136),
        )
        .with_pattern(Pattern::Wood),
        leg(-0.28, -0.45),
        leg(-0.28, 1.1),
    ]
}

/// Returns an orange, which is a ball as well.
fn orange() -> Object {
    Object::new(sphere([0.05, 1.02, 0.042], 0.042), Material::from_srgb(240, 132, 30))
}

/// Returns objects that a detector on the red channel confuses with the ball.
fn distractors() -> Vec<Object> {
    let white = Material::from_srgb(240, 239, 235);
    let red_paper = Material::from_srgb(205, 40, 44).matt();
    let can = |base| {
        Object::new(cylinder(base, 0.033, 0.122), Material::from_srgb(190, 22, 30))
            .with_pattern(Pattern::Label([0.75, 0.75, 0.75]))
    };
    vec![
        Object::new(sphere([0.45, 0.80, 0.04], 0.04), white),
        Object::new(sphere([0.30, -0.28, 0.045], 0.045), Material::from_srgb(228, 178, 148)),
        orange(),
        can([0.12, -0.44, 0.0]),
        can([-0.22, 0.66, 0.0]),
        Object::new(block([0.25, 0.98, 0.001_5], [0.105, 0.148, 0.001_5], 0.35), red_paper),
        Object::new(block([-1.945, 0.56, 0.62], [0.002, 0.105, 0.148], 0.0), red_paper)
            .with_pattern(Pattern::Print([0.6, 0.6, 0.6])),
        Object::new(sphere([-0.15, 0.99, 0.42], 0.062), Material::from_srgb(255, 244, 222))
            .glowing(1.6),
        Object::new(cylinder([-0.15, 0.99, 0.0], 0.07, 0.02), Material::from_srgb(40, 40, 44)),
        Object::new(cylinder([-0.15, 0.99, 0.02], 0.008, 0.35), Material::from_srgb(170, 172, 176)),
    ]
}

fn on_the_bench() -> Vec<Object> {
    let black = Material::from_srgb(34, 35, 38);
    vec![
        Object::new(block([-0.2, -0.27, 0.25], [0.018, 0.25, 0.165], -0.3), black),
        Object::new(
            block([-0.181, -0.275, 0.255], [0.003, 0.235, 0.145], -0.3),
            Material::from_srgb(58, 74, 104),
        ),
        Object::new(cylinder([-0.22, -0.27, 0.0], 0.02, 0.1), black),
        Object::new(cylinder([-0.21, -0.27, 0.0], 0.1, 0.012), black),
        Object::new(
            block([0.0, -0.3, 0.01], [0.07, 0.2, 0.01], -0.3),
            Material::from_srgb(60, 61, 64),
        )
        .with_pattern(Pattern::Print([0.2, 0.2, 0.2])),
        Object::new(cylinder([-0.08, 0.47, 0.0], 0.04, 0.095), Material::from_srgb(44, 92, 150)),
        Object::new(
            block([-0.2, 0.22, 0.018], [0.10, 0.14, 0.018], 0.25),
            Material::from_srgb(60, 110, 70),
        ),
        Object::new(
            block([-0.2, 0.22, 0.05], [0.09, 0.12, 0.014], -0.1),
            Material::from_srgb(222, 214, 196),
        ),
        Object::new(
            block([0.2, -0.05, 0.001], [0.105, 0.148, 0.001], 1.2),
            Material::from_srgb(244, 244, 240).matt(),
        )
        .with_pattern(Pattern::Mottled),
    ]
}

/// In the wall behind the rig, to its left.
fn window() -> Vec<Object> {
    let frame = Material::from_srgb(236, 236, 232);
    let bar = |y, z, half_y, half_z| {
        Object::new(block([-2.17, y, z], [0.03, half_y, half_z], 0.0), frame)
    };
    vec![
        Object::new(
            block([-2.195, -0.75, 0.55], [0.005, 0.5, 0.55], 0.0),
            Material::from_srgb(226, 238, 255),
        )
        .with_pattern(Pattern::Sky)
        .glowing(1.25),
        bar(-1.25, 0.55, 0.035, 0.6),
        bar(-0.25, 0.55, 0.035, 0.6),
        bar(-0.75, 0.55, 0.022, 0.55),
        bar(-0.75, 1.12, 0.535, 0.035),
        bar(-0.75, 0.72, 0.5, 0.02),
        Object::new(block([-2.12, -0.75, -0.03], [0.09, 0.56, 0.02], 0.0), frame),
    ]
}

/// A white chimney breast, a skirting board, a lamp under the ceiling, a notice.
fn walls() -> Vec<Object> {
    let white = Material::from_srgb(246, 245, 241).matt();
    vec![
        Object::new(block([-2.08, 0.35, 0.45], [0.13, 0.42, 1.2], 0.0), white)
            .with_pattern(Pattern::Mottled),
        Object::new(block([-2.19, 0.3, -0.69], [0.012, 1.9, 0.06], 0.0), white),
        Object::new(block([-1.5, 0.9, 1.62], [0.55, 0.07, 0.025], 0.0), white).glowing(1.5),
        Object::new(
            block([-1.948, 0.12, 0.35], [0.002, 0.105, 0.148], 0.0),
            Material::from_srgb(238, 236, 224).matt(),
        )
        .with_pattern(Pattern::Print([0.05, 0.05, 0.05])),
    ]
}

/// Against the wall behind the rig, to its right.
fn shelf() -> Vec<Object> {
    let board = Material::from_srgb(128, 92, 62).matt();
    let mut objects = vec![
        Object::new(block([-2.02, 0.86, 0.12], [0.17, 0.018, 0.87], 0.0), board),
        Object::new(block([-2.02, 1.94, 0.12], [0.17, 0.018, 0.87], 0.0), board),
    ];
    for level in 0..6 {
        let z = -0.72 + 0.34 * f64::from(level);
        objects.push(Object::new(block([-2.02, 1.4, z], [0.17, 0.53, 0.014], 0.0), board));
        if level < 5 {
            let books = block(
                [-2.05, 1.4 - 0.02 * f64::from(level % 3), z + 0.139],
                [0.12, 0.5, 0.125],
                0.0,
            );
            objects.push(
                Object::new(books, Material::from_srgb(90, 90, 90).matt())
                    .with_pattern(Pattern::Books),
            );
        }
    }
    objects
}

fn chair() -> Vec<Object> {
    let cloth = Material::from_srgb(66, 82, 98).matt();
    let steel = Material::from_srgb(110, 112, 116);
    let leg = |x, y, top| Object::new(cylinder([x, y, -0.75], 0.014, top), steel);
    vec![
        Object::new(block([-0.95, 0.62, -0.30], [0.21, 0.21, 0.025], 0.4), cloth)
            .with_pattern(Pattern::Mottled),
        Object::new(block([-1.13, 0.53, 0.08], [0.02, 0.2, 0.16], 0.4), cloth)
            .with_pattern(Pattern::Mottled),
        leg(-0.84, 0.86, 0.43),
        leg(-0.70, 0.52, 0.43),
        leg(-1.20, 0.72, 0.43),
        leg(-1.08, 0.38, 0.43),
        leg(-1.19, 0.67, 0.75),
        leg(-1.08, 0.40, 0.75),
    ]
}

/// In the corner to the left.
fn plant() -> Vec<Object> {
    let pot = Object::new(
        cylinder([-1.55, -1.2, -0.75], 0.17, 0.34),
        Material::from_srgb(176, 104, 78).matt(),
    );
    let leaves = (0..16_i64).map(|k| {
        let random = |what| hash_noise(k, what, 40);
        let (sin, cos) = (std::f64::consts::TAU * random(0)).sin_cos();
        let out = 0.22 * random(1).sqrt();
        let centre = [-1.55 + out * cos, -1.2 + out * sin, -0.25 + 0.5 * random(2)];
        let green =
            Material::from_srgb(44 + (26.0 * random(3)) as u8, 92 + (40.0 * random(4)) as u8, 46);
        Object::new(sphere(centre, 0.06 + 0.06 * random(5)), green.matt())
            .with_pattern(Pattern::Mottled)
    });
    std::iter::once(pot).chain(leaves).collect()
}
