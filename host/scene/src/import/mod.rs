//! Readers of models: glTF 2.0, Wavefront OBJ, PLY and STL; and of scenes of other renderers:
//! pbrt-v4 and Mitsuba 3.
//!
//! Each reader turns bytes into a [`Description`] and takes other files through [`Files`]. A
//! violation of the format is an error that names the place. An unsupported feature is a warning
//! that names it, or an error if the file requires it.
//!
//! No input makes a reader panic, and their memory is bounded: beside its images, a description
//! takes at most 64 times the bytes read plus 64 MiB, 17 times as much if they are compressed, and
//! it stands for at most 2^30 triangles.

mod assembly;
mod budget;
mod files;
#[cfg(test)]
mod foreign_tests;
pub mod gltf;
mod gzip;
mod images;
mod mesh;
pub mod mitsuba;
pub mod obj;
mod open_model;
mod options;
mod origin;
pub mod pbrt;
pub mod ply;
mod source_location;
pub mod stl;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod warnings;

pub use files::{Files, Folder, Includes, NoFiles};
pub(crate) use open_model::OpenModel;
pub use options::ModelOptions;
pub(crate) use source_location::shown;

use super::description::{Description, TextureImage};
use super::error::SceneError;
use crate::ImageSettings;
use images::Curve;
use source_location::SourceLocation;
use std::path::Path;

/// A reader: takes bytes, their name in messages and the files beside them.
type Parse = fn(&[u8], &str, &ModelOptions, &mut dyn Files) -> Result<Description, SceneError>;

/// Returns the reader for a file's extension, in upper or lower case.
fn reader(path: &Path) -> Option<Parse> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "gltf" | "glb" => Some(gltf::parse),
        "obj" => Some(|bytes, name, _, files| obj::parse(bytes, name, files)),
        "ply" => Some(|bytes, name, _, _| ply::parse(bytes, name)),
        "stl" => Some(|bytes, name, _, _| stl::parse(bytes, name)),
        _ => None,
    }
}

/// A reader of scenes: returns the image settings, too.
type ParseScene = fn(&[u8], &str, &mut dyn Files) -> Result<(Description, ImageSettings), SceneError>;

/// Returns the reader of scenes for a file's extension, in upper or lower case.
fn scene_reader(path: &Path) -> Option<ParseScene> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "pbrt" => Some(pbrt::parse),
        "xml" => Some(mitsuba::parse),
        _ => None,
    }
}

/// Returns whether a path's extension is that of a scene of another renderer.
pub fn is_foreign_scene(path: &Path) -> bool {
    scene_reader(path).is_some()
}

/// Reads a scene of pbrt-v4 (`.pbrt`) or Mitsuba 3 (`.xml`), and the files in `folder` that it
/// names.
///
/// # Errors
///
/// Those of [`load`].
pub fn load_foreign_scene(path: &Path, folder: &Folder) -> Result<(Description, ImageSettings), SceneError> {
    let parse = scene_reader(path).ok_or_else(|| SceneError::UnknownFormat { path: path.to_owned() })?;
    let bytes = files::read_whole(path)?;
    let mut folder = folder.clone();
    let (mut description, settings) = parse(&bytes, &path.display().to_string(), &mut folder)?;
    description.files.extend(folder.into_read());
    Ok((description, settings))
}

/// Returns whether [`load`] reads files with this path's extension.
pub fn is_model(path: &Path) -> bool {
    reader(path).is_some()
}

/// Reads a scene from a `.gltf`, `.glb`, `.obj`, `.ply` or `.stl` file and the files beside it that
/// it names, as `options` choose.
///
/// # Errors
///
/// * [`SceneError::UnknownFormat`] for another extension
/// * [`SceneError::Read`] for a file that cannot be read
/// * [`SceneError::Resource`] and [`SceneError::Outside`] for files that it names and that cannot
///   or must not be read
/// * [`SceneError::Malformed`], [`SceneError::Invalid`], [`SceneError::Unsupported`] and
///   [`SceneError::TooLarge`] for their content
pub fn load(path: &Path, options: &ModelOptions) -> Result<Description, SceneError> {
    load_below(path, options, &Folder::of(path))
}

/// Reads a model that a scene in `folder` names, as `options` choose. The files that the model
/// names must be in that folder too.
///
/// # Errors
///
/// Those of [`load`].
pub fn load_below(path: &Path, options: &ModelOptions, folder: &Folder) -> Result<Description, SceneError> {
    let parse = reader(path).ok_or_else(|| not_a_model(path))?;
    let bytes = files::read_whole(path)?;
    let mut folder = folder.beside(path);
    let mut description = parse(&bytes, &path.display().to_string(), options, &mut folder)?;
    description.files.push(path.to_owned());
    description.files.extend(folder.into_read());
    Ok(description)
}

/// Returns the error for a file that no reader of models reads.
fn not_a_model(path: &Path) -> SceneError {
    if !is_foreign_scene(path) {
        return SceneError::UnknownFormat { path: path.to_owned() };
    }
    SceneError::Inconsistent {
        file: path.display().to_string(),
        message: "this is a scene, not a model; render it by itself".to_owned(),
    }
}

/// Reads a PNG, JPEG, WebP or KTX2 file as an image for textures; its colours are sRGB-encoded
/// unless they are `linear`.
///
/// # Errors
///
/// * [`SceneError::Read`] for a file that cannot be read
/// * [`SceneError::Malformed`] and [`SceneError::Unsupported`] for a file of another format
/// * [`SceneError::TooLarge`] for more than 16384 texels across or down, or more than fit into
///   memory
pub fn texture(path: &Path, linear: bool) -> Result<TextureImage, SceneError> {
    let bytes = files::read_whole(path)?;
    let name = path.display().to_string();
    let curve = if linear { Curve::Linear } else { Curve::Srgb };
    images::decode(&bytes, curve, &name, &SourceLocation::new(&name, "image"))
}
