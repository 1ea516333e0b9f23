//! What is wrong with a scene, and where.

use std::path::PathBuf;
use thiserror::Error;

/// A scene that cannot be used.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not a scene: a syntax error, an unknown field, a value out of range, an unknown material.
    #[error("{file}:{line}:{column}: {message}\n{excerpt}\n  see docs/scenes.md for the format")]
    Invalid {
        /// The file, or what stands for it.
        file: String,
        /// Counted from 1.
        line: usize,
        /// Counted from 1, in characters.
        column: usize,
        /// What is wrong and what would be right.
        message: String,
        /// The line and a mark below the place.
        excerpt: String,
    },
    /// Values that are right by themselves but not together.
    #[error("{file}: {message}")]
    Inconsistent {
        /// The file, or what stands for it.
        file: String,
        /// What is wrong and what would be right.
        message: String,
    },
    /// The extension names no format of scenes or models.
    #[error("{}: unknown scene format; use .ron, .gltf, .glb, .obj or .ply", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A part of an imported file is not what its format allows.
    #[error("{file}: {place}: {problem}; {remedy}")]
    Malformed {
        /// The file, or what stands for it.
        file: String,
        /// The part, as the format's own words name it: `meshes[3].primitives[0].attributes.POSITION`.
        place: String,
        /// What is wrong.
        problem: String,
        /// What would be right.
        remedy: String,
    },
    /// An imported file cannot be shown without a feature that this program does not have.
    #[error("{file}: {place}: {feature} is not supported; {remedy}")]
    Unsupported {
        /// The file, or what stands for it.
        file: String,
        /// The part, as the format's own words name it.
        place: String,
        /// What is missing.
        feature: String,
        /// What to do instead.
        remedy: String,
    },
    /// A part of an imported file is larger than this program takes, or than memory is.
    #[error("{file}: {place}: {what}; the maximum is {maximum}")]
    TooLarge {
        /// The file, or what stands for it.
        file: String,
        /// The part, as the format's own words name it.
        place: String,
        /// What is too large, and how large it is.
        what: String,
        /// How large it may be, and what limits it.
        maximum: String,
    },
    /// An imported file refers to a file outside the scene's folder.
    #[error(
        "{file}: {place}: \"{uri}\" lies outside the scene's folder; put it there, or say --allow-outside"
    )]
    Outside {
        /// The file that refers to it, or what stands for it.
        file: String,
        /// The part that refers to it, as the format's own words name it.
        place: String,
        /// What it is called there.
        uri: String,
    },
    /// A file that an imported file refers to cannot be read.
    #[error(
        "{file}: {place}: cannot read \"{uri}\": {source}; it must lie where {file} says, relative to its folder"
    )]
    Resource {
        /// The file that refers to it, or what stands for it.
        file: String,
        /// The part that refers to it, as the format's own words name it.
        place: String,
        /// What it is called there.
        uri: String,
        /// Why.
        source: std::io::Error,
    },
}

impl SceneError {
    /// An error at a place of `text`.
    pub(crate) fn at(file: &str, text: &str, line: usize, column: usize, message: String) -> Self {
        // A file without line breaks may be one long line: at most 100 characters before the place, and 100 after.
        let skipped = column.saturating_sub(101);
        let all = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        // One character each, so that the mark stays below its place.
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
