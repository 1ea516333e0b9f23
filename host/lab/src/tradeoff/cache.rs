//! Folder that keeps references between measurements.

use super::TradeoffError;
use std::path::{Path, PathBuf};

/// Returns the user's cache folder by the XDG base directory specification; `None` without `HOME`.
pub fn user_cache() -> Option<PathBuf> {
    let home = || std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache"));
    std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).or_else(home)
}

/// Returns the folder of references: the given one, or one in the user's cache. There is no default
/// that other users could write to, because their references would be trusted.
///
/// # Errors
///
/// [`TradeoffError::NoCache`] without a given folder and a home folder.
pub fn cache_folder(given: Option<&Path>) -> Result<PathBuf, TradeoffError> {
    let user = || user_cache().map(|cache| cache.join("trisect/references"));
    given.map(Path::to_owned).or_else(user).ok_or(TradeoffError::NoCache)
}
