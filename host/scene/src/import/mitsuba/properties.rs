//! Properties of Mitsuba's objects: numbers, words, vectors and transforms.

use super::super::assembly::{look_at, rotation};
use super::super::source_location::shown;
use super::document::{Document, Element};
use crate::error::SceneError;
use glam::{DAffine3, DMat3, DVec3};
use std::rc::Rc;

impl Document {
    /// Returns an attribute that an element must have.
    pub fn required<'e>(&self, element: &'e Element, name: &str) -> Result<&'e str, SceneError> {
        element
            .attribute(name)
            .ok_or_else(|| self.error(element, format!("{} needs the attribute {name}", element.label())))
    }

    /// Returns the numbers of a list whose separators are commas and spaces.
    pub fn numbers(&self, element: &Element, text: &str) -> Result<Vec<f64>, SceneError> {
        let words = text.split(|letter: char| letter == ',' || letter.is_whitespace());
        words.filter(|word| !word.is_empty()).map(|word| self.parse_number(element, word)).collect()
    }

    /// Returns a finite number.
    pub fn parse_number(&self, element: &Element, word: &str) -> Result<f64, SceneError> {
        word.trim()
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.error(element, format!("\"{}\" is not a finite number", shown(word))))
    }

    /// Returns a number by the name of its property.
    pub fn number(&self, object: &Element, name: &str, default: f64) -> Result<f64, SceneError> {
        match object.property(name) {
            Some(property) => self.parse_number(property, self.required(property, "value")?),
            None => Ok(default),
        }
    }

    /// Returns a count of at least `least` by the name of its property.
    pub fn count(&self, object: &Element, name: &str, least: u32, default: u32) -> Result<u32, SceneError> {
        let Some(property) = object.property(name) else { return Ok(default) };
        let number = self.parse_number(property, self.required(property, "value")?)?;
        if number.fract() == 0.0 && (f64::from(least)..=f64::from(u32::MAX)).contains(&number) {
            return Ok(number as u32);
        }
        let message = format!("{name} is {number}; it must be a whole number from {least} to {}", u32::MAX);
        Err(self.error(property, message))
    }

    /// Returns a truth value by the name of its property.
    pub fn flag(&self, object: &Element, name: &str, default: bool) -> Result<bool, SceneError> {
        let Some(property) = object.property(name) else { return Ok(default) };
        match self.required(property, "value")? {
            "true" => Ok(true),
            "false" => Ok(false),
            other => {
                Err(self.error(property, format!("{name} is \"{}\"; it must be true or false", shown(other))))
            }
        }
    }

    /// Returns a word by the name of its property.
    pub fn word<'e>(&self, object: &'e Element, name: &str) -> Result<Option<&'e str>, SceneError> {
        object.property(name).map(|property| self.required(property, "value")).transpose()
    }

    /// Returns a vector of an element: its `value`, or its `x`, `y` and `z`, of which those that
    /// are left out are `default`.
    pub fn vector(&self, element: &Element, default: f64) -> Result<DVec3, SceneError> {
        if let Some(text) = element.attribute("value") {
            return match self.numbers(element, text)?[..] {
                [x, y, z] => Ok(DVec3::new(x, y, z)),
                [x] => Ok(DVec3::splat(x)),
                _ => Err(self.error(element, "it needs one number or three")),
            };
        }
        let axis =
            |name: &str| element.attribute(name).map_or(Ok(default), |word| self.parse_number(element, word));
        Ok(DVec3::new(axis("x")?, axis("y")?, axis("z")?))
    }

    /// Returns a point by the name of its property.
    pub fn point(&self, object: &Element, name: &str, default: DVec3) -> Result<DVec3, SceneError> {
        object.property(name).map_or(Ok(default), |property| self.vector(property, 0.0))
    }

    /// Returns a transform by the name of its property; the identity without it.
    pub fn transform(&self, object: &Element, name: &str) -> Result<DAffine3, SceneError> {
        let Some(property) = object.property(name) else { return Ok(DAffine3::IDENTITY) };
        let mut map = DAffine3::IDENTITY;
        for step in &property.children {
            map = self.step(step)? * map;
        }
        let in_range = map.to_cols_array().iter().all(|number| number.is_finite());
        in_range.then_some(map).ok_or_else(|| self.error(property, "the transform goes beyond all numbers"))
    }

    fn step(&self, step: &Rc<Element>) -> Result<DAffine3, SceneError> {
        match step.tag.as_str() {
            "translate" => Ok(DAffine3::from_translation(self.vector(step, 0.0)?)),
            "scale" => Ok(DAffine3::from_scale(self.vector(step, 1.0)?)),
            "rotate" => {
                let angle = self.parse_number(step, self.required(step, "angle")?)?;
                rotation(self.vector(step, 0.0)?, angle)
                    .ok_or_else(|| self.error(step, "the axis of the rotation is 0"))
            }
            "lookat" | "lookAt" => {
                let three = |name: &str| match self.numbers(step, self.required(step, name)?)?[..] {
                    [x, y, z] => Ok(DVec3::new(x, y, z)),
                    _ => Err(self.error(step, format!("{name} needs three numbers"))),
                };
                let up = if step.attribute("up").is_some() { three("up")? } else { DVec3::Y };
                look_at(three("origin")?, three("target")?, up).ok_or_else(|| {
                    self.error(step, "there is no view: target is origin, or up is along the view (or 0)")
                })
            }
            "matrix" => self.matrix(step),
            _ => {
                let message = format!(
                    "{} is no step of a transform; use translate, scale, rotate, lookat or matrix",
                    step.label()
                );
                Err(self.error(step, message))
            }
        }
    }

    /// Returns a matrix of 4 x 4 or 3 x 3 numbers, row by row.
    fn matrix(&self, step: &Element) -> Result<DAffine3, SceneError> {
        let n = self.numbers(step, self.required(step, "value")?)?;
        let rows =
            |width: usize| DMat3::from_cols_array_2d(&[0, 1, 2].map(|c| [0, 1, 2].map(|r| n[r * width + c])));
        match n.len() {
            9 => Ok(DAffine3::from_mat3(rows(3))),
            16 if n[12..] == [0.0, 0.0, 0.0, 1.0] => {
                Ok(DAffine3::from_mat3_translation(rows(4), DVec3::new(n[3], n[7], n[11])))
            }
            16 => Err(self.error(step, "the last row of the matrix must be 0 0 0 1")),
            count => Err(self.error(step, format!("the matrix has {count} numbers; it needs 16 or 9"))),
        }
    }
}
