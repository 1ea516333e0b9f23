//! Normals of faces without vn in smoothing groups.

use super::super::mesh::corner_normals;
use super::group::{Group, NONE};
use glam::DVec3;
use std::collections::HashMap;

/// Minimum length of a mean of unit normals that has a direction: shorter ones are rounding errors
/// of normals that cancel.
const MIN_MEAN: f64 = 1e-6;

/// Sums of the normals of faces, by position index and smoothing group.
#[derive(Debug, Default)]
pub struct Smoothing {
    index: HashMap<[u32; 2], u32>,
    sums: Vec<Sum>,
}

/// Sum of unit normals times angles, and sum of these angles.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    normal: DVec3,
    angle: f64,
}

impl Sum {
    /// Returns the mean as a unit vector, unless the normals cancel or there are none.
    fn unit(&self) -> Option<DVec3> {
        let is_usable = self.normal.length() > MIN_MEAN * self.angle;
        self.normal.try_normalize().filter(|_| is_usable)
    }
}

impl Smoothing {
    /// Adds a triangle of a smoothing group to the sums at its corners, and returns its corners
    /// with the indices of these sums in place of normals. A triangle without area adds nothing.
    pub fn add(&mut self, group: u32, triangle: [[u32; 3]; 3], positions: &[[f64; 3]]) -> [[u32; 3]; 3] {
        let added = corner_normals(points(&triangle, positions));
        let mut corners = triangle;
        for ([position, _, slot], added) in corners.iter_mut().zip(added) {
            let next = self.sums.len();
            let index = *self.index.entry([*position, group]).or_insert(next as u32);
            if index as usize == next {
                self.sums.push(Sum::default());
            }
            if let Some(sum) = self.sums.get_mut(index as usize) {
                sum.normal += added;
                sum.angle += added.length();
            }
            *slot = index;
        }
        corners
    }

    /// Appends the means to `normals`, and replaces the indices of sums in the smooth `groups` by
    /// those of normals. A corner whose normals cancel gets the normal of its triangle.
    ///
    /// `None` if there are too many normals for their indices.
    pub fn finish(
        self,
        groups: &mut [Group],
        positions: &[[f64; 3]],
        normals: &mut Vec<[f32; 3]>,
    ) -> Option<()> {
        let first = u32::try_from(normals.len()).ok()?;
        u32::try_from(normals.len() + self.sums.len()).ok()?;
        normals.extend(self.sums.iter().map(|sum| single(sum.unit().unwrap_or(DVec3::Z))));
        for triangle in groups.iter_mut().filter(|group| group.is_smooth).flat_map(|of| &mut of.triangles) {
            let face = corner_normals(points(triangle, positions)).into_iter().find_map(DVec3::try_normalize);
            let mut own = None;
            for [.., slot] in triangle {
                let has_mean = self.sums.get(*slot as usize).is_some_and(|sum| sum.unit().is_some());
                *slot = match (face, own) {
                    // A triangle without area has no normal. It is dropped later.
                    (None, _) => first + *slot,
                    _ if has_mean => first + *slot,
                    (Some(_), Some(own)) => own,
                    (Some(face), None) => {
                        let next = u32::try_from(normals.len()).ok().filter(|&next| next != NONE)?;
                        normals.push(single(face));
                        *own.insert(next)
                    }
                };
            }
        }
        Some(())
    }
}

/// Returns the positions of a triangle's corners.
fn points(triangle: &[[u32; 3]; 3], positions: &[[f64; 3]]) -> [DVec3; 3] {
    triangle.map(|[position, ..]| positions.get(position as usize).copied().unwrap_or_default().into())
}

fn single(normal: DVec3) -> [f32; 3] {
    normal.as_vec3().into()
}
