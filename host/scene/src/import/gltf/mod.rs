//! Reads glTF 2.0: `.gltf` with buffers in data URIs or files beside it, and `.glb`.
//!
//! [`parse`] turns a file into a [`Description`]; docs/reference/scene-format/models.md lists the
//! supported features for users.

mod accessor;
mod attributes;
mod buffers;
mod camera;
mod container;
mod draco;
mod features;
mod instancing;
mod json;
mod layers;
mod light;
mod material;
mod meshopt;
mod motion;
mod primitive;
mod scene;
mod slots;
mod texture;
mod transform;
mod version;

use super::ModelOptions;
use super::budget::Budget;
use super::files::Files;
use super::images::Images;
use super::source_location::SourceLocation;
use super::warnings::Warnings;
use crate::description::Description;
use crate::error::SceneError;
use buffers::Buffers;
use container::Container;
use json::Root;
use std::borrow::Cow;

/// Reads glTF 2.0 from `bytes`, JSON or GLB, as `options` choose; `name` stands for the file in
/// messages.
///
/// Supported are:
///
/// * meshes of triangles, strips and fans, indexed or not, interleaved, sparse or quantised
///   (KHR_mesh_quantization)
/// * nodes, in the default scene, or from all roots if the file names no scene; their instances
///   (EXT_mesh_gpu_instancing) and visibility (KHR_node_visibility)
/// * skins, morph targets and animations, at a time, also of materials, lights and cameras
///   (KHR_animation_pointer)
/// * perspective cameras and KHR_lights_punctual
/// * the metallic-roughness material with KHR_materials_anisotropy, clearcoat,
///   diffuse_transmission, dispersion, emissive_strength, ior, iridescence, sheen, specular,
///   transmission, unlit and volume, and pbrSpecularGlossiness; in variants
///   (KHR_materials_variants)
/// * PNG, JPEG, WebP (EXT_texture_webp) and KTX2 textures (KHR_texture_basisu) with samplers and
///   KHR_texture_transform
/// * geometry compressed by EXT_meshopt_compression, KHR_meshopt_compression and
///   KHR_draco_mesh_compression
///
/// Meshes and materials that nothing in the scene uses are left out, and with them their images.
/// glTF's units are taken as those of the renderer: a candela is 1 in a light's intensity, a lux 1
/// in its irradiance, and an emissive factor is a radiance. A primitive's texture coordinates are
/// those of the set that its material's textures use. The rotation of KHR_texture_transform is
/// counter-clockwise with v down, as in its example and in other programs; the GLSL in its text has
/// the inverse (KhronosGroup/glTF issue 1563).
///
/// # Errors
///
/// * [`SceneError::Invalid`] for text that is not the JSON of a glTF file
/// * [`SceneError::Malformed`] for violations of the specification that cannot be shown
/// * [`SceneError::Unsupported`] for features that the file requires and the renderer does not have
/// * [`SceneError::Resource`] and [`SceneError::Outside`] for buffers and images that `files` does
///   not give
/// * [`SceneError::TooLarge`] for data beyond the limits
pub fn parse(
    bytes: &[u8],
    name: &str,
    options: &ModelOptions,
    files: &mut dyn Files,
) -> Result<Description, SceneError> {
    Gltf::open(bytes, name, files)?.describe(options, files)
}

/// A glTF file that was read: its document, its buffers, and the images that descriptions used.
pub struct Gltf<'a> {
    document: Document<'a>,
    images: Images,
    /// Warnings about the whole document.
    warnings: Warnings,
    /// Bytes and triangles that a description may take.
    budget: Budget,
}

impl<'a> Gltf<'a> {
    /// Reads the document and its buffers from `bytes`, JSON or GLB.
    ///
    /// # Errors
    ///
    /// Those of [`parse`] for the document and its buffers.
    pub fn open(bytes: &'a [u8], name: &'a str, files: &mut dyn Files) -> Result<Self, SceneError> {
        let Container { json, chunk, aligned } = match bytes.starts_with(container::MAGIC) {
            true => container::split(bytes, name)?,
            false => Container { json: bytes, chunk: None, aligned: true },
        };
        let text = str::from_utf8(json).map_err(|error| {
            let place = format!("byte {} of the JSON", error.valid_up_to());
            SourceLocation::new(name, place).malformed("it is not UTF-8", "glTF's JSON must be UTF-8")
        })?;
        let root = json::parse(text, name)?;
        let mut warnings = Warnings::default();
        if !aligned {
            warnings.once("the chunks of the GLB are not aligned to 4 bytes, and read where they are");
        }
        features::check(&root, name, &mut warnings)?;
        let mut budget = Budget::new(bytes.len());
        let buffers = Buffers::read(&root, name, chunk, files, &mut budget)?;
        let document = Document { name: Cow::Borrowed(name), root, buffers };
        Ok(Self { document, images: Images::default(), warnings, budget })
    }

    /// Returns the file with copies of what it borrows.
    pub fn into_owned(self) -> Gltf<'static> {
        let Self { document: Document { name, root, buffers }, images, warnings, budget } = self;
        let name = Cow::Owned(name.into_owned());
        let document = Document { name, root, buffers: buffers.into_owned() };
        Gltf { document, images, warnings, budget }
    }

    /// Returns whether the file has animations.
    pub fn is_animated(&self) -> bool {
        !self.document.root.animations.is_empty()
    }

    /// Describes the scene as `options` choose. Each image is read once, also for several
    /// descriptions.
    ///
    /// # Errors
    ///
    /// Those of [`parse`] for the scene.
    pub fn describe(
        &mut self,
        options: &ModelOptions,
        files: &mut dyn Files,
    ) -> Result<Description, SceneError> {
        let (images, warnings, budget) =
            (std::mem::take(&mut self.images), self.warnings.clone(), self.budget.clone());
        let (description, notes) = (Description::default(), Vec::new());
        let mut output = Output { description, images, warnings, notes, budget, files };
        let chosen = motion::choose(&self.document, &mut output, options)?;
        let mut records = match chosen {
            Some(chosen) => motion::Records::of(&self.document, &mut output, chosen)?,
            None => None,
        };
        // The document has the animated records while it is read.
        let mut exchange = |document: &mut Document| {
            if let Some(records) = &mut records {
                records.exchange(&mut document.root);
            }
        };
        exchange(&mut self.document);
        let read = scene::read(&self.document, &mut output, chosen, options);
        exchange(&mut self.document);
        read?;
        let Output { mut description, images, warnings, notes, budget, .. } = output;
        description.images.clone_from(&images.all);
        (description.notes, description.warnings) = (notes, warnings.finish());
        self.images = images;
        self.budget.extend_as(&budget);
        Ok(description)
    }
}

/// A document with its buffers: the input of the readers.
struct Document<'a> {
    name: Cow<'a, str>,
    root: Root,
    buffers: Buffers<'a>,
}

impl Document<'_> {
    fn site(&self, place: impl Into<String>) -> SourceLocation<'_> {
        SourceLocation::new(&self.name, place)
    }
}

/// The output of the readers, with their warnings and limits.
struct Output<'a> {
    description: Description,
    images: Images,
    warnings: Warnings,
    /// Choices among what the file holds, for people.
    notes: Vec<String>,
    budget: Budget,
    files: &'a mut dyn Files,
}

#[cfg(test)]
mod container_tests;
#[cfg(test)]
mod motion_tests;
#[cfg(test)]
mod pointer_tests;
#[cfg(test)]
mod scene_tests;
#[cfg(test)]
mod tests;
