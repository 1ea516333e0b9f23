//! Numbers that are in range once they exist. Serde checks them while it reads, so the reader's error names line and column.

use serde::Deserialize;

/// Coordinates and distances may be this large: their squares, summed over three axes, stay finite in f32.
pub const GREATEST: f64 = 1e18;

/// Radii may be this small: their squares stay normal numbers in f32.
pub const LEAST: f64 = 1e-18;

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
    };
}

number!(
    /// A coordinate in scene units.
    Coordinate, "a finite coordinate, at most 1e18 from 0", x => x.abs() <= GREATEST
);
number!(
    /// A radius or distance in scene units.
    Length, "a positive finite length between 1e-18 and 1e18", x => (LEAST..=GREATEST).contains(&x)
);
number!(
    /// A reflected share, or a fuzz radius.
    Share, "between 0 and 1", x => (0.0..=1.0).contains(&x)
);
number!(
    /// A radiance.
    Radiance, "a finite radiance, 0 or more and at most 1e18", x => (0.0..=GREATEST).contains(&x)
);
number!(
    /// An index of refraction.
    Ior, "a positive index of refraction, between 1e-3 and 1e3", x => (1e-3..=1e3).contains(&x)
);
number!(
    /// The angle of a view, in degrees.
    FieldOfView, "an angle between 0.001 and 179 degrees", x => (1e-3..=179.0).contains(&x)
);
number!(
    /// The angle of a lens seen from the plane in focus, in degrees.
    Defocus, "an angle between 0 and 179 degrees", x => (0.0..=179.0).contains(&x)
);

/// A count from 1.
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

/// Red, green and blue shares, linear Rec. 709.
pub type Albedo = (Share, Share, Share);

/// Red, green and blue radiance, linear Rec. 709.
pub type Colour = (Radiance, Radiance, Radiance);
