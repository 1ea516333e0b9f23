//! Findings, and the kinds of limits that they exceed.

use serde::Serialize;
use std::fmt;

/// Kind of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// A primitive is too small for its distance from the origin: its position is rounded.
    FarFromOrigin,
    /// The eye, or a small object, is too near to a surface for that surface's size and position.
    NearSurface,
    /// A primitive is so small that its square leaves the range of f32.
    TooSmall,
    /// A pixel is narrower than the spacing of directions in f32.
    NarrowView,
    /// The points of a lens far from the origin are rounded.
    FarLens,
    /// An index of refraction so near to 1 that f32 loses the difference.
    IorNearOne,
    /// An index of refraction so large or small that the cone of refraction is lost.
    IorExtreme,
    /// Radiance whose square or sum overflows f32.
    TooBright,
    /// Radiance whose square underflows f32.
    TooDim,
    /// So many samples that the accumulator's rounding exceeds their noise.
    Samples,
}

impl Limit {
    /// Returns the title for people.
    pub fn title(self) -> &'static str {
        match self {
            Self::FarFromOrigin => "small for its distance from the origin",
            Self::NearSurface => "too large or too far away for what is near it",
            Self::TooSmall => "too small for single precision",
            Self::NarrowView => "pixels narrower than the spacing of directions",
            Self::FarLens => "a lens far from the origin",
            Self::IorNearOne => "an index of refraction near 1",
            Self::IorExtreme => "an extreme index of refraction",
            Self::TooBright => "too bright for the film",
            Self::TooDim => "too dim for the film",
            Self::Samples => "more samples than the accumulator holds",
        }
    }
}

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The error may be visible: `trisect check` has exit code 6, and a render warns.
    Warning,
    /// The finding affects less than a thousandth of the triangles, and of their area.
    Note,
}

/// Numbers of triangles of a mesh that a finding affects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Triangles {
    /// Triangles outside the supported range.
    pub outside: usize,
    /// All triangles of the mesh.
    pub of: usize,
}

/// Bound of the supported range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Supported {
    /// Maximum.
    AtMost(f64),
    /// Minimum.
    AtLeast(f64),
}

/// Quantity that an error is relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Size of the smaller primitive.
    Size,
    /// Distance from the eye to the surface.
    Distance,
    /// Pixels.
    Pixels,
    /// Reflectance.
    Reflectance,
    /// 1, the maximum of the squared cosine of refraction.
    SquaredCosine,
    /// Primitives that are left out.
    Primitives,
    /// Mean of a pixel.
    Mean,
    /// Variance of a pixel.
    Variance,
}

/// Predicted error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Predicted {
    /// Error relative to the unit; 1 if all of it may be wrong. For pixels, their number. The root
    /// mean square of measured errors is within a factor of 4 of it.
    pub value: f64,
    /// Unit of the error.
    pub of: Unit,
}

impl Predicted {
    /// Returns a relative error, limited to 1: beyond that nothing is right.
    pub(super) fn share(value: f64, of: Unit) -> Self {
        Self { value: if value < 1.0 { value } else { 1.0 }, of }
    }
}

impl fmt::Display for Predicted {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let of = match self.of {
            Unit::Pixels => return write!(formatter, "an error of {:.2} pixels", self.value),
            Unit::SquaredCosine => {
                return write!(
                    formatter,
                    "an error of {:.1e} in the squared cosine of refraction",
                    self.value
                );
            }
            Unit::Primitives => return formatter.write_str("it is left out"),
            Unit::Size => "its size",
            Unit::Distance => "the distance",
            Unit::Reflectance => "the reflectance",
            Unit::Mean => "a pixel's mean",
            Unit::Variance => "a pixel's variance",
        };
        if self.value < 1.0 {
            write!(formatter, "an error of {:.1e} of {of}", self.value)
        } else {
            write!(formatter, "an error as large as {of}")
        }
    }
}

/// Something outside the supported range.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Finding {
    /// Kind of the limit.
    pub limit: Limit,
    /// Severity.
    pub severity: Severity,
    /// Affected triangles; `None` for anything but a mesh.
    pub triangles: Option<Triangles>,
    /// Object, material or light, by its name in the scene file: `objects[3]` is the fourth object
    /// of the file.
    pub what: String,
    /// Name of the measured quantity.
    pub quantity: &'static str,
    /// Measured value.
    pub measured: f64,
    /// Supported values.
    pub supported: Supported,
    /// Predicted error.
    pub predicted: Predicted,
    /// Remedy, for people.
    pub remedy: &'static str,
}

impl fmt::Display for Finding {
    /// Writes four lines: object, measured value, prediction, remedy.
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let (word, bound) = match self.supported {
            Supported::AtMost(bound) => ("most", bound),
            Supported::AtLeast(bound) => ("least", bound),
        };
        let note = if self.severity == Severity::Note { "note: " } else { "" };
        writeln!(formatter, "{note}{}: {}", self.limit.title(), self.what)?;
        writeln!(formatter, "  {}: {:.3e}; supported: at {word} {bound:.3e}", self.quantity, self.measured)?;
        writeln!(formatter, "  predicted: {}", self.predicted)?;
        writeln!(formatter, "  remedy: {}", self.remedy)
    }
}
