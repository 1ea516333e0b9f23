//! Warns if no object is in view: of a camera that looks away from all of them.

use crate::CameraPose;
use crate::description::{Description, ShapeKind};
use crate::mesh_boxes::MeshBoxes;
use crate::part_names as names;
use glam::DVec3;

/// Maximum number of objects that are examined.
const MAX_OBJECTS: usize = 1 << 16;

/// Returns a warning if all objects are outside the cone around the image, whose width is `aspect`
/// times its height. A plane has no end and counts as in view.
pub(super) fn nothing(scene: &Description, aspect: f64) -> Option<String> {
    let (_, camera) = scene.cameras.first()?;
    let count = scene.shapes.len() + scene.instances.len();
    if count == 0 || count > MAX_OBJECTS || scene.shapes.iter().any(|shape| shape.kind.is_plane()) {
        return None;
    }
    let view = View::of(camera, aspect);
    let boxes = MeshBoxes::of(scene);
    let shapes = scene.shapes.iter().enumerate().map(|(index, shape)| {
        let (center, radius) = ball_around(&shape.kind);
        (center, radius, Part::Shape(index))
    });
    let instances = scene.instances.iter().enumerate().filter_map(|(index, instance)| {
        let corners: Vec<DVec3> = boxes.corners(instance).collect();
        let center = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let radius = corners.iter().map(|corner| corner.distance(center)).fold(0.0, f64::max);
        (!corners.is_empty()).then_some((center, radius, Part::Instance(index)))
    });
    let mut nearest: Option<(f64, DVec3, Part)> = None;
    for (center, radius, part) in shapes.chain(instances) {
        if view.may_see(center, radius) {
            return None;
        }
        let distance = center.distance(camera.look_from) - radius;
        if nearest.as_ref().is_none_or(|(least, ..)| distance < *least) {
            nearest = Some((distance, center, part));
        }
    }
    let (_, center, part) = nearest?;
    let name = match part {
        Part::Shape(index) => names::shape(scene, index, scene.shapes.get(index)?),
        Part::Instance(index) => names::instance(scene, index),
    };
    let point = |p: DVec3| format!("({:.6}, {:.6}, {:.6})", p.x, p.y, p.z).replace(".000000", "");
    Some(format!(
        "nothing in view: the camera at {} looks at {}, away from all objects; the nearest, {name}, is around \
         {}: set look_at to it",
        point(camera.look_from),
        point(camera.look_at),
        point(center)
    ))
}

enum Part {
    Shape(usize),
    Instance(usize),
}

/// Returns a ball around a shape: centre and radius.
fn ball_around(kind: &ShapeKind) -> (DVec3, f64) {
    match *kind {
        ShapeKind::Sphere { center, radius } | ShapeKind::Disc { center, radius, .. } => (center, radius),
        ShapeKind::Quad { corner, u, v } => {
            (corner + 0.5 * (u + v), 0.5 * (u + v).length().max((u - v).length()))
        }
    }
}

/// Cone around the image of a camera, or cylinder around that of a parallel projection.
struct View {
    origin: DVec3,
    axis: DVec3,
    /// Half the angle of the cone, in radians.
    angle: f64,
    /// Radius around the axis at the camera: that of the lens, or of the cylinder.
    radius: f64,
    is_parallel: bool,
}

impl View {
    fn of(camera: &CameraPose, aspect: f64) -> Self {
        let diagonal = 1f64.hypot(aspect);
        let is_parallel = camera.parallel_height > 0.0;
        let lens = (0.5 * camera.defocus_angle).tan() * camera.focus_distance;
        Self {
            origin: camera.look_from,
            axis: (camera.look_at - camera.look_from).normalize_or_zero(),
            angle: ((0.5 * camera.vertical_fov).tan() * diagonal).atan(),
            radius: if is_parallel { 0.5 * diagonal * camera.parallel_height } else { lens },
            is_parallel,
        }
    }

    /// Returns false if no point of a ball is in the image.
    fn may_see(&self, center: DVec3, radius: f64) -> bool {
        let way = center - self.origin;
        let ahead = way.dot(self.axis);
        let aside = (way - self.axis * ahead).length();
        let reach = radius + self.radius;
        if ahead < -reach {
            return false;
        }
        if self.is_parallel {
            return aside <= reach;
        }
        let distance = way.length();
        // A defocused point is blurred over the cone of the lens, which the reach covers nearby.
        distance <= reach || aside.atan2(ahead) - (reach / distance).asin() <= self.angle
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use crate::SceneDocument;

    fn warned(camera: &str, objects: &str) -> Option<String> {
        let text = format!(
            "Scene(version: 1, image: (width: 64, height: 32, samples: 1, depth: 2), camera: ({camera}), \
             sky: Uniform(radiance: (1, 1, 1)), materials: {{ \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, \
             objects: [{objects}])"
        );
        let warnings = SceneDocument::parse(&text, "a.ron").unwrap().warnings();
        warnings.into_iter().find(|line| line.starts_with("nothing in view"))
    }

    const BALL: &str = "Sphere(center: (0, 0, 0), radius: 1, material: \"grey\")";

    #[test]
    fn a_camera_that_looks_away_is_named() {
        let away = warned("look_from: (0, 0, 5), look_at: (0, 0, 9), vertical_fov: 40", BALL).unwrap();
        for part in ["camera at (0, 0, 5) looks at (0, 0, 9)", "objects[0], a sphere", "around (0, 0, 0)"] {
            assert!(away.contains(part), "{away}");
        }
        assert!(warned("look_from: (0, 0, 5), look_at: (3, 0, 3), vertical_fov: 40", BALL).is_some());
        let quad = "Quad(corner: (9, 0, 0), u: (1, 0, 0), v: (0, 1, 0), material: \"grey\")";
        assert!(warned("look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 40", quad).is_some());
        let parallel = "look_from: (0, 0, 5), look_at: (0, 0, 0), height: 4";
        let beside = "Sphere(center: (7, 0, 0), radius: 1, material: \"grey\")";
        assert!(warned(parallel, beside).is_some());
        assert!(warned(parallel, &beside.replace("(7", "(2")).is_none());
    }

    #[test]
    fn what_may_be_seen_is_not_named() {
        for camera in [
            "look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 40",
            // The ball is at the edge, around the camera, and in the corner of a wide image.
            "look_from: (0, 0, 5), look_at: (2.5, 0, 0), vertical_fov: 40",
            "look_from: (0, 0, 0.5), look_at: (0, 0, 9), vertical_fov: 40",
            "look_from: (0, 0, 5), look_at: (3.9, 1.9, 0), vertical_fov: 40",
        ] {
            assert_eq!(warned(camera, BALL), None, "{camera}");
        }
        let away = "look_from: (0, 0, 5), look_at: (0, 0, 9), vertical_fov: 40";
        let plane = "Plane(point: (0, -1, 0), normal: (0, 1, 0), material: \"grey\")";
        assert_eq!(warned(away, &format!("{BALL}, {plane}")), None);
        assert_eq!(warned(away, ""), None);
    }
}
