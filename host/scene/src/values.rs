//! Number types that guarantee their ranges. Serde checks them while it reads, so the reader's
//! error names line and column.

use glam::DVec3;
use serde::{Deserialize, Deserializer};

/// Maximum magnitude of coordinates and distances: their squares, summed over three axes, stay
/// finite in f32.
pub const MAX_MAGNITUDE: f64 = 1e18;

/// Minimum radius or length: its square stays a normal number in f32.
pub const MIN_MAGNITUDE: f64 = 1e-18;

macro_rules! number {
    ($(#[$doc:meta])* $name:ident, $what:literal, $value:ident => $valid:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
        #[serde(try_from = "f64")]
        pub struct $name(pub f64);

        impl TryFrom<f64> for $name {
            type Error = String;

            fn try_from($value: f64) -> Result<Self, String> {
                if $valid { Ok(Self($value)) } else { Err(format!(concat!("{} is not ", $what), $value)) }
            }
        }

        impl From<$name> for f64 {
            fn from(number: $name) -> Self {
                number.0
            }
        }
    };
}

number!(
    /// A coordinate in scene units.
    Coordinate, "a finite coordinate, at most 1e18 from 0", x => x.abs() <= MAX_MAGNITUDE
);
number!(
    /// A radius or distance in scene units.
    Length, "a positive finite length between 1e-18 and 1e18", x => (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// A factor on all lengths.
    Magnification, "a factor on lengths, between 1e-18 and 1e18", x => (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// A reflected fraction, a fuzz radius or a roughness.
    Share, "between 0 and 1", x => (0.0..=1.0).contains(&x)
);
number!(
    /// A radiance.
    Radiance, "a finite radiance, 0 or more and at most 1e18", x => (0.0..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// An intensity or irradiance of a light without extent.
    Strength, "a finite strength of light, 0 or more and at most 1e18", x => (0.0..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// A factor on radiance.
    Gain, "a finite factor, 0 or more and at most 1e18", x => (0.0..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// An index of refraction.
    Ior, "a positive index of refraction, between 1e-3 and 1e3", x => (1e-3..=1e3).contains(&x)
);
number!(
    /// An index of refraction of a thin film.
    FilmIor, "an index of refraction of a film, between 1 and 10", x => (1.0..=10.0).contains(&x)
);
number!(
    /// A thickness of a thin film, in nanometres.
    Thickness, "a thickness between 0 and 1e5 nanometres", x => (0.0..=1e5).contains(&x)
);
number!(
    /// A dispersion: 20 over the Abbe number.
    Dispersion, "a dispersion between 0 and 100", x => (0.0..=100.0).contains(&x)
);
number!(
    /// The real part of a metal's index of refraction.
    Eta, "a positive real part of an index of refraction, between 1e-6 and 1e3", x => (1e-6..=1e3).contains(&x)
);
number!(
    /// The imaginary part of a metal's index of refraction.
    Absorption, "an imaginary part of an index of refraction, between 0 and 1e3", x => (0.0..=1e3).contains(&x)
);
number!(
    /// An extinction of a medium, per scene unit.
    Extinction, "an extinction: 0, or between 1e-18 and 1e18", x => x == 0.0 || (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&x)
);
number!(
    /// A mean cosine of the scattering angle of a medium.
    Anisotropy, "an anisotropy between -0.99 (back) and 0.99 (straight on)", x => (-0.99..=0.99).contains(&x)
);
number!(
    /// The vertical angle of an image, in degrees.
    FieldOfView, "an angle between 0.001 and 179 degrees", x => (1e-3..=179.0).contains(&x)
);
number!(
    /// The angle of a lens seen from the plane in focus, in degrees.
    Defocus, "an angle between 0 and 179 degrees", x => (0.0..=179.0).contains(&x)
);
number!(
    /// An angle of a rotation, in degrees.
    Angle, "an angle between -1e6 and 1e6 degrees", x => x.abs() <= 1e6
);
number!(
    /// Half the opening angle of a cone, in degrees.
    HalfAngle, "an angle between 0 and 90 degrees", x => (0.0..=90.0).contains(&x)
);
number!(
    /// The height of the sun above the horizon, in degrees.
    Elevation, "an elevation between 0 (the horizon) and 90 degrees (straight up)", x => (0.0..=90.0).contains(&x)
);
number!(
    /// A turbidity of the air.
    Turbidity, "a turbidity between 1 (pure air) and 10 (thick haze)", x => (1.0..=10.0).contains(&x)
);
number!(
    /// The angular radius of the sun, in degrees.
    SunRadius, "an angular radius of the sun between 0.2 and 5 degrees", x => (0.2..=5.0).contains(&x)
);
number!(
    /// A factor on lengths; a negative one mirrors.
    Factor, "a factor between 1e-18 and 1e18, or the negative of one", x => (MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&x.abs())
);
number!(
    /// A number of a texture's transform.
    TextureNumber, "a number between -1e6 and 1e6", x => x.abs() <= 1e6
);

/// A count of at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "u32")]
pub struct Count(pub u32);

impl TryFrom<u32> for Count {
    type Error = String;

    fn try_from(count: u32) -> Result<Self, String> {
        if count > 0 { Ok(Self(count)) } else { Err("0 is not a count; it must be 1 or more".to_owned()) }
    }
}

/// A point or vector.
pub type Point = (Coordinate, Coordinate, Coordinate);

/// Red, green and blue radiance, linear Rec. 709.
pub type Colour = (Radiance, Radiance, Radiance);

/// A direction: of any length but 0 in the file, a unit vector here.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Point")]
pub struct Direction(pub DVec3);

impl TryFrom<Point> for Direction {
    type Error = String;

    fn try_from(point: Point) -> Result<Self, String> {
        unit(vector(point)).map(Self).ok_or_else(|| "(0, 0, 0) is not a direction".to_owned())
    }
}

/// Returns three numbers as a vector.
pub fn vector<T: Into<f64>>((x, y, z): (T, T, T)) -> DVec3 {
    DVec3::new(x.into(), y.into(), z.into())
}

/// Formats a point or a direction as in a scene file. Rust's debug form of an f64 reads back to the
/// same bits.
pub fn point_text(v: DVec3) -> String {
    format!("({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

/// Reads a number of type `N`.
pub fn number<'de, N: Deserialize<'de> + Into<f64>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<f64, D::Error> {
    N::deserialize(deserializer).map(Into::into)
}

/// Reads three numbers of type `N`.
pub fn numbers<'de, N: Deserialize<'de> + Into<f64>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<DVec3, D::Error> {
    <(N, N, N)>::deserialize(deserializer).map(vector)
}

/// Reads a vector of any length but 0, and returns the unit vector along it.
pub fn direction<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    Direction::deserialize(deserializer).map(|direction| direction.0)
}

/// Reads an optional field without RON's `Some(…)` around it.
pub fn some<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    T::deserialize(deserializer).map(Some)
}

/// Returns the unit vector along a finite vector; `None` for 0. Unlike `DVec3::normalize`, it is
/// correct for vectors whose squares underflow.
pub fn unit(vector: DVec3) -> Option<DVec3> {
    let greatest = vector.abs().max_element();
    (greatest > 0.0).then(|| (vector / greatest).normalize())
}

/// Returns sine and cosine of an angle in degrees, exact for quarter turns.
pub fn sin_cos_degrees(angle: f64) -> (f64, f64) {
    match angle.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}
