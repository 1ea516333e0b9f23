//! The ground below a model without a scene file: a disc that catches shadows and fades out, so
//! that its border is not visible.

use glam::DVec3;

/// Reflected fraction of the ground.
pub const ALBEDO: f64 = 0.5;
/// Radius up to which the ground is opaque, in units of its size.
const OPAQUE: f64 = 1.5;
/// Radius at which it ends.
pub const END: f64 = 9.0;
/// Distance below the lowest point, in units of its size: a flat base is in front of it.
const GAP: f64 = 2e-4;
/// Number of rings that fade.
const RINGS: u32 = 16;
/// Number of sectors.
const SECTORS: u32 = 64;

/// Ground that fades out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Centre of the disc.
    pub center: DVec3,
    /// Radius of the model on it: the disc is opaque up to 1.5 times this length, and ends at 9
    /// times.
    pub size: f64,
}

/// The ground as a mesh around 0, in units of its size.
#[derive(Debug)]
pub struct Disc {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Opacity of each vertex.
    pub opacity: Vec<f32>,
    /// Vertices of each triangle, counter-clockwise seen from above.
    pub triangles: Vec<[u32; 3]>,
}

impl Ground {
    /// Returns the ground below a body that `center` and `size` bound, whose lowest coordinate is
    /// `lowest`.
    pub fn below(center: DVec3, size: f64, lowest: f64) -> Self {
        // Coordinates are rounded to single precision later.
        let rounding = 4.0 * f64::from(f32::EPSILON) * center.abs().max_element().max(lowest.abs());
        let y = lowest - GAP * size - rounding;
        Self { center: DVec3::new(center.x, y, center.z), size }
    }

    /// Returns the disc's mesh.
    pub fn disc() -> Disc {
        let (mut positions, mut opacity, mut triangles) = (vec![[0.0; 3]], vec![1.0], Vec::new());
        for ring in 0..=RINGS {
            let part = f64::from(ring) / f64::from(RINGS);
            // Wider rings outside, where less is seen of them, so that the fading looks even.
            let radius = OPAQUE * (END / OPAQUE).powf(part);
            for sector in 0..SECTORS {
                let (sine, cosine) =
                    (std::f64::consts::TAU * f64::from(sector) / f64::from(SECTORS)).sin_cos();
                positions.push([(radius * cosine) as f32, 0.0, (-radius * sine) as f32]);
                opacity.push((1.0 - part * part * (3.0 - 2.0 * part)) as f32);
            }
        }
        for sector in 0..SECTORS {
            let next = (sector + 1) % SECTORS;
            triangles.push([0, 1 + sector, 1 + next]);
            for ring in 0..RINGS {
                let [inner, outer] = [1 + ring * SECTORS, 1 + (ring + 1) * SECTORS];
                triangles.push([inner + sector, outer + sector, outer + next]);
                triangles.push([inner + sector, outer + next, inner + next]);
            }
        }
        Disc { positions, opacity, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn it_faces_upward_and_fades_to_nothing() {
        let Disc { positions, opacity, triangles } = Ground::disc();
        assert_eq!(positions.len(), opacity.len());
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|i| Vec3::from(positions[i as usize]));
            assert!((b - a).cross(c - a).y > 1e-3, "{triangle:?}");
        }
        for (position, opacity) in positions.iter().zip(&opacity) {
            let radius = f64::from(Vec3::from(*position).length());
            let (inside, outside) = (radius < OPAQUE + 1e-5, radius > END - 1e-5);
            assert_eq!((*opacity == 1.0, *opacity == 0.0), (inside, outside), "{radius}");
        }
    }

    /// The ground is strictly below a flat base in single precision, near 0 and far away.
    #[test]
    fn a_flat_base_is_in_front() {
        for (place, size) in [(0.0, 1.0), (3e6, 1.0), (-3e6, 1e-3), (0.0, 1e-9), (1e9, 1e6)] {
            let ground = Ground::below(DVec3::splat(place), size, place);
            assert!((ground.center.y as f32) < place as f32, "{place} {size}");
            assert!(place - ground.center.y < 1e-3 * size + 1e-5 * place.abs());
        }
    }
}
