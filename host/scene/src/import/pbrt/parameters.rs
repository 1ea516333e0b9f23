//! Parameters of directives: a list of types, names and values.

use super::super::source_location::shown;
use super::spectrum::Spectrum;
use super::tokens::{At, Token, Tokens, number};
use crate::error::SceneError;
use glam::DVec3;
use std::cell::Cell;

/// Types of values.
const TYPES: [&str; 16] = [
    "float",
    "integer",
    "bool",
    "string",
    "texture",
    "spectrum",
    "rgb",
    "blackbody",
    "point",
    "point2",
    "point3",
    "vector",
    "vector2",
    "vector3",
    "normal",
    "normal3",
];

/// Values of a parameter.
#[derive(Clone, Debug)]
enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Flags(Vec<bool>),
}

/// A parameter.
#[derive(Clone, Debug)]
pub struct Parameter {
    kind: String,
    /// Name of the parameter.
    pub name: String,
    values: Values,
    /// Place of its name.
    pub at: At,
    is_used: Cell<bool>,
}

/// Parameters of a directive.
#[derive(Clone, Debug, Default)]
pub struct Parameters(Vec<Parameter>);

impl Parameters {
    /// Reads the parameters that follow.
    pub fn read(tokens: &mut Tokens) -> Result<Self, SceneError> {
        let mut parameters: Vec<Parameter> = Vec::new();
        loop {
            match tokens.take()? {
                Some(Token::Text(text)) => {
                    let at = tokens.at;
                    let mut words = text.split_whitespace();
                    let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                        let message =
                            format!("\"{}\" is no parameter; it must be a type and a name", shown(&text));
                        return Err(tokens.error(at, message));
                    };
                    let kind = if kind == "color" { "rgb" } else { kind };
                    if !TYPES.contains(&kind) {
                        let message = format!("unknown type \"{}\" of a parameter", shown(kind));
                        return Err(tokens.error(at, message));
                    }
                    if parameters.iter().any(|known| known.name == name) {
                        return Err(
                            tokens.error(at, format!("the parameter \"{}\" occurs twice", shown(name)))
                        );
                    }
                    let (kind, name) = (kind.to_owned(), name.to_owned());
                    let values = values(tokens)?;
                    parameters.push(Parameter { kind, name, values, at, is_used: Cell::new(false) });
                }
                Some(token) => {
                    tokens.put_back(token);
                    return Ok(Self(parameters));
                }
                None => return Ok(Self(parameters)),
            }
        }
    }

    /// Adds parameters, but for those that are there already.
    pub fn extend_by(&mut self, defaults: &Self) {
        for parameter in &defaults.0 {
            if !self.0.iter().any(|known| known.name == parameter.name) {
                self.0.push(parameter.clone());
            }
        }
    }

    /// Puts parameters in place of those of the same names.
    pub fn override_by(&mut self, newer: Self) {
        let older = std::mem::replace(self, newer);
        self.extend_by(&older);
    }

    /// Returns the number of parameters.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns a parameter, and marks it as used.
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        let found = self.0.iter().find(|parameter| parameter.name == name)?;
        found.is_used.set(true);
        Some(found)
    }

    /// Marks parameters that change nothing here as used.
    pub fn ignore(&self, names: &[&str]) {
        for name in names {
            let _ = self.get(name);
        }
    }

    /// Returns the parameters that nothing has used.
    pub fn unused(&self) -> impl Iterator<Item = &Parameter> {
        self.0.iter().filter(|parameter| !parameter.is_used.get())
    }

    /// Returns a number by its name.
    pub fn number(&self, tokens: &Tokens, name: &str, default: f64) -> Result<f64, SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(default) };
        match parameter.values {
            Values::Numbers(ref numbers) if numbers.len() == 1 => Ok(numbers[0]),
            _ => Err(tokens.error(parameter.at, format!("{name} needs one number"))),
        }
    }

    /// Returns a count of at least `least` by its name.
    pub fn count(&self, tokens: &Tokens, name: &str, least: u32, default: u32) -> Result<u32, SceneError> {
        let number = self.number(tokens, name, f64::from(default))?;
        if number.fract() == 0.0 && (f64::from(least)..=f64::from(u32::MAX)).contains(&number) {
            return Ok(number as u32);
        }
        let at = self.get(name).map_or(tokens.at, |parameter| parameter.at);
        Err(tokens
            .error(at, format!("{name} is {number}; it must be a whole number from {least} to {}", u32::MAX)))
    }

    /// Returns numbers by their name; none without the parameter.
    pub fn numbers(&self, tokens: &Tokens, name: &str) -> Result<&[f64], SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(&[]) };
        match &parameter.values {
            Values::Numbers(numbers) => Ok(numbers),
            _ => Err(tokens.error(parameter.at, format!("{name} needs numbers"))),
        }
    }

    /// Returns vectors by their name; none without the parameter.
    pub fn vectors(&self, tokens: &Tokens, name: &str) -> Result<Vec<DVec3>, SceneError> {
        let numbers = self.numbers(tokens, name)?;
        if !numbers.len().is_multiple_of(3) {
            let at = self.get(name).map_or(tokens.at, |parameter| parameter.at);
            return Err(
                tokens.error(at, format!("{name} has {} numbers; it needs three each", numbers.len()))
            );
        }
        Ok(numbers.chunks_exact(3).map(DVec3::from_slice).collect())
    }

    /// Returns a point by its name.
    pub fn point(&self, tokens: &Tokens, name: &str, default: DVec3) -> Result<DVec3, SceneError> {
        match self.vectors(tokens, name)?[..] {
            [] => Ok(default),
            [point] => Ok(point),
            _ => {
                let at = self.get(name).map_or(tokens.at, |parameter| parameter.at);
                Err(tokens.error(at, format!("{name} needs three numbers")))
            }
        }
    }

    /// Returns a truth value by its name.
    pub fn flag(&self, tokens: &Tokens, name: &str, default: bool) -> Result<bool, SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(default) };
        match &parameter.values {
            Values::Flags(flags) if flags.len() == 1 => Ok(flags[0]),
            Values::Texts(texts) if texts.len() == 1 && texts[0] == "true" => Ok(true),
            Values::Texts(texts) if texts.len() == 1 && texts[0] == "false" => Ok(false),
            _ => Err(tokens.error(parameter.at, format!("{name} must be true or false"))),
        }
    }

    /// Returns a text by its name.
    pub fn text(&self, tokens: &Tokens, name: &str) -> Result<Option<&str>, SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(None) };
        match &parameter.values {
            Values::Texts(texts) if texts.len() == 1 => Ok(Some(&texts[0])),
            _ => Err(tokens.error(parameter.at, format!("{name} needs one text"))),
        }
    }

    /// Returns texts by their name; none without the parameter.
    pub fn texts(&self, tokens: &Tokens, name: &str) -> Result<&[String], SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(&[]) };
        match &parameter.values {
            Values::Texts(texts) => Ok(texts),
            _ => Err(tokens.error(parameter.at, format!("{name} needs texts"))),
        }
    }

    /// Returns the name of a texture, if the parameter is one.
    pub fn texture(&self, tokens: &Tokens, name: &str) -> Result<Option<&str>, SceneError> {
        match self.0.iter().find(|parameter| parameter.name == name) {
            Some(parameter) if parameter.kind == "texture" => self.text(tokens, name),
            _ => Ok(None),
        }
    }

    /// Returns a spectrum by its name; a number is one, too.
    pub fn spectrum(&self, tokens: &Tokens, name: &str) -> Result<Option<Spectrum>, SceneError> {
        let Some(parameter) = self.get(name) else { return Ok(None) };
        let found = match (&parameter.values, parameter.kind.as_str()) {
            (Values::Numbers(numbers), "rgb" | "spectrum" | "blackbody" | "float") => {
                match (parameter.kind.as_str(), &numbers[..]) {
                    ("rgb", &[r, g, b]) => Some(Spectrum::Rgb(DVec3::new(r, g, b))),
                    ("float", &[value]) => Some(Spectrum::Rgb(DVec3::splat(value))),
                    ("blackbody", &[kelvin]) => Some(Spectrum::Blackbody(kelvin)),
                    ("spectrum", numbers) => Spectrum::of_samples(numbers),
                    _ => None,
                }
            }
            (Values::Texts(texts), "spectrum") if texts.len() == 1 => Some(Spectrum::Named(texts[0].clone())),
            _ => None,
        };
        found.map(Some).ok_or_else(|| {
            let message = format!(
                "{name} is no spectrum; it must be \"rgb\" with three numbers, \"blackbody\" with one, or \
                 \"spectrum\" with ascending wavelengths and values, or a name"
            );
            tokens.error(parameter.at, message)
        })
    }
}

/// Reads one value, or values between brackets.
fn values(tokens: &mut Tokens) -> Result<Values, SceneError> {
    let first = tokens.take()?;
    let is_list = first == Some(Token::Open);
    let mut token = if is_list { tokens.take()? } else { first };
    let mut values = None;
    loop {
        // Meshes have millions of numbers.
        if let (Some(Values::Numbers(all)), Some(Token::Word(word))) = (&mut values, &token)
            && let Some(number) = number(word)
        {
            all.push(number);
            token = tokens.take()?;
            continue;
        }
        let one = match token {
            Some(Token::Close) if is_list => break,
            Some(token) => value(token, tokens)?,
            None => {
                return Err(
                    tokens.error(tokens.at, "the file ends within a parameter; its values must follow")
                );
            }
        };
        match (&mut values, one) {
            (None, one) => values = Some(one),
            (Some(Values::Numbers(all)), Values::Numbers(one)) => all.extend(one),
            (Some(Values::Texts(all)), Values::Texts(one)) => all.extend(one),
            (Some(Values::Flags(all)), Values::Flags(one)) => all.extend(one),
            _ => return Err(tokens.error(tokens.at, "the values of a parameter must be of one type")),
        }
        if !is_list {
            break;
        }
        token = tokens.take()?;
    }
    Ok(values.unwrap_or(Values::Numbers(Vec::new())))
}

fn value(token: Token, tokens: &Tokens) -> Result<Values, SceneError> {
    match token {
        Token::Text(text) => Ok(Values::Texts(vec![text])),
        Token::Word(word) if word == "true" => Ok(Values::Flags(vec![true])),
        Token::Word(word) if word == "false" => Ok(Values::Flags(vec![false])),
        Token::Word(ref word) => match number(word) {
            Some(number) => Ok(Values::Numbers(vec![number])),
            None => {
                let message = format!(
                    "{} is no value; a finite number, a text, true or false must stand here",
                    token.shown()
                );
                Err(tokens.error(tokens.at, message))
            }
        },
        Token::Open | Token::Close => {
            let message =
                format!("{} is no value; a number, a text, true or false must stand here", token.shown());
            Err(tokens.error(tokens.at, message))
        }
    }
}
