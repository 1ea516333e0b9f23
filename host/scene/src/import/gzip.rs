//! Compressed files (gzip), recognised by their first bytes.

use super::budget::Budget;
use super::source_location::SourceLocation;
use crate::error::SceneError;
use flate2::read::MultiGzDecoder;
use std::io::Read;

/// Bytes that are decompressed at a time.
const PART: usize = 1 << 16;

/// Returns the content of a file: what it is compressed from, or the file itself. The budget takes
/// each part before it is kept.
pub(super) fn decompressed(
    bytes: Vec<u8>,
    budget: &mut Budget,
    site: &SourceLocation,
) -> Result<Vec<u8>, SceneError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let mut decoder = MultiGzDecoder::new(&bytes[..]);
    let (mut content, mut part) = (Vec::new(), vec![0; PART]);
    loop {
        let length = decoder.read(&mut part).map_err(|error| {
            site.malformed(format!("the compressed file is broken ({error})"), "write it again")
        })?;
        if length == 0 {
            return Ok(content);
        }
        budget.decompress(length as u64, bytes.len() as u64, site)?;
        content.extend_from_slice(&part[..length]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn compressed(content: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(content).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn files_are_decompressed_within_the_budget() {
        let site = SourceLocation::new("test", "line 1");
        let mut budget = Budget::new(0);
        let file = compressed(b"ply and more");
        assert_eq!(decompressed(file.clone(), &mut budget, &site).unwrap(), b"ply and more");
        assert_eq!(decompressed(b"ply".to_vec(), &mut budget, &site).unwrap(), b"ply");
        assert!(matches!(
            decompressed(file[..file.len() / 2].to_vec(), &mut budget, &site),
            Err(SceneError::Malformed { .. })
        ));
        // 100 MB of zeros in 100 kB are more than a small file may stand for.
        let bomb = compressed(&vec![0; 100 << 20]);
        let refused = decompressed(bomb, &mut Budget::new(0), &site);
        assert!(matches!(refused, Err(SceneError::TooLarge { .. })));
    }
}
