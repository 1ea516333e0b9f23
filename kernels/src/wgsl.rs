//! WGSL of the kernels, the language in which browsers take them: naga reads SPIR-V and writes it.

use naga::back::wgsl::{WriterFlags, write_string};
use naga::compact::{KeepUnused, compact};
use naga::front::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Returns the WGSL of a SPIR-V module.
///
/// # Errors
///
/// A message for a module that naga does not read, or for which WGSL has no words.
pub fn wgsl(module: &[u8]) -> Result<String, String> {
    let options = spv::Options {
        adjust_coordinate_space: false,
        strict_capabilities: true,
        block_ctx_dump_prefix: None,
    };
    let mut module = spv::parse_u8_slice(module, &options).map_err(|error| error.to_string())?;
    compact(&mut module, KeepUnused::No);
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(""))?;
    write_string(&module, &info, WriterFlags::empty()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::wgsl;
    use crate::{entry_points, spirv};

    /// Kernels without a queue have WGSL with at most as many storage buffers as WebGPU guarantees.
    /// Those with a queue have the counter, too.
    #[test]
    fn kernels_are_for_browsers() {
        let mut most = 0;
        for name in entry_points().filter(|name| !name.ends_with("persistent")) {
            let text = wgsl(spirv(name).unwrap()).unwrap();
            assert!(text.contains(&format!("fn {name}(")), "{name}");
            let buffers = text.matches("var<storage").count();
            assert!((1..=8).contains(&buffers), "{name}: {buffers}");
            most = buffers.max(most);
        }
        assert_eq!(most, 8);
        assert!(wgsl(&[1, 2, 3, 4]).is_err() && wgsl(&[]).is_err());
    }
}
