//! Writes a copy of a scene file with another `space` or camera. Used by `trisect check --write`
//! and by the viewer.

use crate::description::{Ground, PunctualLight, Sky, SunSky};
use crate::import::ModelOptions;
use crate::values::point_text;
use crate::{
    CameraPose, Rebase, SceneDocument, SceneError, Surroundings, apply_edits, camera_value,
    import::is_foreign_scene, insert_camera, insert_space, is_model,
};
use std::path::{Path, PathBuf};
use thiserror::Error;
use trisect_system::atomic_file::{is_same, write_atomic_or_in_place};
use trisect_system::input;

/// Reason why a copy of a scene cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// Names of other files in a scene are relative to its folder, so the copy must be in the same
    /// folder.
    #[error(
        "{}: the scene names other files relative to its folder, so a copy must be in that folder; write to {}",
        path.display(), instead.display()
    )]
    OtherFolder {
        /// Requested path of the copy.
        path: PathBuf,
        /// Path at which a copy can be written.
        instead: PathBuf,
    },
    /// The copy would lose choices of the command line.
    #[error(
        "{}: the copy would not have --time, --animation and --material-variant, nor --env, --sun and --ground; write them into the scene's Mesh objects and its fields sky, lights and ground",
        path.display()
    )]
    Options {
        /// Path of the scene.
        path: PathBuf,
    },
    /// The copy would lose the panorama of the command line.
    #[error(
        "{}: the copy would not have the panorama of --env; leave it out, and write it into the copy as `sky: Image(file: …)`",
        path.display()
    )]
    Environment {
        /// Path of the model.
        path: PathBuf,
    },
    /// The copy would replace the original.
    #[error("{}: this is the scene itself; give the copy another name", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
    /// The name of the copy does not end in `.ron`.
    #[error("{}: the copy is a scene file in RON; let its name end in .ron", path.display())]
    NotRon {
        /// Requested path of the copy.
        path: PathBuf,
    },
    /// A scene of pbrt or Mitsuba has no copy in another format.
    #[error("{}: copies of scenes of other renderers cannot be written; edit the file itself", path.display())]
    Foreign {
        /// The scene.
        path: PathBuf,
    },
    /// The name of the model is not UTF-8, so a scene file cannot contain it.
    #[error("{}: this name is not UTF-8, so a scene file cannot contain it; rename the file", path.display())]
    Name {
        /// The model.
        path: PathBuf,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The original can no longer be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Field that differs in a copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Space in which the scene is computed.
    Space(Rebase),
    /// Camera, in the scene's own units.
    Camera(CameraPose),
}

/// Writes a copy of the scene file `from`, which `scene` was read from, to `to`, with the changed
/// field, and with the edits of `scene`. All other text stays, comments included. For a model,
/// writes a scene file that shows the model as `trisect render` shows it.
///
/// # Errors
///
/// [`WriteError`] with the reason. Nothing was written then, unless the file system failed while
/// writing.
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
    if is_foreign_scene(from) {
        return Err(WriteError::Foreign { path: from.to_owned() });
    }
    let (text, names_files) = if is_model(from) {
        (around_model(from, scene, change)?, true)
    } else {
        if scene.options != ModelOptions::default() || scene.surroundings != Surroundings::default() {
            return Err(WriteError::Options { path: from.to_owned() });
        }
        let text = input::read_text(from).map_err(io(from))?;
        let text = apply_edits(&text, &scene.name, &scene.edits)?;
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

/// Returns the fields of a mesh that choose what is drawn of its model.
fn choices(options: &ModelOptions) -> String {
    let ModelOptions { time, animation, variant } = options;
    let mut text = time.map_or_else(String::new, |time| format!(", time: {time:?}"));
    for (field, name) in [("animation", animation), ("variant", variant)] {
        text += &name
            .as_ref()
            .map_or_else(String::new, |name| format!(", {field}: \"{}\"", name.escape_default()));
    }
    text
}

/// Returns the fields of the sky, the ground and the sun that the model was given; `None` for a
/// panorama, whose file may be in another folder.
fn surroundings(scene: &SceneDocument) -> Option<String> {
    let mut text = match &scene.description.sky {
        None => String::new(),
        Some(Sky::Gradient { bottom, top }) => {
            format!("    sky: Gradient(bottom: {}, top: {}),\n", point_text(*bottom), point_text(*top))
        }
        Some(Sky::Studio { scale, rotation }) => {
            format!("    sky: Studio(scale: {scale:?}, rotation: {:?}),\n", rotation.to_degrees())
        }
        Some(Sky::Sun(sky)) => sun_sky(&sky.parameters()),
        Some(Sky::Image { .. }) => return None,
    };
    if let Some(Ground { center, size }) = scene.description.ground {
        text += &format!("    ground: (center: {}, size: {size:?}),\n", point_text(center));
    }
    if let Some(PunctualLight::Directional { direction, irradiance }) = scene.surroundings.sun_light() {
        let (direction, irradiance) = (point_text(direction), point_text(irradiance));
        text += &format!("    lights: [Directional(direction: {direction}, irradiance: {irradiance})],\n");
    }
    Some(text)
}

/// Returns the field of a clear sky.
fn sun_sky(sky: &SunSky) -> String {
    let SunSky { azimuth, elevation, turbidity, ground_albedo, sun_disc, sun_radius, scale } = sky;
    format!(
        "    sky: Sun(elevation: {elevation:?}, azimuth: {azimuth:?}, turbidity: {turbidity:?}, \
         ground_albedo: {ground_albedo:?}, sun_disc: {sun_disc}, sun_radius: {sun_radius:?}, scale: {scale:?}),\n"
    )
}

/// Returns the value of the field `space`. Rust's debug format of an f64 reads back to the same
/// bits.
fn field(space: Rebase) -> String {
    format!("(origin: {}, scale: {:?})", point_text(space.origin), space.scale)
}

/// Returns the text of a scene file that contains the model, and the camera, sky, sun and ground
/// that the model was given.
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
    text += &surroundings(scene).ok_or_else(|| WriteError::Environment { path: from.to_owned() })?;
    let name = name.escape_default();
    let options = choices(&scene.options);
    text += &format!("    materials: {{}},\n    objects: [Mesh(file: \"{name}\"{options})],\n)\n");
    Ok(text)
}
