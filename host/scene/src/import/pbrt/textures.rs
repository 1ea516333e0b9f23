//! Textures of pbrt as values.

use super::super::assembly::Value;
use super::parameters::Parameters;
use super::spectrum::Spectrum;
use super::tokens::{At, number};
use super::{Reader, SceneError, shown};
use crate::description::{Filter, TextureUse, Wrap};
use glam::{DAffine2, DVec2, DVec3};

/// Map between texture coordinates of pbrt, where v points up, and those of meshes here.
fn flip() -> DAffine2 {
    DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y)
}

impl Reader<'_> {
    /// Defines a texture of numbers or spectra.
    pub fn texture(
        &mut self,
        name: String,
        (values, class): (&str, &str),
        parameters: &Parameters,
        at: At,
    ) -> Result<(), SceneError> {
        let is_number = match values {
            "float" => true,
            "spectrum" | "color" => false,
            _ => return self.error(at, format!("\"{}\" must be float or spectrum", shown(values))),
        };
        let what = format!("Texture \"{}\"", shown(class));
        let value = match class {
            "constant" => self.value(parameters, "value", 1.0, is_number)?,
            "scale" => {
                let texture = self.value(parameters, "tex", 1.0, is_number)?;
                let scale = self.value(parameters, "scale", 1.0, true)?;
                match texture.times(&scale) {
                    Some(product) => product,
                    None => {
                        self.unsupported(at, "a texture scaled by an image", "the image's mean is used");
                        let mean = scale.mean(&self.assembly.images.all);
                        texture.times(&Value::Constant(mean)).unwrap_or(texture)
                    }
                }
            }
            "mix" => self.mix(parameters, is_number, at)?,
            "imagemap" => self.imagemap(parameters, at)?,
            "checkerboard" => self.checkerboard(parameters, is_number, at)?,
            _ => {
                self.unsupported(at, &what, "taken as 0.5");
                parameters.unused().for_each(|parameter| parameters.ignore(&[&parameter.name]));
                Value::number(0.5)
            }
        };
        self.report_unused(parameters, &what);
        self.assembly.budget.take(256, &self.tokens.site(at, "Texture"))?;
        self.textures.insert((is_number, name), value);
        Ok(())
    }

    /// Returns a value: a texture by its name, a spectrum or a number.
    pub fn value(
        &mut self,
        parameters: &Parameters,
        name: &str,
        default: f64,
        is_number: bool,
    ) -> Result<Value, SceneError> {
        Ok(self.optional_value(parameters, name, is_number)?.unwrap_or(Value::number(default)))
    }

    /// Returns a value as [`Self::value`] does; `None` without the parameter.
    pub fn optional_value(
        &mut self,
        parameters: &Parameters,
        name: &str,
        is_number: bool,
    ) -> Result<Option<Value>, SceneError> {
        let at = parameters.get(name).map_or(self.tokens.at, |parameter| parameter.at);
        if let Some(texture) = parameters.texture(&self.tokens, name)? {
            let key = (is_number, texture.to_owned());
            return match self.textures.get(&key) {
                Some(value) => Ok(Some(value.clone())),
                None => {
                    let message =
                        format!("unknown texture \"{}\"; Texture must define it before", shown(texture));
                    self.error(at, message)
                }
            };
        }
        let Some(spectrum) = self.spectrum(parameters, name)? else { return Ok(None) };
        match spectrum.share() {
            Some(color) if color.min_element() >= 0.0 => Ok(Some(Value::Constant(color))),
            Some(_) => self.error(at, format!("{name} must not be negative")),
            None => self.error(at, format!("{name} is no spectrum of a share of light")),
        }
    }

    /// Returns a spectrum by its name; one that is in a file is read from it.
    pub fn spectrum(&mut self, parameters: &Parameters, name: &str) -> Result<Option<Spectrum>, SceneError> {
        let found = parameters.spectrum(&self.tokens, name)?;
        let Some(Spectrum::Named(file)) = found.as_ref().filter(|spectrum| spectrum.is_file()) else {
            return Ok(found);
        };
        let at = parameters.get(name).map_or(self.tokens.at, |parameter| parameter.at);
        let bytes = self.assembly.read(file, &self.tokens.site(at, "the spectrum"))?;
        let text = String::from_utf8_lossy(&bytes);
        let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
        let numbers: Option<Vec<f64>> = lines.flat_map(str::split_whitespace).map(number).collect();
        match numbers.and_then(|numbers| Spectrum::of_samples(&numbers)) {
            Some(spectrum) => Ok(Some(spectrum)),
            None => {
                let message = format!("\"{}\" must hold ascending wavelengths and values", shown(file));
                self.error(at, message)
            }
        }
    }

    /// Returns a number: a texture's mean, with a warning.
    pub fn scalar(&mut self, parameters: &Parameters, name: &str, default: f64) -> Result<f64, SceneError> {
        let value = self.value(parameters, name, default, true)?;
        if let (Value::Image { .. }, Some(parameter)) = (&value, parameters.get(name)) {
            let feature = format!("a texture as {}", shown(name));
            self.unsupported(parameter.at, &feature, "its mean is used");
        }
        Ok(value.mean(&self.assembly.images.all).element_sum() / 3.0)
    }

    /// Returns the map from texture coordinates of meshes to pbrt's (s, t).
    fn mapping(&mut self, parameters: &Parameters) -> Result<DAffine2, SceneError> {
        if let Some(kind) = parameters.text(&self.tokens, "mapping")?.filter(|kind| *kind != "uv") {
            let feature = format!("the mapping \"{}\" of a texture", shown(kind));
            let at = parameters.get("mapping").map_or(self.tokens.at, |parameter| parameter.at);
            self.unsupported(at, &feature, "taken as uv");
            parameters.ignore(&["v1", "v2"]);
        }
        let number = |name: &str, default: f64| parameters.number(&self.tokens, name, default);
        let scale = DVec2::new(number("uscale", 1.0)?, number("vscale", 1.0)?);
        let offset = DVec2::new(number("udelta", 0.0)?, number("vdelta", 0.0)?);
        Ok(DAffine2::from_scale_angle_translation(scale, 0.0, offset) * flip())
    }

    fn imagemap(&mut self, parameters: &Parameters, at: At) -> Result<Value, SceneError> {
        let coordinates = self.mapping(parameters)?;
        let tokens = &self.tokens;
        let Some(file) = parameters.text(tokens, "filename")? else {
            return self.error(at, "an imagemap needs the parameter filename");
        };
        let encoding = parameters.text(tokens, "encoding")?.unwrap_or("sRGB");
        let wrap = match parameters.text(tokens, "wrap")?.unwrap_or("repeat") {
            "clamp" | "black" => Wrap::Clamp,
            "octahedralsphere" => return self.error(at, "wrap must be repeat, clamp or black"),
            _ => Wrap::Repeat,
        };
        let is_black = parameters.text(tokens, "wrap")? == Some("black");
        let filter = match parameters.text(tokens, "filter")?.unwrap_or("bilinear") {
            "point" => Filter::Nearest,
            _ => Filter::Linear,
        };
        let scale = parameters.number(tokens, "scale", 1.0)?;
        let is_inverted = parameters.flag(tokens, "invert", false)?;
        parameters.ignore(&["maxanisotropy"]);
        let (is_linear, encoding) = (encoding == "linear", shown(encoding));
        if !matches!(encoding.as_str(), "linear" | "sRGB") {
            self.unsupported(at, &format!("the encoding \"{encoding}\""), "taken as sRGB");
        }
        if is_black {
            self.unsupported(at, "the wrap \"black\"", "taken as clamp");
        }
        if is_inverted {
            self.unsupported(at, "the flag invert of an imagemap", "ignored");
        }
        let image = self.image(file, is_linear, at)?;
        let transform = flip() * coordinates;
        let texture = TextureUse { wrap: [wrap; 2], filter, transform, ..image };
        Ok(Value::Image { texture, scale: DVec3::splat(scale) })
    }

    fn checkerboard(
        &mut self,
        parameters: &Parameters,
        is_number: bool,
        at: At,
    ) -> Result<Value, SceneError> {
        if parameters.count(&self.tokens, "dimension", 2, 2)? != 2 {
            self.unsupported(at, "a checkerboard of three dimensions", "taken as one of two");
        }
        let coordinates = self.mapping(parameters)?;
        let mut mean = |name: &str, default: f64| {
            let value = self.value(parameters, name, default, is_number)?;
            if let Value::Image { .. } = value {
                self.unsupported(at, "an image within a checkerboard", "its mean is used");
            }
            Ok(value.mean(&self.assembly.images.all))
        };
        let colors = [mean("tex1", 1.0)?, mean("tex2", 0.0)?];
        let site = self.tokens.site(at, "Texture");
        self.assembly.checkerboard(colors, coordinates, &site)
    }

    fn mix(&mut self, parameters: &Parameters, is_number: bool, at: At) -> Result<Value, SceneError> {
        let first = self.value(parameters, "tex1", 0.0, is_number)?;
        let second = self.value(parameters, "tex2", 1.0, is_number)?;
        let amount = self.scalar(parameters, "amount", 0.5)?.clamp(0.0, 1.0);
        if let (Value::Constant(a), Value::Constant(b)) = (&first, &second) {
            return Ok(Value::Constant(*a * (1.0 - amount) + *b * amount));
        }
        self.unsupported(at, "a mix with an image", "the texture of the greater amount is used");
        Ok(if amount > 0.5 { second } else { first })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_stay_upright() {
        let [identity, flip] = [flip() * flip(), flip()];
        assert_eq!(identity.transform_point2(DVec2::new(0.25, 0.75)), DVec2::new(0.25, 0.75));
        assert_eq!(flip.transform_point2(DVec2::new(0.25, 0.75)), DVec2::new(0.25, 0.25));
    }
}
