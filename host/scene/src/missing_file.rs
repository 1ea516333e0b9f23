//! Explains that a file is missing by what is there in its place.

use super::shown_text::shown;
use super::similar::nearest_file;
use std::io::{Error, ErrorKind};
use std::path::Path;
use trisect_system::input;

/// Maximum number of names of a folder that are compared.
const MAX_NAMES: usize = 10_000;

/// A missing file, with a hint at what may be meant.
#[derive(Debug, thiserror::Error)]
#[error("{error}; {hint}")]
struct MissingFile {
    error: Error,
    hint: String,
    has_suggestion: bool,
}

/// Returns the error of opening a file. If the file is missing, the error names a similar one in
/// its folder, or says which folder is missing.
pub(crate) fn explained(path: &Path, error: Error) -> Error {
    if error.kind() != ErrorKind::NotFound {
        return error;
    }
    match hint(path) {
        Some((hint, has_suggestion)) => {
            Error::new(ErrorKind::NotFound, MissingFile { error, hint, has_suggestion })
        }
        None => error,
    }
}

/// Returns the error for a missing file in place of which `name` may be meant.
pub(crate) fn suggesting(name: &str) -> Error {
    let error = Error::new(ErrorKind::NotFound, "no such file");
    let hint = suggestion(name);
    Error::new(ErrorKind::NotFound, MissingFile { error, hint, has_suggestion: true })
}

/// Returns whether an error names what may be meant.
pub(crate) fn has_suggestion(error: &Error) -> bool {
    let missing = error.get_ref().and_then(|inner| inner.downcast_ref::<MissingFile>());
    missing.is_some_and(|missing| missing.has_suggestion)
}

/// Returns the names in a folder, in alphabetical order; none if it cannot be read. Of a large
/// folder, some are left out.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = input::entries(folder).take(MAX_NAMES);
    let mut names: Vec<String> =
        entries.filter_map(|entry| Some(entry.file_name()?.to_str()?.to_owned())).collect();
    names.sort();
    names
}

fn suggestion(name: &str) -> String {
    format!("did you mean \"{}\"?", shown(name))
}

/// Returns a hint at what may be meant by a missing file's path, and whether it names something.
fn hint(path: &Path) -> Option<(String, bool)> {
    let folder_of = |path: &Path| {
        let folder = path.parent()?;
        Some(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }.to_owned())
    };
    // The first part of the path that is missing, and the folder that it would be in.
    let (mut missing, mut folder) = (path.to_owned(), folder_of(path)?);
    while !input::is_folder(&folder) {
        let above = folder_of(&folder)?;
        (missing, folder) = (folder, above);
    }
    let names = names_in(&folder);
    let is_folder = missing != path;
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let similar = nearest_file(missing.file_name()?.to_str()?, &names).map(suggestion);
    match similar {
        None if !is_folder => None,
        None => Some((no_folder(&missing), false)),
        Some(similar) if is_folder => Some((format!("{}; {similar}", no_folder(&missing)), true)),
        Some(similar) => Some((similar, true)),
    }
}

fn no_folder(path: &Path) -> String {
    format!("there is no folder \"{}\"", shown(&path.display().to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use trisect_system::input;

    /// Each kind of file that a scene names, at the place of its name.
    #[test]
    fn files_of_a_scene_are_explained() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("maps")).unwrap();
        for file in ["wood.png", "house.obj", "dusk.hdr", "cloud.vol"] {
            fs::write(at("maps").join(file), b"").unwrap();
        }
        let error = |fields: &str| {
            let text = format!(
                "Scene(version: 1, image: (width: 1, height: 1), camera: (look_from: (0, 0, 1), look_at: (0, 0, 0), vertical_fov: 9),\n{fields})"
            );
            fs::write(at("scene.ron"), text).unwrap();
            crate::SceneDocument::load(&at("scene.ron")).map(|_| ()).unwrap_err().to_string()
        };
        for (fields, similar) in [
            ("textures: {\"a\": (file: \"maps/wod.png\")}, materials: {}, objects: []", "wood.png"),
            ("materials: {}, objects: [Mesh(file: \"maps/hose.obj\")]", "house.obj"),
            ("sky: Image(file: \"maps/dsuk.hdr\"), materials: {}, objects: []", "dusk.hdr"),
            (
                "media: {\"a\": (grid: (file: \"maps/clouds.vol\"), extinction: (1, 1, 1))}, materials: {}, objects: []",
                "cloud.vol",
            ),
        ] {
            let message = error(fields);
            assert!(message.contains("scene.ron:2:"), "{message}");
            assert!(message.contains(&format!("(os error 2); did you mean \"{similar}\"?")), "{message}");
            let elsewhere = error(&fields.replace("maps/", "pictures/"));
            assert!(elsewhere.contains("(os error 2); there is no folder \""), "{elsewhere}");
            // Negative control: nothing there has such a name.
            let other = error(&fields.replace("maps/", "maps/another_"));
            assert!(other.contains("(os error 2)\n") && !other.contains("did you mean"), "{other}");
        }
        let misspelt = crate::SceneDocument::load(&at("scne.ron")).map(|_| ()).unwrap_err().to_string();
        assert!(misspelt.ends_with("did you mean \"scene.ron\"?"), "{misspelt}");
    }

    #[test]
    fn missing_files_are_explained() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("textures")).unwrap();
        fs::write(at("textures/checker.png"), b"").unwrap();
        let error = |name: &str| {
            let error = input::open(&at(name)).unwrap_err();
            explained(&at(name), error)
        };
        let similar = error("textures/cheker.png");
        assert!(similar.to_string().ends_with("(os error 2); did you mean \"checker.png\"?"), "{similar}");
        assert!(has_suggestion(&similar) && similar.kind() == ErrorKind::NotFound);
        let elsewhere = error("Texture/checker.png").to_string();
        assert!(elsewhere.contains("there is no folder \""), "{elsewhere}");
        assert!(elsewhere.ends_with("Texture\"; did you mean \"textures\"?"), "{elsewhere}");
        let nowhere = error("models/old/checker.png");
        assert!(nowhere.to_string().ends_with("models\""), "{nowhere}");
        // Negative controls: nothing similar is there, or the file is no missing one.
        for (name, kind) in
            [("textures/wood.png", ErrorKind::NotFound), ("textures", ErrorKind::InvalidInput)]
        {
            let other = error(name);
            assert!(!has_suggestion(&other) && !other.to_string().contains("did you mean"), "{other}");
            assert_eq!(other.kind(), kind);
        }
    }
}
