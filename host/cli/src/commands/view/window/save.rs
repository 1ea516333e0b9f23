//! Files that the window writes: the image, its radiance, and a copy of the scene with its camera.

use crate::cli::JobArgs;
use crate::terminal::with_options;
use std::path::{Path, PathBuf};
use trisect::image::Image;
use trisect::output::{Encoding, Metadata, Picture};
use trisect::precision::{self, Change};
use trisect::scene::{CameraPose, SceneDocument};

/// Returns the first unused path of `STEM-view-1.EXTENSION`, `STEM-view-2.EXTENSION` and so on.
fn free(folder: &Path, stem: &str, extension: &str) -> Option<PathBuf> {
    (1..10_000).map(|n| folder.join(format!("{stem}-view-{n}.{extension}"))).find(|path| !path.exists())
}

fn stem(scene: Option<&Path>) -> String {
    let stem = scene.and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
    stem.unwrap_or_else(|| "trisect".to_owned())
}

/// Writes the image to the current folder. Returns a message with its path, or with the error.
pub fn image(scene: Option<&Path>, size: (u32, u32), pixels: &[u32]) -> String {
    let Some(path) = free(Path::new("."), &stem(scene), "png") else {
        return "there are 9,999 images of this scene here; move them".to_owned();
    };
    match super::super::headless::write(&path, size, pixels) {
        Ok(()) => format!("wrote {}", path.display()),
        Err(error) => error.to_string(),
    }
}

/// Writes the radiance of an image to the current folder. Returns a message with its path, or with
/// the error.
pub fn radiance(scene: Option<&Path>, image: Result<Option<Image>, trisect::Error>) -> String {
    let image = match image {
        Ok(Some(image)) => image,
        Ok(None) => return "there is no image yet".to_owned(),
        Err(error) => return error.to_string(),
    };
    let Some(path) = free(Path::new("."), &stem(scene), "exr") else {
        return "there are 9,999 images of this scene here; move them".to_owned();
    };
    let software = Some(format!("Trisect {}", env!("CARGO_PKG_VERSION")));
    let metadata = Metadata { software, ..Metadata::default() };
    match Picture::from(&image).write(&path, &Encoding { metadata, ..Encoding::default() }) {
        Ok(()) => format!("wrote {}", path.display()),
        Err(error) => error.to_string(),
    }
}

/// Writes a copy of the scene with this camera, in the scene's own units, to the scene's folder.
/// Returns a message with its path, or with the error.
pub fn camera(job: &JobArgs, pose: &CameraPose) -> String {
    let scene = job.scene.as_deref();
    let Some(from) = scene else {
        return "the built-in scene has no file; start with one to save the camera".to_owned();
    };
    let folder = from.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let Some(to) = free(folder, &stem(scene), "ron") else {
        return "there are 9,999 copies of this scene; move them".to_owned();
    };
    let read = SceneDocument::load_with(from, &job.load.options());
    let written = read.map_err(|error| error.to_string()).and_then(|described| {
        precision::write(from, &described, Change::Camera(*pose), &to).map_err(|error| error.to_string())
    });
    match written {
        Ok(()) => format!("wrote {}", to.display()),
        Err(error) => with_options(&error).into_owned(),
    }
}
