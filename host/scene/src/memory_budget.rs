//! Checks that there is memory for a scene's triangles before they are made.

use super::description::{Instance, Mesh};
use trisect_system::memory::{self, SMALL};

/// Estimated bytes for each triangle in the world while the BVH is built: its record of 48 bytes,
/// half a vertex of 32, a node of 64, the wide BVH, and the builder's own memory
/// (docs/notebook/triangles-and-trees.md).
const TRIANGLE: u64 = 200;

/// Estimated further bytes for each triangle with tangents, colours or second texture coordinates:
/// as many records of 32 bytes as there are vertices, which is three if no two triangles share
/// one, and three tangents of 16 bytes while they are read.
const ATTRIBUTES: u64 = 3 * 32 + 3 * 16;

/// Bytes that were taken, and the free memory in bytes once it was queried.
#[derive(Debug, Default)]
pub struct MemoryBudget {
    taken: u64,
    free: Option<u64>,
}

impl MemoryBudget {
    /// Takes memory for the triangles of an instance of a mesh, which have further attributes or
    /// not.
    ///
    /// # Errors
    ///
    /// A message if the free memory does not suffice.
    pub fn place(&mut self, mesh: &Mesh, has_attributes: bool) -> Result<(), String> {
        let each = TRIANGLE + if has_attributes { ATTRIBUTES } else { 0 };
        self.take((mesh.triangles.len() as u64).saturating_mul(each))
    }

    /// Takes memory for `count` further instances, wherever their triangles are.
    ///
    /// # Errors
    ///
    /// A message if the free memory does not suffice.
    pub fn instances(&mut self, count: usize) -> Result<(), String> {
        self.take(count.saturating_mul(size_of::<Instance>()) as u64)
    }

    /// Takes memory for another mesh with the vertices and triangles of `mesh`.
    ///
    /// # Errors
    ///
    /// A message if the free memory does not suffice.
    pub fn store(&mut self, mesh: &Mesh) -> Result<(), String> {
        let vertices = 12 * (mesh.positions.len() + mesh.normals.len())
            + 8 * (mesh.uvs.len() + mesh.second_uvs.len())
            + 16 * (mesh.colors.len() + mesh.tangents.len());
        self.take((vertices + 12 * mesh.triangles.len()) as u64)
    }

    fn take(&mut self, bytes: u64) -> Result<(), String> {
        self.taken = self.taken.saturating_add(bytes);
        if self.taken <= SMALL {
            return Ok(());
        }
        let free = *self.free.get_or_insert_with(memory::available);
        if self.taken <= free {
            return Ok(());
        }
        Err(format!(
            "the scene's triangles, counting each copy of a mesh, need more than the {} of memory that are free; place fewer \
             copies, or simpler meshes",
            memory::display(free)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        let mesh = Mesh { positions: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]; 1000], ..Mesh::default() };
        let mut room = MemoryBudget { free: Some(100 << 20), ..MemoryBudget::default() };
        let placed = (0..10_000).take_while(|_| room.place(&mesh, false).is_ok()).count();
        assert_eq!(placed as u64, (100 << 20) / (1000 * TRIANGLE));
        assert!(room.place(&mesh, false).unwrap_err().contains("100 MiB"));
        let mut room = MemoryBudget { free: Some(64 << 20), ..MemoryBudget::default() };
        let stored = (0..10_000).take_while(|_| room.store(&mesh).is_ok()).count();
        assert!((5_000..6_000).contains(&stored), "{stored}");
    }
}
