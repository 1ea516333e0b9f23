//! Spectra of parameters, and their colours.

use super::super::assembly::{blackbody, emitted, glass, metal, reflected};
use glam::DVec3;

/// A spectrum of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// Red, green and blue, linear.
    Rgb(DVec3),
    /// Samples by wavelength in nanometres.
    Samples(Vec<(f64, f64)>),
    /// A black body by its temperature in kelvin.
    Blackbody(f64),
    /// A spectrum that has a name.
    Named(String),
}

impl Spectrum {
    /// Returns the spectrum of wavelengths and values; `None` if the wavelengths do not ascend.
    pub fn of_samples(numbers: &[f64]) -> Option<Self> {
        let samples: Vec<_> = numbers.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        let ascends = samples.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let is_valid = numbers.len().is_multiple_of(2) && !samples.is_empty() && ascends;
        is_valid.then_some(Self::Samples(samples))
    }

    /// Returns whether the name is that of a file.
    pub fn is_file(&self) -> bool {
        matches!(self, Self::Named(name) if name.contains('.'))
    }

    /// Returns the colour of a share of light; `None` for an unknown name.
    pub fn share(&self) -> Option<DVec3> {
        match self {
            Self::Rgb(color) => Some(*color),
            Self::Samples(samples) => Some(reflected(samples)),
            Self::Blackbody(_) | Self::Named(_) => None,
        }
    }

    /// Returns the colour of light; that of a spectrum has luminance 1. `None` for an unknown name.
    pub fn light(&self) -> Option<DVec3> {
        let unit = |color: DVec3| {
            let luminance = color.dot(DVec3::new(0.2126, 0.7152, 0.0722));
            (luminance > 0.0).then(|| color / luminance)
        };
        match self {
            Self::Rgb(color) => Some(*color),
            Self::Samples(samples) => unit(emitted(samples)),
            Self::Blackbody(kelvin) => blackbody(*kelvin),
            Self::Named(name) => match name.as_str() {
                "stdillum-D65" => Some(DVec3::ONE),
                "stdillum-A" => blackbody(2856.0),
                "stdillum-D50" => blackbody(5003.0),
                _ => None,
            },
        }
    }

    /// Returns the part of a conductor's index that the spectrum is: `eta` or `k`.
    pub fn metal(&self) -> Option<DVec3> {
        let Self::Named(name) = self else { return self.share() };
        let (name, is_real) = match (name.strip_suffix("-eta"), name.strip_suffix("-k")) {
            (Some(name), _) => (name, true),
            (None, Some(name)) => (name, false),
            (None, None) => return None,
        };
        let (eta, k) = metal(name.strip_prefix("metal-")?)?;
        Some(if is_real { eta } else { k })
    }

    /// Returns the index of refraction that the spectrum is.
    pub fn glass(&self) -> Option<f64> {
        match self {
            Self::Named(name) => glass(name),
            other => other.share().map(|color| color.y),
        }
    }
}
