//! Shading: a Lambert term, ambient light from above and below, one highlight.
//!
//! Colours here are linear and in the order blue, green, red, 1 = as bright as the frame can
//! show; [`encode`] and [`decode`] go to and from the 0 to 255 of an sRGB image.

use nalgebra::Vector3;

/// Optical properties of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Diffuse reflectance, linear, order blue, green, red; 0 to 1 each.
    pub colour: [f64; 3],
    /// Strength of the highlight; 0 = matt, about 1 = lacquer.
    pub gloss: f64,
    /// Exponent of the highlight; larger is smaller and sharper, about 10 to 300.
    pub shininess: f64,
}

impl Material {
    /// A material with the sRGB colour `red`, `green`, `blue` (0 to 255, as in a paint chart) and
    /// the highlight of half-polished plastic.
    pub fn from_srgb(red: u8, green: u8, blue: u8) -> Self {
        Self { colour: [blue, green, red].map(decode), gloss: 0.6, shininess: 70.0 }
    }

    /// Returns the material without a highlight.
    pub fn matt(self) -> Self {
        Self { gloss: 0.0, ..self }
    }

    /// Returns the material of the rig's ball: lacquered red.
    pub fn red_ball() -> Self {
        Self { gloss: 0.9, shininess: 110.0, ..Self::from_srgb(196, 32, 34) }
    }

    /// Returns the material of a ball of this hue, degrees: that of hue 0 lacquered in the hue.
    pub fn ball_of_hue(hue: f64) -> Self {
        let red = Self::red_ball();
        if hue == 0.0 {
            return red;
        }
        // HSV: a channel rises to its highest value within 60 degrees of its own hue, and is at its
        // lowest beyond 120.
        let channel = |own: f64| {
            let distance = (hue - own + 180.0).rem_euclid(360.0) - 180.0;
            let share = (2.0 - distance.abs() / 60.0).clamp(0.0, 1.0);
            (32.0 + share * (196.0 - 32.0)).round() as u8
        };
        let Self { colour, .. } = Self::from_srgb(channel(0.0), channel(120.0), channel(240.0));
        Self { colour, ..red }
    }
}

/// The light that falls on the ball, in the rig frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Towards the main light; any length but zero.
    pub direction: Vector3<f64>,
    /// Irradiance of the main light, linear, order blue, green, red.
    pub key: [f64; 3],
    /// Ambient light from above (+z), linear, order blue, green, red.
    pub sky: [f64; 3],
    /// Ambient light from below, linear, order blue, green, red.
    pub ground: [f64; 3],
}

impl Default for Light {
    /// A lamp above and to the left of a camera that looks along -x, in a bright room.
    fn default() -> Self {
        Self {
            direction: Vector3::new(0.55, -0.45, 0.75),
            key: [0.66, 0.72, 0.76],
            sky: [0.36, 0.34, 0.33],
            ground: [0.17, 0.20, 0.22],
        }
    }
}

/// [`Light`] as seen from a camera: unit vectors in camera axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraLight {
    pub(super) direction: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    key: [f64; 3],
    sky: [f64; 3],
    ground: [f64; 3],
}

impl CameraLight {
    /// Returns `light` rotated by `to_camera` (rig frame to camera axes).
    pub(super) fn new(light: &Light, to_camera: &nalgebra::UnitQuaternion<f64>) -> Self {
        let direction = light.direction.try_normalize(1e-12).unwrap_or_else(Vector3::z);
        Self {
            direction: to_camera * direction,
            up: to_camera * Vector3::z(),
            key: light.key,
            sky: light.sky,
            ground: light.ground,
        }
    }

    /// Returns the irradiance of a surface with unit `normal`, linear.
    pub(super) fn irradiance(&self, normal: &Vector3<f64>) -> [f64; 3] {
        self.arriving(normal.dot(&self.direction).max(0.0), normal.dot(&self.up))
    }

    /// Light that a thin round rod with unit direction `axis` gets on the average of the side one
    /// sees, linear.
    pub(super) fn on_rod(&self, axis: &Vector3<f64>) -> [f64; 3] {
        let along = axis.dot(&self.direction);
        self.arriving(0.55 * (1.0 - along * along).max(0.0).sqrt(), 0.2)
    }

    fn arriving(&self, facing: f64, upward: f64) -> [f64; 3] {
        let from_above = 0.5 + 0.5 * upward;
        std::array::from_fn(|k| {
            self.key[k] * facing + self.sky[k] * from_above + self.ground[k] * (1.0 - from_above)
        })
    }

    /// Brightness of the highlight (Blinn-Phong) at unit `normal`, seen from unit `to_eye`; 0 to
    /// `gloss`.
    pub(super) fn highlight(
        &self,
        material: &Material,
        normal: &Vector3<f64>,
        to_eye: &Vector3<f64>,
    ) -> f64 {
        specular(material, normal, to_eye, &self.direction)
    }

    /// Returns the visible colour of a surface, linear; `highlight` as from
    /// [`CameraLight::highlight`].
    pub(super) fn shade(
        &self,
        material: &Material,
        normal: &Vector3<f64>,
        to_eye: &Vector3<f64>,
        highlight: f64,
    ) -> [f64; 3] {
        let arriving = self.irradiance(normal);
        // Schlick: lacquer reflects its surroundings at grazing angles.
        let rim = 0.25 * material.gloss * (1.0 - normal.dot(to_eye).clamp(0.0, 1.0)).powi(5);
        let mirrored = 2.0 * normal * normal.dot(to_eye) - to_eye;
        let from_above = 0.5 + 0.5 * mirrored.dot(&self.up);
        // A faint broad lobe models the roughness that one exponent lacks.
        let haze = 0.04 * material.gloss * from_above.max(0.0).powi(3);
        std::array::from_fn(|k| {
            let surroundings = self.sky[k] * from_above + self.ground[k] * (1.0 - from_above);
            material.colour[k] * arriving[k]
                + highlight * self.key[k] * 1.6
                + (rim + haze) * surroundings
        })
    }
}

/// Blinn-Phong highlight of a light in unit direction `to_light`; 0 to `gloss`.
pub(super) fn specular(
    material: &Material,
    normal: &Vector3<f64>,
    to_eye: &Vector3<f64>,
    to_light: &Vector3<f64>,
) -> f64 {
    if material.gloss <= 0.0 {
        return 0.0;
    }
    let half = (to_eye + to_light).try_normalize(1e-12).unwrap_or(*to_eye);
    material.gloss * normal.dot(&half).max(0.0).powf(material.shininess)
}

/// Linear light (1 = white) as the 0 to 255 of an sRGB image, not rounded; too much light
/// saturates.
pub(super) fn encode(linear: f64) -> f64 {
    let x = linear.clamp(0.0, 1.0);
    255.0 * if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Returns the linear light of an sRGB value.
pub(super) fn decode(value: u8) -> f64 {
    let x = f64::from(value) / 255.0;
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_its_hue() {
        let srgb = |hue: f64| {
            let [blue, green, red] = Material::ball_of_hue(hue).colour.map(encode);
            [red, green, blue].map(|channel| channel.round() as u8)
        };
        assert_eq!(Material::ball_of_hue(0.0), Material::red_ball());
        assert_eq!(srgb(60.0), [196, 196, 32]);
        assert_eq!(srgb(240.0), [32, 32, 196]);
        assert_eq!(srgb(330.0), [196, 32, 114]);
    }

    #[test]
    fn encoding_is_undone_by_decoding() {
        for value in 0..=255_u8 {
            assert!((encode(decode(value)) - f64::from(value)).abs() < 1e-3, "{value}");
        }
        assert!((encode(7.0) - 255.0).abs() < 1e-9);
    }

    #[test]
    fn the_side_towards_the_light_is_brighter() {
        let light = CameraLight::new(&Light::default(), &nalgebra::UnitQuaternion::identity());
        let ball = Material::red_ball();
        let eye = Vector3::x();
        let lit = light.shade(&ball, &light.direction, &eye, 0.0);
        let dark = light.shade(&ball, &-light.direction, &eye, 0.0);
        assert!(lit[2] > 2.0 * dark[2], "{lit:?} {dark:?}");
        assert!(lit[2] > 5.0 * lit[0], "a red ball is red: {lit:?}");
    }
}
