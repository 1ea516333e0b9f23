//! WGSL of the kernels, the language in which browsers take them: naga reads SPIR-V and writes it.

mod constant_branches;
mod selections;

use naga::Module;
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
    let mut module = read(module)?;
    constant_branches::remove(&mut module);
    selections::select(&mut module);
    compact(&mut module, KeepUnused::No);
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(""))?;
    let text = write_string(&module, &info, WriterFlags::empty()).map_err(|error| error.to_string())?;
    Ok(text.replace(DECIMAL_MAX, EXACT_MAX))
}

/// Reads a SPIR-V module.
fn read(module: &[u8]) -> Result<Module, String> {
    let options = spv::Options {
        adjust_coordinate_space: false,
        strict_capabilities: true,
        block_ctx_dump_prefix: None,
    };
    spv::parse_u8_slice(module, &options).map_err(|error| error.to_string())
}

/// `f32::MAX` in the fewest decimal digits that round to it, as naga writes it: more than it is,
/// which browsers refuse.
const DECIMAL_MAX: &str = "340282350000000000000000000000000000000f";

/// `f32::MAX`.
const EXACT_MAX: &str = "0x1.fffffep+127f";

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::{DECIMAL_MAX, read, wgsl};
    use crate::{entry_points, features_by_names, specialise, spirv};
    use naga::{Block, Statement};
    use trisect_shared::features::Features;

    /// Returns the WGSL of a kernel with these features.
    fn text_of(name: &str, features: Features) -> String {
        let mut words: Vec<u32> = spirv(name)
            .unwrap()
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
            .collect();
        specialise::spirv(&mut words, features);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        wgsl(&bytes).unwrap()
    }

    fn without_queue() -> impl Iterator<Item = &'static str> {
        entry_points().filter(|name| !name.ends_with("persistent"))
    }

    /// Kernels without a queue have WGSL with at most as many storage buffers as WebGPU guarantees.
    /// Those with a queue have the counter, too.
    #[test]
    fn kernels_are_for_browsers() {
        let mut most = 0;
        for name in without_queue() {
            let text = text_of(name, Features::MAX);
            assert!(text.contains(&format!("fn {name}(")), "{name}");
            let buffers = text.matches("var<storage").count();
            assert!((1..=8).contains(&buffers), "{name}: {buffers}");
            most = buffers.max(most);
            assert!(!text.contains(DECIMAL_MAX), "{name}");
            assert!(!text.contains("override"), "{name}");
        }
        assert_eq!(most, 8);
        assert!(wgsl(&[1, 2, 3, 4]).is_err() && wgsl(&[]).is_err());
    }

    /// A browser compiles only what the features of a scene need: a box of planes at most a fifth
    /// of the text of all features.
    #[test]
    fn what_features_exclude_is_not_written() {
        for name in ["render", "render_general"] {
            let all = text_of(name, Features::MAX);
            let of_box = text_of(name, features_by_names("planar,lambertian,nee").unwrap());
            assert!(of_box.len() * 5 < all.len(), "{name}: {} of {}", of_box.len(), all.len());
            // A branch has statements: small ones became selections.
            assert!(of_box.matches("select(").count() > 100, "{name}");
        }
    }

    /// Returns the number of exits of functions within loops: each leaves all loops around it.
    fn exits_of_several_loops(block: &Block, is_inside: bool) -> usize {
        let count = |of: &Block, is_inside| exits_of_several_loops(of, is_inside);
        let exits = block.iter().map(|statement| match statement {
            Statement::Return { .. } | Statement::Kill => usize::from(is_inside),
            Statement::Block(inner) => count(inner, is_inside),
            Statement::If { accept, reject, .. } => count(accept, is_inside) + count(reject, is_inside),
            Statement::Switch { cases, .. } => cases.iter().map(|case| count(&case.body, is_inside)).sum(),
            Statement::Loop { body, continuing, .. } => count(body, true) + count(continuing, true),
            _ => 0,
        });
        exits.sum()
    }

    /// Some compilers of drivers err where an exit leaves several loops. A break leaves its own
    /// loop only, so returns are what remains.
    #[test]
    fn no_exit_leaves_several_loops() {
        let mut loops = 0;
        for name in entry_points() {
            let module = read(spirv(name).unwrap()).unwrap();
            let functions = module.functions.iter().map(|(_, function)| function);
            for function in functions.chain(module.entry_points.iter().map(|entry| &entry.function)) {
                assert_eq!(exits_of_several_loops(&function.body, false), 0, "{name}");
                loops += format!("{:?}", function.body).matches("Loop {").count();
            }
        }
        assert!(loops > 80, "{loops}");
        // Negative control.
        let leave = Block::from_vec(vec![Statement::Return { value: None }]);
        let body = Statement::Loop { body: leave, continuing: Block::new(), break_if: None };
        assert_eq!(exits_of_several_loops(&Block::from_vec(vec![body]), false), 1);
    }
}
