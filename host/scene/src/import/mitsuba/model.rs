//! Meshes of OBJ and PLY files, as Mitsuba reads them.

use super::super::assembly::{Item, Part, oriented, smooth, turned_inside_out};
use super::super::files::Files;
use super::super::{obj, ply};
use super::document::Element;
use super::{Reader, SceneError};
use crate::description::{Description, Mesh};
use glam::{DAffine3, DVec3};
use std::rc::Rc;

/// Files without content: Mitsuba does not read the materials of models.
struct Empty;

impl Files for Empty {
    fn read(&mut self, _: &str, _: u64) -> std::io::Result<Vec<u8>> {
        Ok(Vec::new())
    }
}

impl Reader<'_, '_> {
    /// Returns the meshes of an OBJ or PLY file; a file is read once for each material.
    pub fn model(
        &mut self,
        element: &Rc<Element>,
        map: &DAffine3,
        is_flipped: bool,
        material: usize,
    ) -> Result<Rc<[Item]>, SceneError> {
        let document = self.document;
        let site = document.site(element);
        let name = document.word(element, "filename")?;
        let name =
            name.ok_or_else(|| document.error(element, format!("{} needs a filename", element.label())))?;
        let is_obj = element.kind() == "obj";
        let is_flat = document.flag(element, "face_normals", false)?;
        let is_turned = document.flag(element, "flip_tex_coords", is_obj)?;
        // Normals that the file does not state follow the triangles, which a reflection turns over.
        let is_mirrored = map.matrix3.determinant() < 0.0;
        let flags = [is_flipped, is_flat, is_turned, is_mirrored];
        let bits = flags.iter().fold(0, |bits, &flag| bits << 1 | u8::from(flag));
        let key = (name.to_owned(), bits, material);
        if let Some(known) = self.models.get(&key) {
            let moved = known.iter().map(|item| Item { transform: *map * item.transform, ..item.clone() });
            return Ok(moved.collect());
        }
        let bytes = self.assembly.read(name, &site)?;
        self.assembly.extend_budget(name, bytes.len());
        let read = match is_obj {
            true => obj::parse_unsmoothed(&bytes, name, &mut Empty)?,
            false => ply::parse(&bytes, name)?,
        };
        let Description { meshes, instances, warnings, .. } = read;
        self.assembly.add_warnings(&warnings, name);
        let mut items = Vec::new();
        for (mesh, instance) in meshes.into_iter().zip(instances) {
            let mut mesh = Mesh { material, ..mesh };
            let has_normals = !mesh.normals.is_empty() && !is_flat;
            if is_flat {
                mesh.normals = Vec::new();
            } else if mesh.normals.is_empty() {
                smooth(&mut mesh);
            }
            // The readers have turned v once.
            if !is_turned {
                mesh.uvs.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
            }
            if has_normals {
                mesh = oriented(mesh);
            } else if is_mirrored {
                mesh = turned_inside_out(mesh);
            }
            if is_flipped {
                mesh = turned_inside_out(mesh);
            }
            if let Some(mesh) = self.assembly.add_mesh(mesh, &site)? {
                let part = Part::Mesh { mesh, origin: DVec3::ZERO };
                items.push(Item { part, transform: instance.transform });
            }
        }
        let items: Rc<[Item]> = items.into();
        self.models.insert(key, Rc::clone(&items));
        Ok(items.iter().map(|item| Item { transform: *map * item.transform, ..item.clone() }).collect())
    }
}
