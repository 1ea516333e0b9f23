//! Warns of smooth glass that blocks lights without extent. Connections pass clear glass and thin
//! walls, but not glass with layers: a path crosses that only by sampling, and a sampled direction
//! never hits such a light.
//!
//! The shadow of a glass ball is expected. Not expected are a pane that turns the sun off, and
//! objects inside glass that no light reaches. The search is rough: meshes are their boxes, and
//! objects between light and glass are ignored.

use crate::description::{Alpha, Description, Instance, PunctualLight, ShapeKind};
use crate::mesh_boxes;
use crate::part_names as names;
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// Maximum numbers of lights, pieces of glass and other objects that are examined.
const MAX_LIGHTS: usize = 16;
const MAX_GLASS: usize = 64;
const MAX_THINGS: usize = 4096;

/// Maximum length of a pane's shortest edge, relative to its next edge.
const PANE: f64 = 0.1;

/// Thickness of flat objects, relative to their size.
const FLAT: f64 = 1e-6;

/// Approximate shape of an object.
#[derive(Clone, Copy, Debug)]
enum Form {
    Ball {
        center: DVec3,
        radius: f64,
    },
    /// A parallelepiped; a thin one for flat objects.
    Block {
        corner: DVec3,
        edges: [DVec3; 3],
    },
    Disc {
        center: DVec3,
        normal: DVec3,
        radius: f64,
    },
}

impl Form {
    fn of_shape(kind: &ShapeKind) -> Self {
        match *kind {
            ShapeKind::Sphere { center, radius } => Self::Ball { center, radius },
            ShapeKind::Quad { corner, u, v } => {
                let thickness = FLAT * (u.length() + v.length());
                Self::Block { corner, edges: [u, v, u.cross(v).normalize_or_zero() * thickness] }
            }
            ShapeKind::Disc { center, normal, radius } => {
                Self::Disc { center, normal: normal.normalize_or_zero(), radius }
            }
        }
    }

    /// Returns the box around a mesh in the world; `low` and `high` are that in its coordinates.
    fn of_mesh((low, high): (DVec3, DVec3), instance: &Instance) -> Self {
        let matrix = instance.transform.matrix3;
        let size = (high - low).max(DVec3::ZERO);
        let size = size.max(DVec3::splat(FLAT * size.max_element()));
        let edges = [matrix.x_axis * size.x, matrix.y_axis * size.y, matrix.z_axis * size.z];
        Self::Block { corner: instance.transform.transform_point3(low), edges }
    }

    /// Returns the block that a box's sides enclose.
    fn of_sides(sides: &[&ShapeKind]) -> Option<Self> {
        let edges_of = |kind: &ShapeKind| match *kind {
            ShapeKind::Quad { corner, u, v } => Some((corner, u, v)),
            _ => None,
        };
        let (corner, u, v) = edges_of(sides.first()?)?;
        let depth = |edge: DVec3| edge.dot(u.cross(v).normalize_or_zero()).abs();
        let all = sides.iter().filter_map(|kind| edges_of(kind));
        let third = all.flat_map(|(_, u, v)| [u, v]).max_by(|a, b| depth(*a).total_cmp(&depth(*b)))?;
        // Pointed into the box, because the edge may point either way on its side.
        let centers = sides.iter().filter_map(|kind| edges_of(kind)).map(|(c, u, v)| c + 0.5 * (u + v));
        let middle = centers.sum::<DVec3>() / sides.len() as f64;
        let third = if third.dot(middle - corner) < 0.0 { -third } else { third };
        Some(Self::Block { corner, edges: [u, v, third] })
    }

    fn center(&self) -> DVec3 {
        match *self {
            Self::Ball { center, .. } | Self::Disc { center, .. } => center,
            Self::Block { corner, edges } => corner + 0.5 * edges.iter().sum::<DVec3>(),
        }
    }

    fn radius(&self) -> f64 {
        match *self {
            Self::Ball { radius, .. } | Self::Disc { radius, .. } => radius,
            Self::Block { edges, .. } => 0.5 * edges.iter().sum::<DVec3>().length(),
        }
    }

    /// Returns whether a point is inside, by a margin of 1 %.
    fn contains(&self, point: DVec3) -> bool {
        match *self {
            Self::Ball { center, radius } => point.distance(center) < 0.99 * radius,
            Self::Disc { .. } => false,
            Self::Block { corner, edges } => {
                let matrix = DMat3::from_cols(edges[0], edges[1], edges[2]);
                if matrix.determinant() == 0.0 {
                    return false;
                }
                let at = matrix.inverse() * (point - corner);
                (at.cmpgt(DVec3::splat(0.01)) & at.cmplt(DVec3::splat(0.99))).all()
            }
        }
    }

    /// Returns five points of a pane, from which rays are tested, and its normal; `None` if this is
    /// not a pane.
    fn pane(&self) -> Option<([DVec3; 5], DVec3)> {
        let (center, u, v) = match *self {
            Self::Ball { .. } => return None,
            Self::Disc { center, normal, radius } => {
                let (u, v) = normal.any_orthonormal_pair();
                (center, u * radius, v * radius)
            }
            Self::Block { mut edges, .. } => {
                edges.sort_by(|a, b| a.length().total_cmp(&b.length()));
                let [least, u, v] = edges;
                if least.length() > PANE * u.length() {
                    return None;
                }
                (self.center(), u, v)
            }
        };
        let points = [(0.0, 0.0), (0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)];
        Some((points.map(|(a, b)| center + u * a + v * b), u.cross(v).normalize_or_zero()))
    }

    /// Returns whether a ray meets the form at a distance of more than `least`.
    fn is_hit(&self, origin: DVec3, direction: DVec3, least: f64) -> bool {
        match *self {
            Self::Ball { center, radius } => {
                let to = center - origin;
                let along = to.dot(direction);
                let beside = to.length_squared() - along * along;
                let half = (radius * radius - beside).max(0.0).sqrt();
                beside <= radius * radius && along + half > least
            }
            Self::Disc { center, normal, radius } => {
                let t = (center - origin).dot(normal) / direction.dot(normal);
                t > least && t.is_finite() && (origin + direction * t).distance(center) <= radius
            }
            Self::Block { corner, edges } => block_is_hit(corner, edges, origin, direction, least),
        }
    }
}

fn block_is_hit(corner: DVec3, edges: [DVec3; 3], origin: DVec3, direction: DVec3, least: f64) -> bool {
    let (mut near, mut far) = (least, f64::INFINITY);
    for i in 0..3 {
        let (a, b) = (edges[(i + 1) % 3], edges[(i + 2) % 3]);
        let normal = a.cross(b).normalize_or_zero();
        let (from, to) = ((corner - origin).dot(normal), (corner + edges[i] - origin).dot(normal));
        let speed = direction.dot(normal);
        if speed == 0.0 {
            if from.min(to) > 0.0 || from.max(to) < 0.0 {
                return false;
            }
            continue;
        }
        let (t, u) = (from / speed, to / speed);
        (near, far) = (near.max(t.min(u)), far.min(t.max(u)));
    }
    near <= far && far.is_finite()
}

/// Returns the pieces of glass with their names, and all other objects.
fn sort(scene: &Description) -> (Vec<(String, Form)>, Vec<Form>) {
    let is_glass = |material: usize| {
        scene
            .materials
            .get(material)
            .is_some_and(|m| m.surface.blocks_connections() && m.alpha == Alpha::Opaque)
    };
    let (mut glass, mut things) = (Vec::new(), Vec::new());
    for (index, shape) in scene.shapes.iter().enumerate() {
        if !is_glass(shape.material) {
            things.push(Form::of_shape(&shape.kind));
            continue;
        }
        let object = scene.shape_objects.get(index);
        // A box's sides are consecutive.
        if index > 0 && object.is_some() && scene.shape_objects.get(index - 1) == object {
            continue;
        }
        let same =
            |&(at, _): &(usize, &_)| at == index || object.is_some() && scene.shape_objects.get(at) == object;
        let sides: Vec<&ShapeKind> =
            (index..).zip(&scene.shapes[index..]).take_while(same).map(|(_, shape)| &shape.kind).collect();
        let form = if sides.len() > 1 { Form::of_sides(&sides) } else { None };
        glass.push((names::shape(scene, index, shape), form.unwrap_or(Form::of_shape(&shape.kind))));
    }
    let mut boxes = HashMap::new();
    for (index, instance) in scene.instances.iter().enumerate() {
        let Some(mesh) = scene.meshes.get(instance.mesh) else { continue };
        let bounds = boxes.entry(instance.mesh).or_insert_with(|| mesh_boxes::of_mesh(mesh));
        let form = Form::of_mesh(*bounds, instance);
        if is_glass(mesh.material) {
            glass.push((names::instance(scene, index), form));
        } else {
            things.push(form);
        }
    }
    glass.truncate(MAX_GLASS);
    things.truncate(MAX_THINGS);
    (glass, things)
}

/// Returns the unit direction of a light at a point, if it shines there.
fn direction(light: &PunctualLight, point: DVec3) -> Option<DVec3> {
    light.arrival(point).map(|(along, _)| along)
}

/// Returns whether glass keeps a light from an object.
fn keeps_from(light: &PunctualLight, glass: &Form, things: &[Form]) -> bool {
    let position = light.position();
    if let Form::Disc { center, normal, radius } = *glass
        && radius >= crate::values::MAX_MAGNITUDE
    {
        // An infinite plane, such as water: objects on its other side.
        let side = position.map_or_else(
            || direction(light, center).map_or(0.0, |along| -along.dot(normal)),
            |position| (position - center).dot(normal),
        );
        return things.iter().any(|thing| (thing.center() - center).dot(normal) * side < 0.0);
    }
    if let Some((points, normal)) = glass.pane() {
        let size = glass.radius();
        return points.iter().any(|&point| {
            let Some(along) = direction(light, point).filter(|along| along.dot(normal).abs() > 1e-3) else {
                return false;
            };
            things.iter().any(|thing| thing.is_hit(point, along, 1e-6 * size))
        });
    }
    let lit_inside = position.is_some_and(|position| glass.contains(position));
    things.iter().any(|thing| match glass.contains(thing.center()) {
        true => !lit_inside && thing.radius() <= glass.radius(),
        false => lit_inside,
    })
}

/// Returns a warning if smooth glass keeps a light without extent from objects behind it or within
/// it.
pub(super) fn in_the_way(scene: &Description) -> Option<String> {
    let lights = scene.lights.iter().enumerate();
    let mut lights =
        lights.filter(|(_, light)| light.strength().max_element() > 0.0).take(MAX_LIGHTS).peekable();
    lights.peek()?;
    let (glass, things) = sort(scene);
    let (light, name) = lights.find_map(|(index, light)| {
        let (name, _) = glass.iter().find(|(_, form)| keeps_from(light, form, &things))?;
        Some((names::light(index), name))
    })?;
    Some(format!(
        "{light} hardly shines through the smooth glass of {name}: connections to lights without extent pass \
         Dielectric and thin walls, but not glass with layers, and its shadow is nearly black; use Dielectric, or \
         give the light an area (an object that emits)"
    ))
}
