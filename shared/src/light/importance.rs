//! Importance of nodes of a light tree: about the greatest light that may arrive at a point from
//! their lights (after Conty Estevez and Kulla 2018, section 4.1). It is 0 only where none arrives.

use super::{Light, ReferencePoint};
use crate::buffer::{load_local, load_row, store_local};
use crate::math::{max, min, sqrt};
use crate::records::light_node::LightNode;
use crate::scene::Scene;
use core::mem::MaybeUninit;
use core::ops::{Add, Div, Mul, Neg, Sub};
use glam::UVec4;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use glam::{Mat4, Vec4};

/// Maximum number of children of a node.
pub const WIDTH: usize = 8;

/// Factor of the importance of lights below the horizon: a normal map may turn the horizon.
const BELOW_HORIZON: f32 = 0.02;

/// Number of rows of a node.
pub(super) const NODE_ROWS: u32 = (size_of::<LightNode>() / 16) as u32;

/// A number of each of the nodes that are looked at together, by the same operations: of one on a
/// GPU and in a browser, where code must be short, and of four on other processors
/// (docs/notebook/light-tree.md).
trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Returns `x` for each node.
    fn splat(x: f32) -> Self;
    /// Returns the square roots, correctly rounded.
    fn sqrt(self) -> Self;
    /// Returns the larger numbers; none is NaN.
    fn max(self, other: Self) -> Self;
    /// Returns the smaller numbers; none is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns `then` where a number is below `limit`, and `otherwise` elsewhere.
    fn if_below(self, limit: Self, then: Self, otherwise: Self) -> Self;
    /// Returns whether any number is at least 0.
    fn any_positive(self) -> bool;
}

impl Lanes for f32 {
    #[inline(always)]
    fn sqrt(self) -> f32 {
        sqrt(self)
    }
    #[inline(always)]
    fn splat(x: f32) -> f32 {
        x
    }
    #[inline(always)]
    fn max(self, other: f32) -> f32 {
        max(self, other)
    }
    #[inline(always)]
    fn min(self, other: f32) -> f32 {
        min(self, other)
    }
    #[inline(always)]
    fn if_below(self, limit: f32, then: f32, otherwise: f32) -> f32 {
        if self < limit { then } else { otherwise }
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self >= 0.0
    }
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
impl Lanes for Vec4 {
    #[inline(always)]
    fn sqrt(self) -> Vec4 {
        Vec4::new(sqrt(self.x), sqrt(self.y), sqrt(self.z), sqrt(self.w))
    }
    #[inline(always)]
    fn splat(x: f32) -> Vec4 {
        Vec4::splat(x)
    }
    #[inline(always)]
    fn max(self, other: Vec4) -> Vec4 {
        Vec4::select(self.cmpgt(other), self, other)
    }
    #[inline(always)]
    fn min(self, other: Vec4) -> Vec4 {
        Vec4::select(self.cmplt(other), self, other)
    }
    #[inline(always)]
    fn if_below(self, limit: Vec4, then: Vec4, otherwise: Vec4) -> Vec4 {
        Vec4::select(self.cmplt(limit), then, otherwise)
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.cmpge(Vec4::ZERO).any()
    }
}

/// First row of nodes: centre and radius.
struct Sphere<N>(N, N, N, N);

/// Last row of nodes: axis and cosine of their cone.
struct Cone<N>(N, N, N, N);

/// Direction and amount of the light of nodes that arrives at a point.
struct Arrival<N> {
    /// Unit vector from where most of it comes.
    direction: [N; 3],
    /// Sine of the angle from there to where all of it comes from.
    spread: N,
    /// Light that arrives, without the cosine at the surface, for a strength of 1.
    received: N,
}

/// Returns how light arrives from nodes that are not infinitely far: by the squared distance, and
/// by the cosine at the lights. Where θᵤ is the angle from the middle of the sphere to its border,
/// cos θ + sin θᵤ, at most 1, stands for the greatest cosine, cos(θ - θᵤ): it is not below that up
/// to 90°, below it beyond, and 0 where that is. From inside, the distance counts as the radius.
#[inline(always)]
fn near<N: Lanes>(
    sphere: Sphere<N>,
    strength: N,
    sine: N,
    cone: impl FnOnce() -> Cone<N>,
    from: &ReferencePoint,
) -> Arrival<N> {
    let Sphere(x, y, z, radius) = sphere;
    let (zero, one) = (N::splat(0.0), N::splat(1.0));
    let point = from.point;
    let (x, y, z) = (x - N::splat(point.x), y - N::splat(point.y), z - N::splat(point.z));
    let least = (radius * radius).max(N::splat(1e-30));
    let inverse = one / (x * x + y * y + z * z).max(least).sqrt();
    let (x, y, z) = (x * inverse, y * inverse, z * inverse);
    let (spread, mut received) = (radius * inverse, inverse * inverse);
    if sine.any_positive() {
        let Cone(axis_x, axis_y, axis_z, cosine) = cone();
        let cos = -(x * axis_x + y * axis_y + z * axis_z);
        let sin = (one - cos * cos).max(zero).sqrt();
        // The cosine of the angle beyond the cone.
        let beyond = cos.if_below(cosine, cos * cosine + sin * sine, one);
        let (emitted, ahead) = (beyond + spread, beyond.max(zero));
        // A sphere meets a narrow cone where θ, beyond the cone, is at most θᵤ.
        let touching = ahead * ahead + spread * spread - N::splat(0.999_999);
        let reach = strength.if_below(zero, touching, emitted);
        let emitted = zero.if_below(reach, emitted.min(one), zero);
        received = received * sine.if_below(zero, one, emitted);
    }
    Arrival { direction: [x, y, z], spread, received }
}

/// Returns importances of nodes from which light arrives so: with the cosine at the surface, as in
/// [`near`].
#[inline(always)]
fn importance<N: Lanes>(strength: N, arrival: Arrival<N>, from: &ReferencePoint) -> N {
    let Arrival { direction: [x, y, z], spread, mut received } = arrival;
    let normal = from.normal;
    if normal.dot(normal) > 0.0 {
        let cos = x * N::splat(normal.x) + y * N::splat(normal.y) + z * N::splat(normal.z);
        received = received * (cos + spread).max(N::splat(BELOW_HORIZON)).min(N::splat(1.0));
    }
    strength.max(-strength) * received
}

/// Returns the importance of a node by its rows.
#[inline(always)]
fn importance_of_one(
    sphere: Sphere<f32>,
    (strength, sine): (f32, f32),
    cone: impl FnOnce() -> Cone<f32>,
    from: &ReferencePoint,
) -> f32 {
    let arrival = if sphere.3 < 0.0 {
        let Cone(x, y, z, _) = cone();
        Arrival { direction: [x, y, z], spread: sine, received: 1.0 }
    } else {
        near(sphere, strength, sine, cone, from)
    };
    importance(strength, arrival, from)
}

/// Returns the importances of four nodes by their rows.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[inline(always)]
fn importances_of_four(
    sphere: Sphere<Vec4>,
    (strength, sine): (Vec4, Vec4),
    cone: impl Fn() -> Cone<Vec4>,
    from: &ReferencePoint,
) -> Vec4 {
    let is_distant = sphere.3.cmplt(Vec4::ZERO);
    let mut arrival = near(sphere, strength, sine, &cone, from);
    if is_distant.any() {
        let Cone(x, y, z, _) = cone();
        for (direction, axis) in arrival.direction.iter_mut().zip([x, y, z]) {
            *direction = Vec4::select(is_distant, axis, *direction);
        }
        arrival.spread = Vec4::select(is_distant, sine, arrival.spread);
        arrival.received = Vec4::select(is_distant, Vec4::ONE, arrival.received);
    }
    importance(strength, arrival, from)
}

/// Returns row `of` of a node of the tree whose first row this is.
///
/// # Safety
///
/// There is such a node.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn row(scene: Scene, first: u32, node: u32, of: u32) -> UVec4 {
    // SAFETY: the caller's promise.
    unsafe { load_row::<Light>(scene.lights, first + node * NODE_ROWS + of) }
}

/// Returns the importance at `from` of a node of the tree whose first row this is, and whether its
/// lights are infinitely far.
///
/// # Safety
///
/// There is this node.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn of_node(scene: Scene, first: u32, node: u32, from: &ReferencePoint) -> (f32, bool) {
    let numbers = |of: u32| {
        // SAFETY: the caller's promise.
        let row = unsafe { row(scene, first, node, of) };
        (f32::from_bits(row.x), f32::from_bits(row.y), f32::from_bits(row.z), f32::from_bits(row.w))
    };
    let ((x, y, z, radius), (strength, sine, ..)) = (numbers(0), numbers(1));
    let cone = || {
        let (x, y, z, cosine) = numbers(2);
        Cone(x, y, z, cosine)
    };
    let sphere = Sphere(x, y, z, radius);
    (importance_of_one(sphere, (strength, sine), cone, from), radius < 0.0)
}

/// Returns the importances of four nodes that follow each other.
///
/// # Safety
///
/// There are these nodes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn of_four_nodes(scene: Scene, first: u32, node: u32, from: &ReferencePoint) -> Vec4 {
    // The same number of each node in a column.
    let numbers = |of: u32| {
        // SAFETY: the caller's promise.
        let row = |lane: u32| bytemuck::cast(unsafe { row(scene, first, node + lane, of) });
        Mat4::from_cols(row(0), row(1), row(2), row(3)).transpose()
    };
    let (spheres, middle) = (numbers(0), numbers(1));
    let sphere = Sphere(spheres.x_axis, spheres.y_axis, spheres.z_axis, spheres.w_axis);
    let cone = || {
        let cones = numbers(2);
        Cone(cones.x_axis, cones.y_axis, cones.z_axis, cones.w_axis)
    };
    importances_of_four(sphere, (middle.x_axis, middle.y_axis), cone, from)
}

/// Importances of the children of a node.
pub(super) struct Importances {
    all: MaybeUninit<[f32; WIDTH]>,
    /// Their sum, in their order.
    pub sum: f32,
    /// Number of children that may send light.
    pub lit: f32,
}

impl Importances {
    /// Returns the importances at `from` of `count` children from `child` on, of the tree whose
    /// first row this is.
    ///
    /// # Safety
    ///
    /// There are these nodes, 1 to [`WIDTH`], and on a CPU another.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn new(scene: Scene, first: u32, child: u32, count: u32, from: &ReferencePoint) -> Self {
        let mut of = Self { all: MaybeUninit::uninit(), sum: 0.0, lit: 0.0 };
        let mut place = 0;
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        if count > 2 {
            while place + 2 < count {
                // SAFETY: the caller's promise; three nodes are read as four.
                let four = unsafe { of_four_nodes(scene, first, child + place, from) }.to_array();
                for (next, importance) in (place..).zip(four) {
                    // SAFETY: twice four are as many as there may be.
                    unsafe { store_local(&mut of.all, next, importance) };
                }
                place += 4;
            }
            for before in 0..place.min(count) {
                // SAFETY: they were just written.
                of.add(unsafe { of.of(before) });
            }
        }
        while place < count {
            // SAFETY: as above.
            let (importance, _) = unsafe { of_node(scene, first, child + place, from) };
            // SAFETY: there are so many.
            unsafe { store_local(&mut of.all, place, importance) };
            of.add(importance);
            place += 1;
        }
        of
    }

    /// Adds an importance to the sums.
    #[inline(always)]
    fn add(&mut self, importance: f32) {
        self.sum += importance;
        self.lit += if importance > 0.0 { 1.0 } else { 0.0 };
    }

    /// Returns that of the child at `place`.
    ///
    /// # Safety
    ///
    /// There is this child.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn of(&self, place: u32) -> f32 {
        // SAFETY: `new` wrote it.
        unsafe { load_local(&self.all, place) }
    }
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests;
