//! Tube of light: a ray from a vertex through smooth glass to a light, with its derivatives by the
//! direction in which it starts (Igehy, "Tracing Ray Differentials", SIGGRAPH 1999).

use super::vertex::Vertex;
use super::{MAX_PASSES, Path, blocks};
use crate::bsdf::{DIELECTRIC, is_pane, slots};
use crate::bvh::{NO_PRIMITIVE, RayQuery};
use crate::curvature::Curvature;
use crate::features::{FeatureSet, Features, HOLES, MEDIA, PANES, SCHLICK};
use crate::fresnel;
use crate::light::glass::Piece;
use crate::light::{DIRECTIONAL, Light};
use crate::material::{BLENDED, MASKED};
use crate::math::{basis, max_component, min, normalize, sqrt};
use crate::medium::MediumStack;
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::traversal::closest_hit;
use glam::Vec3;

/// Maximum number of surfaces that refract or reflect a connection.
const MAX_BENDS: u32 = 4;

/// No bend of a tube is a reflection below the critical angle.
pub(super) const NO_MIRROR: u32 = u32::MAX;

/// Number of the first [block](blocks::refracted) for flights through media, after those of walks.
/// All walks of a vertex share these words: what media let pass by chance decides for all of them
/// alike which paths they find, so that their number stays unbiased.
const FIRST_FLIGHT: u32 = 0x3e0;

/// End of a tube at a light. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Part of the light by channel that glass lets pass.
    pub passed: Vec3,
    /// Number of rays traced.
    pub rays: u32,
    /// Unit vector of the last ray.
    pub direction: Vec3,
    /// Square of the distance by which the tube misses a light with a position, or of the
    /// difference of unit vectors for a light at infinity.
    pub miss2: f32,
    /// Change of the first direction that Newton's method finds, perpendicular to it.
    pub step: Vec3,
    /// Area, or solid angle at infinity, that the tube covers at the light per solid angle at its
    /// start.
    pub spread: f32,
    /// True if the tube went through glass towards the light, and nothing blocked it.
    pub arrived: bool,
}

impl Arrival {
    /// No arrival.
    pub const NONE: Self = Self {
        passed: Vec3::ZERO,
        rays: 0,
        direction: Vec3::Y,
        miss2: MISS,
        step: Vec3::ZERO,
        spread: 0.0,
        arrived: false,
    };
}

/// Tube of light on its way. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Tube {
    ray: Ray,
    /// Derivatives of the ray's origin and direction by both coordinates of the first direction.
    origin_u: Vec3,
    /// Number of surfaces that bent the tube.
    bends: u32,
    origin_v: Vec3,
    /// Number of segments.
    segments: u32,
    along_u: Vec3,
    /// Number of surfaces that let it pass straight.
    passes: u32,
    along_v: Vec3,
    media: MediumStack,
    /// Part of the light by channel that has passed.
    passed: Vec3,
}

impl Tube {
    /// Moves the origin's derivatives by a distance along the ray.
    #[inline(always)]
    fn travel(&mut self, distance: f32) {
        self.origin_u += self.along_u * distance;
        self.origin_v += self.along_v * distance;
    }

    /// Refracts the tube at a surface of smooth glass, or reflects it: totally, or as the bend
    /// `mirror`. Returns false where the tube ends.
    ///
    /// # Safety
    ///
    /// As [`follow`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn bend<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        at: &Vertex,
        mirror: u32,
    ) -> bool {
        let (front, incoming) = (at.is_front(), self.ray.direction);
        let normals = at.facing_normals(features, params, front);
        let (n, cos) = (normals.of_bsdf.shading, -incoming.dot(normals.of_bsdf.shading));
        let eta = if front { 1.0 / at.material.ior } else { at.material.ior };
        let cos2 = fresnel::refracted_cos2(cos, eta);
        // The ray becomes `scale` times itself plus `bend` times the normal; `slope` is the
        // derivative of `bend` by the cosine.
        let (mut scale, mut bend, mut slope) = (1.0, 2.0 * cos, 2.0);
        let (is_total, is_mirror) = (cos2 <= 0.0, self.bends == mirror);
        let is_reflected = is_total || is_mirror;
        if !is_total {
            let refracted = sqrt(cos2);
            let reflectance = if features.has::<SCHLICK>() {
                fresnel::schlick(cos, eta)
            } else {
                fresnel::dielectric(cos, refracted, eta)
            };
            self.passed *= if is_mirror { reflectance } else { 1.0 - reflectance };
            if !is_mirror {
                (scale, bend) = (eta, eta * cos - refracted);
                slope = eta - eta * eta * cos * (1.0 / refracted);
            }
        }
        // SAFETY: a primitive was hit; the caller's promise.
        let curvature = unsafe { Curvature::at(features, params, scene, at.hit, &at.surface) };
        // Positions on the tangent plane, then directions.
        let across = 1.0 / incoming.dot(normals.geometric);
        self.travel(at.hit.distance);
        self.origin_u -= incoming * (self.origin_u.dot(normals.geometric) * across);
        self.origin_v -= incoming * (self.origin_v.dot(normals.geometric) * across);
        let mixed = at.surface.interpolated_normal;
        let normal_u = curvature.change(self.origin_u, n, mixed, front);
        let normal_v = curvature.change(self.origin_v, n, mixed, front);
        let cos_u = -self.along_u.dot(n) - incoming.dot(normal_u);
        let cos_v = -self.along_v.dot(n) - incoming.dot(normal_v);
        self.along_u = self.along_u * scale + n * (slope * cos_u) + normal_u * bend;
        self.along_v = self.along_v * scale + n * (slope * cos_v) + normal_v * bend;
        let direction = normalize(incoming * scale + n * bend);
        self.ray = at.leave(features, direction, front != is_reflected);
        if features.has::<MEDIA>() && !is_reflected {
            self.media = self.media.cross(at.material.medium, front);
        }
        self.bends += 1;
        self.segments += 1;
        // Walks without a mirror find what is reflected totally.
        cos > 0.0 && (direction.dot(normals.geometric) > 0.0) == is_reflected && !(is_total && is_mirror)
    }

    /// Passes a surface straight, unless no light is left. Returns false where the tube ends.
    #[inline(always)]
    fn pass<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        at: &Vertex,
        max_segments: u32,
    ) -> bool {
        let opacity = at.opacity(features);
        let mut through = Vec3::splat(1.0 - opacity);
        if features.has::<PANES>() && is_pane(features, &at.material) {
            self.segments += 1;
            if self.segments <= max_segments {
                through += at.straight_transmittance(features, params) * opacity;
            }
        }
        self.passed *= through;
        self.passes += 1;
        self.travel(at.hit.distance);
        self.ray = at.pass();
        if features.has::<MEDIA>() {
            self.media = self.media.cross(at.material.medium, at.is_front());
        }
        max_component(self.passed) > 0.0 && self.passes <= MAX_PASSES
    }

    /// Returns the arrival of a tube that started along `direction`, after `rays`. A light with a
    /// position is closest at the distance `reach`.
    #[inline(always)]
    fn arrive(&self, light: &Light, direction: Vec3, reach: f32, rays: u32) -> Arrival {
        let (u, v) = basis(direction);
        let Self { ray, passed, along_u, along_v, .. } = *self;
        let (x, y) = basis(ray.direction);
        let (mut miss, mut by_u, mut by_v) = (light.position - ray.direction, along_u, along_v);
        if light.kind != DIRECTIONAL {
            miss = light.position - ray.origin - ray.direction * reach;
            (by_u, by_v) = (self.origin_u + along_u * reach, self.origin_v + along_v * reach);
        }
        let (ux, uy, vx, vy) = (by_u.dot(x), by_u.dot(y), by_v.dot(x), by_v.dot(y));
        let (mx, my) = (miss.dot(x), miss.dot(y));
        let determinant = ux * vy - vx * uy;
        let step = u * (mx * vy - my * vx) + v * (my * ux - mx * uy);
        Arrival {
            passed,
            rays,
            direction: ray.direction,
            miss2: miss.dot(miss),
            step: step * (1.0 / determinant),
            spread: determinant.abs(),
            arrived: determinant.abs() > f32::MIN_POSITIVE,
        }
    }
}

/// Follows a tube from a vertex towards the light, along `direction`. The glass `piece` must be the
/// first that bends it, unless `any_piece`. The bend with the number `mirror` is a reflection below
/// the critical angle; a tube with fewer bends does not arrive.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel).
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one tube; see buffer")]
pub(super) unsafe fn follow<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    from: &Vertex,
    piece: &Piece,
    light: &Light,
    direction: Vec3,
    any_piece: bool,
    mirror: u32,
    max_segments: u32,
) -> Arrival {
    let least_bends = if mirror == NO_MIRROR { 1 } else { mirror + 1 };
    let inside = direction.dot(from.surface.normal) < 0.0;
    let (along_u, along_v) = basis(direction);
    let mut tube = Tube {
        ray: from.leave(features, direction, inside),
        origin_u: Vec3::ZERO,
        bends: 0,
        origin_v: Vec3::ZERO,
        segments: 1,
        along_u,
        passes: 0,
        along_v,
        media: MediumStack::EMPTY,
        passed: Vec3::ONE,
    };
    if features.has::<MEDIA>() {
        tube.media = path.media_behind(from, from.is_front(), inside);
    }
    let (mut rays, mut reach, mut arrived, mut going) = (0, MISS, false, true);
    while going {
        let ray = tube.ray;
        // SAFETY: the caller's promise.
        let hit = unsafe { closest_hit(features, params, scene, ray, RayQuery::CLOSEST) };
        rays += 1;
        going = false;
        // Before that many bends the tube may pass the light.
        let is_last = tube.bends >= least_bends;
        if light.kind != DIRECTIONAL && is_last {
            reach = (light.position - ray.origin).dot(ray.direction);
        }
        if features.has::<MEDIA>() {
            let block = blocks::refracted(path.segment, FIRST_FLIGHT | rays & 0x1f);
            let distance = min(hit.distance, reach);
            // SAFETY: the caller's promise.
            tube.passed *=
                unsafe { path.transmittance(features, params, scene, tube.media, ray, distance, block) };
        }
        if hit.primitive == NO_PRIMITIVE || hit.distance >= reach {
            arrived = is_last && reach > 0.0;
        } else {
            // SAFETY: a primitive was hit; the caller's promise.
            let at = unsafe { Vertex::at(features, params, scene, ray, hit, slots::PASSING) };
            let is_part = any_piece || tube.bends > 0 || piece.has(hit.named(features, params));
            let has_hole = features.has::<HOLES>() && at.material.flags & (MASKED | BLENDED) != 0;
            if at.material.kind != DIELECTRIC || has_hole {
                going = tube.pass(features, params, &at, max_segments);
            } else if is_part && tube.bends < MAX_BENDS && tube.segments < max_segments {
                // SAFETY: the caller's promise.
                going = unsafe { tube.bend(features, params, scene, &at, mirror) };
            }
        }
    }
    let mut arrival = Arrival { rays, ..Arrival::NONE };
    if arrived {
        arrival = tube.arrive(light, direction, reach, rays);
    }
    arrival
}
