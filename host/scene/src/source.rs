//! Kinds of files that hold a scene, by their extension.

use super::import;
use super::{FieldEdit, SceneError};
use std::path::Path;
use trisect_system::input;

/// File of a scene, opened.
pub(super) enum Source {
    /// A model, which an importer reads.
    Model,
    /// A scene of another renderer, which an importer reads.
    Foreign,
    /// Text of a scene file.
    File(String),
}

impl Source {
    /// Opens a scene by its extension. Files without an extension, such as `/dev/stdin`, are scene
    /// files. `edits` will change its fields.
    ///
    /// # Errors
    ///
    /// [`SceneError::UnknownFormat`] for another extension; [`SceneError::Read`] for a scene file
    /// that cannot be read; [`SceneError::Inconsistent`] for changes of what is no scene file.
    pub fn open(path: &Path, edits: &[FieldEdit]) -> Result<Self, SceneError> {
        let (is_model, is_foreign) = (import::is_model(path), import::is_foreign_scene(path));
        if (is_model || is_foreign) && !edits.is_empty() {
            return Err(Self::no_fields(&path.display().to_string()));
        }
        if is_model {
            return Ok(Self::Model);
        }
        if is_foreign {
            return Ok(Self::Foreign);
        }
        if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("ron")) {
            return Err(SceneError::UnknownFormat { path: path.to_owned() });
        }
        Ok(Self::File(input::read_text(path).map_err(|error| SceneError::read(path, error))?))
    }

    /// Returns the error of changes of what is no scene file.
    pub fn no_fields(file: &str) -> SceneError {
        let remedy = "use the options of the camera and the surroundings, or write a scene file around a model by `trisect check MODEL --write FILE.ron`";
        SceneError::Inconsistent {
            file: file.to_owned(),
            message: format!("`set` changes fields of .ron files only; {remedy}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AnimatedScene, LoadOptions, SceneDocument};
    use super::*;

    /// A still scene and one that moves open the same files, with the same errors.
    #[test]
    fn scenes_are_opened_by_their_extension() {
        let options = LoadOptions::default();
        for (name, kind) in [
            ("missing.ron", "read"),
            ("missing.RON", "read"),
            ("missing", "read"),
            ("missing.txt", "format"),
            ("missing.ron.bak", "format"),
        ] {
            let path = Path::new(name);
            let still = SceneDocument::load(path).err();
            let moving = AnimatedScene::load(path, &options).err();
            for error in [Source::open(path, &[]).err(), still, moving] {
                let found = match error {
                    Some(SceneError::Read { .. }) => "read",
                    Some(SceneError::UnknownFormat { .. }) => "format",
                    _ => "other",
                };
                assert_eq!(found, kind, "{name}");
            }
        }
        for name in ["a.gltf", "a.GLB", "a.obj", "a.ply", "a.stl"] {
            assert!(matches!(Source::open(Path::new(name), &[]), Ok(Source::Model)), "{name}");
        }
        for name in ["a.pbrt", "a.XML"] {
            assert!(matches!(Source::open(Path::new(name), &[]), Ok(Source::Foreign)), "{name}");
        }
        let edits = ["image.width=1".parse::<FieldEdit>().unwrap_or_else(|error| panic!("{error}"))];
        for name in ["a.glb", "a.xml"] {
            assert!(
                matches!(Source::open(Path::new(name), &edits), Err(SceneError::Inconsistent { .. })),
                "{name}"
            );
        }
    }
}
