//! Places in files, for error messages.

use super::files::Outside;
use crate::error::SceneError;
pub(crate) use crate::shown_text::shown;

/// A place in a file.
#[derive(Clone, Debug)]
pub(super) struct SourceLocation<'a> {
    /// Path of the file, or the name that stands for it.
    pub file: &'a str,
    /// Part of the file, in the format's own words.
    pub place: String,
}

impl<'a> SourceLocation<'a> {
    pub fn new(file: &'a str, place: impl Into<String>) -> Self {
        Self { file, place: place.into() }
    }

    /// Returns a part of this place.
    pub fn member(&self, name: &str) -> Self {
        Self::new(self.file, format!("{}.{name}", self.place))
    }

    pub fn malformed(&self, problem: impl Into<String>, remedy: impl Into<String>) -> SceneError {
        SceneError::Malformed {
            file: self.file.to_owned(),
            place: self.place.clone(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    pub fn unsupported(&self, feature: impl Into<String>, remedy: impl Into<String>) -> SceneError {
        SceneError::Unsupported {
            file: self.file.to_owned(),
            place: self.place.clone(),
            feature: feature.into(),
            remedy: remedy.into(),
        }
    }

    pub fn too_large(&self, what: impl Into<String>, maximum: impl Into<String>) -> SceneError {
        SceneError::TooLarge {
            file: self.file.to_owned(),
            place: self.place.clone(),
            what: what.into(),
            maximum: maximum.into(),
        }
    }

    pub fn resource(&self, uri: &str, source: std::io::Error) -> SceneError {
        if source.get_ref().is_some_and(|error| error.is::<Outside>()) {
            let (file, place, uri) = (self.file.to_owned(), self.place.clone(), shown(uri));
            return SceneError::Outside { file, place, uri };
        }
        SceneError::Resource {
            file: self.file.to_owned(),
            place: self.place.clone(),
            uri: shown(uri),
            source,
        }
    }
}
