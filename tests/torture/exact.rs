//! Intersections of rays with primitives by double precision, with their margins.

use glam::{DVec3, Vec3};
use trisect_shared::planar::{DISC, Planar};
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::Triangle;

/// Intersection by double precision.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Distance in lengths of the direction; infinite for a miss.
    pub distance: f64,
    /// Smallest move of the ray, perpendicular to it, that turns a hit into a miss or a miss into a
    /// hit; approximate, in scene units.
    pub margin: f64,
}

/// Intersects a sphere: at the near root from outside, at the far root from inside.
pub fn sphere(sphere: &Sphere, origin: Vec3, direction: Vec3) -> Meeting {
    let (f, d) = (origin.as_dvec3() - sphere.center.as_dvec3(), direction.as_dvec3());
    let radius = f64::from(sphere.radius);
    let square = d.length_squared();
    let b = -f.dot(d) / square;
    let impact = (f + d * b).length();
    let half = ((radius - impact) * (radius + impact) / square).sqrt(); // NaN beside it
    let distance = if f.length() <= radius { b + half } else { b - half };
    let surface = (f.length() - radius).abs();
    let margin = (radius - impact).abs().min(surface);
    Meeting { distance: if distance > 0.0 { distance } else { f64::INFINITY }, margin }
}

/// Returns the signed distance from the coordinate origin to the line through `from` along `edge`,
/// seen along `direction`.
fn beside(from: DVec3, edge: DVec3, direction: DVec3) -> f64 {
    let across = edge.cross(direction);
    if across.length_squared() > 0.0 { from.dot(across.normalize()) } else { 0.0 }
}

/// Intersects a parallelogram or a disc.
pub fn flat(flat: &Planar, origin: Vec3, direction: Vec3) -> Meeting {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let (corner, u, v) = (flat.origin.as_dvec3() - o, flat.edge_u.as_dvec3(), flat.edge_v.as_dvec3());
    let cross = u.cross(v);
    let normal = cross.normalize();
    let (height, approach) = (corner.dot(normal), d.dot(normal));
    let distance = height / approach;
    let at = d * distance - corner;
    let square = cross.length_squared();
    let (x, y) = (at.dot(v.cross(cross)) / square, at.dot(cross.cross(u)) / square);
    let (inside, border) = if flat.kind == DISC {
        let far = x.hypot(y);
        (far <= 1.0, (far - 1.0).abs() * u.length() * approach.abs())
    } else {
        let sides = [(corner, u), (corner, v), (corner + u, v), (corner + v, u)];
        let nearest =
            sides.map(|(from, edge)| beside(from, edge, d).abs()).into_iter().fold(f64::MAX, f64::min);
        ((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y), nearest)
    };
    let margin = if border.is_nan() { 0.0 } else { border.min(height.abs()) };
    Meeting { distance: if inside && distance > 0.0 { distance } else { f64::INFINITY }, margin }
}

/// Intersects a triangle, from either side.
pub fn triangle(t: &Triangle, origin: Vec3, direction: Vec3) -> Meeting {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let [a, b, c] = [t.a, t.b, t.c].map(|v| v.as_dvec3() - o);
    let normal = (b - a).cross(c - a);
    let (height, approach) = (a.dot(normal), d.dot(normal));
    let sides = [beside(a, b - a, d), beside(b, c - b, d), beside(c, a - c, d)];
    let inside = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
    let nearest = sides.iter().fold(f64::MAX, |least, s| s.abs().min(least));
    let margin = nearest.min((height / normal.length()).abs());
    let distance = height / approach;
    let margin = if margin.is_nan() { 0.0 } else { margin };
    Meeting { distance: if inside && distance > 0.0 { distance } else { f64::INFINITY }, margin }
}

#[test]
fn margins() {
    use bytemuck::Zeroable;
    let s = Sphere { center: Vec3::ZERO, radius: 1.0, material: 0, pad: [0; 3] };
    let m = sphere(&s, Vec3::new(0.0, 0.75, 4.0), Vec3::NEG_Z);
    assert!((m.distance - (4.0 - 0.4375f64.sqrt())).abs() < 1e-12 && m.margin == 0.25, "{m:?}");
    let (edge_u, edge_v) = (Vec3::X, Vec3::Y * 2.0);
    let q = Planar { edge_u, edge_v, ..Planar::zeroed() };
    let m = flat(&q, Vec3::new(0.75, 1.0, 4.0), Vec3::NEG_Z);
    assert_eq!((m.distance, m.margin), (4.0, 0.25));
    let m = flat(&Planar { kind: DISC, ..q }, Vec3::new(1.25, 0.0, 4.0), Vec3::NEG_Z);
    assert_eq!((m.distance, m.margin), (f64::INFINITY, 0.25));
    let t = Triangle::of([Vec3::ZERO, edge_u, edge_v]);
    let m = triangle(&t, Vec3::new(0.125, 0.5, -4.0), Vec3::Z);
    assert_eq!((m.distance, m.margin), (4.0, 0.125));
    let m = triangle(&t, Vec3::new(-0.125, 0.5, 4.0), Vec3::NEG_Z);
    assert_eq!((m.distance, m.margin), (f64::INFINITY, 0.125));
}
