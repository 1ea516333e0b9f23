//! Reads the statements of an OBJ file: vertices, and groups of triangles with their materials.

use super::super::mesh::{POSITION_REMEDY, check_position};
use super::super::source_location::{SourceLocation, shown};
use super::super::warnings::Warnings;
pub use super::group::{Group, NONE};
use super::lines::{Source, Statement};
use super::smoothing::Smoothing;
use crate::error::SceneError;
use std::collections::{HashMap, HashSet};

/// Content of an OBJ file.
#[derive(Debug, Default)]
pub struct Geometry {
    pub positions: Vec<[f64; 3]>,
    /// Texture coordinates; (0, 0) is the top left.
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f32; 3]>,
    pub groups: Vec<Group>,
    /// Names of material libraries, with their lines.
    pub libraries: Vec<(String, usize)>,
    names: Names,
    materials: Names,
}

/// Kind of the normals of a face.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Normals {
    Flat,
    /// Normals of `vn`.
    Given,
    /// Normals of a smoothing group.
    Smooth,
}

/// Distinct names, numbered from 0.
#[derive(Debug, Default)]
struct Names {
    all: Vec<String>,
    index: HashMap<String, u32>,
}

impl Names {
    fn number(&mut self, name: &str) -> u32 {
        if let Some(&number) = self.index.get(name) {
            return number;
        }
        let number = self.all.len() as u32; // below 2^32: each takes a line, and `read` limits lines
        self.all.push(name.to_owned());
        self.index.insert(name.to_owned(), number);
        number
    }

    fn name(&self, number: u32) -> &str {
        self.all.get(number as usize).map_or("", String::as_str)
    }
}

impl Geometry {
    /// Returns the name of a group's object or group; "" before the first one.
    pub fn name(&self, group: &Group) -> &str {
        self.names.name(group.name)
    }

    /// Returns the position of each corner of each triangle.
    pub fn corners(&self) -> impl Iterator<Item = [f64; 3]> {
        let corners = self.groups.iter().flat_map(|group| group.triangles.as_flattened());
        corners.filter_map(|&[position, ..]| self.positions.get(position as usize).copied())
    }

    /// Returns the name of a group's material; "" without one.
    pub fn material(&self, group: &Group) -> &str {
        self.materials.name(group.material)
    }
}

/// Reads all statements of a file. Smoothing groups have an effect only if `is_smoothed`.
pub fn read(source: &Source, is_smoothed: bool, warnings: &mut Warnings) -> Result<Geometry, SceneError> {
    let mut geometry = Geometry::default();
    let mut groups: HashMap<(u32, u32, bool, Normals), usize> = HashMap::new();
    let mut libraries = HashSet::new();
    let mut name = geometry.names.number("");
    let mut material = geometry.materials.number("");
    let (mut smoothing, mut smoothing_groups) = (Smoothing::default(), Names::default());
    let (mut smoothing_group, mut polygon) = (None, Vec::new());
    for statement in source.statements() {
        if statement.line >= NONE as usize {
            return Err(statement.error("", format!("there are more than {NONE} lines")));
        }
        match statement.keyword() {
            "v" => {
                let [x, y, z, _, g, _] = statement.numbers(3)?;
                if g != 0.0 {
                    warnings.once("vertex colours (v with six numbers) are not supported and ignored");
                }
                let position = check_position([x, y, z])
                    .map_err(|problem| statement.error("", format!("{problem}; {POSITION_REMEDY}")))?;
                geometry.positions.push(position);
            }
            "vt" => {
                let [u, v] = statement.numbers(1)?;
                geometry.uvs.push([u as f32, (1.0 - v) as f32]);
            }
            "vn" => geometry.normals.push(statement.numbers(3)?.map(|x: f64| x as f32)),
            "f" => {
                polygon.clear();
                for word in statement.arguments() {
                    polygon.push(corner(&statement, word, &geometry)?);
                }
                let place = || format!("line {}", statement.line);
                let [first, others @ ..] = &mut polygon[..] else {
                    warnings.tally("faces with fewer than three vertices, dropped", 1, &place());
                    continue;
                };
                if others.len() < 2 {
                    warnings.tally("faces with fewer than three vertices, dropped", 1, &place());
                    continue;
                }
                let has =
                    |part: usize| first[part] != NONE && others.iter().all(|corner| corner[part] != NONE);
                let (uvs, normals) = (has(1), has(2));
                for corner in std::iter::once(&mut *first).chain(&mut *others) {
                    *corner = [
                        corner[0],
                        if uvs { corner[1] } else { NONE },
                        if normals { corner[2] } else { NONE },
                    ];
                }
                let kind = match (normals, smoothing_group) {
                    (true, _) => Normals::Given,
                    (false, Some(_)) => Normals::Smooth,
                    (false, None) => Normals::Flat,
                };
                let is_smooth = kind == Normals::Smooth;
                let group = *groups.entry((name, material, uvs, kind)).or_insert_with(|| {
                    geometry.groups.push(Group { name, material, is_smooth, triangles: Vec::new() });
                    geometry.groups.len() - 1
                });
                let fan = others.array_windows().map(|&[second, third]| {
                    let triangle = [*first, second, third];
                    let smoothed = smoothing_group.map(|of| smoothing.add(of, triangle, &geometry.positions));
                    smoothed.filter(|_| is_smooth).unwrap_or(triangle)
                });
                geometry.groups[group].triangles.extend(fan);
            }
            "o" | "g" => name = geometry.names.number(statement.rest()),
            "s" => {
                smoothing_group = match statement.arguments().next().unwrap_or_default() {
                    "" | "0" | "off" => None,
                    group => Some(smoothing_groups.number(group)).filter(|_| is_smoothed),
                }
            }
            "usemtl" => material = geometry.materials.number(statement.rest()),
            "mtllib" => {
                if libraries.insert(statement.rest().to_owned()) {
                    geometry.libraries.push((statement.rest().to_owned(), statement.line));
                }
            }
            other => {
                warnings.once(format!("the OBJ statement \"{}\" is not supported and ignored", shown(other)));
            }
        }
    }
    let Geometry { groups, positions, normals, .. } = &mut geometry;
    smoothing.finish(groups, positions, normals).ok_or_else(|| {
        SourceLocation::new(source.name, "smoothing groups").too_large("too many normals", NONE.to_string())
    })?;
    Ok(geometry)
}

/// Parses a face's corner, `v`, `v/vt`, `v//vn` or `v/vt/vn`, as three indices.
fn corner(statement: &Statement, word: &str, geometry: &Geometry) -> Result<[u32; 3], SceneError> {
    let Geometry { positions, uvs, normals, .. } = geometry;
    let mut parts = word.split('/');
    let mut index = |what: &str, count: usize| -> Result<u32, SceneError> {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() && what != "v" {
            return Ok(NONE);
        }
        let number: i64 = part.parse().map_err(|_| {
            let message =
                format!("\"{}\" is not a vertex; a face takes v, v/vt, v//vn or v/vt/vn", shown(word));
            statement.error(word, message)
        })?;
        // Positive numbers count from 1, negative ones back from the latest.
        let place = if number > 0 { number - 1 } else { number.saturating_add(count as i64) };
        if number == 0 || !(0..count as i64).contains(&place) {
            let message = format!(
                "{what} {number} does not exist, there are {count} before this line; the first is 1, the latest -1"
            );
            return Err(statement.error(word, message));
        }
        Ok(place as u32)
    };
    let corner = [index("v", positions.len())?, index("vt", uvs.len())?, index("vn", normals.len())?];
    Ok(corner)
}
