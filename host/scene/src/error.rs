//! Errors of reading a scene: the problem, its place and a remedy.

use super::missing_file::{explained, has_suggestion};
use super::shown_text::shown;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Returns a path's extension with its dot, for messages.
fn extension(path: &Path) -> String {
    path.extension().map_or_else(|| "without an extension".to_owned(), |name| format!(".{}", name.display()))
}

/// Returns the page of the scene format's reference that describes a file.
fn page(file: &str) -> &'static str {
    let extension = Path::new(file).extension().unwrap_or_default();
    let is_foreign = ["pbrt", "xml"].iter().any(|name| extension.eq_ignore_ascii_case(name));
    if is_foreign { "pbrt-and-mitsuba.md" } else { "README.md" }
}

/// Returns the remedy for a file that cannot be read, unless its error suggests one.
fn remedy(source: &std::io::Error, file: &str) -> String {
    if has_suggestion(source) {
        return String::new();
    }
    format!("; it must be at this path, relative to the folder of {file}")
}

/// Returns the first comment of a scene's text that has the name of one of the files in a line.
fn comment_on_files(text: &str, line: usize) -> Option<&str> {
    let line = text.lines().nth(line.checked_sub(1)?)?;
    let quoted = line.split('"').skip(1).step_by(2);
    let names: Vec<&str> =
        quoted.filter(|word| word.contains('.')).filter_map(|word| word.rsplit('/').next()).collect();
    let comments = text.lines().filter_map(|line| line.trim_start().strip_prefix("//"));
    let is_part = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    let has = |comment: &str, name: &str| {
        comment.match_indices(name).any(|(at, _)| {
            !comment[..at].ends_with(is_part) && !comment[at + name.len()..].starts_with(is_part)
        })
    };
    comments.map(str::trim).find(|comment| names.iter().any(|name| !name.is_empty() && has(comment, name)))
}

/// An error that makes a scene unusable.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The text is not a scene: a syntax error, an unknown field, a value out of range or an
    /// unknown material.
    #[error(
        "{file}:{line}:{column}: {message}\n{excerpt}\n  see docs/reference/scene-format/{} for the format",
        page(file)
    )]
    Invalid {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1 in characters.
        column: usize,
        /// Problem and remedy.
        message: String,
        /// The line, with a mark below the column.
        excerpt: String,
    },
    /// Values that are valid on their own but not together.
    #[error("{file}: {message}")]
    Inconsistent {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Problem and remedy.
        message: String,
    },
    /// The extension is not that of a scene or model format.
    #[error("{}: unknown format {}; readable: .ron, .gltf, .glb, .obj, .ply, .stl, .pbrt, .xml", path.display(), extension(path))]
    UnknownFormat {
        /// Path of the file.
        path: PathBuf,
    },
    /// The scene has warnings, and the user denies them.
    #[error("{file}: `deny_warnings`: the warnings above ({count}) are errors")]
    Denied {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Number of warnings.
        count: usize,
    },
    /// A part of an imported file violates its format.
    #[error("{file}: {place}: {problem}; {remedy}")]
    Malformed {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Part of the file in the format's own words, such as
        /// `meshes[3].primitives[0].attributes.POSITION`.
        place: String,
        /// Violation of the format.
        problem: String,
        /// Content that the format allows.
        remedy: String,
    },
    /// An imported file needs a feature that the renderer does not have.
    #[error("{file}: {place}: {feature} is not supported; {remedy}")]
    Unsupported {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Part of the file, in the format's own words.
        place: String,
        /// The missing feature.
        feature: String,
        /// Alternative without the feature.
        remedy: String,
    },
    /// A part of an imported file exceeds a limit of the program or the available memory.
    #[error("{file}: {place}: {what}; the maximum is {maximum}")]
    TooLarge {
        /// Path of the file, or the name that stands for it.
        file: String,
        /// Part of the file, in the format's own words.
        place: String,
        /// Part that is too large, with its size.
        what: String,
        /// Maximum size, and the reason for it.
        maximum: String,
    },
    /// An imported file refers to a file outside the scene's folder.
    #[error(
        "{file}: {place}: \"{uri}\" lies outside the scene's folder; move it there, or pass `allow_outside`"
    )]
    Outside {
        /// Path of the referring file, or the name that stands for it.
        file: String,
        /// Part that refers to the other file, in the format's own words.
        place: String,
        /// The other file's name, as the referring file has it.
        uri: String,
    },
    /// A file that an imported file refers to cannot be read.
    #[error("{file}: {place}: cannot read \"{uri}\": {source}{}", remedy(source, file))]
    Resource {
        /// Path of the referring file, or the name that stands for it.
        file: String,
        /// Part that refers to the other file, in the format's own words.
        place: String,
        /// The other file's name, as the referring file has it.
        uri: String,
        /// Error of the file system.
        source: std::io::Error,
    },
}

impl SceneError {
    /// Returns the error with what a comment of the scene's text says about a file that is missing,
    /// such as the command that makes it.
    pub(crate) fn with_comment(self, text: &str) -> Self {
        let Self::Invalid { file, line, column, message, excerpt } = self else { return self };
        let is_missing = message.contains("No such file");
        let comment = comment_on_files(text, line).filter(|_| is_missing);
        let message = match comment {
            Some(comment) => format!("{message}; the scene says: {}", shown(comment)),
            None => message,
        };
        Self::Invalid { file, line, column, message, excerpt }
    }

    /// Returns the error for a file that cannot be read. For a missing one it names a similar file.
    pub(crate) fn read(path: &Path, source: std::io::Error) -> Self {
        Self::Read { path: path.to_owned(), source: explained(path, source) }
    }

    /// Returns an error at a line and column of `text`, both counted from 1.
    pub(crate) fn at(file: &str, text: &str, line: usize, column: usize, message: String) -> Self {
        // A file without line breaks may be one long line: show at most 100 characters before the
        // place and 100 after it.
        let skipped = column.saturating_sub(101);
        let all = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        // Each character becomes one character, so that the mark stays below its place.
        let plain = |letter: char| match letter {
            '\t' => ' ',
            letter if letter.is_control() => '\u{fffd}',
            letter => letter,
        };
        let shown: String = all.chars().skip(skipped).take(200).map(plain).collect();
        let mark = " ".repeat(column.saturating_sub(1 + skipped).min(200)) + "^";
        let excerpt = format!("{line:5} | {shown}\n      | {mark}");
        Self::Invalid { file: file.to_owned(), line, column, message, excerpt }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_on_a_file_is_found() {
        let text = "// make it:\n//     generate a.ply\n// b.ply is there\nMesh(file: \"meshes/a.ply\"),\n";
        assert_eq!(comment_on_files(text, 4), Some("generate a.ply"));
        assert_eq!((comment_on_files(text, 1), comment_on_files(text, 9)), (None, None));
        assert_eq!(comment_on_files("Mesh(file: \"a.ply\")", 1), None);
        assert_eq!(comment_on_files("// data.ply: run make\nMesh(file: \"a.ply\")", 2), None);
    }
}
