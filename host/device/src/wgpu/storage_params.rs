//! Launch parameters in a storage buffer, for software adapters.
//!
//! Mesa's lavapipe makes conditions on uniforms constant: whenever the uniforms differ from those
//! of the last launch, it compiles the kernel again, and keeps each result as long as the pipeline.
//! A render has other parameters in each launch. Storage buffers are not treated so.

/// Words before the first instruction of a module.
const HEADER: usize = 5;

/// Storage classes of SPIR-V.
const UNIFORM: u32 = 2;
const STORAGE_BUFFER: u32 = 12;

const OP_TYPE_POINTER: u32 = 4 << 16 | 32;
const OP_VARIABLE: u32 = 4 << 16 | 59;
const OP_DECORATE_BINDING: (u32, u32) = (4 << 16 | 71, 33);
const OP_DECORATE: u32 = 3 << 16 | 71;
const NON_WRITABLE: u32 = 24;

/// Returns the module with its uniform variables in storage buffers that it only reads.
pub(super) fn storage_params(module: &[u32]) -> Vec<u32> {
    let uniforms: Vec<u32> = instructions(module)
        .filter_map(|instruction| match *instruction {
            [OP_VARIABLE, _, variable, UNIFORM] => Some(variable),
            _ => None,
        })
        .collect();
    let mut words = module.get(..HEADER).unwrap_or(module).to_vec();
    for instruction in instructions(module) {
        match *instruction {
            [OP_TYPE_POINTER, pointer, UNIFORM, to] => {
                words.extend([OP_TYPE_POINTER, pointer, STORAGE_BUFFER, to]);
            }
            [OP_VARIABLE, pointer, variable, UNIFORM] => {
                words.extend([OP_VARIABLE, pointer, variable, STORAGE_BUFFER]);
            }
            [op, variable, decoration, _]
                if (op, decoration) == OP_DECORATE_BINDING && uniforms.contains(&variable) =>
            {
                words.extend(instruction);
                words.extend([OP_DECORATE, variable, NON_WRITABLE]);
            }
            _ => words.extend(instruction),
        }
    }
    words
}

/// Returns the instructions of a module, each with all its words.
fn instructions(module: &[u32]) -> impl Iterator<Item = &[u32]> {
    let mut rest = module.get(HEADER..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = (*rest.first()? >> 16).max(1) as usize;
        let (instruction, after) = rest.split_at(length.min(rest.len()));
        rest = after;
        Some(instruction)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use trisect_kernels::{entry_points, spirv};

    /// Each kernel has one uniform variable, which becomes a storage buffer; nothing else changes.
    #[test]
    fn uniforms_become_storage_buffers() {
        let uniforms = |module: &[u32]| {
            instructions(module).filter(|of| matches!(of, [OP_VARIABLE, _, _, UNIFORM])).count()
        };
        for name in entry_points() {
            let module: Vec<u32> = bytemuck::pod_collect_to_vec(spirv(name).unwrap());
            let moved = storage_params(&module);
            assert_eq!((uniforms(&module), uniforms(&moved)), (1, 0), "{name}");
            assert_eq!(instructions(&moved).count(), instructions(&module).count() + 1, "{name}");
            let classes = |of: &&[u32]| matches!(of, [OP_TYPE_POINTER | OP_VARIABLE, ..]);
            let others = |module: &[u32]| -> Vec<Vec<u32>> {
                let added = |of: &&[u32]| matches!(of, [OP_DECORATE, _, NON_WRITABLE]);
                let rest = instructions(module).filter(|of| !classes(of) && !added(of));
                rest.map(<[u32]>::to_vec).collect()
            };
            assert!(others(&module) == others(&moved), "{name}");
        }
        for short in [&[][..], &[1, 2, 3], &[0; 5], &[0, 0, 0, 0, 0, OP_VARIABLE, 1]] {
            assert_eq!(storage_params(short), short);
        }
    }
}
