//! Environment, sun and ground around a scene: choices of who renders it, in place of those of the
//! file or in addition to them.

use crate::description::{Description, PunctualLight, Sky, SunSky};
use crate::error::SceneError;
use crate::values::sin_cos_degrees;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trisect_image::{Image, ImageError};

/// Extensions of panoramas.
pub(crate) const PANORAMAS: [&str; 3] = ["hdr", "exr", "pfm"];

/// Environment, sun and ground around a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Radiance from infinity. `None` keeps that of a scene file, and gives a model whose own
    /// lights do not carry the image the studio.
    pub environment: Option<EnvironmentSource>,
    /// Parallel light in addition to all other light; the place of the sun of
    /// [`EnvironmentSource::Sky`].
    pub sun: Option<Sun>,
    /// True for a ground below the scene. `None` gives one to a model that has neither a camera
    /// nor lights that carry its image, and keeps that of a scene file.
    pub ground: Option<bool>,
}

/// Radiance from infinity.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentSource {
    /// The built-in panorama of a studio.
    Studio,
    /// A clear sky with its sun, at [`Surroundings::sun`] if that is given.
    Sky,
    /// Radiance 1 from all directions.
    Uniform,
    /// A panorama file in latitude and longitude.
    File(PathBuf),
}

/// Parallel light from the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Azimuth in degrees: 0 is -z, 90 is +x, clockwise seen from above.
    pub azimuth: f64,
    /// Height above the horizon in degrees, 0 to 90.
    pub elevation: f64,
    /// Irradiance of a surface that faces the sun; `None` is [`Self::DEFAULT_IRRADIANCE`], and for
    /// [`EnvironmentSource::Sky`] the sun's own.
    pub irradiance: Option<f64>,
}

impl Surroundings {
    /// Applies the choices to the scene of a scene file. `name` stands for it in messages.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a panorama that cannot be read, and for a ground, which a scene states
    /// itself.
    pub(crate) fn apply(&self, scene: &mut Description, name: &str) -> Result<(), SceneError> {
        self.apply_environment(scene)?;
        scene.lights.extend(self.sun_light());
        match (self.ground, &scene.ground) {
            (Some(true), None) => Err(SceneError::Inconsistent {
                file: name.to_owned(),
                message: "`ground` on is for models without a scene file; write the field \"ground\", or a Plane, into the scene"
                    .to_owned(),
            }),
            (Some(false), _) => {
                scene.ground = None;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Returns the parallel light; `None` if there is no sun, or it is that of the sky.
    pub(crate) fn sun_light(&self) -> Option<PunctualLight> {
        let is_apart = self.environment != Some(EnvironmentSource::Sky);
        self.sun.filter(|_| is_apart).map(|sun| sun.light())
    }

    /// Replaces the sky of a scene, if an environment is chosen.
    pub(crate) fn apply_environment(&self, scene: &mut Description) -> Result<(), SceneError> {
        if let Some(environment) = &self.environment {
            let (sky, file) = environment.sky(self.sun)?;
            scene.sky = Some(sky);
            scene.files.extend(file);
        }
        Ok(())
    }
}

impl Sun {
    /// Default irradiance: with the dimmed studio that a model gets beside a sun, about that of an
    /// upward surface in the studio alone.
    pub const DEFAULT_IRRADIANCE: f64 = 2.0;

    /// Sun of the clear sky: it shines over the left shoulder of a viewer at +z.
    const OF_SKY: Self = Self { azimuth: 225.0, elevation: 40.0, irradiance: None };

    /// Returns the light, which travels away from the sun.
    pub fn light(&self) -> PunctualLight {
        let (east, north) = sin_cos_degrees(self.azimuth);
        let (up, along) = sin_cos_degrees(self.elevation);
        let toward = DVec3::new(along * east, up, -along * north);
        let irradiance = self.irradiance.unwrap_or(Self::DEFAULT_IRRADIANCE);
        PunctualLight::Directional { direction: -toward, irradiance: DVec3::splat(irradiance) }
    }
}

impl EnvironmentSource {
    /// Returns the sky, with this sun if it is a clear sky, and the file that it was read from.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a panorama that cannot be read.
    pub(crate) fn sky(&self, sun: Option<Sun>) -> Result<(Sky, Option<PathBuf>), SceneError> {
        let (scale, rotation) = (1.0, 0.0);
        Ok(match self {
            Self::Studio => (Sky::Studio { scale, rotation }, None),
            Self::Sky => {
                let Sun { azimuth, elevation, irradiance } = sun.unwrap_or(Sun::OF_SKY);
                let sky = SunSky::new(azimuth, elevation);
                let scale = irradiance.map_or(1.0, |wanted| wanted / sky.sun_luminance());
                (Sky::Sun(SunSky { scale, ..sky }.into()), None)
            }
            Self::Uniform => (Sky::Gradient { bottom: DVec3::ONE, top: DVec3::ONE }, None),
            Self::File(path) => {
                (Sky::Image { image: read_panorama(path)?, scale, rotation }, Some(path.clone()))
            }
        })
    }
}

/// Reads a panorama: HDR, EXR or PFM by its extension, in upper or lower case.
pub(crate) fn read_panorama(path: &Path) -> Result<Arc<Image>, SceneError> {
    let inconsistent = |message| SceneError::Inconsistent { file: path.display().to_string(), message };
    let known =
        |extension: &std::ffi::OsStr| PANORAMAS.iter().any(|known| extension.eq_ignore_ascii_case(known));
    if !path.extension().is_some_and(known) {
        return Err(inconsistent(format!("this is not a panorama; use .{}", PANORAMAS.join(", ."))));
    }
    Image::read(path).map(Arc::new).map_err(|error| match error {
        ImageError::Io { path, source } => SceneError::read(&path, source),
        ImageError::Codec { message, .. } => inconsistent(message),
        other => {
            let (file, text) = (path.display().to_string(), other.to_string());
            inconsistent(text.strip_prefix(&format!("{file}: ")).unwrap_or(&text).to_owned())
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_goes_clockwise_from_minus_z() {
        let from = |azimuth: f64, elevation: f64| {
            let sun = Sun { azimuth, elevation, irradiance: Some(3.0) };
            let PunctualLight::Directional { direction, irradiance } = sun.light() else { panic!() };
            assert_eq!(irradiance, DVec3::splat(3.0));
            -direction
        };
        assert_eq!(from(0.0, 0.0), DVec3::NEG_Z);
        assert_eq!(from(90.0, 0.0), DVec3::X);
        assert_eq!(from(180.0, 0.0), DVec3::Z);
        assert_eq!(from(-90.0, 0.0), DVec3::NEG_X);
        for azimuth in [0.0, 33.0, 270.0] {
            assert!((from(azimuth, 90.0) - DVec3::Y).length() < 1e-15);
        }
        assert!((from(45.0, 30.0).y - 0.5).abs() < 1e-12 && from(45.0, 30.0).is_normalized());
    }
}
