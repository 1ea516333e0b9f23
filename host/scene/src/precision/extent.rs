//! Extent of a scene, and the space that suits it.

use crate::description::{Description, ShapeKind};
use crate::mesh_boxes::{self, MeshBoxes};
use crate::{Rebase, triple};
use glam::DVec3;
use serde::{Serialize, Serializer};

/// A shape more than this many times as large as the median one is surroundings (ground, distant
/// walls), whose position does not matter for the space.
const SURROUNDINGS: f64 = 64.0;

/// Extent of a scene, in its own units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Extent {
    /// Minimum corner of the bounding box of everything except planes; `None` for an empty scene.
    #[serde(serialize_with = "optional")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<[f64; 3]>"))]
    pub low: Option<DVec3>,
    /// Maximum corner of that box.
    #[serde(serialize_with = "optional")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<[f64; 3]>"))]
    pub high: Option<DVec3>,
    /// Centre of the box around what matters: everything except planes and surroundings (shapes and
    /// meshes more than 64 times as large as the median one).
    #[serde(serialize_with = "triple")]
    #[cfg_attr(feature = "schema", schemars(with = "[f64; 3]"))]
    pub center: DVec3,
    /// Half the longest side of that box.
    pub radius: f64,
    /// Position of the camera.
    #[serde(serialize_with = "optional")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<[f64; 3]>"))]
    pub eye: Option<DVec3>,
}

fn optional<S: Serializer>(vector: &Option<DVec3>, serializer: S) -> Result<S::Ok, S::Error> {
    vector.map(|vector| vector.to_array()).serialize(serializer)
}

#[derive(Clone, Copy)]
struct Bounds(DVec3, DVec3);

impl Bounds {
    const EMPTY: Self = Self(DVec3::INFINITY, DVec3::NEG_INFINITY);

    fn add(self, p: DVec3) -> Self {
        Self(self.0.min(p), self.1.max(p))
    }

    fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::add)
    }

    fn size(self) -> f64 {
        (self.1 - self.0).max_element()
    }
}

fn shape(kind: &ShapeKind) -> Bounds {
    match *kind {
        ShapeKind::Sphere { center, radius } => Bounds::of([center - radius, center + radius]),
        ShapeKind::Quad { corner, u, v } => Bounds::of([corner, corner + u, corner + v, corner + u + v]),
        ShapeKind::Disc { center, normal, radius } => {
            let n = normal.normalize_or_zero();
            let reach = (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt) * radius;
            Bounds::of([center - reach, center + reach])
        }
    }
}

impl Extent {
    /// Computes the extent of a scene description.
    pub fn of(scene: &Description) -> Self {
        let mut all: Vec<Bounds> =
            scene.shapes.iter().filter(|s| !s.kind.is_plane()).map(|s| shape(&s.kind)).collect();
        let (boxes, is_large) = (MeshBoxes::of(scene), mesh_boxes::is_large(scene));
        for instance in &scene.instances {
            all.push(Bounds::of(boxes.points(scene, instance, is_large)));
        }
        all.retain(|bounds| bounds.0.is_finite() && bounds.1.is_finite());
        let eye = scene.cameras.first().map(|(_, camera)| camera.look_from);
        let around = |boxes: &mut dyn Iterator<Item = &Bounds>| {
            boxes.fold(Bounds::EMPTY, |all, &bounds| all.add(bounds.0).add(bounds.1))
        };
        let whole = around(&mut all.iter());
        if all.is_empty() {
            let look = scene.cameras.first().map(|(_, c)| c.look_at.distance(c.look_from));
            let (center, radius) = (eye.unwrap_or_default(), look.unwrap_or(1.0));
            return Self { low: None, high: None, center, radius, eye };
        }
        let mut sizes: Vec<f64> = all.iter().map(|bounds| bounds.size()).collect();
        sizes.sort_by(f64::total_cmp);
        let median = sizes[(sizes.len() - 1) / 2];
        let matters = around(&mut all.iter().filter(|bounds| bounds.size() <= SURROUNDINGS * median));
        let radius = 0.5 * matters.size();
        Self { low: Some(whole.0), high: Some(whole.1), center: 0.5 * (matters.0 + matters.1), radius, eye }
    }

    /// Returns the space with its origin at [`center`](Self::center), and as scale the power of two
    /// that brings [`radius`](Self::radius) to between 1 and 2. The origin stays 0 if each
    /// coordinate of the centre is within twice the radius of it; otherwise it is rounded to
    /// multiples of 1/8 of the new space's unit.
    pub fn best_space(&self) -> Rebase {
        let radius = if self.radius > 0.0 && self.radius.is_finite() { self.radius } else { 1.0 };
        let unit = 2f64.powi(radius.log2().floor().clamp(-59.0, 59.0) as i32);
        let near = self.center.abs().max_element() <= 2.0 * radius;
        let grid = 0.125 * unit;
        let origin = if near { DVec3::ZERO } else { (self.center / grid).round() * grid };
        Rebase { origin, scale: 1.0 / unit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Shape;

    #[test]
    fn the_ground_does_not_matter() {
        let sphere = |center, radius| Shape { kind: ShapeKind::Sphere { center, radius }, material: 0 };
        let at = DVec3::new(1e6, 0.0, -3.0);
        let mut scene = Description {
            shapes: vec![sphere(at, 0.5), sphere(at + 2.0, 0.5), sphere(DVec3::Y * -1e6, 1e6)],
            ..Description::default()
        };
        let extent = Extent::of(&scene);
        assert_eq!((extent.center, extent.radius), (at + 1.0, 1.5));
        assert_eq!(extent.low, Some(DVec3::new(-1e6, -2e6, -1e6)));
        assert_eq!(extent.best_space(), Rebase { origin: at + 1.0, scale: 1.0 });
        scene.shapes.iter_mut().for_each(|shape| *shape = sphere(DVec3::X * 1000.0, 1024.0));
        assert_eq!(Extent::of(&scene).best_space(), Rebase { origin: DVec3::ZERO, scale: 1.0 / 1024.0 });
        assert_eq!(Extent::of(&Description::default()).best_space(), Rebase::IDENTITY);
    }
}
