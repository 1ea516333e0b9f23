//! Reads the instances of a node's mesh (EXT_mesh_gpu_instancing).

use super::super::source_location::SourceLocation;
use super::accessor::{Component, Elements, Expected};
use super::json::Instancing;
use super::{Document, Output};
use crate::error::SceneError;
use Component::{F32, I8, I16};
use glam::{DAffine3, DQuat, DVec3, DVec4};

const VECTOR: Expected = Expected { kind: "VEC3", components: &[F32] };
const ROTATION: Expected = Expected { kind: "VEC4", components: &[F32, I8, I16] };

/// Returns the transforms of the instances relative to the node.
pub fn read(
    document: &Document,
    output: &mut Output,
    instancing: &Instancing,
    user: &SourceLocation,
) -> Result<Vec<DAffine3>, SceneError> {
    let site = user.member("extensions.EXT_mesh_gpu_instancing");
    let mut count = None;
    let mut open = |output: &mut Output, name: &str, expected| {
        let Some(&accessor) = instancing.attributes.get(name) else { return Ok(None) };
        let site = site.member(&format!("attributes.{name}"));
        let elements = Elements::open(document, &mut output.budget, accessor, expected, &site)?;
        if *count.get_or_insert(elements.count) != elements.count {
            let problem = format!("it has {} elements, another attribute {:?}", elements.count, count);
            return Err(site.malformed(problem, "attributes of instances must have the same count"));
        }
        Ok(Some(elements))
    };
    let translations = open(output, "TRANSLATION", VECTOR)?;
    let rotations = open(output, "ROTATION", ROTATION)?;
    let scales = open(output, "SCALE", VECTOR)?;
    let count = count.unwrap_or(1);
    output.budget.take(u64::from(count) * size_of::<DAffine3>() as u64, &site)?;
    let vector = |of: &Option<Elements>, instance, otherwise| {
        of.as_ref().map_or(otherwise, |of| DVec3::from(of.floats::<3>(instance).map(f64::from)))
    };
    let place = |instance| {
        let rotation =
            rotations.as_ref().map_or(DVec4::W, |of| of.floats::<4>(instance).map(f64::from).into());
        DAffine3::from_scale_rotation_translation(
            vector(&scales, instance, DVec3::ONE),
            DQuat::from_vec4(rotation.try_normalize().unwrap_or(DVec4::W)),
            vector(&translations, instance, DVec3::ZERO),
        )
    };
    Ok((0..count).map(place).collect())
}
