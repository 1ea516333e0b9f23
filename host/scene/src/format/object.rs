//! The objects of a scene file, with their checks.

use super::name::Name;
use super::transform::Transform;
use crate::import::ModelOptions;
use crate::limits::has_area;
use crate::values::some;
use crate::values::{Direction, Length, MAX_MAGNITUDE, Point, vector};
use glam::{DAffine3, DVec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A visible object.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub enum Object<'a> {
    /// A sphere.
    Sphere {
        /// Centre in scene units.
        center: Point,
        /// Radius in scene units.
        radius: Length,
        /// A name from `materials`.
        #[serde(borrow)]
        material: Name<'a>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
    /// A parallelogram.
    Quad {
        /// One corner.
        corner: Point,
        /// Edge from `corner` to the next corner.
        u: Point,
        /// Edge from `corner` to the other adjacent corner.
        v: Point,
        /// A name from `materials`.
        #[serde(borrow)]
        material: Name<'a>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
    /// A disc.
    Disc {
        /// Centre in scene units.
        center: Point,
        /// Normal, which points out of the front.
        normal: Direction,
        /// Radius in scene units.
        radius: Length,
        /// A name from `materials`.
        #[serde(borrow)]
        material: Name<'a>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
    /// An infinite plane: a disc of the maximum radius.
    Plane {
        /// Any point of the plane.
        point: Point,
        /// Normal, which points out of the front.
        normal: Direction,
        /// A name from `materials`.
        #[serde(borrow)]
        material: Name<'a>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
    /// Six parallelograms that bound a box.
    Box {
        /// Corner with the smallest coordinates.
        min: Point,
        /// Corner with the largest coordinates.
        max: Point,
        /// Transform of the box; default: none.
        #[serde(default)]
        transform: Transform,
        /// A name from `materials`.
        #[serde(borrow)]
        material: Name<'a>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
    /// A model from another file.
    Mesh {
        /// File name, relative to the scene file.
        #[serde(borrow)]
        file: Name<'a>,
        /// Transform that is applied after the file's own.
        #[serde(default)]
        transform: Transform,
        /// A name from `materials`, which replaces all materials of the file.
        #[serde(default, borrow, deserialize_with = "some")]
        material: Option<Name<'a>>,
        /// Time in seconds of the animation that is drawn; default: the file's own pose.
        #[serde(default, deserialize_with = "some")]
        time: Option<f64>,
        /// Name of the animation; default: the file's first, if a time is given.
        #[serde(default, deserialize_with = "some")]
        animation: Option<String>,
        /// Name of the variant of the file's materials; default: none.
        #[serde(default, deserialize_with = "some")]
        variant: Option<String>,
        /// Name of the object, for mattes; default: its place in the file.
        #[serde(default, deserialize_with = "some")]
        name: Option<String>,
    },
}

impl<'de: 'a, 'a> Deserialize<'de> for Object<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let object = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        object.check().map_err(D::Error::custom)?;
        Ok(object)
    }
}

impl<'a> Object<'a> {
    /// Returns the name of the material that the object refers to.
    pub fn material(&self) -> Option<&Name<'a>> {
        match self {
            Self::Sphere { material, .. }
            | Self::Quad { material, .. }
            | Self::Disc { material, .. }
            | Self::Plane { material, .. }
            | Self::Box { material, .. } => Some(material),
            Self::Mesh { material, .. } => material.as_ref(),
        }
    }

    /// Returns the object's name, if it has one.
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Sphere { name, .. }
            | Self::Quad { name, .. }
            | Self::Disc { name, .. }
            | Self::Plane { name, .. }
            | Self::Box { name, .. }
            | Self::Mesh { name, .. } => name.as_deref(),
        }
    }

    /// Returns what is chosen of what the file of a mesh holds.
    pub fn options(&self) -> ModelOptions {
        match self {
            Self::Mesh { time, animation, variant, .. } => {
                ModelOptions { time: *time, animation: animation.clone(), variant: variant.clone() }
            }
            _ => ModelOptions::default(),
        }
    }

    /// Checks values of an object that are valid on their own but may not be together.
    fn check(&self) -> Result<(), String> {
        match self {
            Self::Quad { u, v, .. } => {
                has_area(vector(*u), vector(*v)).map_err(|fault| format!("Quad: {fault}"))
            }
            Self::Box { min, max, transform, .. } => {
                let (min, max) = (vector(*min), vector(*max));
                if !min.cmplt(max).all() {
                    return Err("Box: each coordinate of min must be less than that of max".to_owned());
                }
                for [corner, u, v] in sides(min, max, &transform.0) {
                    if [corner, u, v].iter().any(|vector| vector.abs().max_element() > MAX_MAGNITUDE) {
                        return Err("Box: it reaches beyond 1e18".to_owned());
                    }
                    has_area(u, v).map_err(|fault| format!("Box: a side: {fault}"))?;
                }
                Ok(())
            }
            Self::Mesh { time: Some(time), .. } if !time.is_finite() => {
                Err(format!("Mesh: time is {time}; it must be finite"))
            }
            _ => Ok(()),
        }
    }
}

/// Returns a box's sides, each as corner, u and v, with u × v outward. Seen from outside before the
/// transform, u points right and v points up. Up is +y; on the top side it is -z, and on the bottom
/// side +z.
pub fn sides(min: DVec3, max: DVec3, transform: &DAffine3) -> [[DVec3; 3]; 6] {
    let (x, y, z) = (DVec3::X * (max - min).x, DVec3::Y * (max - min).y, DVec3::Z * (max - min).z);
    let sides =
        [[max - y, -z, y], [min, z, y], [min + y + z, x, -z], [min, x, z], [min + z, x, y], [min + x, -x, y]];
    let mirrors = transform.matrix3.determinant() < 0.0;
    sides.map(|[corner, u, v]| {
        let corner = transform.transform_point3(if mirrors { corner + u } else { corner });
        let [u, v] = [if mirrors { -u } else { u }, v].map(|edge| transform.transform_vector3(edge));
        [corner, u, v]
    })
}
