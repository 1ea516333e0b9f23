//! Digests of arrays of records, which stand for their content once the records are gone.

use bytemuck::Pod;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};

/// SHA-256 of an array. Arrays with equal digests count as equal: no two different ones are known.
pub(crate) type Digest = [u8; 32];

/// Number of records in a block. Blocks are hashed in parallel.
const BLOCK: usize = 1 << 13;

/// Returns the digest of a part of each record.
pub(crate) fn digest_of<T: Sync, P: Pod>(records: &[T], part: impl Fn(&T) -> P + Sync) -> Digest {
    let of_block = |block: &[T]| -> Digest {
        let parts: Vec<P> = block.iter().map(&part).collect();
        Sha256::digest(bytemuck::cast_slice::<P, u8>(&parts)).into()
    };
    // A small array starts no threads.
    let blocks: Vec<Digest> = match records.len() <= BLOCK {
        true => vec![of_block(records)],
        false => records.par_chunks(BLOCK).map(of_block).collect(),
    };
    let mut all = Sha256::new_with_prefix((records.len() as u64).to_le_bytes());
    all.update(blocks.as_flattened());
    all.finalize().into()
}

/// Returns the digest of records.
pub(crate) fn digest<T: Pod + Sync>(records: &[T]) -> Digest {
    digest_of(records, |record| *record)
}

/// Returns whether two arrays are equal, by the key of each record. Large arrays are compared in
/// parallel.
pub(crate) fn equal_by<T: Sync, K: PartialEq>(a: &[T], b: &[T], key: impl Fn(&T) -> K + Sync) -> bool {
    let equal = |(a, b): (&[T], &[T])| a.iter().zip(b).all(|(a, b)| key(a) == key(b));
    match (a.len() == b.len(), a.len() <= BLOCK) {
        (false, _) => false,
        (true, true) => equal((a, b)),
        (true, false) => a.par_chunks(BLOCK).zip(b.par_chunks(BLOCK)).all(equal),
    }
}

/// Returns whether two arrays have the same bytes.
pub(crate) fn equal<T: Pod + Sync>(a: &[T], b: &[T]) -> bool {
    let bytes = |records| -> &[u8] { bytemuck::cast_slice(records) };
    match (a.len() == b.len(), a.len() <= BLOCK) {
        (false, _) => false,
        (true, true) => bytes(a) == bytes(b),
        (true, false) => a.par_chunks(BLOCK).zip(b.par_chunks(BLOCK)).all(|(a, b)| bytes(a) == bytes(b)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any record counts, in each block, and so does the number of records.
    #[test]
    fn each_record_counts() {
        for count in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 5] {
            let records: Vec<[u32; 2]> = (0..count as u32).map(|i| [i, i % 3]).collect();
            let same = records.clone();
            assert!(equal(&records, &same) && digest(&records) == digest(&same), "{count}");
            let mut longer = same.clone();
            longer.push([0, 0]);
            assert!(!equal(&records, &longer) && digest(&records) != digest(&longer), "{count}");
            for place in [0, count / 2, count.saturating_sub(1)] {
                let mut other = records.clone();
                let Some(record) = other.get_mut(place) else { continue };
                record[1] ^= 1;
                assert!(!equal(&records, &other) && digest(&records) != digest(&other), "{count} {place}");
                // What is left out does not count.
                let first = |record: &[u32; 2]| record[0];
                assert!(equal_by(&records, &other, first), "{count} {place}");
                assert_eq!(digest_of(&records, first), digest_of(&other, first), "{count} {place}");
                assert!(!equal_by(&records, &other, |record| record[1]), "{count} {place}");
            }
        }
    }
}
