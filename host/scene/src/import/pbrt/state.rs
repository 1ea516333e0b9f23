//! Graphics state of a pbrt file, and the transforms that change it.

use super::super::assembly::{look_at, rotation};
use super::parameters::Parameters;
use super::tokens::{At, Token, number};
use super::{Reader, SceneError, shown};
use glam::{DAffine3, DMat3, DVec3};
use std::rc::Rc;

/// Maximum number of states that are saved at a time.
const MAX_SAVED: usize = 1024;

/// Graphics state: settings of directives for those that follow.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// Map from the current coordinates to the world; before the world begins, from the world to
    /// the camera.
    pub map: DAffine3,
    /// True if front and back are exchanged.
    pub is_reversed: bool,
    /// Index of the material.
    pub material: usize,
    /// Index of the light that shapes emit.
    pub light: Option<usize>,
    /// Name of the medium inside of surfaces; empty for none.
    pub inside: String,
    /// Name of the medium outside of surfaces; empty for none.
    pub outside: String,
    /// Parameters of shapes, lights, materials, media and textures that do not state them.
    pub defaults: [Rc<Parameters>; 5],
}

/// Targets of the directive `Attribute`, in the order of [`State::defaults`].
pub const TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];

impl Reader<'_> {
    /// Saves the state for the directive `end` to return to.
    pub fn save(&mut self, begin: &'static str, at: At) -> Result<(), SceneError> {
        if self.stack.len() >= MAX_SAVED {
            return self.error(at, format!("{begin} is nested too deeply; at most {MAX_SAVED} may be open"));
        }
        self.stack.push((begin, at, self.state.clone()));
        Ok(())
    }

    /// Returns to the state that `begin` saved.
    pub fn restore(&mut self, begin: &'static str, at: At) -> Result<(), SceneError> {
        match self.stack.pop() {
            Some((opened, _, state)) if opened == begin => {
                // The end of a transform keeps all else.
                if begin == "TransformBegin" {
                    self.state.map = state.map;
                } else {
                    self.state = state;
                }
                Ok(())
            }
            Some((opened, ..)) => self.error(at, format!("{opened} is open; its end must stand before this")),
            None => self.error(at, format!("there is no {begin} that this ends")),
        }
    }

    /// Appends a map to the current one, on the side of the shapes.
    pub fn concat(&mut self, map: DAffine3, at: At) -> Result<(), SceneError> {
        self.set_map(self.state.map * map, at)
    }

    /// Sets the current map.
    pub fn set_map(&mut self, map: DAffine3, at: At) -> Result<(), SceneError> {
        if !map.to_cols_array().iter().all(|number| number.is_finite()) {
            return self.error(at, "the transform goes beyond all numbers");
        }
        self.state.map = map;
        Ok(())
    }

    /// Reads numbers that follow a directive, with or without brackets around them.
    pub fn numbers<const N: usize>(&mut self, directive: &str) -> Result<[f64; N], SceneError> {
        let at = self.tokens.at;
        let mut numbers = [0.0; N];
        let mut is_open = false;
        let mut count = 0;
        while count < N {
            match self.tokens.take()? {
                Some(Token::Open) if count == 0 && !is_open => is_open = true,
                Some(Token::Word(word)) if number(&word).is_some() => {
                    numbers[count] = number(&word).unwrap_or_default();
                    count += 1;
                }
                Some(other) => {
                    let message = format!("{directive} needs {N} finite numbers, not {}", other.shown());
                    return self.error(self.tokens.at, message);
                }
                None => return self.error(at, format!("{directive} needs {N} numbers; the file ends")),
            }
        }
        if is_open && self.tokens.take()? != Some(Token::Close) {
            return self.error(self.tokens.at, format!("{directive} needs {N} numbers and then \"]\""));
        }
        Ok(numbers)
    }

    /// Reads the text that follows a directive.
    pub fn text(&mut self, directive: &str) -> Result<String, SceneError> {
        let at = self.tokens.at;
        match self.tokens.take()? {
            Some(Token::Text(text)) => Ok(text),
            Some(other) => {
                let message = format!("{directive} needs a text in quotes, not {}", other.shown());
                self.error(self.tokens.at, message)
            }
            None => self.error(at, format!("{directive} needs a text in quotes; the file ends")),
        }
    }

    /// Reads a directive that changes the current map; `false` for another one.
    pub fn transform(&mut self, word: &str, at: At) -> Result<bool, SceneError> {
        match word {
            "Identity" => self.state.map = DAffine3::IDENTITY,
            "Translate" => {
                let by = self.numbers::<3>(word)?;
                self.concat(DAffine3::from_translation(by.into()), at)?;
            }
            "Scale" => {
                let by = self.numbers::<3>(word)?;
                self.concat(DAffine3::from_scale(by.into()), at)?;
            }
            "Rotate" => {
                let [angle, x, y, z] = self.numbers(word)?;
                let Some(map) = rotation(DVec3::new(x, y, z), angle) else {
                    return self.error(at, "the axis of the rotation is 0");
                };
                self.concat(map, at)?;
            }
            "LookAt" => {
                let n = self.numbers::<9>(word)?;
                let [eye, target, up] = [0, 3, 6].map(|i| DVec3::from_slice(&n[i..i + 3]));
                let Some(map) = look_at(eye, target, up) else {
                    let message =
                        "there is no view: both points are the same, or up is along the view (or 0)";
                    return self.error(at, message);
                };
                self.concat(map.inverse(), at)?;
            }
            "Transform" | "ConcatTransform" => {
                let n = self.numbers::<16>(word)?;
                if [n[3], n[7], n[11], n[15]] != [0.0, 0.0, 0.0, 1.0] {
                    return self.error(at, "the numbers 4, 8, 12 and 16 of the matrix must be 0, 0, 0 and 1");
                }
                let column = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
                let linear = DMat3::from_cols(column(0), column(4), column(8));
                let map = DAffine3::from_mat3_translation(linear, column(12));
                match word {
                    "Transform" => self.set_map(map, at)?,
                    _ => self.concat(map, at)?,
                }
            }
            "CoordinateSystem" => {
                let name = self.text(word)?;
                self.assembly.budget.take(256, &self.tokens.site(at, word))?;
                self.systems.insert(name, self.state.map);
            }
            "CoordSysTransform" => {
                let name = self.text(word)?;
                match self.systems.get(&name) {
                    Some(&map) => self.state.map = map,
                    None => {
                        let message = format!("unknown coordinate system \"{}\"", shown(&name));
                        return self.error(at, message);
                    }
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}
