//! Spheres: record, numerically robust intersection, and projection of a hit onto the surface.

use crate::math::sqrt;
use crate::ray::OriginPrimitive;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Distance of a ray that misses: `f32::MAX`, so every hit that counts is closer.
pub const MISS: f32 = f32::MAX;

/// Sphere. 32 bytes; traversal reads the first row only.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Sphere {
    /// Centre, in scene units.
    pub center: Vec3,
    /// Radius in scene units, positive and finite.
    pub radius: f32,
    /// Index into the scene's materials.
    pub material: u32,
    /// Unused.
    pub pad: [u32; 3],
}

const _: () = assert!(size_of::<Sphere>() == 32 && align_of::<Sphere>() == 16);

impl Sphere {
    /// Returns the distance along the unit `direction` to the closest hit in front of `origin`, or
    /// [`MISS`].
    ///
    /// Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection"
    /// (Ray Tracing Gems, ch. 7): the discriminant comes from the distance of the centre to the
    /// line, so that remote spheres are not lost, and the roots c/q and q do not cancel. An origin
    /// on the surface of another sphere counts as inside it. A sphere that the ray starts on
    /// (`is_origin`) is hit at its far side only, and only if the ray goes inside.
    #[inline(always)]
    pub fn distance(
        &self,
        origin: Vec3,
        direction: Vec3,
        is_origin: bool,
        origin_primitive: OriginPrimitive,
    ) -> f32 {
        let from_center = origin - self.center;
        let b = -from_center.dot(direction);
        let offset = from_center + direction * b; // from the centre to the line
        let discriminant = self.radius * self.radius - offset.dot(offset);
        if discriminant < 0.0 {
            return MISS;
        }
        let root = sqrt(discriminant);
        let c = from_center.dot(from_center) - self.radius * self.radius;
        let inside = (is_origin & origin_primitive.goes_inside()) | (!is_origin & (c <= 0.0));
        let q = if b >= 0.0 { b + root } else { b - root };
        // From inside: the far root, q / 1 or c / q by the sign of b. From outside: the near root,
        // c / q, negative if behind. All lanes of a warp compute the quotient.
        let far = inside & (b >= 0.0);
        let near = c * (1.0 / q);
        let t = if far { q } else { near };
        let leaves = is_origin & (!inside | (b <= 0.0));
        if (t > 0.0) & !leaves { t } else { MISS }
    }

    /// Returns the outward unit normal at `point`, which lies near the surface, and the surface
    /// point there.
    ///
    /// A point at distance `t` along a ray has an error that grows with the distance; the error of
    /// its projection grows only with the sphere's radius and position (pbrt 4th ed., section
    /// 6.8.4). If rounding puts `point` at the centre (a sphere below the resolution of its
    /// position), the normal points against `direction`, the unit direction of the ray.
    #[inline(always)]
    pub fn project(&self, point: Vec3, direction: Vec3) -> (Vec3, Vec3) {
        let from_center = point - self.center;
        let square = from_center.dot(from_center);
        let normal = if square > 0.0 { from_center * (1.0 / sqrt(square)) } else { -direction };
        (normal, self.center + normal * self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(center: Vec3, radius: f32) -> Sphere {
        Sphere { center, radius, material: 0, pad: [0; 3] }
    }

    fn free(s: &Sphere, origin: Vec3, direction: Vec3) -> f32 {
        s.distance(origin, direction, false, OriginPrimitive::NONE)
    }

    #[test]
    fn near_far_behind_and_beside() {
        let s = sphere(Vec3::ZERO, 1.0);
        assert_eq!(free(&s, Vec3::new(0.0, 0.0, 3.0), Vec3::NEG_Z), 2.0);
        assert_eq!(free(&s, Vec3::ZERO, Vec3::NEG_Z), 1.0);
        assert_eq!(free(&s, Vec3::new(0.0, 0.0, 0.5), Vec3::Z), 0.5);
        assert_eq!(free(&s, Vec3::new(0.0, 0.0, 0.5), Vec3::NEG_Z), 1.5);
        assert_eq!(free(&s, Vec3::new(0.0, 0.0, 3.0), Vec3::Z), MISS);
        assert_eq!(free(&s, Vec3::new(0.0, 1.5, 3.0), Vec3::NEG_Z), MISS);
    }

    #[test]
    fn departing_rays() {
        let s = sphere(Vec3::new(5.0, 0.0, 0.0), 0.25);
        let point = Vec3::new(5.25, 0.0, 0.0);
        let at = |direction, inside| s.distance(point, direction, true, OriginPrimitive::new(0, inside));
        assert_eq!(at(Vec3::X, false), MISS);
        assert_eq!(at(Vec3::Y, false), MISS);
        assert_eq!(at(Vec3::NEG_X, true), 0.5);
        assert_eq!(at(Vec3::X, true), MISS); // rounding put a grazing ray outside: it leaves
    }

    /// Torture test 11: spheres far away. Negative control: the naive discriminant b² - c misses
    /// some.
    #[test]
    fn remote_spheres_are_hit() {
        let mut missed_by_naive = 0;
        for distance in [1e2f32, 1e3, 1e4, 1e5] {
            for i in 0..1000u32 {
                let w = crate::rng::PathKey { seed: 0, pixel: i, sample: 0 }.words(0);
                let axis = crate::math::unit_sphere(w.x, w.y);
                let side = crate::math::normalize(axis.cross(Vec3::new(0.36, 0.48, 0.8)));
                let height = 0.995 * crate::math::unit_f32(w.z);
                let s = sphere(axis * distance + side * height, 1.0);
                let t = free(&s, Vec3::ZERO, axis);
                // True distance for these f32 inputs: the axis is a unit vector within rounding
                // only.
                let (c, a) = (s.center.as_dvec3(), axis.as_dvec3());
                let (b, aa) = (c.dot(a), a.dot(a));
                let offset = (c - a * (b / aa)).length_squared();
                let want = b / aa - ((1.0 - offset) / aa).sqrt();
                let ulp = f64::from(f32::EPSILON) * f64::from(distance);
                assert!((f64::from(t) - want).abs() <= 16.0 * ulp, "{distance} {height}: {t} for {want}");
                let b = s.center.dot(axis);
                missed_by_naive += u32::from(b * b - (s.center.dot(s.center) - 1.0) < 0.0);
            }
        }
        assert!(missed_by_naive > 0, "the test does not reach the naive form's failure");
    }

    /// Torture test 12: no ray finds the surface that it leaves, at any scale; one that goes in
    /// hits the far side.
    #[test]
    fn no_self_intersection_at_any_scale() {
        for i in 0..20_000u32 {
            let w = crate::rng::PathKey { seed: 1, pixel: i, sample: 0 }.words(0);
            let unit = |bits| f64::from(crate::math::unit_f32(bits));
            let radius = libm::pow(10.0, 8.0 * unit(w.x) - 4.0) as f32;
            let far = libm::pow(10.0, 16.0 * unit(w.y) - 8.0) as f32;
            let s = sphere(Vec3::new(far, -0.5 * far, 0.25 * far), radius);
            let (normal, point) = s.project(s.center + crate::math::unit_sphere(w.z, w.w) * radius, Vec3::X);
            let v = crate::rng::PathKey { seed: 2, pixel: i, sample: 0 }.words(0);
            let direction = crate::math::normalize(normal + crate::math::unit_sphere(v.x, v.y));
            assert_eq!(s.distance(point, direction, true, OriginPrimitive::new(0, false)), MISS);
            let through = s.distance(point, -direction, true, OriginPrimitive::new(0, true));
            assert!(through == MISS || through <= 2.01 * radius + far * 1e-6, "{through} {radius} {far}");
        }
    }

    #[test]
    fn projection_is_on_the_surface() {
        let s = sphere(Vec3::new(1.0, 2.0, 3.0), 0.5);
        let (normal, point) = s.project(Vec3::new(1.0, 2.0, 3.6), Vec3::X);
        assert_eq!((normal, point), (Vec3::Z, Vec3::new(1.0, 2.0, 3.5)));
        // Radius far below the resolution of its position: no NaN.
        let s = sphere(Vec3::splat(1e6), 1e-9);
        assert_eq!(s.project(s.center, Vec3::X), (Vec3::NEG_X, s.center));
    }
}
