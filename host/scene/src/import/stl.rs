//! Reads STL, binary and text: triangles without anything else.

use super::budget::Budget;
use super::mesh::{self, POSITION_REMEDY, check_position, extent, finish};
use super::source_location::{SourceLocation, shown};
use super::warnings::Warnings;
use crate::description::{Description, Instance, Lambertian, Material, Mesh};
use crate::error::SceneError;
use glam::DAffine3;
use std::str::SplitAsciiWhitespace;

/// Bytes before the triangles of a binary file, and bytes of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads STL from `bytes`; `name` stands for the file in messages.
///
/// The normals of the file are ignored: the order of the vertices states the front, as most
/// programs have it. The material is that of PLY files.
///
/// # Errors
///
/// * [`SceneError::Malformed`] for data that is cut off, or that is not STL
/// * [`SceneError::TooLarge`] for data beyond the limits
pub fn parse(bytes: &[u8], name: &str) -> Result<Description, SceneError> {
    let mut budget = Budget::new(bytes.len());
    let mut warnings = Warnings::default();
    let count = bytes.get(80..).and_then(|bytes| bytes.first_chunk()).map(|count| u32::from_le_bytes(*count));
    let exact = |count: u32| HEADER as u64 + TRIANGLE as u64 * u64::from(count);
    let is_binary = count.is_some_and(|count| exact(count) == bytes.len() as u64);
    let starts = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Text has no byte 0, which the header or the count of a binary file has nearly always.
    let starts = starts && !bytes.iter().take(HEADER).any(|byte| *byte == 0);
    let corners = match (is_binary, starts, count) {
        (false, true, _) => text(bytes, name, &mut budget)?,
        (_, _, Some(count)) => binary(bytes, count, name, &mut budget, &mut warnings)?,
        (_, _, None) => {
            let site = SourceLocation::new(name, "the header");
            return Err(site.malformed("it is not STL", "a file has 84 bytes or more, or begins with solid"));
        }
    };
    let site = SourceLocation::new(name, "the triangles");
    for (index, corner) in corners.iter().enumerate() {
        check_position(corner.map(f64::from)).map_err(|problem| {
            let site = SourceLocation::new(name, format!("triangle {}", index / 3));
            site.malformed(format!("a vertex at {problem}"), POSITION_REMEDY)
        })?;
    }
    let triangles = (0..(corners.len() / 3) as u32).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]);
    let mesh = Mesh {
        name: "stl".to_owned(),
        triangles: triangles.collect(),
        positions: corners,
        ..Mesh::default()
    };
    let mut description = Description::default();
    description.materials.push(Material::from(Lambertian::rgb(0.8, 0.8, 0.8)).named("default"));
    if let Some(mesh) = finish(mesh, &site, &mut warnings) {
        if mesh::check_instance(extent(&mesh), mesh.triangles.len(), &DAffine3::IDENTITY, &mut budget, &site)?
        {
            description.instances.push(Instance { mesh: 0, transform: DAffine3::IDENTITY });
        }
        description.meshes.push(mesh);
    }
    description.warnings = warnings.finish();
    Ok(description)
}

/// Returns the vertices of the triangles of a binary file.
fn binary(
    bytes: &[u8],
    count: u32,
    name: &str,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Vec<[f32; 3]>, SceneError> {
    let site = SourceLocation::new(name, "the header");
    let body = bytes.get(HEADER..).unwrap_or_default();
    if body.len() / TRIANGLE < count as usize {
        let problem =
            format!("it states {count} triangles, and there are bytes for {}", body.len() / TRIANGLE);
        return Err(site.malformed(problem, "the file is cut off, or not STL: copy or export it again"));
    }
    warnings.tally(
        "bytes after the last triangle, ignored",
        (body.len() - TRIANGLE * count as usize) as u64,
        &site.place,
    );
    budget.take(mesh::bytes(3 * u64::from(count), count.into()), &site)?;
    let number = |bytes: &[u8], at: usize| {
        f32::from_le_bytes(bytes.get(at..).and_then(|bytes| bytes.first_chunk().copied()).unwrap_or_default())
    };
    let triangles = body.chunks_exact(TRIANGLE).take(count as usize);
    Ok(triangles
        .flat_map(|triangle| [12, 24, 36].map(|at| [0, 4, 8].map(|axis| number(triangle, at + axis))))
        .collect())
}

/// Returns the vertices of the triangles of a text; a facet of more vertices is a fan.
fn text(bytes: &[u8], name: &str, budget: &mut Budget) -> Result<Vec<[f32; 3]>, SceneError> {
    let site = |line: usize| SourceLocation::new(name, format!("line {}", line + 1));
    let (mut corners, mut facet, mut open) = (Vec::new(), Vec::new(), 0usize);
    for (line, text) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let Ok(text) = str::from_utf8(text) else {
            // A name of a solid may be in any encoding.
            continue;
        };
        let mut words = text.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        match word.to_ascii_lowercase().as_str() {
            "vertex" => facet.push(vertex(&mut words, &site(line))?),
            "endfacet" | "endloop" => {
                if let [first, others @ ..] = &facet[..] {
                    for &[a, b] in others.array_windows() {
                        budget.take(mesh::bytes(3, 1), &site(line))?;
                        corners.extend([*first, a, b]);
                    }
                }
                facet.clear();
            }
            "solid" => open = line + 1,
            "endsolid" => open = 0,
            "facet" | "outer" => {}
            other => {
                let problem = format!("\"{}\" is not a word of STL", shown(other));
                return Err(
                    site(line).malformed(problem, "use solid, facet, outer loop, vertex and their ends")
                );
            }
        }
    }
    if open > 0 {
        let problem = "the solid has no endsolid: the file is cut off";
        return Err(site(open - 1).malformed(problem, "copy or export it again"));
    }
    Ok(corners)
}

fn vertex(words: &mut SplitAsciiWhitespace, site: &SourceLocation) -> Result<[f32; 3], SceneError> {
    let mut position = [0.0; 3];
    for value in &mut position {
        *value = words
            .next()
            .and_then(|word| word.parse().ok())
            .ok_or_else(|| site.malformed("a vertex does not have three numbers", "write vertex X Y Z"))?;
    }
    Ok(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary_file(count: u32, triangles: usize) -> Vec<u8> {
        let mut file = b"solid but binary".to_vec();
        file.resize(80, 0);
        file.extend(count.to_le_bytes());
        for index in 0..triangles {
            let z = index as f32;
            for number in [0.0, 0.0, f32::NAN, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z] {
                file.extend(number.to_le_bytes());
            }
            file.extend([0; 2]);
        }
        file
    }

    const TEXT: &str = "solid\nFACET normal nan 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1e0 0\n\
                        vertex 0 1 0\nendloop\nendfacet\nendsolid\nsolid b\nendsolid b\n";

    #[test]
    fn both_kinds_are_read() {
        let scene = parse(&binary_file(2, 2), "a.stl").unwrap();
        assert_eq!(scene.meshes[0].positions[3..], [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]);
        assert!(scene.warnings.is_empty() && scene.instances.len() == 1);
        let scene = parse(TEXT.as_bytes(), "a.stl").unwrap();
        assert_eq!(scene.meshes[0].triangles.len(), 2);
        assert_eq!(scene.meshes[0].positions[3..], [[0.0; 3], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    }

    #[test]
    fn broken_files_name_the_place() {
        let message = |bytes: &[u8]| parse(bytes, "a.stl").unwrap_err().to_string();
        assert!(message(b"").contains("the header: it is not STL"));
        let mut long = binary_file(9, 2);
        long[0] = b'x';
        assert!(message(&long).contains("it states 9 triangles, and there are bytes for 2"));
        let found = message(TEXT.replace("vertex 1 0 0", "vertex 1 0").as_bytes());
        assert!(found.contains("line 5: a vertex does not have three numbers"), "{found}");
        assert!(
            message(TEXT.replace("outer", "inner").as_bytes()).contains("line 3: \"inner\" is not a word")
        );
        assert!(message(TEXT.replace("1e0", "1e30").as_bytes()).contains("is beyond 1e18"));
        assert!(
            message(TEXT.split("endsolid").next().unwrap().as_bytes())
                .contains("line 1: the solid has no endsolid")
        );
        let mut longer = binary_file(2, 2);
        longer.push(7);
        let scene = parse(&longer, "a.stl").unwrap();
        assert_eq!(scene.warnings, ["bytes after the last triangle, ignored: 1, the first in the header"]);
    }
}
