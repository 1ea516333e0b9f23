//! Ids of names: a hash, and a float of its bits.

/// Returns MurmurHash3 (x86, 32 bits, seed 0; Austin Appleby, 2011) of a name's UTF-8 bytes.
pub fn hash_of_name(name: &str) -> u32 {
    let (blocks, tail) = name.as_bytes().as_chunks::<4>();
    let mut hash = 0u32;
    for block in blocks {
        hash ^= scrambled(u32::from_le_bytes(*block));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let rest = tail.iter().rev().fold(0, |rest, byte| rest << 8 | u32::from(*byte));
    hash ^= scrambled(rest);
    hash ^= name.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

fn scrambled(block: u32) -> u32 {
    block.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593)
}

/// Returns the float of a hash's bits ("uint32_to_float32" of the specification), whose exponent is
/// changed where it would be that of 0, a denormal number, infinity or NaN. Hash 0 is no id and
/// gives 0.
pub fn id_of_hash(hash: u32) -> f32 {
    if hash == 0 {
        return 0.0;
    }
    let exponent = hash >> 23 & 255;
    f32::from_bits(if exponent == 0 || exponent == 255 { hash ^ 1 << 23 } else { hash })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the reference implementation.
    #[test]
    fn known_hashes() {
        for (name, hash) in
            [("", 0), ("hello", 0x248b_fa47), ("hello, world", 0x149b_bb7f), ("a", 0x3c25_69b2)]
        {
            assert_eq!(hash_of_name(name), hash, "{name}: {:08x}", hash_of_name(name));
        }
    }

    #[test]
    fn ids_are_normal_numbers() {
        for hash in [1, 0x007f_ffff, 0x7f80_0000, 0x7fff_ffff, 0xff80_0001, 0x8000_0000, 0x3c25_69b2] {
            assert!(id_of_hash(hash).is_normal(), "{hash:08x}");
        }
        assert_eq!((id_of_hash(0), id_of_hash(0x3f80_0000)), (0.0, 1.0));
    }
}
