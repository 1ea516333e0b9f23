//! What a rule says.

use serde::Serialize;
use std::fmt;

/// Kinds of limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// A primitive is too small for its distance from the origin: its place is rounded.
    FarFromOrigin,
    /// The eye, or a small object, is too near to a surface for the size and place of that surface.
    NearSurface,
    /// A primitive is so small that its square leaves the range of f32.
    TooSmall,
    /// A pixel is narrower than the directions of f32 are apart.
    NarrowView,
    /// The points of a lens far from the origin are rounded.
    FarLens,
    /// An index of refraction so near to 1 that f32 loses the difference.
    IorNearOne,
    /// An index of refraction so great or small that the cone of refraction is lost.
    IorExtreme,
    /// Radiance whose square or sum overflows f32.
    TooBright,
    /// Radiance whose square underflows f32.
    TooDim,
    /// So many samples that the accumulator's rounding exceeds their noise.
    Samples,
}

impl Limit {
    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::FarFromOrigin => "small for its distance from the origin",
            Self::NearSurface => "too great or remote for what is near to it",
            Self::TooSmall => "too small for single precision",
            Self::NarrowView => "pixels narrower than directions are apart",
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
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// It may show: `trisect check` has exit code 6, and a render warns.
    Warning,
    /// It touches less than a thousandth of the triangles, and of their area.
    Note,
}

/// Triangles of a mesh that a finding touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Triangles {
    /// Those outside the range.
    pub outside: usize,
    /// All of the mesh.
    pub of: usize,
}

/// What the rule supports.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Supported {
    /// No more than this.
    AtMost(f64),
    /// No less than this.
    AtLeast(f64),
}

/// What an error is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// The size of the smaller primitive.
    Size,
    /// The distance from the eye to the surface.
    Distance,
    /// Pixels.
    Pixels,
    /// The reflectance.
    Reflectance,
    /// 1, which the squared cosine of refraction is at most.
    SquaredCosine,
    /// The primitives that are left out.
    Primitives,
    /// The mean of a pixel.
    Mean,
    /// The variance of a pixel.
    Variance,
}

/// A predicted error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Predicted {
    /// Relative to the unit, 1 where all of it may be wrong; of pixels, their number. Typical: measured errors have a root mean
    /// square within a factor of 4 of it.
    pub value: f64,
    /// What it is counted in.
    pub of: Unit,
}

impl Predicted {
    /// Relative errors are at most 1: then nothing is right.
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
pub struct Finding {
    /// Of which kind.
    pub limit: Limit,
    /// Severity.
    pub severity: Severity,
    /// The triangles that it is about; `None` for what is no mesh.
    pub triangles: Option<Triangles>,
    /// The object, material or light, as the scene's author knows it: `objects[3]` is the fourth of the scene file.
    pub what: String,
    /// What was measured.
    pub quantity: &'static str,
    /// How much of it there is.
    pub measured: f64,
    /// How much of it may be.
    pub supported: Supported,
    /// What to expect.
    pub predicted: Predicted,
    /// What helps.
    pub remedy: &'static str,
}

impl fmt::Display for Finding {
    /// Four lines.
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
