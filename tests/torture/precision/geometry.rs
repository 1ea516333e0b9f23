//! Tests the limits `FarFromOrigin`, `TooSmall` and `NearSurface` of `trisect check`: measures the
//! rounding errors of hits in f32 against f64, and compares them with the predicted errors.

use super::{Random, agrees, described, found, grey, spread};
use glam::{DVec3, Vec3};
use trisect::precision::{Limit, ROUNDING};
use trisect::scene::{Rebase, Scene, SceneDocument};
use trisect_shared::planar::Planar;
use trisect_shared::ray::OriginPrimitive;
use trisect_shared::sphere::{MISS, Sphere};
use trisect_shared::triangle::Shear;

/// Returns the distance to a sphere in f64, from an `origin` outside it along a unit `direction`;
/// NaN for a miss.
fn exact(center: DVec3, radius: f64, origin: DVec3, direction: DVec3) -> f64 {
    let from = origin - center;
    let b = -from.dot(direction);
    let root = (radius * radius - (from + direction * b).length_squared()).sqrt();
    let c = from.length_squared() - radius * radius;
    c / if b >= 0.0 { b + root } else { b - root }
}

/// Returns a direction rounded to f32, and the unit vector in f64 along the rounded direction.
fn unit(direction: DVec3) -> (Vec3, DVec3) {
    let rounded = direction.as_vec3();
    (rounded, rounded.as_dvec3().normalize())
}

/// Returns the errors of hit distances on a sphere near `place`, in radii: root mean square and
/// maximum. Rays start 2 to 8 radii from the centre.
fn sphere_errors(place: DVec3, radius: f64) -> (f64, f64) {
    let mut random = Random(1);
    spread((0..2000).filter_map(|_| {
        let center = place + random.point() * radius;
        let origin = center + random.direction() * (radius * (2.0 + 6.0 * random.number()));
        let (rounded, direction) = unit((center + random.direction() * (0.7 * radius) - origin).normalize());
        let sphere = Sphere { center: center.as_vec3(), radius: radius as f32, material: 0, pad: [0; 3] };
        let distance = sphere.distance(origin.as_vec3(), rounded, false, OriginPrimitive::NONE);
        // A miss counts as an error of the whole size.
        let error = f64::from(distance) - exact(center, radius, origin, direction);
        let error = if distance == MISS { 1.0 } else { error / radius };
        error.is_finite().then_some(error)
    }))
}

#[test]
fn small_spheres_far_from_the_origin() {
    for radius in [1.0, 1e-3, 1e4] {
        for ratio in [1e3, 4e3, 6.4e4, 1e6, 4e6] {
            let x = ratio * radius;
            let scene =
                grey(&format!("Sphere(center: ({x}, {x}, -{x}), radius: {radius}, material: \"grey\")"));
            let (typical, greatest) = sphere_errors(DVec3::new(x, x, -x), radius);
            agrees(&scene, Limit::FarFromOrigin, typical).unwrap();
            // Below a quarter of the limit, the largest error is within the tolerance, too.
            assert!(ratio > 4096.0 || greatest < 1e-3, "{radius} {ratio}: {greatest:e}");
        }
    }
    // At coordinates of 2²⁴ radii, neighbours in f32 are two radii apart.
    let (typical, _) = sphere_errors(DVec3::splat(f64::from(1 << 24)), 1.0);
    assert!(typical > 0.5, "{typical}");
    // Another space moves it back.
    let mut scene = grey("Sphere(center: (1e6, 0, 0), radius: 1, material: \"grey\")");
    assert_eq!(found(&scene, Limit::FarFromOrigin).len(), 1);
    scene.space = Rebase { origin: DVec3::X * 1e6, scale: 1.0 };
    assert_eq!(found(&scene, Limit::FarFromOrigin).len(), 0);
}

/// Returns the root mean square error of hit distances on a flat shape far from the origin,
/// relative to its size. Rays in f32 hit it from above, from a height of 2 to 3 sizes.
fn flat_errors(
    far: f64,
    size: f64,
    document: impl Fn(DVec3, f64) -> SceneDocument,
    hit: impl Fn(&Scene, Vec3, Vec3) -> f32,
) -> f64 {
    let mut random = Random(2);
    let errors = (0..300).map(|_| {
        let place = DVec3::new(far, far, -far) * (1.0 + 0.1 * random.number());
        let scene = document(place, size).lower(Rebase::IDENTITY).unwrap();
        let height = (2.0 + random.number()) * size;
        let origin = place + DVec3::new(0.3 * size, height, 0.2 * size);
        let distance = f64::from(hit(&scene, origin.as_vec3(), Vec3::NEG_Y));
        (distance - height).abs().min(size) / size
    });
    spread(errors).0
}

#[test]
fn small_quads_far_from_the_origin() {
    let text = |p: DVec3, size: f64| {
        let p = (p.x, p.y, p.z);
        grey(&format!("Quad(corner: {p:?}, u: (0, 0, {size}), v: ({size}, 0, 0), material: \"grey\")"))
    };
    let hit = |scene: &Scene, origin, direction| Planar::distance(&scene.flats[0], origin, direction);
    for far in [1e3, 1e6] {
        let scene = text(DVec3::new(far, far, -far), 1.0);
        agrees(&scene, Limit::FarFromOrigin, flat_errors(far, 1.0, text, hit)).unwrap();
    }
}

fn triangle(p: DVec3, size: f64) -> SceneDocument {
    use trisect::scene::description::{Instance, Mesh};
    let mut scene = grey("");
    scene.description.meshes.push(Mesh {
        name: "triangle".to_owned(),
        positions: vec![[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    });
    let transform =
        glam::DAffine3::from_scale_rotation_translation(DVec3::splat(size), glam::DQuat::IDENTITY, p);
    scene.description.instances.push(Instance { mesh: 0, transform });
    scene
}

#[test]
fn small_triangles_far_from_the_origin() {
    let hit = |scene: &Scene, origin, direction| {
        scene.triangles.first().map_or(MISS, |triangle| triangle.hit(origin, &Shear::new(direction)).distance)
    };
    for far in [1e3, 1e6] {
        let scene = triangle(DVec3::new(far, far, -far), 1.0);
        agrees(&scene, Limit::FarFromOrigin, flat_errors(far, 1.0, triangle, hit)).unwrap();
    }
    let finding = &found(&triangle(DVec3::X * 1e6, 1.0), Limit::FarFromOrigin)[0];
    assert_eq!(finding.what, "mesh \"triangle\": 1 of 1 triangles");
}

#[test]
fn triangles_without_area_in_single_precision() {
    // Only the shape matters, not the size: see `Triangle::MIN_SQUARE`.
    for size in [1e-3, 3e-10, 1e-12] {
        let scene = triangle(DVec3::ZERO, size);
        assert!(found(&scene, Limit::TooSmall).is_empty(), "{size}");
        assert_eq!(scene.lower(Rebase::IDENTITY).unwrap().triangles.len(), 1);
    }
    for (width, kept) in [(1e-14, true), (3e-15, true), (3e-16, false), (0.0, false)] {
        let mut scene = triangle(DVec3::ZERO, 1.0);
        scene.description.meshes[0].positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, width, 0.0]];
        assert_eq!(found(&scene, Limit::TooSmall).is_empty(), kept, "{width}");
        assert_eq!(scene.lower(Rebase::IDENTITY).unwrap().triangles.len(), usize::from(kept));
    }
}

/// Returns `x` as a device computes it that flushes subnormal numbers to 0.
fn flushed(x: f32) -> f32 {
    if x.abs() < f32::MIN_POSITIVE { 0.0 } else { x }
}

#[test]
fn spheres_whose_squares_are_subnormal() {
    for radius in [1e-18, 5e-18, 7e-18, 1e-17] {
        // Relative loss of |v|², for vectors v of length `radius`, if subnormal squares become 0.
        let mut random = Random(3);
        let losses = (0..20_000).map(|_| {
            let v = (random.direction() * radius).as_vec3();
            let flushed = flushed(v.x * v.x) + flushed(v.y * v.y) + flushed(v.z * v.z);
            1.0 - f64::from(flushed) / v.as_dvec3().length_squared()
        });
        let (_, greatest) = spread(losses);
        let scene = grey(&format!("Sphere(center: (0, 0, 0), radius: {radius:e}, material: \"grey\")"));
        let finding = found(&scene, Limit::TooSmall);
        assert_eq!(finding.is_empty(), radius > 6e-18, "{radius}");
        if let [one] = &finding[..] {
            assert!((0.25..=4.0).contains(&(greatest / one.predicted.value)), "{greatest:e} for {one}");
        } else {
            assert!(greatest < 1e-3, "{radius}: {greatest:e}");
        }
    }
}

/// Returns two root mean square errors for an eye at `height` above a large sphere: the relative
/// error of the hit distance, and the projected hit's distance from the surface in units of
/// radius · 2⁻²⁴.
fn ground_errors(radius: f64, height: f64) -> (f64, f64) {
    let mut random = Random(4);
    let (mut distances, mut points) = (Vec::new(), Vec::new());
    while distances.len() < 2000 {
        let (eye, up) = (random.point() * 4.0 - 2.0, random.direction());
        let center = eye - up * (radius + height);
        let (rounded, direction) = unit(random.direction());
        if direction.dot(up) > -0.5 {
            continue;
        }
        let sphere = Sphere { center: center.as_vec3(), radius: radius as f32, material: 0, pad: [0; 3] };
        let distance = sphere.distance(eye.as_vec3(), rounded, false, OriginPrimitive::NONE);
        let want = exact(center, radius, eye, direction);
        let error = if distance == MISS { 1.0 } else { f64::from(distance) / want - 1.0 };
        distances.push(error);
        if distance != MISS {
            let (_, point) = sphere.project(eye.as_vec3() + rounded * distance, rounded);
            points.push(point.as_dvec3().distance(center) - radius);
        }
    }
    (spread(distances).0, spread(points).0 / (radius * ROUNDING))
}

/// A large sphere as the ground, as in torture test 30.
#[test]
fn a_large_sphere_as_ground() {
    for radius in [1e3, 1e4, 1e5, 1e6] {
        for height in [0.1, 1.0, 10.0] {
            // The direction from eye to centre is no axis: there, round coordinates would be exact.
            let (x, y, z) = (0.48 * (radius + height), 0.6 * (radius + height), 0.64 * (radius + height));
            let scene = grey(&format!(
                "Sphere(center: ({:e}, {:e}, {:e}), radius: {radius}, material: \"grey\")",
                -x,
                -y,
                3.0 - z
            ));
            let (distance, point) = ground_errors(radius, height);
            eprintln!("R {radius:e}, height {height}: {distance:.2e} of the distance, hits {point:.2} R u");
            if distance < 0.5 {
                agrees(&scene, Limit::NearSurface, distance).unwrap();
            } else {
                assert_eq!(found(&scene, Limit::NearSurface).len(), 1);
            }
            assert!((0.25..=4.0).contains(&point), "{point}");
        }
    }
    // The remedy, a plane at the same height, has no finding.
    assert_eq!(
        found(&grey("Plane(point: (0, -1, 0), normal: (0, 1, 0), material: \"grey\")"), Limit::NearSurface),
        []
    );
    // The eye is on a surface.
    let on = found(&grey("Sphere(center: (0, 0, 0), radius: 3, material: \"grey\")"), Limit::NearSurface);
    assert_eq!((on[0].measured, on[0].predicted.value), (0.0, 1.0));
}

#[test]
fn small_spheres_on_a_large_one() {
    let scene = |radius: f64, size: f64| {
        described(&format!(
            "camera: (look_from: (0, 1, 3), look_at: (0, 0, 0), vertical_fov: 40),
             materials: {{ \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)) }},
             objects: [Sphere(center: (0, -{radius}, 0), radius: {radius}, material: \"grey\"),
                 Sphere(center: (0, {size}, 0), radius: {size}, material: \"grey\")]"
        ))
    };
    // The eye is high enough to cause no finding.
    let found = |radius, size| found(&scene(radius, size), Limit::NearSurface);
    assert_eq!(found(1e3, 0.2), []);
    let beyond = found(1e4, 0.2);
    assert_eq!((beyond.len(), &*beyond[0].what), (1, "objects[0], a sphere of \"grey\""));
    // Hits are off by 0.25 to 4 R u, as `a_large_sphere_as_ground` measures.
    assert!((beyond[0].predicted.value / (1e4 * ROUNDING / 0.2) - 1.0).abs() < 1e-6);
}

#[test]
fn a_plane_far_from_the_point_that_it_is_given_by() {
    let mut random = Random(5);
    for (far, height) in [(1.0, 1.0), (1e3, 1.0), (1e5, 1.0), (1e4, 0.01)] {
        let normal = DVec3::new(0.48, 0.6, 0.64);
        let (u, v) = normal.any_orthonormal_pair();
        let mut errors = Vec::new();
        let mut last = grey("");
        for _ in 0..300 {
            let eye = DVec3::new(0.0, 0.0, 3.0);
            let point =
                eye - normal * height + (u * (0.5 + random.number()) - v * (0.5 + random.number())) * far;
            let [p, n] = [point, normal].map(|v| (v.x, v.y, v.z));
            last = grey(&format!("Plane(point: {p:?}, normal: {n:?}, material: \"grey\")"));
            let scene = last.clone().lower(Rebase::IDENTITY).unwrap();
            let (rounded, direction) = unit(-normal);
            let distance = f64::from(scene.flats[0].distance(eye.as_vec3(), rounded));
            let want = (point - eye).dot(normal) / direction.dot(normal);
            errors.push((distance / want - 1.0).abs().min(1.0));
        }
        agrees(&last, Limit::NearSurface, spread(errors).0).unwrap();
    }
}
