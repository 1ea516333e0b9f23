//! Check that there is memory for a BVH, before it is built.

use super::parts::PartSizes;
use trisect_scene::SceneError;
use trisect_system::memory::display;

/// Bytes for each primitive while its BVH is built and prepared for a device: nodes of the binary
/// and of the wide BVH, and of the builder (docs/notebook/triangles-and-trees.md).
const BYTES_PER_PRIMITIVE: u64 = 140;

/// Further bytes for each primitive of a BVH that is built in one piece, which has at most
/// [`PartSizes::DEFAULT`]'s number of primitives; the parts of a larger one take as much at most.
const BYTES_IN_ONE_PIECE: u64 = 150;

/// Maximum number of bytes for which a BVH is built without a query of the available memory.
const SMALL: u64 = 64 << 20;

/// Returns an error for a BVH that the memory cannot hold; the builder would panic.
pub(super) fn check(count: usize, scene: &str, available: impl Fn() -> u64) -> Result<(), SceneError> {
    let in_one_piece = count.min(PartSizes::DEFAULT.whole) as u64 * BYTES_IN_ONE_PIECE;
    let needed = (count as u64).saturating_mul(BYTES_PER_PRIMITIVE).saturating_add(in_one_piece);
    if needed <= SMALL {
        return Ok(());
    }
    let available = available();
    if needed <= available {
        return Ok(());
    }
    let (needed, available) = (display(needed), display(available));
    let message = format!(
        "the BVH of {count} primitives needs {needed} of memory, and {available} are available; place fewer copies, or simpler meshes"
    );
    Err(SceneError::Inconsistent { file: scene.to_owned(), message })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_that_does_not_fit_is_refused() {
        let error = check(1_000_000, "a.ron", || 250 << 20).and(check(1_000_000, "a.ron", || 200 << 20));
        let text = error.unwrap_err().to_string();
        assert!(text.contains("a.ron") && text.contains("200 MiB") && text.contains("1000000"), "{text}");
        // For a small one the available memory is not queried.
        check(100_000, "a.ron", || 0).unwrap();
    }
}
