//! Whether there is memory for a scene's triangles, asked before they are made.

use super::description::Mesh;
use crate::memory;

/// Bytes for each triangle in the world while its tree is built: records of 112 in the scene's order and in the tree's, a node, the
/// builder's own; measured.
const TRIANGLE: u64 = 450;

/// Less is not worth asking the system how much there is.
const SMALL: u64 = 64 << 20;

/// What is left of the memory.
#[derive(Debug, Default)]
pub struct MemoryBudget {
    taken: u64,
    free: Option<u64>,
}

impl MemoryBudget {
    /// Asks for a copy of a mesh in the world.
    pub fn place(&mut self, mesh: &Mesh) -> Result<(), String> {
        self.take((mesh.triangles.len() as u64).saturating_mul(TRIANGLE))
    }

    /// Asks for another mesh with the same vertices and triangles.
    pub fn store(&mut self, mesh: &Mesh) -> Result<(), String> {
        let vertices = 12 * (mesh.positions.len() + mesh.normals.len()) + 8 * mesh.uvs.len();
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
        let placed = (0..10_000).take_while(|_| room.place(&mesh).is_ok()).count();
        assert_eq!(placed as u64, (100 << 20) / (1000 * TRIANGLE));
        assert!(room.place(&mesh).unwrap_err().contains("100 MiB"));
        let mut room = MemoryBudget { free: Some(SMALL), ..MemoryBudget::default() };
        let stored = (0..10_000).take_while(|_| room.store(&mesh).is_ok()).count();
        assert!((5_000..6_000).contains(&stored), "{stored}");
    }
}
