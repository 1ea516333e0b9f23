//! Times that the images of a configuration took, and their file `times.json`.

use super::EvaluateError;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Times of rendering: one for each image, one for all of them, or none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// Wall-clock seconds.
    pub seconds: Vec<f64>,
    /// Seconds of all processors together.
    pub processor_seconds: Vec<f64>,
    /// File that they were read from, for messages.
    pub file: Option<PathBuf>,
}

/// One time or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrMore {
    One(f64),
    More(Vec<f64>),
}

/// Content of a file of times.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TimesFile {
    seconds: Option<OneOrMore>,
    processor_seconds: Option<OneOrMore>,
}

impl OneOrMore {
    /// Returns the times, or a message about a list that is shorter than that of any set.
    fn values(of: Option<Self>, key: &str) -> Result<Vec<f64>, String> {
        match of {
            None => Ok(Vec::new()),
            Some(Self::One(value)) => Ok(vec![value]),
            Some(Self::More(values)) if values.len() < 2 => {
                Err(format!("{key} is a list of {} times", values.len()))
            }
            Some(Self::More(values)) => Ok(values),
        }
    }
}

impl Times {
    /// Reads a file of times: an object with the keys `seconds` and `processor_seconds`, each a
    /// number, or a list of as many numbers as there are images. Either may be left out.
    ///
    /// # Errors
    ///
    /// [`EvaluateError::Io`] and [`EvaluateError::Times`].
    pub fn read(path: &Path) -> Result<Self, EvaluateError> {
        let bytes = std::fs::read(path).map_err(EvaluateError::io(path))?;
        let wrong = |message: String| EvaluateError::Times { path: path.to_owned(), message };
        let found: TimesFile = serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
        if found.seconds.is_none() && found.processor_seconds.is_none() {
            return Err(wrong("neither `seconds` nor `processor_seconds`".to_owned()));
        }
        Ok(Self {
            seconds: OneOrMore::values(found.seconds, "seconds").map_err(wrong)?,
            processor_seconds: OneOrMore::values(found.processor_seconds, "processor_seconds")
                .map_err(wrong)?,
            file: Some(path.to_owned()),
        })
    }

    /// Checks that the times of the set of this name are positive, and as many as its images.
    pub(super) fn check(&self, set: &str, images: usize) -> Result<(), EvaluateError> {
        let wrong = |message: String| {
            let path = self.file.clone().unwrap_or_else(|| set.into());
            Err(EvaluateError::Times { path, message })
        };
        for (key, values) in [("seconds", &self.seconds), ("processor_seconds", &self.processor_seconds)] {
            if let Some(value) = values.iter().find(|value| !value.is_finite() || **value <= 0.0) {
                return wrong(format!("{key} has {value}, which is no positive time"));
            }
            if values.len() > 1 && values.len() != images {
                return wrong(format!("{key} has {} times for {images} images", values.len()));
            }
        }
        Ok(())
    }
}
