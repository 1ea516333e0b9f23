//! Specialisation of compiled kernels: the features are a constant of the module, which the host
//! sets before the driver compiles it. The driver then removes what the features lack.

use crate::branch_free::branch_free;
use trisect_shared::features::{self, Features};

/// Numbers in the PTX of render kernels that stand for the words of the features.
const PTX_FEATURES: [u32; 2] = [0x7ea5_e7ed, 0x7ea5_e7ee];

/// Identifiers of the specialisation constants of SPIR-V that hold the words of the features.
const SPIRV_FEATURES: [u32; 2] = [0, 1];

/// Returns a PTX module for these features, its reciprocals and square roots without
/// branches.
pub fn ptx(module: &str, features: Features) -> String {
    // LLVM prints a move of a constant as it stands in the assembly of `ptx::features`.
    let [low, high] = features::to_words(features).map(|word| format!("{word:#x}"));
    let [low_mark, high_mark] = PTX_FEATURES.map(|mark| format!("{mark:#x}"));
    branch_free(&module.replace(&high_mark, &high).replace(&low_mark, &low))
}

/// Sets the features of a SPIR-V module: the defaults of its specialisation constants. Modules of
/// other kernels stay as they are.
///
/// wgpu hands no specialisation constants to the driver with modules that it passes through, but
/// the driver takes a constant's default where it gets no other value.
pub fn spirv(words: &mut [u32], features: Features) {
    const HEADER: usize = 5;
    const DECORATE: u32 = 4 << 16 | 71; // OpDecorate of four words
    const SPEC_ID: u32 = 1;
    const SPEC_CONSTANT: u32 = 4 << 16 | 50; // OpSpecConstant of four words
    let mut constants = [None; 2];
    let mut place = HEADER;
    while let Some(&first) = words.get(place) {
        let instruction = words.get_mut(place..place + 4);
        if let Some(instruction) = instruction {
            for (word, constant) in constants.iter_mut().enumerate() {
                if *instruction == [DECORATE, instruction[1], SPEC_ID, SPIRV_FEATURES[word]] {
                    *constant = Some(instruction[1]);
                } else if first == SPEC_CONSTANT && Some(instruction[2]) == *constant {
                    instruction[3] = features::to_words(features)[word];
                }
            }
        }
        place += ((first >> 16).max(1)) as usize;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{entry_points, ptx_names};

    const SPECIAL: Features = 0x8765_4321_1234_5678;

    /// A render kernel has a constant for each word in each form, and other kernels have none.
    #[test]
    fn each_render_kernel_has_two_constants() {
        for name in ptx_names() {
            let constants = usize::from(name.starts_with("render"));
            for fast in [false, true] {
                let module = crate::ptx(name, fast).expect(name);
                let special = ptx(&module, SPECIAL);
                for (word, other) in [("0x12345678", SPECIAL + 1), ("0x87654321", SPECIAL + (1 << 32))] {
                    assert_eq!(special.matches(word).count(), constants, "{name}: {word}");
                    assert_eq!(special == ptx(&module, other), constants == 0, "{name}: {word}");
                }
            }
        }
        for name in entry_points() {
            let constants = 2 * usize::from(crate::is_render(name));
            let (words, _) = crate::spirv(name).expect(name).as_chunks();
            let module: Vec<u32> = words.iter().copied().map(u32::from_le_bytes).collect();
            let mut special = module.clone();
            spirv(&mut special, SPECIAL);
            let changed = module.iter().zip(&special).filter(|(before, after)| before != after).count();
            assert_eq!(changed, constants, "{name}");
        }
    }

    #[test]
    fn modules_that_end_early_are_left() {
        for words in [vec![], vec![0; 4], vec![0; 7], vec![0, 0, 0, 0, 0, 4 << 16 | 71, 1]] {
            let mut special = words.clone();
            spirv(&mut special, 1);
            assert_eq!(special, words);
        }
    }
}
