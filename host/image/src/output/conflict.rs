//! Checks that no output of a command is another output or one of its inputs.

use super::is_stdout;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;
use trisect_system::atomic_file::{canonical_path, is_same};

/// Output that is also another output or an input of the command, or that `resume` must not write.
#[derive(Debug, Error)]
pub enum ConflictError {
    /// Two outputs are one file.
    #[error("{}: {first} and {second} are the same file; name two", path.display())]
    Outputs {
        /// Path of the second output.
        path: PathBuf,
        /// Option of the first output.
        first: &'static str,
        /// Option of the second output.
        second: &'static str,
    },
    /// Several scenes would be written to one file.
    #[error("{}: several scenes have one name for {option}; put {{scene}} into it", path.display())]
    Several {
        /// Path that the option gives.
        path: PathBuf,
        /// Option of the output.
        option: &'static str,
    },
    /// Two scenes would be written to one file, as their own names are the same.
    #[error(
        "{}: two scenes have this file for {option}, because their names are the same but for folder and extension; start a command for each",
        path.display()
    )]
    SameName {
        /// Path that the option gives.
        path: PathBuf,
        /// Option of the output.
        option: &'static str,
    },
    /// A file of results is given as a scene.
    #[error("{}: this is no scene; name a file of results by --json={}", path.display(), path.display())]
    NoScene {
        /// The file.
        path: PathBuf,
    },
    /// An output is an input.
    #[error("{}: {output} would overwrite {input}, {}; name another file", path.display(), read.display())]
    Input {
        /// Path of the output.
        path: PathBuf,
        /// Option of the output.
        output: &'static str,
        /// Role of the input in the command, such as "the scene".
        input: &'static str,
        /// Path of the input.
        read: PathBuf,
    },
    /// A checkpoint's own image file is outside the folders that `resume` writes to unasked.
    #[error(
        "{}: the checkpoint names this file for the image, and it is neither in the checkpoint's folder nor in the current one; name the image file with -o",
        path.display()
    )]
    Stored {
        /// Path of the image file.
        path: PathBuf,
    },
}

/// Output files and folders of a command, each with the option that names it.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    files: Vec<(&'static str, PathBuf)>,
    folders: Vec<Folder>,
    /// Options that name standard output.
    stdout: Vec<&'static str>,
}

/// Folder to which a command writes files; `writes` returns whether it writes one of this name.
#[derive(Clone)]
struct Folder {
    option: &'static str,
    path: PathBuf,
    writes: Arc<dyn Fn(&Path) -> bool + Send + Sync>,
}

impl fmt::Debug for Folder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Folder").field(&self.option).field(&self.path).finish()
    }
}

impl Folder {
    /// Returns whether the command writes this file.
    fn has(&self, file: &Path) -> bool {
        let place = canonical_path(file);
        let name = place.file_name().map(Path::new);
        if name.is_some_and(|name| (self.writes)(name) && is_same(&self.path.join(name), file)) {
            return true;
        }
        // An existing entry under a name that the command writes may be a link to the file.
        let entries = std::fs::read_dir(&self.path).into_iter().flatten().flatten();
        entries
            .into_iter()
            .any(|entry| (self.writes)(Path::new(&entry.file_name())) && is_same(&entry.path(), file))
    }
}

impl Outputs {
    /// Adds a file. An existing path that is not a regular file, such as `/dev/null`, conflicts
    /// with nothing; standard output conflicts with itself only.
    #[must_use]
    pub fn file(mut self, option: &'static str, path: Option<&Path>) -> Self {
        self.stdout.extend(path.filter(|path| is_stdout(path)).map(|_| option));
        let path =
            path.filter(|path| !is_stdout(path) && path.metadata().map_or(true, |facts| facts.is_file()));
        self.files.extend(path.map(|path| (option, path.to_owned())));
        self
    }

    /// Adds a folder. `writes` returns whether the command writes a file of this name to it.
    #[must_use]
    pub fn folder(
        mut self,
        option: &'static str,
        path: Option<&Path>,
        writes: impl Fn(&Path) -> bool + Send + Sync + 'static,
    ) -> Self {
        let folder = |path: &Path| Folder { option, path: path.to_owned(), writes: Arc::new(writes) };
        self.folders.extend(path.map(folder));
        self
    }

    /// Checks that no two outputs are one file.
    ///
    /// # Errors
    ///
    /// Returns [`ConflictError::Outputs`] for the first two that are.
    pub fn check(&self) -> Result<(), ConflictError> {
        if let [first, second, ..] = self.stdout.as_slice() {
            return Err(ConflictError::Outputs { path: "standard output".into(), first, second });
        }
        for (index, (second, path)) in self.files.iter().enumerate() {
            let (files, folders) = (self.files[..index].to_vec(), self.folders.clone());
            let others = Self { files, folders, stdout: Vec::new() };
            if let Some(first) = others.writes(path) {
                return Err(ConflictError::Outputs { path: path.clone(), first, second });
            }
        }
        Ok(())
    }

    /// Checks that no output is one of the files that the command reads. `input` is their role, for
    /// the message.
    ///
    /// # Errors
    ///
    /// Returns [`ConflictError::Input`] for the first one that is.
    pub fn check_inputs<P: AsRef<Path>>(
        &self,
        input: &'static str,
        paths: impl IntoIterator<Item = P>,
    ) -> Result<(), ConflictError> {
        for read in paths {
            let read = read.as_ref();
            if let Some(output) = self.writes(read) {
                let path = self.files.iter().find(|(option, _)| *option == output);
                let path = path.map_or_else(|| read.to_owned(), |(_, path)| path.clone());
                return Err(ConflictError::Input { path, output, input, read: read.to_owned() });
            }
        }
        Ok(())
    }

    /// Returns the option of the output that would write a file, or `None`.
    fn writes(&self, path: &Path) -> Option<&'static str> {
        let file = self.files.iter().find(|(_, file)| is_same(file, path)).map(|(option, _)| *option);
        file.or_else(|| self.folders.iter().find(|folder| folder.has(path)).map(|folder| folder.option))
    }
}

/// Checks that `resume` may write the image file `stored` that a checkpoint names, without being
/// asked: it must be in or below the folder of the checkpoint or the current one. A checkpoint may
/// come from someone else and must not choose which of the user's files are replaced.
///
/// # Errors
///
/// Returns [`ConflictError::Stored`] for a file anywhere else.
pub fn check_stored(stored: &Path, checkpoint: &Path) -> Result<(), ConflictError> {
    let stored_in = canonical_path(stored);
    let of_checkpoint = canonical_path(checkpoint);
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    let folders = [of_checkpoint.parent().map(Path::to_owned), here.ok()];
    let is_below = |folder: &PathBuf| folder.is_absolute() && stored_in.starts_with(folder);
    let has_parent_parts = stored_in.components().any(|part| part == std::path::Component::ParentDir);
    match folders.iter().flatten().any(is_below) && !has_parent_parts {
        true => Ok(()),
        false => Err(ConflictError::Stored { path: stored.to_owned() }),
    }
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn outputs_are_files_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("scene.ron"), b"").unwrap();
        symlink("a.png", at("link.png")).unwrap();
        let of =
            |stats: &str| Outputs::default().file("-o", Some(&at("a.png"))).file("--stats", Some(&at(stats)));
        for same in ["a.png", "./a.png", "link.png"] {
            let error = of(same).check().unwrap_err().to_string();
            assert!(error.contains("-o and --stats are the same file; name two"), "{error}");
        }
        of("b.json").check().unwrap();
        let over = of("scene.ron").check_inputs("the scene", [at("./scene.ron")]).unwrap_err().to_string();
        assert!(over.contains("--stats would overwrite the scene"), "{over}");
        of("b.json").check_inputs("the scene", [at("scene.ron")]).unwrap();
        // A device such as /dev/null conflicts with nothing.
        let null = Some(Path::new("/dev/null"));
        Outputs::default().file("-o", null).file("--stats", null).check().unwrap();
    }

    #[test]
    fn folders_are_what_is_written_in_them() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("front.png"), b"").unwrap();
        symlink("front.png", at("sky.png")).unwrap();
        let outputs =
            Outputs::default().folder("-o", Some(folder.path()), |name| name == Path::new("front.png"));
        for over in ["front.png", "sky.png"] {
            assert!(outputs.check_inputs("a texture", [at(over)]).is_err(), "{over}");
        }
        outputs.check_inputs("a texture", [at("back.png"), at("sub/front.png")]).unwrap();
        // A symbolic or hard link, under a name that the command writes, leads to an input.
        fs::remove_file(at("front.png")).unwrap();
        fs::write(at("scene.ron"), b"").unwrap();
        symlink("scene.ron", at("front.png")).unwrap();
        assert!(outputs.check_inputs("the scene", [at("scene.ron")]).is_err());
        fs::remove_file(at("front.png")).unwrap();
        outputs.check_inputs("the scene", [at("scene.ron")]).unwrap();
        fs::hard_link(at("scene.ron"), at("front.png")).unwrap();
        assert!(outputs.check_inputs("the scene", [at("scene.ron")]).is_err());
        assert!(outputs.clone().file("--json", Some(&at("front.png"))).check().is_err());
        outputs.file("--json", Some(&at("a.json"))).check().unwrap();
    }

    #[test]
    fn a_checkpoint_chooses_nothing_elsewhere() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        ["own", "own/below", "other"].iter().for_each(|name| fs::create_dir(at(name)).unwrap());
        symlink("../other/a.png", at("own/link.png")).unwrap();
        symlink("../other", at("own/away")).unwrap();
        let checkpoint = at("own/a.ckpt");
        for good in ["own/a.png", "own/below/a.png", "own/below/../a.png"] {
            check_stored(&at(good), &checkpoint).unwrap();
        }
        for bad in [
            "other/a.png",
            "own/../other/a.png",
            "own/link.png",
            "own/away/a.png",
            "own/none/../../other/a.png",
            "a.png",
        ] {
            let error = check_stored(&at(bad), &checkpoint).unwrap_err().to_string();
            assert!(error.contains("with -o"), "{error}");
        }
        let here = std::env::current_dir().unwrap();
        check_stored(&here.join("a.png"), &checkpoint).unwrap();
    }
}
