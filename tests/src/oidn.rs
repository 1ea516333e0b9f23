//! Open Image Denoise, which may be missing.

use trisect::denoise::oidn;

/// Returns whether the library is available; prints on standard error why not.
///
/// # Panics
///
/// If `REQUIRE_BACKENDS` names `oidn` and it is missing.
pub fn available() -> bool {
    let Err(error) = oidn::describe() else { return true };
    let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
    assert!(
        !required.split(',').any(|name| name.trim() == "oidn"),
        "REQUIRE_BACKENDS names oidn, but: {error}"
    );
    eprintln!("SKIPPED: no Open Image Denoise: {error}");
    false
}
