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
use crate::math::{basis, max, max_component, min, normalize, sqrt};
use crate::medium::MediumStack;
use crate::params::RenderParams;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::traversal::closest_hit;
use glam::Vec3;

/// Maximum number of surfaces that refract a connection, or reflect it totally.
pub const MAX_BENDS: u32 = 4;

/// Number of the first [block](blocks::refracted) for flights through media, after those of walks.
const FIRST_FLIGHT: u32 = 0x60;

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

/// Follows a tube from a vertex towards the light, along `direction`. The glass `piece` must be the
/// first that bends it, unless `any_piece`.
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
    max_segments: u32,
) -> Arrival {
    let (u, v) = basis(direction);
    let inside = direction.dot(from.surface.normal) < 0.0;
    let mut ray = from.leave(features, direction, inside);
    let (mut origin_u, mut origin_v, mut along_u, mut along_v) = (Vec3::ZERO, Vec3::ZERO, u, v);
    let (mut passed, mut rays, mut passes) = (Vec3::ONE, 0, 0);
    let (mut bends, mut segments) = (0, 1);
    let (mut reach, mut arrived, mut going) = (MISS, false, true);
    let mut media = MediumStack::EMPTY;
    if features.has::<MEDIA>() {
        media = path.media_behind(from, from.is_front(), inside);
    }
    while going {
        // SAFETY: the caller's promise.
        let hit = unsafe { closest_hit(features, params, scene, ray, RayQuery::CLOSEST) };
        rays += 1;
        going = false;
        if light.kind != DIRECTIONAL {
            reach = (light.position - ray.origin).dot(ray.direction);
        }
        if features.has::<MEDIA>() {
            let block = blocks::refracted(path.segment, FIRST_FLIGHT | rays & 0x1f);
            // SAFETY: the caller's promise.
            passed *= unsafe {
                path.transmittance(features, params, scene, media, ray, min(hit.distance, reach), block)
            };
        }
        if hit.primitive == NO_PRIMITIVE || hit.distance >= reach {
            arrived = bends > 0 && reach > 0.0;
        } else {
            // SAFETY: a primitive was hit; the caller's promise.
            let at = unsafe { Vertex::at(features, params, scene, ray, hit, slots::PASSING) };
            let is_part = any_piece || bends > 0 || piece.has(hit.named(features, params));
            let has_hole = features.has::<HOLES>() && at.material.flags & (MASKED | BLENDED) != 0;
            if at.material.kind == DIELECTRIC && !has_hole {
                let front = at.is_front();
                let normals = at.facing_normals(features, params, front);
                let (n, cos) = (normals.of_bsdf.shading, -ray.direction.dot(normals.of_bsdf.shading));
                let eta = if front { 1.0 / at.material.ior } else { at.material.ior };
                let cos2 = fresnel::refracted_cos2(cos, eta);
                let is_total = cos2 <= 0.0;
                if is_part && cos > 0.0 && bends < MAX_BENDS && segments < max_segments {
                    let refracted = sqrt(max(cos2, 0.0));
                    let reflectance = if features.has::<SCHLICK>() {
                        fresnel::schlick(cos, eta)
                    } else {
                        fresnel::dielectric(cos, refracted, eta)
                    };
                    passed *= if is_total { 1.0 } else { 1.0 - reflectance };
                    // SAFETY: as above.
                    let curvature = unsafe { Curvature::at(features, params, scene, hit, &at.surface) };
                    // The ray becomes `scale` times itself plus `bend` times the normal.
                    let (mut scale, mut bend, mut slope) = (1.0, 2.0 * cos, 2.0);
                    if !is_total {
                        (scale, bend) = (eta, eta * cos - refracted);
                        slope = eta - eta * eta * cos * (1.0 / refracted);
                    }
                    // Positions on the tangent plane, then directions.
                    let across = 1.0 / ray.direction.dot(normals.geometric);
                    origin_u += along_u * hit.distance;
                    origin_v += along_v * hit.distance;
                    origin_u -= ray.direction * (origin_u.dot(normals.geometric) * across);
                    origin_v -= ray.direction * (origin_v.dot(normals.geometric) * across);
                    let mixed = at.surface.interpolated_normal;
                    let normal_u = curvature.change(origin_u, n, mixed, front);
                    let normal_v = curvature.change(origin_v, n, mixed, front);
                    let cos_u = -along_u.dot(n) - ray.direction.dot(normal_u);
                    let cos_v = -along_v.dot(n) - ray.direction.dot(normal_v);
                    along_u = along_u * scale + n * (slope * cos_u) + normal_u * bend;
                    along_v = along_v * scale + n * (slope * cos_v) + normal_v * bend;
                    let direction = normalize(ray.direction * scale + n * bend);
                    going = (direction.dot(normals.geometric) > 0.0) == is_total;
                    ray = at.leave(features, direction, front != is_total);
                    if features.has::<MEDIA>() && !is_total {
                        media = media.cross(at.material.medium, front);
                    }
                    bends += 1;
                    segments += 1;
                }
            } else {
                let opacity = at.opacity(features);
                let mut through = Vec3::splat(1.0 - opacity);
                if features.has::<PANES>() && is_pane(features, &at.material) {
                    segments += 1;
                    if segments <= max_segments {
                        through += at.straight_transmittance(features, params) * opacity;
                    }
                }
                passed *= through;
                passes += 1;
                origin_u += along_u * hit.distance;
                origin_v += along_v * hit.distance;
                going = max_component(passed) > 0.0 && passes <= MAX_PASSES;
                ray = at.pass();
                if features.has::<MEDIA>() {
                    media = media.cross(at.material.medium, at.is_front());
                }
            }
        }
    }
    let mut arrival = Arrival { passed, rays, direction: ray.direction, arrived, ..Arrival::NONE };
    if arrived {
        let (x, y) = basis(ray.direction);
        let (mut miss, mut by_u, mut by_v) = (light.position - ray.direction, along_u, along_v);
        if light.kind != DIRECTIONAL {
            miss = light.position - ray.origin - ray.direction * reach;
            (by_u, by_v) = (origin_u + along_u * reach, origin_v + along_v * reach);
        }
        let (ux, uy, vx, vy) = (by_u.dot(x), by_u.dot(y), by_v.dot(x), by_v.dot(y));
        let (mx, my) = (miss.dot(x), miss.dot(y));
        let determinant = ux * vy - vx * uy;
        arrival.miss2 = miss.dot(miss);
        arrival.spread = determinant.abs();
        arrival.arrived = arrival.spread > f32::MIN_POSITIVE;
        let inverse = 1.0 / determinant;
        arrival.step = (u * (mx * vy - my * vx) + v * (my * ux - mx * uy)) * inverse;
    }
    arrival
}
