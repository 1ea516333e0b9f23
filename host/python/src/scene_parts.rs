//! Parts of a built scene that are arrays: meshes, many spheres, and a panorama.

use crate::array::{contiguous, rows};
use numpy::{PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use trisect::glam::{DAffine3, DVec3};
use trisect::image::Image;
use trisect::scene::description::{Description, Instance, Mesh, Shape, ShapeKind, Sky};

/// Mesh that is placed once.
#[derive(Clone, Debug)]
struct PlacedMesh {
    mesh: Mesh,
    transform: DAffine3,
    name: Option<String>,
}

/// Spheres of one material.
#[derive(Clone, Debug)]
struct Spheres {
    shapes: Vec<Shape>,
    name: Option<String>,
}

/// Parts of a scene that are arrays.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    meshes: Vec<Arc<PlacedMesh>>,
    spheres: Vec<Arc<Spheres>>,
    sky: Option<Sky>,
}

impl Parts {
    /// Reads the arrays that `trisect._build` has collected.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with the name of the array.
    pub fn read(arrays: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut parts = Self::default();
        for part in arrays.get_item("meshes")?.try_iter()? {
            parts.meshes.push(Arc::new(mesh(part?.cast::<PyDict>()?)?));
        }
        for part in arrays.get_item("spheres")?.try_iter()? {
            parts.spheres.push(Arc::new(spheres(part?.cast::<PyDict>()?)?));
        }
        let sky = arrays.get_item("sky")?;
        if !sky.is_none() {
            parts.sky = Some(panorama(&sky)?);
        }
        Ok(parts)
    }

    /// Returns whether the sky is an array.
    pub fn has_sky(&self) -> bool {
        self.sky.is_some()
    }

    /// Returns whether there are no arrays.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty() && self.spheres.is_empty() && self.sky.is_none()
    }

    /// Adds the parts to a scene.
    pub fn add_to(&self, description: &mut Description) {
        for placed in &self.meshes {
            let mesh = description.meshes.len();
            description.meshes.push(placed.mesh.clone());
            description.instances.push(Instance { mesh, transform: placed.transform });
            description.instance_objects.push(description.object_names.len());
            description.object_names.push(placed.name.clone());
        }
        for spheres in &self.spheres {
            let object = description.object_names.len();
            description.shapes.extend_from_slice(&spheres.shapes);
            description.shape_objects.extend(spheres.shapes.iter().map(|_| object));
            description.object_names.push(spheres.name.clone());
        }
        if let Some(sky) = &self.sky {
            description.sky = Some(sky.clone());
        }
    }
}

/// Returns an entry of a dict, unless it is None.
fn given<'py>(part: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(part.get_item(name)?.filter(|value| !value.is_none()))
}

/// Returns an entry that must be there.
fn needed<'py>(part: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    given(part, name)?.ok_or_else(|| PyValueError::new_err(format!("{name} is missing")))
}

fn mesh(part: &Bound<'_, PyDict>) -> PyResult<PlacedMesh> {
    let name: Option<String> = given(part, "name")?.map(|name| name.extract()).transpose()?;
    let positions: Vec<[f32; 3]> = rows("positions", &needed(part, "positions")?)?;
    let triangles: Vec<[u32; 3]> = rows("triangles", &needed(part, "triangles")?)?;
    let vertices = positions.len();
    if let Some(index) = triangles.iter().flatten().find(|index| **index as usize >= vertices) {
        let message = format!("triangles has the index {index}, and positions has {vertices} vertices");
        return Err(PyValueError::new_err(message));
    }
    let mesh = Mesh {
        name: name.clone().unwrap_or_else(|| "mesh".to_owned()),
        normals: by_vertex(part, "normals", vertices)?,
        uvs: by_vertex(part, "uvs", vertices)?,
        colors: by_vertex(part, "colors", vertices)?,
        positions,
        triangles,
        material: needed(part, "material")?.extract()?,
        ..Mesh::default()
    };
    for (name, values) in [("positions", mesh.positions.as_flattened()), ("uvs", mesh.uvs.as_flattened())] {
        all_finite(name, values)?;
    }
    all_finite("normals", mesh.normals.as_flattened())?;
    all_finite("colors", mesh.colors.as_flattened())?;
    let columns: [f64; 12] = needed(part, "transform")?.extract()?;
    Ok(PlacedMesh { mesh, transform: DAffine3::from_cols_array(&columns), name })
}

/// Returns an array of a mesh with a row for each vertex; an empty one if it is not given.
fn by_vertex<const N: usize>(
    part: &Bound<'_, PyDict>,
    name: &str,
    vertices: usize,
) -> PyResult<Vec<[f32; N]>> {
    let Some(array) = given(part, name)? else { return Ok(Vec::new()) };
    let values: Vec<[f32; N]> = rows(name, &array)?;
    if values.len() != vertices {
        let message = format!("{name} has {} rows, and positions has {vertices}", values.len());
        return Err(PyValueError::new_err(message));
    }
    Ok(values)
}

/// Refuses values that are NaN or infinite.
fn all_finite(name: &str, values: &[f32]) -> PyResult<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => {
            let message = format!("{name} has {} as its value {at}; all must be finite", values[at]);
            Err(PyValueError::new_err(message))
        }
    }
}

fn spheres(part: &Bound<'_, PyDict>) -> PyResult<Spheres> {
    let centers: Vec<[f32; 3]> = rows("centers", &needed(part, "centers")?)?;
    let given_radii = needed(part, "radii")?;
    let radii: PyReadonlyArray1<'_, f32> = given_radii
        .extract()
        .map_err(|_| pyo3::exceptions::PyTypeError::new_err("radii must be a float32 array of shape (n,)"))?;
    let radii = radii.as_slice().map_err(|_| {
        PyValueError::new_err("radii is not contiguous in memory; pass numpy.ascontiguousarray(radii)")
    })?;
    if radii.len() != centers.len() {
        let message = format!("radii has {} values, and centers has {} rows", radii.len(), centers.len());
        return Err(PyValueError::new_err(message));
    }
    all_finite("centers", centers.as_flattened())?;
    all_finite("radii", radii)?;
    if let Some(at) = radii.iter().position(|radius| *radius <= 0.0) {
        return Err(PyValueError::new_err(format!(
            "radii has {} as its value {at}; all must be above 0",
            radii[at]
        )));
    }
    let material: usize = needed(part, "material")?.extract()?;
    let sphere = |(center, radius): (&[f32; 3], &f32)| {
        let kind =
            ShapeKind::Sphere { center: DVec3::from(center.map(f64::from)), radius: f64::from(*radius) };
        Shape { kind, material }
    };
    let shapes = centers.iter().zip(radii).map(sphere).collect();
    let name = given(part, "name")?.map(|name| name.extract()).transpose()?;
    Ok(Spheres { shapes, name })
}

fn panorama(part: &Bound<'_, PyAny>) -> PyResult<Sky> {
    let part = part.cast::<PyDict>()?;
    let array = needed(part, "radiance")?;
    let radiance: PyReadonlyArray3<'_, f32> = array.extract().map_err(|_| {
        pyo3::exceptions::PyTypeError::new_err("sky must be a float32 array of shape (height, width, 3)")
    })?;
    let shape = radiance.shape();
    if shape[2] != 3 || shape[0] == 0 || shape[1] == 0 {
        return Err(PyValueError::new_err(format!("sky has shape {shape:?}; it must be (height, width, 3)")));
    }
    contiguous("sky", radiance.is_c_contiguous() && radiance.as_slice().is_ok())?;
    let values = radiance.as_slice().map_err(|error| PyValueError::new_err(error.to_string()))?;
    all_finite("sky", values)?;
    if let Some(at) = values.iter().position(|value| *value < 0.0) {
        return Err(PyValueError::new_err(format!(
            "sky has {} as its value {at}; all must be 0 or more",
            values[at]
        )));
    }
    let image = Image {
        width: shape[1] as u32,
        height: shape[0] as u32,
        pixels: bytemuck::cast_slice(values).to_vec(),
    };
    let scale = needed(part, "scale")?.extract()?;
    let rotation: f64 = needed(part, "rotation")?.extract()?;
    Ok(Sky::Image { image: Arc::new(image), scale, rotation: rotation.to_radians() })
}
