//! Parts of a scene that are arrays: objects, images of textures, and a panorama.

use crate::array_image::{self, Panorama};
use crate::array_object::ArrayObject;
use pyo3::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use trisect::scene::description::{Description, TextureImage};

/// Place of an object of the list from which a scene was built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Number among the objects of the scene's text.
    Text(usize),
    /// Number among the objects of arrays.
    Array(usize),
}

/// Parts of a scene that are arrays. Clones share the arrays.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    pub objects: Vec<ArrayObject>,
    /// Places of all objects, as the list had them; empty for a scene that was not built.
    places: Arc<Vec<Place>>,
    pub sky: Option<Panorama>,
    /// Images by the names of the files that they stand for. Their own names are those of the
    /// textures.
    pub images: BTreeMap<String, Arc<TextureImage>>,
}

impl Parts {
    /// Reads the arrays that `trisect._build.scene` has collected.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with the name of the array.
    pub fn read(arrays: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut parts = Self::default();
        for object in arrays.get_item("objects")?.try_iter()? {
            parts.objects.push(ArrayObject::read(&object?, "")?);
        }
        let place = |(is_array, number): (bool, usize)| match is_array {
            true => Place::Array(number),
            false => Place::Text(number),
        };
        let places: Vec<(bool, usize)> = arrays.get_item("places")?.extract()?;
        parts.places = Arc::new(places.into_iter().map(place).collect());
        for texture in arrays.get_item("textures")?.try_iter()? {
            let (name, file, texels): (String, String, Bound<'_, PyAny>) = texture?.extract()?;
            parts.set_image(&name, file, &texels)?;
        }
        let sky = arrays.get_item("sky")?;
        parts.sky = if sky.is_none() { None } else { Some(Panorama::read(&sky)?) };
        Ok(parts)
    }

    /// Sets the image of a texture, which stands for `file`.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with the name of the texture.
    pub fn set_image(&mut self, name: &str, file: String, texels: &Bound<'_, PyAny>) -> PyResult<()> {
        let image = array_image::texels(&format!("textures.{name}"), name, texels)?;
        self.images.insert(file, Arc::new(image));
        Ok(())
    }

    /// Returns the file for which the image of a texture stands, if it has one in memory.
    pub fn file_of(&self, texture: &str) -> Option<&String> {
        self.images.iter().find(|(_, image)| image.name == texture).map(|(file, _)| file)
    }

    /// Returns the place of an object, by its place in the list or its name; `None` for one that
    /// only the text may have.
    pub fn place(&self, object: &str) -> Option<Place> {
        let number = object.parse().ok().and_then(|number: usize| self.places.get(number).copied());
        let of_name = || self.objects.iter().position(|of| of.name == object).map(Place::Array);
        number.or_else(of_name)
    }

    /// Returns whether there are no arrays.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && self.sky.is_none() && self.images.is_empty()
    }

    /// Returns whether the objects of arrays have the same names and materials in both.
    pub fn has_names_of(&self, other: &Self) -> bool {
        self.objects.iter().map(ArrayObject::names).eq(other.objects.iter().map(ArrayObject::names))
    }

    /// Adds objects and sky to a scene, whose materials they name.
    ///
    /// # Errors
    ///
    /// A message for a material that the scene lacks.
    pub fn add_to(&self, description: &mut Description) -> Result<(), String> {
        let mut materials = HashMap::new();
        for (index, material) in description.materials.iter().enumerate() {
            materials.entry(material.name.clone()).or_insert(index);
        }
        self.objects.iter().try_for_each(|object| object.add_to(description, &materials))?;
        if let Some(sky) = &self.sky {
            description.sky = Some(sky.sky());
        }
        Ok(())
    }
}
