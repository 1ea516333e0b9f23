//! Colours, spectra and textures of Mitsuba as values.

use super::super::assembly::{Value, emitted, reflected};
use super::super::source_location::shown;
use super::document::Element;
use super::{Reader, SceneError};
use crate::description::{Filter, TextureUse, Wrap};
use glam::{DAffine2, DAffine3, DMat2, DVec2, DVec3};
use std::rc::Rc;
use trisect_image::metrics::srgb;

/// Kind of quantity that a spectrum describes: its colour depends on that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A share of light, seen in daylight.
    Share,
    /// Light.
    Light,
}

/// First and second radiation constant of Planck's law, for wavelengths in nanometres and radiance
/// in W m⁻² sr⁻¹ nm⁻¹.
const PLANCK: [f64; 2] = [1.191042972e20, 1.438776877e7];

impl Reader<'_, '_> {
    /// Returns a value by the name of its property.
    pub fn value(
        &mut self,
        object: &Element,
        name: &str,
        quantity: Quantity,
    ) -> Result<Option<Value>, SceneError> {
        let Some(property) = object.property(name).cloned() else { return Ok(None) };
        self.value_of(&property, quantity).map(Some)
    }

    /// Returns a colour by the name of its property: a texture's mean, with a warning.
    pub fn color(
        &mut self,
        object: &Element,
        name: &str,
        quantity: Quantity,
    ) -> Result<Option<DVec3>, SceneError> {
        let Some(value) = self.value(object, name, quantity)? else { return Ok(None) };
        if let Value::Image { .. } = value {
            let feature =
                format!("a texture as {name} of <{} type=\"{}\">", object.tag, shown(object.kind()));
            self.unsupported(object, &feature, "its mean is used");
        }
        Ok(Some(value.mean(&self.assembly.images.all)))
    }

    /// Returns a number that may be a texture, as [`Self::color`] does.
    pub fn scalar(&mut self, object: &Element, name: &str, default: f64) -> Result<f64, SceneError> {
        let color = self.color(object, name, Quantity::Share)?;
        Ok(color.map_or(default, |color| color.element_sum() / 3.0))
    }

    /// Returns the value of a number, colour, spectrum or texture.
    pub fn value_of(&mut self, element: &Rc<Element>, quantity: Quantity) -> Result<Value, SceneError> {
        let document = self.document;
        let element = self.resolved(element)?;
        match element.tag.as_str() {
            "float" | "integer" => {
                let word = document.required(element, "value")?;
                document.parse_number(element, word).map(Value::number)
            }
            "rgb" | "srgb" => self.rgb(element).map(Value::Constant),
            "spectrum" => self.spectrum(element, quantity).map(Value::Constant),
            "texture" => self.texture(element, quantity),
            _ => {
                let message = format!("{} is no colour, spectrum or texture", element.label());
                Err(document.error(element, message))
            }
        }
    }

    fn rgb(&self, element: &Element) -> Result<DVec3, SceneError> {
        let document = self.document;
        let text = document.required(element, "value")?.trim();
        if let Some(code) = text.strip_prefix('#') {
            let parsed = u32::from_str_radix(code, 16).ok().filter(|_| code.len() == 6);
            let code = parsed.ok_or_else(|| {
                document.error(element, format!("\"{}\" is no colour such as #8899aa", shown(text)))
            })?;
            let [_, r, g, b] = code.to_be_bytes();
            return Ok(DVec3::from([r, g, b].map(|code| f64::from(srgb::decode(f32::from(code) / 255.0)))));
        }
        let color = match document.numbers(element, text)?[..] {
            [grey] => DVec3::splat(grey),
            [r, g, b] => DVec3::new(r, g, b),
            _ => return Err(document.error(element, "a colour needs one number or three")),
        };
        if color.min_element() < 0.0 {
            return Err(document.error(element, "a colour must not be negative"));
        }
        Ok(color)
    }

    fn spectrum(&mut self, element: &Rc<Element>, quantity: Quantity) -> Result<DVec3, SceneError> {
        let document = self.document;
        let color = |samples: &[(f64, f64)]| match quantity {
            Quantity::Share => reflected(samples),
            Quantity::Light => emitted(samples),
        };
        let constant = |value: f64| match quantity {
            Quantity::Share => DVec3::splat(value),
            Quantity::Light => emitted(&[(0.0, value), (1e4, value)]),
        };
        let invalid = |message: &str| document.error(element, message);
        let found = match element.attribute("type") {
            None => match (element.attribute("filename"), element.attribute("value")) {
                (Some(name), _) => {
                    let bytes = self.assembly.read(name, &document.site(element))?;
                    let text = String::from_utf8_lossy(&bytes).into_owned();
                    let lines = text.lines().filter(|line| !line.trim_start().starts_with('#'));
                    let numbers = document.numbers(element, &lines.collect::<Vec<_>>().join(" "))?;
                    color(&pairs(&numbers).ok_or_else(|| invalid("the file needs ascending wavelengths"))?)
                }
                (None, Some(text)) if text.contains(':') => {
                    let numbers = document.numbers(element, &text.replace(':', " "))?;
                    color(&pairs(&numbers).ok_or_else(|| invalid("the wavelengths must ascend"))?)
                }
                (None, Some(text)) => constant(document.parse_number(element, text)?),
                (None, None) => {
                    return Err(invalid("a spectrum needs the attribute value, filename or type"));
                }
            },
            Some("uniform") => constant(document.number(element, "value", 1.0)?),
            Some("d65") => {
                let value = document.number(element, "value", 1.0)?;
                DVec3::splat(document.number(element, "scale", 1.0)? * value)
            }
            Some("blackbody") => {
                let temperature = document.number(element, "temperature", 5000.0)?;
                if !(500.0..=1e5).contains(&temperature) {
                    return Err(invalid("temperature must be from 500 to 100000 kelvin"));
                }
                let planck = |nm: f64| PLANCK[0] * nm.powi(-5) / libm::expm1(PLANCK[1] / (nm * temperature));
                let samples: Vec<(f64, f64)> =
                    (36..=84).map(|step| 10.0 * f64::from(step)).map(|nm| (nm, planck(nm))).collect();
                color(&samples) * document.number(element, "scale", 1.0)?
            }
            Some("irregular") => {
                let list = |name: &str| match document.word(element, name)? {
                    Some(text) => document.numbers(element, text),
                    None => Err(invalid("it needs wavelengths and values")),
                };
                let samples: Vec<_> = list("wavelengths")?.into_iter().zip(list("values")?).collect();
                let flat: Vec<f64> = samples.iter().flat_map(|&(nm, value)| [nm, value]).collect();
                color(&pairs(&flat).ok_or_else(|| invalid("the wavelengths must ascend"))?)
            }
            Some(_) => {
                self.unsupported(element, &element.label(), "taken as 0.5");
                return Ok(DVec3::splat(0.5));
            }
        };
        if found.is_finite() && found.min_element() >= 0.0 {
            return Ok(found);
        }
        Err(invalid("the spectrum must not be negative"))
    }

    fn texture(&mut self, element: &Rc<Element>, quantity: Quantity) -> Result<Value, SceneError> {
        let document = self.document;
        let site = document.site(element);
        element.mark();
        let coordinates = texture_coordinates(&document.transform(element, "to_uv")?);
        let value = match element.kind() {
            "bitmap" => {
                let name = document.word(element, "filename")?;
                let name = name.ok_or_else(|| document.error(element, "a bitmap needs a filename"))?;
                let is_linear = document.flag(element, "raw", false)?;
                let image = self.assembly.image(name, is_linear, &site)?;
                let filter = match document.word(element, "filter_type")? {
                    Some("nearest") => Filter::Nearest,
                    _ => Filter::Linear,
                };
                let wrap = match document.word(element, "wrap_mode")? {
                    Some("mirror") => Wrap::Mirror,
                    Some("clamp") => Wrap::Clamp,
                    _ => Wrap::Repeat,
                };
                let texture =
                    TextureUse { image, wrap: [wrap; 2], filter, transform: coordinates, second_uvs: false };
                Value::Image { texture, scale: DVec3::ONE }
            }
            "checkerboard" => {
                let even = self.color(element, "color0", quantity)?.unwrap_or(DVec3::splat(0.4));
                let odd = self.color(element, "color1", quantity)?.unwrap_or(DVec3::splat(0.2));
                // Two fields go across the unit square.
                let twice = DAffine2::from_scale(DVec2::splat(2.0));
                self.assembly.checkerboard([even, odd], twice * coordinates, &site)?
            }
            _ => {
                self.unsupported(element, &element.label(), "taken as 0.5");
                return Ok(Value::number(0.5));
            }
        };
        self.report_unused(element);
        Ok(value)
    }
}

/// Returns the part of a transform that texture coordinates take.
fn texture_coordinates(map: &DAffine3) -> DAffine2 {
    let m = map.matrix3;
    let linear = DMat2::from_cols(m.x_axis.truncate(), m.y_axis.truncate());
    DAffine2::from_mat2_translation(linear, map.translation.truncate())
}

/// Returns a list of wavelengths and values as pairs; `None` if the wavelengths do not ascend.
fn pairs(numbers: &[f64]) -> Option<Vec<(f64, f64)>> {
    let pairs: Vec<(f64, f64)> = numbers.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
    let is_valid =
        numbers.len().is_multiple_of(2) && !pairs.is_empty() && pairs.windows(2).all(|w| w[0].0 < w[1].0);
    is_valid.then_some(pairs)
}
