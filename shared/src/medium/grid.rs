//! Walk of a ray through a grid of densities, cell by cell of a coarser grid of majorants.

use super::{Medium, exponential};
use crate::buffer::load;
use crate::math::{floor, from_half, max, min, unit_f32};
use crate::ray::Ray;
use crate::rng::{Words, pcg4d};
use crate::scene::Scene;
use crate::texture::Texel;
use glam::{Vec3, Vec4};

/// Number of voxels along each axis of a cell that has one majorant.
pub const CELL: u32 = 8;

/// Maximum number of collisions of a ray in a grid, null collisions among them; light that has more
/// is absorbed, so that no walk is endless.
pub const MAX_COLLISIONS: u32 = 1024;

/// Transmittance below which ratio tracking ends half of its walks, and doubles the others.
const ROULETTE_BELOW: f32 = 1.0 / 64.0;

/// Result of a walk.
#[derive(Clone, Copy)]
pub(super) struct Walk {
    pub collided: bool,
    /// Distance to the collision.
    pub distance: f32,
    /// Majorant's optical depth of the way, for an extinction of 1.
    pub depth: f32,
    /// Number of collisions, null collisions among them.
    pub collisions: f32,
    /// Estimate of what null collisions leave of the light; 1 unless the walk only transmits.
    pub transmittance: f32,
}

/// Part of a ray inside a grid, in cells: `origin` + t `direction` for t from `near` to `far`.
struct Span {
    origin: Vec3,
    direction: Vec3,
    /// Reciprocals of the direction, at most 1e30.
    inverse: Vec3,
    near: f32,
    far: f32,
}

#[inline(always)]
fn reciprocal(x: f32) -> f32 {
    let large = if x < 0.0 { -1e30 } else { 1e30 };
    if x.abs() > 1e-30 { 1.0 / x } else { large }
}

#[inline(always)]
fn row(row: Vec4) -> Vec3 {
    Vec3::new(row.x, row.y, row.z)
}

/// Returns a coordinate of a point by its row of a map.
#[inline(always)]
fn at(map: Vec4, point: Vec3) -> f32 {
    row(map).dot(point) + map.w
}

impl Span {
    /// Clips the first `distance` of a ray to the grid.
    #[inline(always)]
    fn new(medium: &Medium, ray: Ray, distance: f32) -> Self {
        let Medium { x, y, z, width, height, depth, .. } = *medium;
        let scale = 1.0 / CELL as f32;
        let (o, d) = (ray.origin, ray.direction);
        let origin = Vec3::new(at(x, o), at(y, o), at(z, o)) * scale;
        let direction = Vec3::new(row(x).dot(d), row(y).dot(d), row(z).dot(d)) * scale;
        let inverse = Vec3::new(reciprocal(direction.x), reciprocal(direction.y), reciprocal(direction.z));
        let size = Vec3::new(width as f32, height as f32, depth as f32) * scale;
        let (a, b) = (-origin * inverse, (size - origin) * inverse);
        let near = max(max(min(a.x, b.x), min(a.y, b.y)), max(min(a.z, b.z), 0.0));
        let far = min(min(max(a.x, b.x), max(a.y, b.y)), min(max(a.z, b.z), distance));
        Self { origin, direction, inverse, near, far }
    }
}

/// Position of a walk along one axis: the cell, its step, and the distances to the next border and
/// between borders.
#[derive(Clone, Copy)]
struct Axis {
    cell: i32,
    step: i32,
    next: f32,
    spacing: f32,
}

impl Axis {
    #[inline(always)]
    fn new(origin: f32, direction: f32, inverse: f32, near: f32, cells: i32) -> Self {
        let place = min(max(origin + direction * near, 0.0), cells as f32);
        let cell = floor(place);
        let cell = if cell >= cells { cells - 1 } else { cell };
        let (step, border) = if direction < 0.0 { (-1, cell) } else { (1, cell + 1) };
        Self { cell, step, next: (border as f32 - origin) * inverse, spacing: inverse.abs() }
    }

    #[inline(always)]
    fn advance(&mut self) {
        self.cell += self.step;
        self.next += self.spacing;
    }

    #[inline(always)]
    fn is_inside(&self, cells: i32) -> bool {
        self.cell >= 0 && self.cell < cells
    }
}

/// Returns the number of cells for a number of voxels.
#[inline(always)]
fn cells(voxels: u32) -> i32 {
    voxels.div_ceil(CELL) as i32
}

/// Returns the voxel whose centre is next below a place in cells, along an axis with `voxels`,
/// and how far the place is on the way to the next centre. A place outside counts as the nearest
/// inside.
#[inline(always)]
fn split(place: f32, voxels: u32) -> (u32, f32) {
    let p = min(max(place * CELL as f32 - 0.5, 0.0), (voxels - 1) as f32);
    let i = floor(p);
    (i as u32, p - i as f32)
}

/// Returns the density between a voxel and its neighbours to the right, below and both, all of
/// which its texel has.
#[inline(always)]
fn interpolate(texel: Texel, u: f32, v: f32) -> f32 {
    let Texel { red_green, blue_alpha } = texel;
    let top = from_half(red_green) * (1.0 - u) + from_half(red_green >> 16) * u;
    let bottom = from_half(blue_alpha) * (1.0 - u) + from_half(blue_alpha >> 16) * u;
    top * (1.0 - v) + bottom * v
}

/// Returns the density, 0 to 1, at a place in cells.
///
/// # Safety
///
/// As [`walk`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn density(scene: Scene, medium: &Medium, place: Vec3) -> f32 {
    let (i, u) = split(place.x, medium.width);
    let (j, v) = split(place.y, medium.height);
    let (k, w) = split(place.z, medium.depth);
    let above = if k + 1 < medium.depth { k + 1 } else { k };
    let index = medium.first_density + (k * medium.height + j) * medium.width + i;
    let index_above = index + (above - k) * medium.height * medium.width;
    // SAFETY: the voxels lie inside the grid; the caller's promise for its texels.
    let (low, high) =
        unsafe { (load::<Texel>(scene.texels, index), load::<Texel>(scene.texels, index_above)) };
    interpolate(low, u, v) * (1.0 - w) + interpolate(high, u, v) * w
}

/// Walks along `ray` for at most `distance`, with collisions for a channel of this `extinction`, of
/// which the first is at the optical depth `first`. Each is real with the probability that density
/// has of the majorant, which ends the walk; unless it `only_transmits`, when the estimate loses
/// that part.
///
/// # Safety
///
/// The medium has a grid, whose texels were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one loop for both; see buffer")]
pub(super) unsafe fn walk(
    scene: Scene,
    medium: &Medium,
    ray: Ray,
    distance: f32,
    extinction: f32,
    first: f32,
    only_transmits: bool,
    random: Words,
) -> Walk {
    let Span { origin, direction, inverse, near, far } = Span::new(medium, ray, distance);
    let (across, down, layers) = (cells(medium.width), cells(medium.height), cells(medium.depth));
    let mut x = Axis::new(origin.x, direction.x, inverse.x, near, across);
    let mut y = Axis::new(origin.y, direction.y, inverse.y, near, down);
    let mut z = Axis::new(origin.z, direction.z, inverse.z, near, layers);
    let mut walk = Walk { collided: false, distance, depth: 0.0, collisions: 0.0, transmittance: 1.0 };
    let (mut t, mut remaining, mut collisions) = (near, first, 0);
    let mut walks = near < far;
    while walks {
        let cell = medium.first_majorant + ((z.cell * down + y.cell) * across + x.cell) as u32;
        // SAFETY: the cell lies inside the grid; the caller's promise for its texels.
        let majorant = f32::from_bits(unsafe { load::<Texel>(scene.texels, cell) }.red_green);
        let exit = max(min(min(x.next, y.next), min(z.next, far)), t);
        let rate = extinction * majorant;
        let to_exit = (exit - t) * rate;
        if remaining >= to_exit {
            remaining -= to_exit;
            walk.depth += (exit - t) * majorant;
            t = exit;
            walks = exit < far;
            if x.next <= exit {
                x.advance();
                walks = walks && x.is_inside(across);
            } else if y.next <= exit {
                y.advance();
                walks = walks && y.is_inside(down);
            } else {
                z.advance();
                walks = walks && z.is_inside(layers);
            }
        } else {
            let step = remaining * (1.0 / rate);
            t += step;
            walk.depth += step * majorant;
            collisions += 1;
            walk.collisions += 1.0;
            let mut words = random;
            words.w = random.w ^ collisions;
            let words = pcg4d(words);
            remaining = exponential(words.x);
            // SAFETY: the caller's promise.
            let dense = unsafe { density(scene, medium, origin + direction * t) };
            let inverse = 1.0 / majorant;
            let real = dense * inverse;
            if only_transmits {
                walk.transmittance *= max(majorant - dense, 0.0) * inverse;
                if walk.transmittance < ROULETTE_BELOW {
                    walk.transmittance *= if words.z & 1 == 0 { 2.0 } else { 0.0 };
                    walks = walk.transmittance > 0.0;
                }
            } else if unit_f32(words.y) < real {
                (walk.collided, walk.distance, walks) = (true, t, false);
            }
            if collisions >= MAX_COLLISIONS && walks {
                (walk.transmittance, walks) = (0.0, false);
            }
        }
    }
    walk
}
