//! Objects of arrays: a mesh that is placed once, or many spheres of one material.

use crate::array::{all_finite, rows, values, wrong_type};
use crate::error::{self, Facts};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::sync::Arc;
use trisect::glam::{DAffine3, DVec3};
use trisect::scene::description::{Description, Instance, Mesh, Shape, ShapeKind};
use trisect::scene::parse_transform;

/// Object of a scene that is made of arrays.
#[derive(Clone, Debug)]
pub struct ArrayObject {
    /// Name of the object, or its place in the list of objects.
    pub name: String,
    /// Name of the material.
    material: String,
    shape: ArrayShape,
}

/// Arrays of an object. Objects of edited scenes share those that did not change.
#[derive(Clone, Debug)]
enum ArrayShape {
    /// Mesh, whose name and material are those of the object.
    Mesh {
        arrays: Arc<Mesh>,
        transform: DAffine3,
    },
    Spheres {
        centers: Arc<Vec<[f32; 3]>>,
        radii: Arc<Vec<f32>>,
    },
}

impl ArrayObject {
    /// Reads an object as `trisect._build.array_object` returns it.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with the name of the array, which follows `prefix`.
    pub fn read(part: &Bound<'_, PyAny>, prefix: &str) -> PyResult<Self> {
        let (kind, fields): (String, Bound<'_, PyDict>) = part.extract()?;
        let shape = match kind.as_str() {
            "Mesh" => ArrayShape::Mesh { arrays: Arc::default(), transform: DAffine3::IDENTITY },
            _ => ArrayShape::Spheres { centers: Arc::default(), radii: Arc::default() },
        };
        let mut object = Self { name: String::new(), material: String::new(), shape };
        for (field, value) in fields {
            let field: String = field.extract()?;
            object.set(&field, &format!("{prefix}{field}"), &value)?;
        }
        object.check(prefix)?;
        Ok(object)
    }

    /// Returns the names of the fields.
    pub fn fields(&self) -> &'static [&'static str] {
        match self.shape {
            ArrayShape::Mesh { .. } => {
                &["positions", "triangles", "normals", "uvs", "colors", "transform", "material", "name"]
            }
            ArrayShape::Spheres { .. } => &["centers", "radii", "material", "name"],
        }
    }

    /// Returns the names of the object and its material, and the number of parts with these names.
    pub fn names(&self) -> (&str, &str, usize) {
        let count = match &self.shape {
            ArrayShape::Mesh { .. } => 1,
            ArrayShape::Spheres { centers, .. } => centers.len(),
        };
        (&self.name, &self.material, count)
    }

    /// Sets a field, and returns whether the object has it. `place` names it in errors. Arrays that
    /// depend on each other are left to [`check`](Self::check).
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with `place`.
    pub fn set(&mut self, field: &str, place: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
        match (field, &mut self.shape) {
            ("name", _) => self.name = word(place, value)?,
            ("material", _) => self.material = word(place, value)?,
            ("transform", ArrayShape::Mesh { transform, .. }) => *transform = map(place, value)?,
            ("triangles", ArrayShape::Mesh { arrays, .. }) => {
                Arc::make_mut(arrays).triangles = rows(place, value)?;
            }
            ("positions", ArrayShape::Mesh { arrays, .. }) => {
                Arc::make_mut(arrays).positions = finite_rows(place, value)?;
            }
            ("normals", ArrayShape::Mesh { arrays, .. }) => {
                Arc::make_mut(arrays).normals = optional_rows(place, value)?;
            }
            ("uvs", ArrayShape::Mesh { arrays, .. }) => {
                Arc::make_mut(arrays).uvs = optional_rows(place, value)?;
            }
            ("colors", ArrayShape::Mesh { arrays, .. }) => {
                Arc::make_mut(arrays).colors = optional_rows(place, value)?;
            }
            ("centers", ArrayShape::Spheres { centers, .. }) => {
                *centers = Arc::new(finite_rows(place, value)?);
            }
            ("radii", ArrayShape::Spheres { radii, .. }) => *radii = Arc::new(lengths(place, value)?),
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Checks that the arrays have as many rows as each other, and that indices are in range.
    ///
    /// # Errors
    ///
    /// `ValueError` with the name of the array, which follows `prefix`.
    pub fn check(&self, prefix: &str) -> PyResult<()> {
        let fault = match &self.shape {
            ArrayShape::Mesh { arrays, .. } => mesh_fault(arrays),
            ArrayShape::Spheres { centers, radii } => (radii.len() != centers.len())
                .then(|| format!("radii has {} values, and centers has {} rows", radii.len(), centers.len())),
        };
        fault.map_or(Ok(()), |fault| Err(PyValueError::new_err(format!("{prefix}{fault}"))))
    }

    /// Returns whether both have the same arrays in memory.
    pub fn shares_arrays_with(&self, other: &Self) -> bool {
        match (&self.shape, &other.shape) {
            (ArrayShape::Mesh { arrays, .. }, ArrayShape::Mesh { arrays: others, .. }) => {
                Arc::ptr_eq(arrays, others)
            }
            (
                ArrayShape::Spheres { centers, radii },
                ArrayShape::Spheres { centers: other_centers, radii: other_radii },
            ) => Arc::ptr_eq(centers, other_centers) && Arc::ptr_eq(radii, other_radii),
            _ => false,
        }
    }

    /// Adds the object to a scene with these materials.
    ///
    /// # Errors
    ///
    /// A message for a material that the scene lacks.
    pub fn add_to(
        &self,
        description: &mut Description,
        materials: &HashMap<String, usize>,
    ) -> Result<(), String> {
        let Self { name, material: wanted, shape } = self;
        let Some(&material) = materials.get(wanted) else {
            let mut known: Vec<&str> = materials.keys().map(String::as_str).collect();
            known.sort_unstable();
            let known = known.join(", ");
            return Err(format!(
                "objects.{name}.material: unknown material {wanted:?}; `materials` has: {known}"
            ));
        };
        let object = description.object_names.len();
        description.object_names.push(Some(name.clone()));
        match shape {
            ArrayShape::Mesh { arrays, transform } => {
                let mesh = description.meshes.len();
                let placed = Mesh { name: name.clone(), material, ..Mesh::clone(arrays) };
                description.meshes.push(placed);
                description.instances.push(Instance { mesh, transform: *transform });
                description.instance_objects.push(object);
            }
            ArrayShape::Spheres { centers, radii } => {
                let spheres = centers.iter().zip(radii.iter()).map(|(center, radius)| {
                    let center = DVec3::from(center.map(f64::from));
                    Shape { kind: ShapeKind::Sphere { center, radius: f64::from(*radius) }, material }
                });
                description.shapes.extend(spheres);
                description.shape_objects.resize(description.shapes.len(), object);
            }
        }
        Ok(())
    }
}

/// Returns what is wrong with the numbers of vertices or with the indices of a mesh.
fn mesh_fault(mesh: &Mesh) -> Option<String> {
    let vertices = mesh.positions.len();
    let all = [("normals", mesh.normals.len()), ("uvs", mesh.uvs.len()), ("colors", mesh.colors.len())];
    if let Some((name, rows)) = all.into_iter().find(|(_, rows)| *rows != 0 && *rows != vertices) {
        return Some(format!("{name} has {rows} rows, and positions has {vertices}"));
    }
    let mut indices = mesh.triangles.iter().flatten();
    let index = indices.find(|index| **index as usize >= vertices)?;
    Some(format!("triangles has the index {index}, and positions has {vertices} vertices"))
}

/// Returns a string.
fn word(place: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    value.extract().map_err(|_| wrong_type(place, "str", value))
}

/// Returns rows of which all values are finite.
fn finite_rows<const N: usize>(place: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; N]>> {
    let rows: Vec<[f32; N]> = rows(place, value)?;
    all_finite(place, rows.as_flattened())?;
    Ok(rows)
}

/// Returns rows of which all values are finite; none for None.
fn optional_rows<const N: usize>(place: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; N]>> {
    if value.is_none() { Ok(Vec::new()) } else { finite_rows(place, value) }
}

/// Returns positive lengths.
fn lengths(place: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f32>> {
    let lengths = values(place, value)?;
    all_finite(place, &lengths)?;
    match lengths.iter().position(|length| *length <= 0.0) {
        None => Ok(lengths),
        Some(at) => {
            let message = format!("{place} has {} as its value {at}; all must be above 0", lengths[at]);
            Err(PyValueError::new_err(message))
        }
    }
}

/// Returns a map: the columns that `trisect._build.array_value` returns, or text of steps.
fn map(place: &str, value: &Bound<'_, PyAny>) -> PyResult<DAffine3> {
    if let Ok(steps) = value.extract::<String>() {
        return parse_transform(&steps).map_err(|fault| {
            let facts = Facts { kind: "Inconsistent", place: Some(place.to_owned()), ..Facts::default() };
            error::raise("SceneError", format!("{place} is {steps:?}: {fault}"), facts)
        });
    }
    let columns: [f64; 12] = value.extract().map_err(|_| wrong_type(place, "matrix", value))?;
    Ok(DAffine3::from_cols_array(&columns))
}
