//! Errors of Open Image Denoise: of finding its library, and of using it.

use super::VARIABLE;
use thiserror::Error;

/// Error of Open Image Denoise.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OidnError {
    /// The library is not on this machine, not where the variable says, or refused by the loader.
    #[error(
        "Open Image Denoise cannot be loaded: {searched}\n  install version 2 (openimagedenoise.org; `pip install \
         pyoidn`; a package of the system); set {VARIABLE} to its file or folder where the loader does not find it; \
         `denoise` svgf needs nothing"
    )]
    NotFound {
        /// Places that were searched, with the loader's messages.
        searched: String,
    },
    /// A file is not version 2 of the library.
    #[error(
        "{path} is not Open Image Denoise 2: {reason}\n  install version 2 (openimagedenoise.org; `pip install \
         pyoidn`), and set {VARIABLE} to its library file or folder; `denoise` svgf needs nothing"
    )]
    NotVersion2 {
        /// File, or the name by which the loader found it.
        path: String,
        /// Reason.
        reason: String,
    },
    /// A call of the library failed.
    #[error("Open Image Denoise: {action}: {message}")]
    Failed {
        /// Action that failed.
        action: &'static str,
        /// Message of the library.
        message: String,
    },
}

impl OidnError {
    /// Returns the program's exit code: 3 if the library is missing, 1 if it failed.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NotFound { .. } | Self::NotVersion2 { .. } => 3,
            Self::Failed { .. } => 1,
        }
    }
}
