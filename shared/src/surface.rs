//! Surface at a hit: position, normals, texture coordinates; and how a ray leaves it. Called by
//! paths.

use crate::attributes::{SurfaceAttributes, TriangleVertices};
use crate::buffer::load_record;
use crate::bvh::Hit;
use crate::features::{ATTRIBUTES, FeatureSet, Features, NORMAL_MAPS, SMOOTH, TEXTURES};
use crate::instance::{self, InstanceEntry, linear, offset, transposed};
use crate::math::{atan2_turns, min, normalize, sqrt};
use crate::params::RenderParams;
use crate::planar::Planar;
use crate::primitive::{is_planar, is_triangle};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::smooth_surface;
use crate::sphere::Sphere;
use crate::triangle::{Shear, Triangle};
use glam::Vec3;

/// Point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position on the surface, within rounding.
    pub point: Vec3,
    /// Geometric unit normal of the surface, towards its outside.
    pub normal: Vec3,
    /// Unit normal for shading, on the side of `normal`: interpolated on a smooth mesh.
    pub shading_normal: Vec3,
    /// Bound of the distance of `point` from the surface, along `normal`; 0 if the primitive's
    /// number is enough to avoid hitting it again.
    pub error_bound: f32,
    /// Height, above a triangle on the viewer's side, of the [smooth
    /// surface](crate::smooth_surface) that the triangle stands for; 0 for other primitives, and
    /// unless the kernel has [`SMOOTH`].
    pub smooth_height: f32,
    /// Texture coordinate u; 0 unless the kernel has textures.
    pub u: f32,
    /// Texture coordinate v; 0 unless the kernel has textures.
    pub v: f32,
    /// Interpolated normal of a smooth mesh, not of unit length: that of the tangent space.
    pub interpolated_normal: Vec3,
    /// Further attributes; none unless the kernel has [`NORMAL_MAPS`] or [`ATTRIBUTES`].
    pub attributes: SurfaceAttributes,
    /// Index into the scene's materials.
    pub material: u32,
}

/// Error bound of a point that is a sum of three products, relative to the coordinates that it came
/// from: 10 roundings. (Pharr et al., "Physically Based Rendering", 4th ed., section 6.8.5, count
/// 7, without the weights of this interpolation.)
const ROUNDING: f32 = 10.0 * 0.5 * f32::EPSILON;

/// Returns the origin of a ray that leaves a planar shape or triangle at `point`: offset by the
/// point's error bound, so that the ray does not hit a neighbour of the primitive that rounding
/// puts on the wrong side of the point. The offset is relative to the coordinates: there is no
/// absolute epsilon.
#[inline(always)]
pub fn offset_ray_origin(point: Vec3, normal: Vec3, error: f32, outside: bool) -> Vec3 {
    point + normal * (if outside { error } else { -error })
}

/// Returns the surface at the hit of `ray`.
///
/// # Safety
///
/// The scene's indices were proven as [`crate::buffer`] says, and `hit` comes from its traversal.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn at<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    hit: Hit,
) -> Surface {
    let index = hit.primitive;
    if is_triangle(features, params, index) {
        // SAFETY: the caller's promise.
        return unsafe { on_triangle(features, params, scene, ray, hit) };
    }
    if is_planar(features, params, index) {
        // SAFETY: the caller's promise.
        let planar = unsafe { load_record::<Planar>(scene.planars, index - params.first_planar) };
        let (u, v) = planar.coordinates(ray.origin + ray.direction * hit.distance);
        let (along_u, along_v) = (planar.edge_u * u, planar.edge_v * v);
        let size = planar.origin.abs() + along_u.abs() + along_v.abs();
        let disc = planar.kind == crate::planar::DISC;
        return Surface {
            point: planar.origin + along_u + along_v,
            normal: planar.normal,
            shading_normal: planar.normal,
            error_bound: size.dot(planar.normal.abs()) * ROUNDING,
            smooth_height: 0.0,
            u: if disc { 0.5 + 0.5 * u } else { u },
            v: if disc { 0.5 - 0.5 * v } else { 1.0 - v }, // an image's top row is its first
            interpolated_normal: planar.normal,
            attributes: SurfaceAttributes::NONE,
            material: planar.material,
        };
    }
    // SAFETY: the caller's promise.
    let sphere = unsafe { load_record::<Sphere>(scene.spheres, index) };
    let (normal, point) = sphere.project(ray.origin + ray.direction * hit.distance, ray.direction);
    let (mut u, mut v) = (0.0, 0.0);
    if features.has::<TEXTURES>() {
        // u runs from -x by +z, +x and -z; v from the top down (Shirley et al., "Ray Tracing: The
        // Next Week", section 4.4).
        u = 0.5 + atan2_turns(-normal.z, normal.x);
        v = 2.0 * atan2_turns(sqrt(normal.x * normal.x + normal.z * normal.z), normal.y);
    }
    Surface {
        point,
        normal,
        shading_normal: normal,
        error_bound: 0.0,
        smooth_height: 0.0,
        u,
        v,
        interpolated_normal: normal,
        attributes: SurfaceAttributes::NONE,
        material: sphere.material,
    }
}

/// Returns the surface at a hit of a triangle, in the world or in an instance.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn on_triangle<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    hit: Hit,
) -> Surface {
    let is_placed = hit.is_in_instance(features);
    let mut local = ray;
    if is_placed {
        // SAFETY: the caller's promise.
        local = unsafe { instance::entry(params, scene, hit.instance) }.enter(ray, hit.instance);
    }
    // SAFETY: the caller's promise.
    let (mut surface, size) =
        unsafe { triangle(features, scene, local, hit.primitive - params.first_triangle) };
    if is_placed {
        // SAFETY: the caller's promise.
        surface = unsafe { placed(params, scene, hit.instance, surface, size) };
    }
    surface
}

/// Returns the surface at a hit of a triangle, and a bound of the sizes of the products that its
/// point is a sum of.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn triangle<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    scene: Scene,
    ray: Ray,
    index: u32,
) -> (Surface, Vec3) {
    // SAFETY: the caller's promise.
    let triangle = unsafe { load_record::<Triangle>(scene.triangles, index) };
    // SAFETY: the caller's promise.
    let vertices = unsafe { TriangleVertices::load(scene.vertices, &triangle) };
    // Intersected again: cheaper than carrying the weights through the traversal.
    let hit = triangle.hit(ray.origin, &Shear::new(ray.direction));
    let (b, c) = (hit.weight_b, hit.weight_c);
    let a = 1.0 - b - c;
    let (part_a, part_b, part_c) = (triangle.a * a, triangle.b * b, triangle.c * c);
    let size = part_a.abs() + part_b.abs() + part_c.abs();
    let normal = normalize(triangle.normal());
    let (mut u, mut v) = (0.0, 0.0);
    if features.has::<TEXTURES>() {
        (u, v) = vertices.uv(a, b, c);
    }
    let mut attributes = SurfaceAttributes::NONE;
    if features.has::<{ NORMAL_MAPS | ATTRIBUTES }>() && vertices.have_attributes() {
        // SAFETY: the caller's promise.
        attributes = unsafe { vertices.attributes(scene.vertices, a, b, c) };
    }
    let point = part_a + part_b + part_c;
    let error_bound = size.dot(normal.abs()) * ROUNDING;
    let (mut interpolated_normal, mut smooth, mut height) = (normal, normal, 0.0);
    if features.has::<SMOOTH>() {
        let mixed = vertices.normal(a, b, c);
        let square = mixed.dot(mixed);
        // Otherwise the triangle is flat, or its normals cancel.
        if square > 1e-8 {
            (interpolated_normal, smooth) = (mixed, mixed * (1.0 / sqrt(square)));
            let facing = if ray.direction.dot(normal) < 0.0 { normal } else { -normal };
            height = smooth_surface::height(&triangle, &vertices, point, facing, (a, b, c));
        }
    }
    let surface = Surface {
        point,
        normal,
        shading_normal: if smooth.dot(normal) < 0.0 { -smooth } else { smooth },
        error_bound,
        // A lower one may be rounding.
        smooth_height: if height > 8.0 * error_bound { height } else { 0.0 },
        u,
        v,
        interpolated_normal,
        attributes,
        material: vertices.a.material,
    };
    (surface, size)
}

/// Returns in the world what [`triangle`] found in the coordinates of a mesh;
/// `size` bounds the sizes of the products that the point is a sum of.
///
/// The error bound along the world's normal covers the point's rounding, that of its way into the
/// world, and that of a ray's way back from there: 10 roundings of each sum of products. All are
/// measured in the mesh's coordinates, along its normal n; a step δ along the world's normal is a
/// step |Rᵀn| δ there, where R maps the world to the mesh.
///
/// # Safety
///
/// As [`instance::entry`], for instance `number`.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn placed(params: &RenderParams, scene: Scene, number: u32, surface: Surface, size: Vec3) -> Surface {
    // SAFETY: the caller's promise.
    let (entry, to) = unsafe { instance::records(params, scene, number) };
    let InstanceEntry { x, y, z, .. } = entry;
    let (to_x, to_y, to_z) = (to.x, to.y, to.z);
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let reach = linear(to_x.abs(), to_y.abs(), to_z.abs(), size) + offset(to_x, to_y, to_z).abs();
    let error = size + linear(ax, ay, az, reach) + offset(ax, ay, az);
    let turned = transposed(x, y, z, surface.normal);
    let inverse_length = 1.0 / sqrt(turned.dot(turned));
    let normal = turned * inverse_length;
    let smooth = transposed(x, y, z, surface.shading_normal);
    let smooth = smooth * (1.0 / sqrt(smooth.dot(smooth)));
    // The tangent space is of vectors that are interpolated and not made units again.
    let along = transposed(x, y, z, surface.interpolated_normal);
    let along = along * kept_length(surface.interpolated_normal, along);
    let mut attributes = surface.attributes;
    let tangent = linear(to_x, to_y, to_z, attributes.tangent);
    attributes.tangent = tangent * kept_length(attributes.tangent, tangent);
    attributes.handedness *= to.handedness;
    Surface {
        point: linear(to_x, to_y, to_z, surface.point) + offset(to_x, to_y, to_z),
        normal,
        shading_normal: if smooth.dot(normal) < 0.0 { -smooth } else { smooth },
        error_bound: surface.normal.abs().dot(error) * inverse_length * ROUNDING,
        smooth_height: surface.smooth_height * inverse_length,
        interpolated_normal: along,
        attributes,
        ..surface
    }
}

/// Returns the factor that gives `to` the length of `from`; 1 where there is no length.
#[inline(always)]
fn kept_length(from: Vec3, to: Vec3) -> f32 {
    let (wanted, given) = (from.dot(from), to.dot(to));
    if wanted > 0.0 && given > 0.0 { sqrt(wanted) * (1.0 / sqrt(given)) } else { 1.0 }
}

/// Returns the unit normal that a normal map gives: `mapped` in the tangent space of the surface,
/// which is that of MikkTSpace (Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008):
/// normal and tangent are interpolated and not made units again. It lies at least
/// [`MIN_REFLECTED_COSINE`] above the surface. Without tangents, and where the map has no
/// direction, it is the shading normal.
#[inline(always)]
pub fn mapped_normal(surface: &Surface, mapped: Vec3) -> Vec3 {
    let SurfaceAttributes { tangent, handedness, .. } = surface.attributes;
    let along = surface.interpolated_normal;
    let bitangent = along.cross(tangent) * handedness;
    let mixed = tangent * mapped.x + bitangent * mapped.y + along * mapped.z;
    let square = mixed.dot(mixed);
    // Comparisons with NaN are false.
    if !(square > 1e-12 && square < 1e12 && tangent.dot(tangent) > 0.0) {
        return surface.shading_normal;
    }
    let normal = mixed * (1.0 / sqrt(square));
    let lift = MIN_REFLECTED_COSINE - normal.dot(surface.normal);
    if lift > 0.0 { normalize(normal + surface.normal * lift) } else { normal }
}

/// Returns the shading normal, bent towards the surface's own `normal` where the view direction
/// mirrored about it would enter the surface. Unbent, a mirror would be black there, as coarse
/// smooth meshes are at silhouettes. All are unit vectors, `viewer` and `shading` on the side of
/// `normal`.
///
/// The mirrored direction is lifted to a cosine c with the surface's normal of
/// [`MIN_REFLECTED_COSINE`], or of 0.9 times the viewer's if that is less; the bent normal lies
/// along the sum of that direction and the viewer's. The lifted direction's length is at most
/// sqrt(1 + c²), so the view direction mirrored about the bent normal has a cosine of at least
/// c / 2, and the viewer sees the front of the shading normal.
#[inline(always)]
pub fn bend_shading_normal(shading: Vec3, normal: Vec3, viewer: Vec3) -> Vec3 {
    let (facing, up) = (2.0 * shading.dot(viewer), viewer.dot(normal));
    // Distance to lift the mirrored direction; never 0 at the horizon, where no normal would be
    // left.
    let lift = min(0.9 * up, MIN_REFLECTED_COSINE) + 1e-7 + up - facing * shading.dot(normal);
    if lift > 0.0 { normalize(shading * facing + normal * lift) } else { shading }
}

/// Minimum cosine of a mirrored direction with the surface's own normal: about 0.6 degrees from the
/// horizon.
pub const MIN_REFLECTED_COSINE: f32 = 0.01;
