//! Kinds of files that hold a scene, by their extension.

use super::SceneError;
use super::import;
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
    /// files.
    ///
    /// # Errors
    ///
    /// [`SceneError::UnknownFormat`] for another extension; [`SceneError::Read`] for a scene file
    /// that cannot be read.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        if import::is_model(path) {
            return Ok(Self::Model);
        }
        if import::is_foreign_scene(path) {
            return Ok(Self::Foreign);
        }
        if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("ron")) {
            return Err(SceneError::UnknownFormat { path: path.to_owned() });
        }
        let text = input::read_text(path);
        Ok(Self::File(text.map_err(|source| SceneError::Read { path: path.to_owned(), source })?))
    }
}

#[cfg(test)]
mod tests {
    use super::super::import::{Includes, ModelOptions};
    use super::super::surroundings::Surroundings;
    use super::super::{AnimatedScene, SceneDocument};
    use super::*;

    /// A still scene and one that moves open the same files, with the same errors.
    #[test]
    fn scenes_are_opened_by_their_extension() {
        let options = ModelOptions::default();
        for (name, kind) in [
            ("missing.ron", "read"),
            ("missing.RON", "read"),
            ("missing", "read"),
            ("missing.txt", "format"),
            ("missing.ron.bak", "format"),
        ] {
            let path = Path::new(name);
            let still = SceneDocument::load(path).err();
            let (includes, surroundings) = (Includes::Below, Surroundings::default());
            let moving = AnimatedScene::load(path, includes, &options, &surroundings).err();
            for error in [Source::open(path).err(), still, moving] {
                let found = match error {
                    Some(SceneError::Read { .. }) => "read",
                    Some(SceneError::UnknownFormat { .. }) => "format",
                    _ => "other",
                };
                assert_eq!(found, kind, "{name}");
            }
        }
        for name in ["a.gltf", "a.GLB", "a.obj", "a.ply", "a.stl"] {
            assert!(matches!(Source::open(Path::new(name)), Ok(Source::Model)), "{name}");
        }
        for name in ["a.pbrt", "a.XML"] {
            assert!(matches!(Source::open(Path::new(name)), Ok(Source::Foreign)), "{name}");
        }
    }
}
