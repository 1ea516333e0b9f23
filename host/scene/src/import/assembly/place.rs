//! Meshes and shapes of a scene under construction, and their places in the world.

use super::super::mesh::{POSITION_REMEDY, bytes, check_instance, check_position, check_uvs, extent, finish};
use super::super::origin;
use super::super::source_location::{SourceLocation, shown};
use super::{Assembly, Form};
use crate::description::{Instance, Material, Mesh, Shape, ShapeKind};
use crate::error::SceneError;
use crate::limits::{has_area, is_singular};
use crate::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use glam::{DAffine3, DVec3};

/// A shape or a mesh that can be placed any number of times.
#[derive(Clone, Debug)]
pub enum Part {
    /// An analytic shape; `is_flipped` exchanges front and back.
    Form { form: Form, is_flipped: bool, material: usize },
    /// A mesh by its index, and the point that its positions are relative to.
    Mesh { mesh: usize, origin: DVec3 },
}

/// A part with its place in an object.
#[derive(Clone, Debug)]
pub struct Item {
    /// Shape or mesh.
    pub part: Part,
    /// Map from the part's coordinates to the object's or the file's world.
    pub transform: DAffine3,
}

impl Assembly<'_> {
    /// Adds a mesh, which has a material and may have normals; `None` if no triangle has an area.
    pub fn add_mesh(&mut self, mesh: Mesh, site: &SourceLocation) -> Result<Option<usize>, SceneError> {
        self.budget.take(bytes(mesh.positions.len() as u64, mesh.triangles.len() as u64), site)?;
        let mut mesh = mesh;
        check_uvs(&mut mesh.uvs, site, &mut self.warnings);
        let Some(mesh) = finish(mesh, site, &mut self.warnings) else { return Ok(None) };
        self.scene.meshes.push(mesh);
        Ok(Some(self.scene.meshes.len() - 1))
    }

    /// Adds the warnings of a model, but for those about materials, which it does not bring.
    pub fn add_warnings(&mut self, warnings: &[String], file: &str) {
        for warning in warnings.iter().filter(|text| !["material", "mtllib"].iter().any(|w| text.contains(w)))
        {
            self.warnings.once(format!("{}: {warning}", shown(file)));
        }
    }

    /// Returns positions relative to a point that suits them, and that point.
    pub fn positions(
        &mut self,
        exact: &[DVec3],
        site: &SourceLocation,
    ) -> Result<(Vec<[f32; 3]>, DVec3), SceneError> {
        for &position in exact {
            check_position(position.into())
                .map_err(|problem| site.malformed(format!("its position {problem}"), POSITION_REMEDY))?;
        }
        self.budget.take(12 * exact.len() as u64, site)?;
        let origin = origin::choose(exact.iter().map(|&position| position.into()));
        Ok((exact.iter().map(|&position| origin::relative(position.into(), origin)).collect(), origin))
    }

    /// Places a part in the world by a map from its coordinates to the file's world.
    pub fn place(&mut self, item: &Item, site: &SourceLocation) -> Result<(), SceneError> {
        let map = self.world * item.transform;
        match item.part {
            Part::Mesh { mesh, origin } => {
                self.place_mesh(mesh, map * DAffine3::from_translation(origin), site)
            }
            Part::Form { form, is_flipped, material } => {
                let of = self.scene.materials.get(material);
                let is_textured = of.is_some_and(|of| of.textures().next().is_some());
                let is_flipped = is_flipped && of.is_some_and(has_sides);
                match form.shape(&map, is_flipped).filter(|_| !is_textured) {
                    Some(kind) => self.place_shape(Shape { kind, material }, &map, site),
                    None => {
                        let key = form.key(is_flipped, material);
                        let mesh = match self.forms.get(&key) {
                            Some(&mesh) => mesh,
                            None => {
                                let mesh = Mesh { material, name: "shape".to_owned(), ..form.mesh() };
                                let mesh = if is_flipped { turned_inside_out(mesh) } else { mesh };
                                let mesh = self.add_mesh(mesh, site)?;
                                self.forms.insert(key, mesh);
                                mesh
                            }
                        };
                        mesh.map_or(Ok(()), |mesh| self.place_mesh(mesh, map, site))
                    }
                }
            }
        }
    }

    fn place_mesh(&mut self, mesh: usize, map: DAffine3, site: &SourceLocation) -> Result<(), SceneError> {
        let Some(placed) = self.scene.meshes.get(mesh) else { return Ok(()) };
        let (extent, triangles) = (extent(placed), placed.triangles.len());
        if check_instance(extent, triangles, &map, &mut self.budget, site)? {
            self.scene.instances.push(Instance { mesh, transform: map });
        } else {
            self.warnings.tally("shapes that are scaled to nothing, left out", 1, &site.place);
        }
        Ok(())
    }

    fn place_shape(&mut self, shape: Shape, map: &DAffine3, site: &SourceLocation) -> Result<(), SceneError> {
        let far = |point: DVec3| !point.abs().cmple(DVec3::splat(MAX_MAGNITUDE)).all();
        let (is_far, is_flat) = match &shape.kind {
            ShapeKind::Sphere { center, radius } | ShapeKind::Disc { center, radius, .. } => {
                (far(*center + *radius) || far(*center - *radius), *radius < MIN_MAGNITUDE)
            }
            ShapeKind::Quad { corner, u, v } => {
                (far(*corner) || far(*corner + *u + *v) || far(*u) || far(*v), has_area(*u, *v).is_err())
            }
        };
        if is_far {
            return Err(site.too_large("the shape's position or extent is too large", "1e18"));
        }
        if is_flat || is_singular(map) {
            self.warnings.tally("shapes that are scaled to nothing, left out", 1, &site.place);
            return Ok(());
        }
        self.budget.take(size_of::<Shape>() as u64, site)?;
        self.scene.shapes.push(shape);
        Ok(())
    }
}

/// Returns whether a surface of this material looks or shines otherwise from its other side.
fn has_sides(material: &Material) -> bool {
    let shines = material.emission != DVec3::ZERO && !material.emits_both_sides;
    shines || material.surface.transmits() || material.medium.is_some()
}

/// Returns a mesh with front and back exchanged.
pub fn turned_inside_out(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = normal.map(|x| -x));
    mesh
}
