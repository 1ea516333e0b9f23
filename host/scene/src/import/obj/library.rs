//! Reads the statements of MTL files, without converting their materials.

use super::super::budget::Budget;
use super::super::files::{Files, readable};
use super::super::source_location::{SourceLocation, shown};
use super::super::warnings::Warnings;
use super::lines::{Source, Statement};
use super::map::{Map, map, portable};
use crate::error::SceneError;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::io::{Error, ErrorKind};

/// Materials of the libraries that have been read, by name.
#[derive(Debug, Default)]
pub struct Libraries {
    pub entries: HashMap<String, Entry>,
    /// Paths of the files that have been read.
    known: HashSet<String>,
}

/// The statements of an MTL file about a material, with the numbers of the file.
#[derive(Debug, Default)]
pub struct Entry {
    /// File of the material, for messages; `line` is that of its newmtl.
    pub file: String,
    pub line: usize,
    pub diffuse: Option<DVec3>,
    pub specular: Option<DVec3>,
    pub emission: Option<DVec3>,
    pub filter: Option<DVec3>,
    pub exponent: Option<f64>,
    pub ior: Option<f64>,
    pub dissolve: Option<f64>,
    pub transparency: Option<f64>,
    pub illumination: Option<f64>,
    pub roughness: Option<f64>,
    pub metallic: Option<f64>,
    pub diffuse_map: Option<Map>,
    pub specular_map: Option<Map>,
    pub emission_map: Option<Map>,
    pub roughness_map: Option<Map>,
    pub metallic_map: Option<Map>,
    /// Height map, or a normal map.
    pub bump_map: Option<Map>,
    pub normal_map: Option<Map>,
}

impl Libraries {
    /// Adds the materials of the libraries that `mtllib` names: one name, which may contain spaces,
    /// or several names. A missing library is a warning.
    pub fn read(
        &mut self,
        names: &str,
        site: &SourceLocation,
        files: &mut dyn Files,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let Some(error) = self.read_one(names, site, files, budget, warnings)? else { return Ok(()) };
        let mut missing = vec![(names, error)];
        if names.contains(char::is_whitespace) {
            let words: Vec<&str> = names.split_whitespace().collect();
            let mut each = Vec::new();
            for &word in &words {
                let error = self.read_one(word, site, files, budget, warnings)?;
                each.extend(error.map(|error| (word, error)));
            }
            // If all are missing, the line is one name with spaces as likely as not.
            if each.len() < words.len() {
                missing = each;
            }
        }
        for (name, error) in missing {
            let (SourceLocation { place, .. }, name) = (site, shown(name));
            warnings.once(format!(
                "{place}: the material library \"{name}\" is missing ({error}): its materials are diffuse grey, as of a model without materials"
            ));
        }
        Ok(())
    }

    /// Adds the materials of one library, unless it was read. Returns the error for a missing one.
    fn read_one(
        &mut self,
        name: &str,
        site: &SourceLocation,
        files: &mut dyn Files,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Option<Error>, SceneError> {
        let path = portable(name);
        if self.known.contains(&path) {
            return Ok(None);
        }
        match files.read(&path, readable()) {
            Ok(bytes) => self.add(&path, &bytes, budget, warnings).map(|()| None),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Some(error)),
            Err(error) => Err(site.resource(name, error)),
        }
    }

    fn add(
        &mut self,
        path: &str,
        bytes: &[u8],
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        budget.extend(bytes.len());
        self.known.insert(path.to_owned());
        let source = Source::new(path, bytes);
        let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut current: Option<(String, Entry)> = None;
        for statement in source.statements() {
            if statement.keyword() == "newmtl" {
                self.entries.extend(current.take());
                let site = SourceLocation::new(path, format!("line {}", statement.line));
                budget.take(2 * size_of::<(String, Entry)>() as u64, &site)?; // a map may be half empty
                let entry = Entry { file: shown(path), line: statement.line, ..Entry::default() };
                current = Some((statement.rest().to_owned(), entry));
                continue;
            }
            let Some((_, entry)) = &mut current else {
                // The file may be anything, so messages must not show its text.
                let site = SourceLocation::new(path, format!("line {}", statement.line));
                let problem = "no newmtl comes before this statement";
                return Err(site.malformed(problem, "mtllib must name a material library (MTL)"));
            };
            entry.set(&statement, folder, warnings)?;
        }
        self.entries.extend(current);
        Ok(())
    }
}

impl Entry {
    fn set(
        &mut self,
        statement: &Statement,
        folder: &str,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let number = |slot: &mut Option<f64>| -> Result<(), SceneError> {
            let [number] = statement.numbers(1)?;
            if !number.is_finite() {
                return Err(statement.error("", format!("{number} is not finite")));
            }
            *slot = Some(number);
            Ok(())
        };
        match statement.keyword() {
            "Kd" => self.diffuse = colour(statement, warnings)?,
            "Ks" => self.specular = colour(statement, warnings)?,
            "Ke" => self.emission = colour(statement, warnings)?,
            "Tf" => self.filter = colour(statement, warnings)?,
            "Ns" => number(&mut self.exponent)?,
            "Ni" => number(&mut self.ior)?,
            "d" if statement.arguments().next() == Some("-halo") => {
                warnings.once("the MTL option \"d -halo\" is not supported and ignored");
            }
            "d" => number(&mut self.dissolve)?,
            "Tr" => number(&mut self.transparency)?,
            "illum" => number(&mut self.illumination)?,
            "Pr" => number(&mut self.roughness)?,
            "Pm" => number(&mut self.metallic)?,
            "map_Kd" => self.diffuse_map = map(statement, folder, warnings)?,
            "map_Ks" => self.specular_map = map(statement, folder, warnings)?,
            "map_Ke" => self.emission_map = map(statement, folder, warnings)?,
            "map_Pr" => self.roughness_map = map(statement, folder, warnings)?,
            "map_Pm" => self.metallic_map = map(statement, folder, warnings)?,
            "map_Bump" | "map_bump" | "bump" => self.bump_map = map(statement, folder, warnings)?,
            "norm" | "map_Kn" => self.normal_map = map(statement, folder, warnings)?,
            "Ka" => {} // ambient light is computed
            other => {
                warnings.once(format!("the MTL statement \"{}\" is not supported and ignored", shown(other)));
            }
        }
        Ok(())
    }
}

/// Parses red, green and blue, or one number for all of them.
fn colour(statement: &Statement, warnings: &mut Warnings) -> Result<Option<DVec3>, SceneError> {
    if let Some(kind @ ("spectral" | "xyz")) = statement.arguments().next() {
        warnings.once(format!("MTL colours by \"{kind}\" are not supported and ignored"));
        return Ok(None);
    }
    let numbers = if statement.arguments().nth(1).is_none() {
        let [grey] = statement.numbers(1)?;
        [grey; 3]
    } else {
        statement.numbers(3)?
    };
    let colour = DVec3::from(numbers);
    if colour.is_finite() {
        return Ok(Some(colour));
    }
    Err(statement.error("", format!("the colour {colour} is not finite")))
}
