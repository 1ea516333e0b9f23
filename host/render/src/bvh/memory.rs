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

/// Returns an error for a BVH that the memory cannot hold; the builder would panic.
pub(super) fn check(
    count: usize,
    scene: &str,
    lacking: impl Fn(u64) -> Option<u64>,
) -> Result<(), SceneError> {
    let in_one_piece = count.min(PartSizes::DEFAULT.whole) as u64 * BYTES_IN_ONE_PIECE;
    let needed = (count as u64).saturating_mul(BYTES_PER_PRIMITIVE).saturating_add(in_one_piece);
    let Some(available) = lacking(needed) else { return Ok(()) };
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
        let free = |free: u64| move |needed| (needed > free).then_some(free);
        let check = |megabytes: u64| check(1_000_000, "a.ron", free(megabytes << 20));
        let text = check(250).and(check(200)).unwrap_err().to_string();
        assert!(text.contains("a.ron") && text.contains("200 MiB") && text.contains("1000000"), "{text}");
    }
}
