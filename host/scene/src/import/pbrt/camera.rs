//! Camera, film, sampler and integrator of pbrt.

use super::super::assembly::{Projection, View, reflection};
use super::parameters::Parameters;
use super::tokens::At;
use super::{CameraDirective, Reader, SceneError, shown};
use glam::{DAffine3, DVec3};

impl Reader<'_> {
    /// Reads a directive about the image.
    pub fn image_setting(
        &mut self,
        word: &str,
        kind: &str,
        parameters: &Parameters,
        at: At,
    ) -> Result<(), SceneError> {
        let what = format!("{word} \"{}\"", shown(kind));
        let (tokens, settings) = (&self.tokens, &mut self.assembly.settings);
        match word {
            "Film" => {
                settings.width = parameters.count(tokens, "xresolution", 1, settings.width)?;
                settings.height = parameters.count(tokens, "yresolution", 1, settings.height)?;
                parameters.ignore(&[
                    "filename",
                    "diagonal",
                    "savefp16",
                    "maxcomponentvalue",
                    "coordinatesystem",
                ]);
                if kind == "spectral" {
                    self.unsupported(at, &what, "the image has red, green and blue");
                }
            }
            "Sampler" => {
                let stratified = kind == "stratified" && parameters.get("xsamples").is_some();
                settings.samples = if stratified {
                    let across = parameters.count(tokens, "xsamples", 1, 4)?;
                    across.saturating_mul(parameters.count(tokens, "ysamples", 1, 4)?)
                } else {
                    parameters.count(tokens, "pixelsamples", 1, settings.samples)?
                };
                parameters.ignore(&["seed", "randomization", "jitter"]);
            }
            "Integrator" => {
                // The first segment of a path has depth 0.
                settings.depth = parameters.count(tokens, "maxdepth", 0, 5)?.saturating_add(1).min(65535);
                parameters.ignore(&["lightsampler", "samplelights", "samplebsdf"]);
                if !matches!(kind, "path" | "volpath" | "simplepath" | "simplevolpath" | "bdpt") {
                    self.unsupported(at, &what, "paths are traced");
                }
            }
            "PixelFilter" => {
                if kind != "box" {
                    self.unsupported(at, &what, "the filter is a box of one pixel");
                }
                parameters.ignore(&["xradius", "yradius", "sigma", "B", "C", "tau"]);
            }
            _ => parameters.unused().for_each(|parameter| parameters.ignore(&[&parameter.name])),
        }
        self.report_unused(parameters, &what);
        Ok(())
    }

    /// Chooses the camera, and whether the world is reflected.
    pub fn begin_world(&mut self, at: At) -> Result<(), SceneError> {
        // Without a camera, pbrt's looks along +z from the origin.
        let camera = self.camera.take().unwrap_or_else(|| CameraDirective {
            kind: "perspective".to_owned(),
            parameters: Parameters::default(),
            to_world: DAffine3::IDENTITY,
            at,
        });
        let CameraDirective { kind, parameters, to_world, at } = camera;
        let what = format!("Camera \"{}\"", shown(&kind));
        if !matches!(kind.as_str(), "perspective" | "orthographic") {
            self.unsupported(at, &what, "taken as perspective");
        }
        let (tokens, settings) = (&self.tokens, &self.assembly.settings);
        let pixels = f64::from(settings.width) / f64::from(settings.height);
        let aspect = match parameters.number(tokens, "frameaspectratio", pixels)? {
            ratio if ratio > 0.0 => ratio,
            _ => return self.error(at, "frameaspectratio must be above 0"),
        };
        // The shorter axis of the view goes from -1 to 1.
        let mut half_height = if aspect >= 1.0 { 1.0 } else { 1.0 / aspect };
        let (mut is_shifted, mut window) = (false, aspect);
        match *parameters.numbers(tokens, "screenwindow")? {
            [] => {}
            [left, right, bottom, top] if left < right && bottom < top => {
                half_height = 0.5 * (top - bottom);
                window = (right - left) / (top - bottom);
                is_shifted = (left + right).abs() > 1e-9 * (right - left)
                    || (bottom + top).abs() > 1e-9 * (top - bottom);
            }
            _ => return self.error(at, "screenwindow needs four numbers: left, right, bottom, top"),
        }
        let fov = parameters.number(tokens, "fov", 90.0)?;
        let is_parallel = kind == "orthographic";
        let projection = if is_parallel {
            Projection::Parallel { half_height }
        } else if fov > 0.0 && fov < 180.0 {
            Projection::Perspective { half_height: half_height * (0.5 * fov.to_radians()).tan() }
        } else {
            return self.error(at, format!("fov is {fov}; it must be above 0 and below 180 degrees"));
        };
        let lens_radius = parameters.number(tokens, "lensradius", 0.0)?;
        let focus_distance = parameters.number(tokens, "focaldistance", 1e6)?;
        if !(lens_radius >= 0.0 && focus_distance > 0.0) {
            return self.error(at, "lensradius must be 0 or more, focaldistance above 0");
        }
        parameters.ignore(&["shutteropen", "shutterclose"]);
        if (window / pixels - 1.0).abs() > 1e-6 {
            self.unsupported(at, "a view whose aspect is not that of the film", "pixels are square");
        }
        if is_shifted {
            self.unsupported(at, "a screenwindow that is not centred", "the view is centred");
        }
        let lens_radius = if is_parallel { 0.0 } else { lens_radius };
        let view = View { to_world, right: DVec3::X, projection, lens_radius, focus_distance };
        if view.is_mirrored() {
            self.assembly.world = reflection();
            self.notes.push("pbrt's coordinates are left-handed: the world is reflected in x".to_owned());
        }
        let pose = view.pose(&self.assembly.world).map_err(|fault| self.tokens.error(at, fault))?;
        self.assembly.scene.cameras.push(("camera".to_owned(), pose));
        self.report_unused(&parameters, &what);
        Ok(())
    }
}
