//! Edits of scenes: fields of the text, and arrays.

use crate::array_image::Panorama;
use crate::array_object::ArrayObject;
use crate::error;
use crate::scene_parts::{Parts, Place};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyFloat, PyInt, PyModule, PyTuple};
use trisect::error::Error;
use trisect::scene::{FieldEdit, SceneError};

/// Module that makes text of Python values.
static BUILD: PyOnceLock<Py<PyModule>> = PyOnceLock::new();

/// Returns the module that makes text of Python values. An import takes longer than an edit.
pub fn build(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    Ok(BUILD.get_or_try_init(py, || py.import("trisect._build").map(Bound::unbind))?.bind(py))
}

/// Changes of a scene: its arrays afterwards, and changes of fields of its text.
pub struct Changes {
    pub parts: Parts,
    pub fields: Vec<FieldEdit>,
}

impl Changes {
    /// Reads the changes that a dict states for a scene with these arrays, of the file `file`.
    ///
    /// # Errors
    ///
    /// `SceneError` for a field that an object of arrays lacks; `TypeError` or `ValueError` with
    /// the path for a wrong value.
    pub fn read(changes: &Bound<'_, PyDict>, parts: &Parts, file: &str) -> PyResult<Self> {
        let mut all = Self { parts: parts.clone(), fields: Vec::new() };
        for (path, value) in changes {
            let path: String = path.extract()?;
            if path.contains('=') && !path.contains('"') {
                let message = format!("{path:?} is not the path of a field, such as \"camera.look_at\"");
                return Err(PyValueError::new_err(message));
            }
            all.add(&path, &value, file)?;
        }
        for (object, before) in all.parts.objects.iter().zip(&parts.objects) {
            if !object.shares_arrays_with(before) {
                object.check(&format!("objects.{}.", before.name))?;
            }
        }
        Ok(all)
    }

    /// Adds the change of one field.
    fn add(&mut self, path: &str, value: &Bound<'_, PyAny>, file: &str) -> PyResult<()> {
        let build = build(value.py())?;
        let numbers = numbers(path, value);
        // The path of any value is that of this one.
        let edit = field_edit(path, numbers.as_deref().unwrap_or("0"))?;
        let segments: Vec<&str> = edit.path().iter().map(String::as_str).collect();
        let lacks = |of: &str, field: &str, fields: &[&str]| {
            refused(file, format!("`set` {path}: {of} has no {field}; it has {}", fields.join(", ")))
        };
        match segments[..] {
            ["sky"] => {
                let panorama = build.call_method1("panorama", (value,))?;
                if !panorama.is_none() {
                    self.parts.sky = Some(Panorama::read(&panorama)?);
                    return Ok(());
                }
                self.parts.sky = None;
            }
            ["sky", field] => {
                if let Some(sky) = &mut self.parts.sky {
                    return match sky.set(field, path, value)? {
                        true => Ok(()),
                        false => Err(lacks("sky", field, &Panorama::FIELDS)),
                    };
                }
            }
            ["textures", name] => {
                let texture = build.call_method1("texture_of_array", (name, value))?;
                if !texture.is_none() {
                    let (text, file, texels): (String, String, Bound<'_, PyAny>) = texture.extract()?;
                    self.parts.set_image(name, file, &texels)?;
                    self.fields.push(field_edit(path, &text)?);
                    return Ok(());
                }
                self.parts.images.retain(|_, image| image.name != name);
            }
            ["textures", name, "texels"] => {
                let Some(known) = self.parts.file_of(name).cloned() else {
                    let remedy = "pass a trisect.Texels as";
                    let message =
                        format!("`set` {path}: {name} is no texture of an array; {remedy} textures.{name}");
                    return Err(refused(file, message));
                };
                return self.parts.set_image(name, known, value);
            }
            ["objects", object, ref rest @ ..] => match self.parts.place(object) {
                Some(Place::Array(number)) => {
                    let object = &mut self.parts.objects[number];
                    let name = object.name.clone();
                    match *rest {
                        [] => *object = replacement(object, path, value)?,
                        [field] => {
                            let value = build.call_method1("array_value", (field, value))?;
                            if !object.set(field, path, &value)? {
                                return Err(lacks(&format!("objects.{name}"), field, object.fields()));
                            }
                        }
                        [field, ..] => {
                            let message = format!("`set` {path}: objects.{name}.{field} has no fields");
                            return Err(refused(file, message));
                        }
                    }
                    return Ok(());
                }
                Some(Place::Text(number)) => {
                    let mut segments = edit.path().to_vec();
                    segments[1] = number.to_string();
                    return self.add_field(path, edit.at(segments), numbers.is_some(), (value, file));
                }
                None => {}
            },
            _ => {}
        }
        self.add_field(path, edit, numbers.is_some(), (value, file))
    }

    /// Adds the change of a field of the text: this edit if it has the value already, else one at
    /// its path with the value.
    fn add_field(
        &mut self,
        path: &str,
        edit: FieldEdit,
        has_value: bool,
        (value, file): (&Bound<'_, PyAny>, &str),
    ) -> PyResult<()> {
        if has_value {
            self.fields.push(edit);
            return Ok(());
        }
        let is_transform = path.ends_with("transform");
        if !is_transform && value.cast::<PyUntypedArray>().is_ok_and(|array| array.ndim() > 1) {
            let message = format!("`set` {path}: this field takes no array{}", self.arrays());
            return Err(refused(file, message));
        }
        let build = build(value.py())?;
        let text: String = build.call_method1("value_of_field", (value, path))?.extract()?;
        let place = edit.path().to_vec();
        self.fields.push(field_edit(path, &text)?.at(place));
        Ok(())
    }

    /// Returns a clause that names the objects of arrays; empty if there are none.
    fn arrays(&self) -> String {
        arrays_of(&self.parts).map_or_else(String::new, |arrays| format!("; {arrays}"))
    }
}

/// Returns a sentence with the names of the objects of arrays, if there are any.
pub fn arrays_of(parts: &Parts) -> Option<String> {
    let names: Vec<&str> = parts.objects.iter().map(|object| object.name.as_str()).take(20).collect();
    (!names.is_empty()).then(|| format!("objects of arrays are {}", names.join(", ")))
}

/// Returns the object that replaces one of arrays. It keeps its name unless the new one has one.
fn replacement(before: &ArrayObject, path: &str, value: &Bound<'_, PyAny>) -> PyResult<ArrayObject> {
    let build = build(value.py())?;
    let part = build.call_method1("array_object", (value, &before.name))?;
    if part.is_none() {
        let given = value.get_type().name()?;
        let message = format!("{path} is an object of arrays; it must be a Mesh or Spheres, not {given}");
        return Err(PyTypeError::new_err(message));
    }
    ArrayObject::read(&part, &format!("{path}."))
}

/// Returns the text of a number or a short tuple of numbers; `None` for other values, and for
/// fields whose text says more than the numbers. Most edits of loops are these, and a call of
/// Python's code takes longer than the edit.
fn numbers(path: &str, value: &Bound<'_, PyAny>) -> Option<String> {
    if path == "sky" || path.ends_with("transform") {
        return None;
    }
    let number = |value: &Bound<'_, PyAny>| match value.cast_exact::<PyFloat>() {
        Ok(number) => Some(format!("{:?}", number.value())),
        Err(_) => value.cast_exact::<PyInt>().ok()?.extract::<i64>().ok().map(|number| number.to_string()),
    };
    let Ok(tuple) = value.cast_exact::<PyTuple>() else { return number(value) };
    if tuple.len() > 16 {
        return None;
    }
    let numbers: Vec<String> = tuple.iter().map(|each| number(&each)).collect::<Option<_>>()?;
    Some(format!("({})", numbers.join(", ")))
}

/// Returns the change of a field of the text.
fn field_edit(path: &str, text: &str) -> PyResult<FieldEdit> {
    let edit: Result<FieldEdit, String> = format!("{path}={text}").parse();
    edit.map_err(|message| refused(&format!("{path}={text}"), message))
}

/// Returns the exception for a change that cannot be made.
fn refused(file: &str, message: String) -> PyErr {
    error::of_library(Error::Scene(SceneError::Inconsistent { file: file.to_owned(), message }))
}
