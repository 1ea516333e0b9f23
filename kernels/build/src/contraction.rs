//! Forbids contraction to Vulkan drivers: decorates each arithmetic instruction with
//! `NoContraction`.
//!
//! Without it a driver may fuse x y + z, which rounds once where the CPU rounds twice, and
//! reassociate, which turns the rounding error (a - (s - (s - a))) of a sum into 0 (Vulkan
//! specification, "Precision and Operation of SPIR-V Instructions"). rust-gpu has no option for it.
//! Called by `spirv`.

/// First word of a module, little endian.
const MAGIC: u32 = 0x0723_0203;
/// Number of words before the first instruction.
const HEADER: usize = 5;
/// Opcode of OpDecorate (SPIR-V specification, section 3.52).
const DECORATE: u32 = 71;
/// Opcodes of types; the first one ends the annotations.
const TYPES: std::ops::RangeInclusive<u32> = 19..=39;
/// NoContraction, as an operand of OpDecorate.
const NO_CONTRACTION: u32 = 42;
/// Opcodes of FAdd, FSub, FMul, FDiv, FRem, FMod, VectorTimesScalar to OuterProduct, Dot. FNegate
/// is exact and left out: NVIDIA's compiler would make each an addition instead of the sign of an
/// operand.
const ARITHMETIC: [u32; 13] = [129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148];

/// Returns `module` with each result of floating-point arithmetic decorated; `None` if it is not a
/// module.
pub fn forbid_contraction(module: &[u8]) -> Option<Vec<u8>> {
    let words: Vec<u32> =
        module.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    if words.len() < HEADER || words[0] != MAGIC {
        return None;
    }
    let mut decorations = Vec::new();
    let mut first_type = None;
    let mut at = HEADER;
    while at < words.len() {
        let (length, operation) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let instruction = words.get(at..at + length.max(1))?;
        if first_type.is_none() && TYPES.contains(&operation) {
            first_type = Some(at);
        }
        if ARITHMETIC.contains(&operation) {
            decorations.extend([3 << 16 | DECORATE, *instruction.get(2)?, NO_CONTRACTION]);
        }
        at += instruction.len();
    }
    // Annotations end where types begin.
    let (before, after) = words.split_at(first_type?);
    let all = [before, &decorations, after].concat();
    Some(all.into_iter().flat_map(u32::to_le_bytes).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(words: &[u32]) -> Vec<u8> {
        words.iter().copied().flat_map(u32::to_le_bytes).collect()
    }

    #[test]
    fn decorates_sums_before_the_types() {
        let header = [MAGIC, 0x0001_0500, 0, 9, 0];
        let float = [3 << 16 | 22, 1, 32]; // OpTypeFloat
        let sum = [5 << 16 | 129, 1, 7, 5, 6]; // OpFAdd
        let other = [5 << 16 | 128, 1, 8, 5, 6]; // OpIAdd
        let module = [&header[..], &float, &sum, &other].concat();
        let decoration = [3 << 16 | DECORATE, 7, NO_CONTRACTION];
        let want = [&header[..], &decoration, &float, &sum, &other].concat();
        assert_eq!(forbid_contraction(&bytes(&module)), Some(bytes(&want)));
    }

    #[test]
    fn refuses_what_is_no_module() {
        assert_eq!(forbid_contraction(&[]), None);
        assert_eq!(forbid_contraction(&bytes(&[1, 2, 3, 4, 5, 6])), None);
        assert_eq!(forbid_contraction(&bytes(&[MAGIC, 0, 0, 0, 0, 9 << 16 | 22, 1])), None);
    }
}
