//! Quantities on the wire and on the chip: fixed point, with the unit in the type.
//!
//! Each type has the value of its least significant bit (`LSB`, in SI) and conversions from and to
//! SI. Only the host uses the conversions: the board does not need floating point for them.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::dimension::PerAxis;

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident($raw:ty), $lsb:expr) => {
        $(#[$doc])*
        #[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy)]
        #[derive(PartialEq, Eq, PartialOrd, Ord, Default)]
        pub struct $name(pub $raw);

        impl $name {
            /// Value of one unit of the raw number, SI.
            pub const LSB: f64 = $lsb;

            /// Returns the nearest representable quantity; `None` if `value` is not finite or out
            /// of range.
            pub fn from_si(value: f64) -> Option<Self> {
                let raw = value / Self::LSB;
                // Rounds half away from zero: `f64::round` needs std. The range is checked before
                // the cast, which would saturate.
                let rounded = if raw < 0.0 { raw - 0.5 } else { raw + 0.5 };
                let (min, max) = (<$raw>::MIN as f64, <$raw>::MAX as f64);
                let in_range = rounded > min - 1.0 && rounded < max + 1.0;
                (in_range && value.is_finite()).then_some(Self(rounded as $raw))
            }

            /// Returns the value in SI.
            pub fn to_si(self) -> f64 {
                self.0 as f64 * Self::LSB
            }
        }
    };
}

quantity! {
    /// A length or a coordinate in whole micrometres; ±2147 m.
    Micrometres(i32), 1e-6
}
quantity! {
    /// A motor position in 1/16 full steps, + pays cable out; ±134 million steps.
    Steps16(i32), 1.0 / 16.0
}
quantity! {
    /// A motor rate in full steps/s with 8 fraction bits, + pays cable out; ±8.3 million steps/s.
    Rate(i32), 1.0 / 256.0
}
quantity! {
    /// A motor acceleration in whole full steps/s².
    Acceleration(u32), 1.0
}
quantity! {
    /// A bound α or β on an entry of the Jacobian, Q16: metres of ball per metre of cable.
    Bound(u32), 1.0 / 65536.0
}
quantity! {
    /// The gain from v to motor rates, Q16: full steps/s per micrometre of v.
    ///
    /// With γ in 1/s and s metres of cable per step, the gain is γ · 1 µm / s. For γ = 30 /s
    /// and s = 0.471 mm it is 0.0637, raw 4172.
    Gain(u32), 1.0 / 65536.0
}
quantity! {
    /// The gain g/(4s) of the law `sign`, Q20: full steps/s per micrometre of error.
    ///
    /// g is in 1/s, s the cable per step. For g = 4 /s and s = 0.471 mm the gain is 0.00212, raw
    /// 2225.
    SignGain(u32), 1.0 / 1_048_576.0
}
quantity! {
    /// A speed in whole micrometres/s, along an axis with its sign; ±2147 m/s.
    Speed(i32), 1e-6
}
quantity! {
    /// An acceleration of the ball in whole millimetres/s²; at most 65.5 m/s².
    PathAcceleration(u16), 1e-3
}
quantity! {
    /// A jerk of the ball in whole millimetres/s³; at most 4295 km/s³.
    PathJerk(u32), 1e-3
}
quantity! {
    /// A cable's tension over the ball's weight, Q8; below 256.
    RelativeTension(u16), 1.0 / 256.0
}
quantity! {
    /// A span of time in milliseconds; at most 65.5 s.
    Milliseconds(u16), 1e-3
}
quantity! {
    /// A span of time in microseconds; at most 65.5 ms.
    Microseconds(u16), 1e-6
}
quantity! {
    /// A span of time in nanoseconds; at most 65.5 µs.
    Nanoseconds(u16), 1e-9
}
quantity! {
    /// An electric current in milliamperes; at most 65.5 A.
    Milliamperes(u16), 1e-3
}
quantity! {
    /// A resistance in milliohms; at most 65.5 Ω.
    Milliohms(u16), 1e-3
}

/// A moment on the board's clock, microseconds since it started.
#[derive(
    Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default,
)]
pub struct Micros(pub u64);

impl Micros {
    /// Returns the time from `earlier` to this moment, microseconds; 0 if `earlier` is later.
    pub const fn since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Returns the moment `us` microseconds earlier, but not before the clock's start.
    pub const fn back(self, us: u64) -> Self {
        Self(self.0.saturating_sub(us))
    }
}

/// A point in the rig frame (z up, y along BA, C on the side of smaller x) or a difference of two,
/// micrometres.
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Point(pub PerAxis<Micrometres>);

impl Point {
    /// Returns the nearest point to `metres`; `None` if a coordinate is not finite or beyond
    /// ±2147 m.
    pub fn from_metres(metres: PerAxis<f64>) -> Option<Self> {
        let [x, y, z] = metres.map(Micrometres::from_si);
        Some(Self([x?, y?, z?]))
    }

    /// Returns the coordinates in metres.
    pub fn to_metres(self) -> PerAxis<f64> {
        self.0.map(Micrometres::to_si)
    }

    /// Returns the coordinates in whole micrometres.
    pub const fn micrometres(self) -> PerAxis<i32> {
        let [x, y, z] = self.0;
        [x.0, y.0, z.0]
    }
}

/// Covariance of a position in the rig frame, in units of 0.01 mm².
#[derive(Serialize, Deserialize, Schema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Covariance {
    /// Variances of x, y and z: up to 655.35 mm², a standard deviation of 25.6 mm.
    pub variances: PerAxis<u16>,
    /// Covariances of x and y, x and z, y and z: within ±327.68 mm².
    pub covariances: [i16; 3],
}

impl Covariance {
    /// Value of one unit, metres².
    pub const LSB: f64 = 1e-8;
    /// Value of one unit, µm².
    pub const SQUARE_MICROMETRES: i32 = 10_000;

    /// Returns the nearest covariance to the matrix `metres2` (rows x, y, z; m²), of which only
    /// the upper triangle is used. Entries out of range become the nearest limit, and variances
    /// below one unit become one unit. Returns `None` if an entry is not finite or a variance is
    /// negative.
    pub fn from_metres2(metres2: PerAxis<PerAxis<f64>>) -> Option<Self> {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = metres2;
        let (diagonal, beside) = ([xx, yy, zz], [xy, xz, yz]);
        if !diagonal.iter().chain(&beside).all(|v| v.is_finite())
            || diagonal.iter().any(|v| *v < 0.0)
        {
            return None;
        }
        // The casts saturate.
        Some(Self {
            variances: diagonal.map(|v| ((v / Self::LSB + 0.5) as u16).max(1)),
            covariances: beside.map(|v| (v / Self::LSB + if v < 0.0 { -0.5 } else { 0.5 }) as i16),
        })
    }
}
