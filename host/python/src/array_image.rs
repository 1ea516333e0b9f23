//! Images of arrays: textures, and the panorama of the sky.

use crate::array::{all_finite, contiguous, wrong_type};
use numpy::{Element, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use trisect::image::Image;
use trisect::image::texture::MAX_SIDE;
use trisect::scene::description::{Sky, Texels, TextureImage};
use trisect::scene::texture::MAX_TEXEL;

/// Panorama of an array.
#[derive(Clone, Debug)]
pub struct Panorama {
    image: Arc<Image>,
    scale: f64,
    /// Rotation about +y in degrees.
    rotation: f64,
}

impl Panorama {
    /// Names of the fields.
    pub const FIELDS: [&str; 3] = ["radiance", "scale", "rotation"];

    /// Reads the fields of a `trisect.Panorama`.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` that begins with "sky".
    pub fn read(fields: &Bound<'_, PyAny>) -> PyResult<Self> {
        let fields = fields.cast::<PyDict>()?;
        let image = Arc::new(Image { width: 0, height: 0, pixels: Vec::new() });
        let mut panorama = Self { image, scale: 1.0, rotation: 0.0 };
        for (field, value) in fields {
            let field: String = field.extract()?;
            let place = if field == "radiance" { "sky".to_owned() } else { format!("sky.{field}") };
            panorama.set(&field, &place, &value)?;
        }
        Ok(panorama)
    }

    /// Sets a field, and returns whether a panorama has it. `place` names it in errors.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with `place`.
    pub fn set(&mut self, field: &str, place: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
        let number = || value.extract::<f64>().map_err(|_| wrong_type(place, "number", value));
        match field {
            "radiance" => self.image = Arc::new(radiance(place, value)?),
            "scale" => self.scale = number()?,
            "rotation" => self.rotation = number()?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Returns the sky.
    pub fn sky(&self) -> Sky {
        let Self { image, scale, rotation } = self;
        Sky::Image { image: Arc::clone(image), scale: *scale, rotation: rotation.to_radians() }
    }
}

/// Values of an array with its shape.
struct Values<T> {
    shape: Vec<usize>,
    all: Vec<T>,
}

/// Returns the values of an array of the type `T` and any shape; `None` for another type.
fn values_of<T: Element + Copy>(place: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<Values<T>>> {
    let Ok(array) = value.extract::<PyReadonlyArrayDyn<'_, T>>() else { return Ok(None) };
    contiguous(place, array.is_c_contiguous() && array.as_slice().is_ok())?;
    let all = array.as_slice().map_err(|error| PyValueError::new_err(error.to_string()))?.to_vec();
    Ok(Some(Values { shape: array.shape().to_vec(), all }))
}

/// Refuses a value outside `0..=max`.
fn all_within(place: &str, values: &[f32], max: f32, range: &str) -> PyResult<()> {
    all_finite(place, values)?;
    match values.iter().position(|value| !(0.0..=max).contains(value)) {
        None => Ok(()),
        Some(at) => {
            let message = format!("{place} has {} as its value {at}; all must be {range}", values[at]);
            Err(PyValueError::new_err(message))
        }
    }
}

fn radiance(place: &str, value: &Bound<'_, PyAny>) -> PyResult<Image> {
    let wrong = || wrong_type(place, "float32 array of shape (height, width, 3)", value);
    let Values { shape, all } = values_of::<f32>(place, value)?.ok_or_else(wrong)?;
    let [height, width, channels] = shape[..] else { return Err(wrong()) };
    let size = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let (Some((width, height)), 3, false) = (size, channels, all.is_empty()) else {
        return Err(PyValueError::new_err(format!(
            "{place} has shape {shape:?}; it must be (height, width, 3)"
        )));
    };
    all_within(place, &all, f32::MAX, "0 or more")?;
    Ok(Image { width, height, pixels: bytemuck::cast_slice(&all).to_vec() })
}

/// Reads the image of a texture: uint8, or linear float32. Channels of uint8 are sRGB-encoded where
/// the texture does not say otherwise.
///
/// # Errors
///
/// `TypeError` or `ValueError` with `place`.
pub fn texels(place: &str, name: &str, value: &Bound<'_, PyAny>) -> PyResult<TextureImage> {
    let (size, texels) = if let Some(values) = values_of::<u8>(place, value)? {
        let (size, channels) = size_of(place, &values.shape)?;
        (size, Texels::Srgb8(pixels(&values.all, channels, 255)))
    } else if let Some(values) = values_of::<f32>(place, value)? {
        let (size, channels) = size_of(place, &values.shape)?;
        all_within(place, &values.all, MAX_TEXEL, "from 0 to 65504")?;
        (size, Texels::Float(pixels(&values.all, channels, 1.0)))
    } else {
        let wanted =
            "uint8 or float32 array of shape (height, width), (height, width, 3) or (height, width, 4)";
        return Err(wrong_type(place, wanted, value));
    };
    Ok(TextureImage::new(size.0, size.1, texels).named(name))
}

/// Returns width and height of an image, and its number of channels.
fn size_of(place: &str, shape: &[usize]) -> PyResult<((u32, u32), usize)> {
    let wrong = || {
        let message = format!(
            "{place} has shape {shape:?}; it must be (height, width), (height, width, 3) or (height, width, 4), from 1 to {MAX_SIDE} texels across and down"
        );
        PyValueError::new_err(message)
    };
    let (height, width, channels) = match *shape {
        [height, width] => (height, width, 1),
        [height, width, channels @ (3 | 4)] => (height, width, channels),
        _ => return Err(wrong()),
    };
    let side = |length: usize| {
        let side = u32::try_from(length).ok();
        side.filter(|side| (1..=MAX_SIDE).contains(side)).ok_or_else(wrong)
    };
    Ok(((side(width)?, side(height)?), channels))
}

/// Returns texels of four channels. One channel is grey, and without a fourth they are opaque.
fn pixels<T: Copy>(values: &[T], channels: usize, opaque: T) -> Vec<[T; 4]> {
    let texel = |of: &[T]| match *of {
        [r, g, b, a] => [r, g, b, a],
        [r, g, b] => [r, g, b, opaque],
        _ => [of[0], of[0], of[0], opaque],
    };
    values.chunks_exact(channels).map(texel).collect()
}
