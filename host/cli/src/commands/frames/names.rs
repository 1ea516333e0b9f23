//! Names of numbered files.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use trisect::error::MotionError;

/// Digits of a frame's number, unless the name says how many.
const DIGITS: usize = 4;

/// Names of a series of files, in one folder.
#[derive(Clone, Debug)]
pub struct FrameNames {
    folder: PathBuf,
    before: OsString,
    digits: usize,
    after: OsString,
}

impl FrameNames {
    /// Returns the names for the path that an option gives: the number is where the file's name has
    /// `%d` or `%04d`, and otherwise, with four digits, before the extension. A longer number takes
    /// as many digits as it needs.
    ///
    /// # Errors
    ///
    /// [`MotionError::Name`] for a name that has the number twice, or pads it with spaces.
    pub fn new(path: &Path) -> Result<Self, MotionError> {
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let name = path.file_name().unwrap_or_default();
        let wrong = |problem| MotionError::Name { path: path.to_owned(), problem };
        let text = name.to_str().unwrap_or_default();
        let mut numbers = text.match_indices('%').filter_map(|(at, _)| {
            let rest = text.get(at + 1..)?;
            let end = rest.find(|letter: char| !letter.is_ascii_digit())?;
            rest.get(end..)?.starts_with('d').then(|| (at, &rest[..end], at + 1 + end + 1))
        });
        let Some((start, width, end)) = numbers.next() else {
            let mut before = path.file_stem().unwrap_or_default().to_owned();
            before.push(".");
            let mut after = OsString::new();
            if let Some(extension) = path.extension() {
                after.push(".");
                after.push(extension);
            }
            return Ok(Self { folder, before, digits: DIGITS, after });
        };
        if numbers.next().is_some() {
            return Err(wrong("the name has the number of the frame twice"));
        }
        let digits = match (width, width.strip_prefix('0').map(str::parse::<usize>)) {
            ("", _) => 1,
            (_, Some(Ok(digits @ 1..=9))) => digits,
            (_, Some(_)) => return Err(wrong("a number of the frame has 1 to 9 digits")),
            (_, None) => return Err(wrong("the number of the frame would be padded with spaces")),
        };
        let (before, after) = (OsString::from(&text[..start]), OsString::from(&text[end..]));
        Ok(Self { folder, before, digits, after })
    }

    /// Returns the path of a frame's file.
    pub fn path(&self, frame: u32) -> PathBuf {
        self.folder.join(self.name(frame))
    }

    /// Returns the folder of the files.
    pub fn folder(&self) -> &Path {
        if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder }
    }

    /// Returns the frame whose file has this name.
    pub fn frame(&self, name: &Path) -> Option<u32> {
        let digits = |name: &OsStr| {
            let text = name.as_encoded_bytes();
            let text = text.strip_prefix(self.before.as_encoded_bytes())?;
            let text = text.strip_suffix(self.after.as_encoded_bytes())?;
            std::str::from_utf8(text).ok()?.parse::<u32>().ok()
        };
        digits(name.as_os_str()).filter(|frame| self.name(*frame) == name.as_os_str())
    }

    fn name(&self, frame: u32) -> OsString {
        let mut name = self.before.clone();
        name.push(format!("{frame:0digits$}", digits = self.digits));
        name.push(&self.after);
        name
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn numbers_are_where_the_name_says() {
        for (path, frame, expected) in [
            ("out.png", 7, "out.0007.png"),
            ("a/b.c/out.exr", 12345, "a/b.c/out.12345.exr"),
            ("a/%04d/out.png", 0, "a/%04d/out.0000.png"),
            ("out_%03d.png", 7, "out_007.png"),
            ("%d.hdr", 12, "12.hdr"),
            ("50%.png", 1, "50%.0001.png"),
            ("50%%02d%.png", 1, "50%01%.png"),
            ("%s%x.png", 1, "%s%x.0001.png"),
            ("stats", 1, "stats.0001"),
        ] {
            let names = FrameNames::new(Path::new(path)).unwrap();
            assert_eq!(names.path(frame), Path::new(expected), "{path}");
            let name = Path::new(expected).file_name().unwrap();
            assert_eq!(names.frame(Path::new(name)), Some(frame), "{path}");
        }
        let names = FrameNames::new(Path::new("out.png")).unwrap();
        for other in ["out.png", "out.7.png", "out.00007.png", "out.+007.png", "out.0007.exr", "out.-001.png"]
        {
            assert_eq!(names.frame(Path::new(other)), None, "{other}");
        }
        for bad in ["%d%d.png", "%04d-%02d.png", "%4d.png", "%00d.png", "%012d.png"] {
            let error = FrameNames::new(Path::new(bad)).unwrap_err().to_string();
            assert!(error.contains("once in the file's name, as %04d"), "{error}");
        }
    }
}
