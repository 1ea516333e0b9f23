//! Boundaries of media: from them follows which media surround the camera.

use glam::DVec3;
use trisect_scene::Scene;
use trisect_shared::medium::MediumStack;
use trisect_shared::planar::DISC;

/// Directions in which boundaries are counted. None is parallel to an axis, and most agree even if
/// one meets an edge.
const DIRECTIONS: [DVec3; 3] = [
    DVec3::new(0.571_23, 0.633_71, 0.521_59),
    DVec3::new(-0.352_17, 0.871_13, -0.342_59),
    DVec3::new(0.281_53, -0.412_37, -0.866_41),
];

/// Surfaces that bound media, in the world.
#[derive(Debug, Default)]
pub(super) struct Boundaries {
    /// Number of the medium around all of them; 0 for none.
    atmosphere: u32,
    surfaces: Vec<(Form, u32)>,
}

/// Shape of a boundary.
#[derive(Clone, Copy, Debug)]
enum Form {
    Sphere { center: DVec3, radius: f64 },
    Planar { origin: DVec3, u: DVec3, v: DVec3, normal: DVec3, is_disc: bool },
    Triangle([DVec3; 3]),
}

/// Crossing of a ray with a boundary.
struct Crossing {
    distance: f64,
    medium: u32,
    enters: bool,
}

impl Boundaries {
    /// Collects the boundaries of a scene that was validated.
    pub fn of(scene: &Scene) -> Self {
        let mut surfaces = Vec::new();
        if scene.media.is_empty() {
            return Self::default();
        }
        let medium = |material: u32| scene.materials.get(material as usize).map_or(0, |m| m.medium);
        let mut add = |form: Form, material: u32| {
            let medium = medium(material);
            surfaces.extend((medium != 0).then_some((form, medium)));
        };
        for s in &scene.spheres {
            add(Form::Sphere { center: s.center.as_dvec3(), radius: s.radius.into() }, s.material);
        }
        for f in &scene.flats {
            let [origin, u, v, normal] = [f.origin, f.edge_u, f.edge_v, f.normal].map(|v| v.as_dvec3());
            add(Form::Planar { origin, u, v, normal, is_disc: f.kind == DISC }, f.material);
        }
        let material = |vertex: u32| scene.vertices.get(vertex as usize).map_or(0, |v| v.material);
        for t in &scene.triangles {
            add(Form::Triangle([t.a, t.b, t.c].map(|v| v.as_dvec3())), material(t.vertex_a));
        }
        let starts = scene.shared.starts();
        for instance in &scene.shared.instances {
            let mesh = instance.mesh as usize;
            let (Some(&start), Some(&end)) = (starts.get(mesh), starts.get(mesh + 1)) else { continue };
            let map = instance.map();
            for t in scene.shared.triangles.get(start..end).unwrap_or_default() {
                let [a, b, c] = [t.a, t.b, t.c].map(|v| map.transform_point3(v.as_dvec3()));
                let corners = if map.matrix3.determinant() < 0.0 { [a, c, b] } else { [a, b, c] };
                add(Form::Triangle(corners), material(t.vertex_a));
            }
        }
        Self { atmosphere: scene.atmosphere, surfaces }
    }

    /// Returns the media around a point: those whose boundaries enclose it, seen in most of three
    /// directions. Boundaries that are not closed enclose nothing.
    pub fn around(&self, point: DVec3) -> MediumStack {
        let [a, b, c] = DIRECTIONS.map(|direction| self.seen(point, direction.normalize()));
        if b == c { b } else { a }
    }

    /// Returns the media that a ray leaves without having entered them.
    fn seen(&self, point: DVec3, direction: DVec3) -> MediumStack {
        let mut crossings: Vec<Crossing> = Vec::new();
        for (form, medium) in &self.surfaces {
            form.cross(point, direction, |distance, enters| {
                crossings.push(Crossing { distance, medium: *medium, enters });
            });
        }
        crossings.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let (mut entered, mut around) = (Vec::new(), Vec::new());
        for Crossing { medium, enters, .. } in crossings {
            if enters {
                entered.push(medium);
            } else if let Some(place) = entered.iter().rposition(|&of| of == medium) {
                entered.remove(place);
            } else {
                around.push(medium);
            }
        }
        around.iter().rev().fold(MediumStack(self.atmosphere), |stack, &medium| stack.cross(medium, true))
    }
}

impl Form {
    /// Passes on the distance of each crossing with a ray, and whether the ray enters there.
    fn cross(&self, point: DVec3, direction: DVec3, mut found: impl FnMut(f64, bool)) {
        match *self {
            Self::Sphere { center, radius } => {
                let from = point - center;
                let b = -from.dot(direction);
                let discriminant = radius * radius - (from + direction * b).length_squared();
                if discriminant > 0.0 {
                    let root = discriminant.sqrt();
                    for (distance, enters) in [(b - root, true), (b + root, false)] {
                        if distance > 0.0 {
                            found(distance, enters);
                        }
                    }
                }
            }
            Self::Planar { origin, u, v, normal, is_disc } => {
                let distance = (origin - point).dot(normal) / direction.dot(normal);
                let at = point + direction * distance - origin;
                let n = u.cross(v);
                let (a, b) = (at.cross(v).dot(n) / n.dot(n), u.cross(at).dot(n) / n.dot(n));
                let inside = match is_disc {
                    true => a * a + b * b < 1.0,
                    false => (0.0..1.0).contains(&a) && (0.0..1.0).contains(&b),
                };
                if distance > 0.0 && inside {
                    found(distance, direction.dot(normal) < 0.0);
                }
            }
            Self::Triangle([a, b, c]) => {
                let (u, v) = (b - a, c - a);
                let n = u.cross(v);
                let distance = (a - point).dot(n) / direction.dot(n);
                let at = point + direction * distance - a;
                let (s, t) = (at.cross(v).dot(n) / n.dot(n), u.cross(at).dot(n) / n.dot(n));
                if distance > 0.0 && s >= 0.0 && t >= 0.0 && s + t < 1.0 {
                    found(distance, direction.dot(n) < 0.0);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    /// Returns the media around a point of a scene with an atmosphere (medium 1), a ball of medium
    /// 2 in a larger one of medium 3, a box of medium 2, a ball of glass and a sheet of medium 3.
    fn around(x: f64, y: f64, z: f64) -> MediumStack {
        let text = r#"Scene(version: 1, image: (width: 8, height: 8),
            camera: (look_from: (0, 0, 90), look_at: (0, 0, 0), vertical_fov: 1),
            media: { "air": (extinction: (1, 1, 1)), "a": (extinction: (1, 1, 1)), "b": (extinction: (1, 1, 1)) },
            atmosphere: "air",
            materials: { "a": Interface(medium: "a"), "b": Interface(medium: "b"), "glass": Dielectric(ior: 1.5) },
            objects: [
                Sphere(center: (0, 0, 0), radius: 1, material: "a"),
                Sphere(center: (0, 0, 0), radius: 2, material: "b"),
                Box(min: (4, -1, -1), max: (6, 1, 1), transform: [Scale(-1)], material: "a"),
                Sphere(center: (9, 0, 0), radius: 1, material: "glass"),
                Quad(corner: (-9, -9, -9), u: (18, 0, 0), v: (0, 18, 0), material: "b"),
            ])"#;
        let boundaries = Boundaries::of(&Scene::parse(text, "test").unwrap());
        boundaries.around(DVec3::new(x, y, z))
    }

    #[test]
    fn the_camera_is_in_what_encloses_it() {
        let air = MediumStack(1);
        let a = |stack: MediumStack| stack.cross(2, true);
        let b = |stack: MediumStack| stack.cross(3, true);
        assert_eq!(around(0.0, 0.0, 90.0), air);
        assert_eq!(around(0.1, 0.2, 0.3), a(b(air)));
        assert_eq!(around(1.5, 0.2, 0.3), b(air));
        assert_eq!(around(-5.0, 0.2, 0.3), a(air));
        assert_eq!(around(5.0, 0.2, 0.3), air);
        let glass = around(9.0, 0.2, 0.3);
        assert_eq!((glass.innermost(), glass), (0, air.cross(trisect_shared::medium::CLEAR, true)));
        // Of three directions one meets the sheet from behind.
        assert_eq!(around(0.0, 5.0, 1.0), air);
    }
}
