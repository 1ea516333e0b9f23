//! A copy of a scene that differs in one field.

use crate::atomic_file::{is_same, write_atomic_or_in_place};
use crate::input;
use crate::scene::{
    CameraPose, Rebase, SceneDocument, SceneError, camera_value, insert_camera, insert_space, is_model, point,
};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A scene that cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The names of other files in a scene are relative to its folder.
    #[error(
        "{}: the scene names other files relative to its folder, so a copy must lie there, too; write to {}",
        path.display(), instead.display()
    )]
    OtherFolder {
        /// Where it was to go.
        path: PathBuf,
        /// Where it may.
        instead: PathBuf,
    },
    /// The copy would replace the original.
    #[error("{}: this is the scene itself; give the copy another name", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
    /// A scene is RON.
    #[error("{}: the copy is a scene file in RON; let its name end in .ron", path.display())]
    NotRon {
        /// Where it was to go.
        path: PathBuf,
    },
    /// A file's name that a scene file cannot hold.
    #[error("{}: this name is no UTF-8 text, so no scene file can hold it; rename the file", path.display())]
    Name {
        /// The model.
        path: PathBuf,
    },
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The original cannot be read any more.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// What is different in a copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Where it is computed.
    Space(Rebase),
    /// Where it is seen from, in the scene's own units.
    Camera(CameraPose),
}

/// Writes a copy of the scene file `from`, which `scene` was read from, to `to`, with another field: all other
/// text, comments included, stays. Of a model it writes a scene file that shows the model as `trisect render` does by itself.
///
/// # Errors
///
/// [`WriteError`] says what stands against it; nothing was written then, or the file system says so.
pub fn write(from: &Path, scene: &SceneDocument, change: Change, to: &Path) -> Result<(), WriteError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| WriteError::Io { path, source }
    };
    if !to.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")) {
        return Err(WriteError::NotRon { path: to.to_owned() });
    }
    let folder = |path: &Path| match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let folders = [folder(from), folder(to)];
    let same_folder =
        folders[0].canonicalize().map_err(io(from))? == folders[1].canonicalize().map_err(io(to))?;
    if is_same(from, to) {
        return Err(WriteError::SameFile { path: to.to_owned() });
    }
    let (text, names_files) = if is_model(from) {
        (around_model(from, scene, change)?, true)
    } else {
        let text = input::read_text(from).map_err(io(from))?;
        match change {
            Change::Space(space) => insert_space(&text, &scene.name, &field(space))?,
            Change::Camera(camera) => insert_camera(&text, &scene.name, &camera)?,
        }
    };
    if names_files && !same_folder {
        let instead = folders[0].join(to.file_name().unwrap_or_default());
        return Err(WriteError::OtherFolder { path: to.to_owned(), instead });
    }
    write_atomic_or_in_place(to, text.as_bytes()).map_err(io(to))
}

/// The field's value. Rust's debug form of an f64 reads back to the same bits.
fn field(space: Rebase) -> String {
    format!("(origin: {}, scale: {:?})", point(space.origin), space.scale)
}

/// A scene file with nothing but a model, and what the model lacks.
fn around_model(from: &Path, scene: &SceneDocument, change: Change) -> Result<String, WriteError> {
    let Some(name) = from.file_name().and_then(|name| name.to_str()) else {
        return Err(WriteError::Name { path: from.to_owned() });
    };
    let image = &scene.image;
    let own = scene.description.cameras.first().map(|(_, camera)| *camera);
    let (space, camera, by) = match change {
        Change::Space(space) => (space, own, "check --write"),
        Change::Camera(camera) => (scene.space, Some(camera), "view"),
    };
    let mut text = format!(
        "// Shows {}. Written by `trisect {by}`.\nScene(\n    version: 1,\n    space: {},\n    \
         image: (width: {}, height: {}, samples: {}, depth: {}),\n",
        name.escape_debug(),
        field(space),
        image.width,
        image.height,
        image.samples,
        image.depth
    );
    if let Some(camera) = camera {
        text += &format!("    camera: {},\n", camera_value(&camera));
    }
    if let Some(crate::scene::description::Sky::Gradient { bottom, top }) = &scene.description.sky {
        text += &format!("    sky: Gradient(bottom: {}, top: {}),\n", point(*bottom), point(*top));
    }
    text += &format!("    materials: {{}},\n    objects: [Mesh(file: \"{}\")],\n)\n", name.escape_default());
    Ok(text)
}
