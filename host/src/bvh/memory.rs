//! Checks that there is memory for a tree before it is built.

use crate::memory::display;
use crate::scene::SceneError;

/// Bytes of each primitive while its tree is built and made ready for a device: nodes of the
/// builder and of both trees, triangles in another order.
const BYTES_PER_PRIMITIVE: u64 = 520;

/// Trees that need no more are built without asking the system for its memory.
const SMALL: u64 = 64 << 20;

/// Refuses a tree that the memory cannot hold; the builder would panic.
pub(super) fn check(count: usize, scene: &str, available: impl Fn() -> u64) -> Result<(), SceneError> {
    let needed = (count as u64).saturating_mul(BYTES_PER_PRIMITIVE);
    if needed <= SMALL {
        return Ok(());
    }
    let available = available();
    if needed <= available {
        return Ok(());
    }
    let (needed, available) = (display(needed), display(available));
    let message = format!(
        "the tree of {count} primitives needs {needed} of memory, and {available} are available; place fewer copies, or simpler meshes"
    );
    Err(SceneError::Inconsistent { file: scene.to_owned(), message })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_that_does_not_fit_is_refused() {
        let error = check(1_000_000, "a.ron", || 500 << 20).and(check(1_000_000, "a.ron", || 400 << 20));
        let text = error.unwrap_err().to_string();
        assert!(text.contains("a.ron") && text.contains("400 MiB") && text.contains("1000000"), "{text}");
        // A small one is not worth the question.
        check(100_000, "a.ron", || 0).unwrap();
    }
}
