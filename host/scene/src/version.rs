//! Version of the scene format.

/// The only version of the format.
pub const VERSION: u32 = 1;
