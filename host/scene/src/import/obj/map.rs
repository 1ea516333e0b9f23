//! Map statements of MTL files: an image and its placement.

use super::super::source_location::SourceLocation;
use super::super::warnings::Warnings;
use super::lines::Statement;
use crate::error::SceneError;
use glam::{DVec2, DVec3};

/// Maximum factor on heights and normals.
const MAX_BUMP: f64 = 1e6;

/// An image and its placement.
#[derive(Clone, Debug)]
pub struct Map {
    /// Line and keyword of its statement.
    pub line: usize,
    pub keyword: String,
    /// File name as written, with `/` between folders.
    pub written: String,
    /// Folder of the library, relative to the OBJ file's folder.
    pub folder: String,
    /// File name, relative to the OBJ file's folder.
    pub path: String,
    pub scale: DVec2,
    pub offset: DVec2,
    pub clamp: bool,
    /// Factor on heights, `-bm`.
    pub bump: f64,
}

impl Map {
    /// Returns the place of the statement in the library `file`.
    pub fn site<'a>(&self, file: &'a str) -> SourceLocation<'a> {
        SourceLocation::new(file, format!("line {}, {}", self.line, self.keyword))
    }
}

/// Parses options and a file name, which may contain spaces.
pub fn map(statement: &Statement, folder: &str, warnings: &mut Warnings) -> Result<Option<Map>, SceneError> {
    let mut map = Map {
        line: statement.line,
        keyword: statement.keyword().to_owned(),
        written: String::new(),
        folder: folder.to_owned(),
        path: String::new(),
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        clamp: false,
        bump: 1.0,
    };
    let is_bump = matches!(statement.keyword(), "map_Bump" | "map_bump" | "bump" | "norm" | "map_Kn");
    let mut rest = statement.rest();
    let word = |rest: &mut &str| -> String {
        let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((*rest, ""));
        let word = word.to_owned();
        *rest = after.trim_start();
        word
    };
    while rest.starts_with('-') {
        let start = rest;
        let option = word(&mut rest);
        let mut numbers = DVec3::new(1.0, 1.0, 1.0);
        let count = match option.as_str() {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            "-blendu" | "-blendv" | "-boost" | "-bm" | "-cc" | "-clamp" | "-imfchan" | "-texres"
            | "-type" => 1,
            _ => {
                rest = start; // a file name that begins with -
                break;
            }
        };
        if count == 1 {
            let value = word(&mut rest);
            if option == "-clamp" {
                map.clamp = value == "on";
                continue;
            }
            if option == "-bm" && is_bump {
                map.bump = statement.number(&value)?;
                if map.bump.abs() > MAX_BUMP || map.bump.is_nan() {
                    return Err(
                        statement.error(&value, "the option -bm takes a number from -1e6 to 1e6".to_owned())
                    );
                }
                continue;
            }
        } else {
            if option == "-o" {
                numbers = DVec3::ZERO;
            }
            // The second and third number are optional.
            for axis in 0..count {
                let Ok(number) = rest.split_whitespace().next().unwrap_or_default().parse::<f64>() else {
                    break;
                };
                numbers[axis] = number;
                word(&mut rest);
            }
        }
        match option.as_str() {
            "-s" => map.scale = numbers.truncate(),
            "-o" => map.offset = numbers.truncate(),
            other => {
                warnings.once(format!("the option \"{other}\" of MTL maps is not supported and ignored"))
            }
        }
    }
    if !(map.scale.is_finite() && map.offset.is_finite()) {
        return Err(statement.error("", "the options -s and -o take finite numbers".to_owned()));
    }
    map.written = portable(rest);
    if map.written.is_empty() {
        return Err(statement.error("", format!("{} names no file", statement.keyword())));
    }
    let is_alone = folder.is_empty() || is_absolute(&map.written);
    map.path = if is_alone { map.written.clone() } else { format!("{folder}/{}", map.written) };
    Ok(Some(map))
}

/// Returns a path without quotes around it, and with `/` between folders, where Windows programs
/// write `\`.
pub fn portable(path: &str) -> String {
    let inner = path.strip_prefix('"').and_then(|path| path.strip_suffix('"'));
    inner.unwrap_or(path).replace('\\', "/")
}

/// Returns whether a path starts from the root of a file system, or from a drive.
pub fn is_absolute(path: &str) -> bool {
    let mut letters = path.chars();
    let (first, second) = (letters.next(), letters.next());
    first == Some('/') || (first.is_some_and(|letter| letter.is_ascii_alphabetic()) && second == Some(':'))
}
