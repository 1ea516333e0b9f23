//! Fallback paths for output files that cannot be written to their requested paths.

use super::eprint;
use std::path::{Path, PathBuf};
use trisect::image::ImageError;
use trisect::output::is_stdout;
use trisect_lab::Error;

/// Writes a file to `path`, or to a [fallback path](write_to_fallback_path) if that fails, and
/// returns the path written. Prints the first error. So no result is lost to a full disk or a
/// removed folder.
pub fn or_fallback_path(path: &Path, write: impl Fn(&Path) -> Result<(), Error>) -> Result<PathBuf, Error> {
    let Err(error) = write(path) else { return Ok(path.to_owned()) };
    let written = write_to_fallback_path(path, write);
    eprint(&format!("error: {error}"));
    written
}

/// Writes a file of the same name to a new folder in the folder for temporary files, or else in the
/// current one, and returns its path. Nobody else can have put a file or a link into a new folder.
pub fn write_to_fallback_path(
    path: &Path,
    write: impl Fn(&Path) -> Result<(), Error>,
) -> Result<PathBuf, Error> {
    let temporary = write_in_new_folder(&std::env::temp_dir(), path, &write);
    temporary.or_else(|error| {
        let here = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
        write_in_new_folder(&here, path, &write).map_err(|_| error)
    })
}

fn write_in_new_folder(
    parent: &Path,
    path: &Path,
    write: impl Fn(&Path) -> Result<(), Error>,
) -> Result<PathBuf, Error> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("trisect-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    let folder =
        builder.tempdir_in(parent).map_err(|source| ImageError::Io { path: parent.to_owned(), source })?;
    let name = match path.to_str().filter(|_| is_stdout(path)) {
        Some(text) => format!("image.{}", text.strip_suffix(":-").unwrap_or("png")).into(),
        None => path.file_name().unwrap_or_default().to_owned(),
    };
    let new = folder.path().join(name);
    write(&new)?;
    let _ = folder.keep();
    Ok(new)
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};
    use trisect::output::write_file;

    /// Checks a name of the maximum length, and that links of others beside the folder are not
    /// followed.
    #[test]
    fn into_a_folder_of_its_own() {
        let parent = tempfile::tempdir().unwrap();
        let name = "a".repeat(251) + ".png";
        let path = Path::new("/gone").join(&name);
        let victim = parent.path().join("victim");
        fs::write(&victim, b"victim").unwrap();
        for planted in ["a.png", "trisect-a.png"].map(|name| parent.path().join(name)) {
            symlink(&victim, &planted).unwrap();
        }
        symlink(&victim, parent.path().join(format!("trisect-{}-a.png", std::process::id()))).unwrap();
        for path in [path.as_path(), Path::new("a.png")] {
            let new =
                write_in_new_folder(parent.path(), path, |path| Ok(write_file(path, b"film")?)).unwrap();
            assert_eq!(new.file_name(), path.file_name());
            assert_eq!(fs::read(&new).unwrap(), b"film");
            let folder = new.parent().unwrap();
            assert_eq!(folder.metadata().unwrap().permissions().mode() & 0o777, 0o700);
            assert_eq!(folder.parent().unwrap(), parent.path());
        }
        assert_eq!(fs::read(&victim).unwrap(), b"victim");
        // A failed write leaves no folder behind.
        let before = fs::read_dir(parent.path()).unwrap().count();
        let failed = write_in_new_folder(parent.path(), &path, |_| Err(trisect::Error::Cancelled.into()));
        assert!(failed.is_err() && fs::read_dir(parent.path()).unwrap().count() == before);
    }
}
