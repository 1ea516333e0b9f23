//! Models within a scene. Each file is read once and placed wherever an object names it.

use super::CameraPose;
use super::description::{Description, Instance, Material, PunctualLight, TextureUse};
use super::error::SceneError;
use super::format::{Name, Object, SceneFile, Source};
use super::import::{Folder, ModelOptions};
use super::limits;
use super::loader::Loader;
use super::memory_budget::MemoryBudget;
use super::values::{MAX_MAGNITUDE, unit};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::convert::Infallible;
use std::path::{Path, PathBuf};

/// The models of a scene file, each read once for each choice of what it holds.
pub struct Models<'a> {
    folder: &'a Folder,
    source: Source<'a>,
    /// True for each file whose own materials some object shows.
    shows_its_own: HashMap<PathBuf, bool>,
    /// Models by their file, each with what was chosen of it.
    read: HashMap<PathBuf, Vec<(ModelOptions, Model)>>,
    budget: MemoryBudget,
}

/// A model whose meshes are in the scene, with the parts that each copy adds.
struct Model {
    /// File name, for messages.
    name: String,
    /// Scene material of each mesh.
    materials: Vec<usize>,
    /// First scene mesh by the object's material; `None` for the model's own materials.
    meshes: HashMap<Option<usize>, usize>,
    instances: Vec<Instance>,
    lights: Vec<PunctualLight>,
    cameras: Vec<(String, CameraPose)>,
}

impl<'a> Models<'a> {
    /// Returns the models of a scene file, before any is read.
    pub fn of(file: &'a SceneFile, folder: &'a Folder) -> Self {
        let mut shows_its_own = HashMap::new();
        for object in &file.objects {
            // A name outside the scene's folder is an error once it is placed.
            if let Object::Mesh { file, material, .. } = object
                && let Ok(path) = folder.locate(Path::new(&file.name))
            {
                *shows_its_own.entry(path).or_insert(false) |= material.is_none();
            }
        }
        Self {
            folder,
            source: file.source,
            shows_its_own,
            read: HashMap::new(),
            budget: MemoryBudget::default(),
        }
    }

    /// Adds a copy of a model, as `options` choose, to the scene; `material` replaces the model's
    /// own materials.
    pub fn place(
        &mut self,
        scene: &mut Description,
        (file, options): (&Name, &ModelOptions),
        transform: &DAffine3,
        material: Option<usize>,
        loader: &mut dyn Loader,
    ) -> Result<(), SceneError> {
        let source = self.source;
        let path = source.locate(file, self.folder)?;
        let own = self.shows_its_own.get(&path).copied().unwrap_or(true);
        let read = self.read.entry(path.clone()).or_default();
        let known = match read.iter().position(|(chosen, _)| chosen == options) {
            Some(known) => known,
            None => {
                let part = loader.model(&path, options).map_err(|error| source.in_file(file, error))?;
                if !part.shapes.is_empty() {
                    return Err(source.at(file, "a model must consist of triangles".to_owned()));
                }
                let model = Model::merge(scene, file.name.clone(), part, own, material);
                read.push((options.clone(), model));
                read.len() - 1
            }
        };
        let (_, model) = &mut read[known];
        model.reserve(scene, material, &mut self.budget).map_err(|fault| source.at(file, fault))?;
        model
            .copy(scene, transform, material)
            .map_err(|fault| source.at(file, format!("\"{}\" with this transform: {fault}", file.name)))
    }
}

impl Model {
    /// Moves a model's parts to the scene. `own` is true if some object shows the model's own
    /// materials; otherwise they are left out.
    fn merge(
        scene: &mut Description,
        name: String,
        part: Description,
        own: bool,
        material: Option<usize>,
    ) -> Self {
        scene.files.extend(part.files);
        let first = scene.meshes.len();
        let materials: Vec<usize> =
            part.meshes.iter().map(|mesh| mesh.material + scene.materials.len()).collect();
        scene.meshes.extend(part.meshes);
        for (mesh, &own) in scene.meshes[first..].iter_mut().zip(&materials) {
            mesh.material = material.unwrap_or(own);
        }
        if own {
            let images = scene.images.len();
            scene.images.extend(part.images);
            scene.materials.extend(part.materials.into_iter().map(|material| offset(material, images)));
        }
        for warning in part.warnings {
            warn(scene, warning);
        }
        scene.notes.extend(part.notes.into_iter().map(|note| format!("{name}: {note}")));
        Self {
            name,
            materials,
            meshes: HashMap::from([(material, first)]),
            instances: part.instances,
            lights: part.lights,
            cameras: part.cameras,
        }
    }

    /// Checks that there is memory for a copy: for the triangles of meshes that emit, which are
    /// copied for each instance.
    fn reserve(
        &self,
        scene: &Description,
        material: Option<usize>,
        room: &mut MemoryBudget,
    ) -> Result<(), String> {
        let from = self.meshes.values().min().copied().unwrap_or_default();
        if !self.meshes.contains_key(&material) {
            let own = &scene.meshes[from..from + self.materials.len()];
            own.iter().try_for_each(|mesh| room.store(mesh))?;
        }
        self.instances.iter().try_for_each(|instance| {
            let mesh = &scene.meshes[from + instance.mesh];
            let surface = scene.materials.get(material.unwrap_or(self.materials[instance.mesh]));
            match surface.is_some_and(|surface| surface.emission.max_element() > 0.0) {
                true => room.place(mesh, mesh.has_attributes()),
                false => room.instances(1),
            }
        })
    }

    fn copy(
        &mut self,
        scene: &mut Description,
        transform: &DAffine3,
        material: Option<usize>,
    ) -> Result<(), String> {
        // A mesh has one material, so another material needs another mesh.
        let first = match self.meshes.get(&material) {
            Some(&first) => first,
            None => {
                let from = self.meshes.values().min().copied().unwrap_or_default();
                let first = scene.meshes.len();
                for (index, &own) in self.materials.iter().enumerate() {
                    let mut mesh = scene.meshes[from + index].clone();
                    mesh.material = material.unwrap_or(own);
                    scene.meshes.push(mesh);
                }
                self.meshes.insert(material, first);
                first
            }
        };
        let mut flat = 0;
        for instance in &self.instances {
            let transform = *transform * instance.transform;
            if !limits::in_range(&transform) {
                return Err("a mesh goes beyond 1e18".to_owned());
            }
            if limits::is_singular(&transform) {
                flat += 1;
                continue;
            }
            scene.instances.push(Instance { mesh: first + instance.mesh, transform });
        }
        if flat > 0 {
            // Some models hide parts this way.
            warn(scene, format!("{}: {flat} instances of meshes are scaled to nothing: left out", self.name));
        }
        for light in &self.lights {
            scene.lights.push(move_light(light, transform)?);
        }
        for (name, camera) in &self.cameras {
            let camera =
                move_camera(camera, transform).map_err(|fault| format!("camera \"{name}\": {fault}"))?;
            scene.cameras.push((name.clone(), camera));
        }
        Ok(())
    }
}

/// Adds a warning, unless the scene has it already.
fn warn(scene: &mut Description, warning: String) {
    if !scene.warnings.contains(&warning) {
        scene.warnings.push(warning);
    }
}

/// Returns a material whose image indices are larger by `images`.
fn offset(material: Material, images: usize) -> Material {
    let shift = |texture: TextureUse| TextureUse { image: texture.image + images, ..texture };
    let Ok(moved) = material.with_textures(|texture| Ok::<_, Infallible>(shift(texture)));
    moved
}

fn move_point(point: DVec3, transform: &DAffine3) -> Result<DVec3, String> {
    let moved = transform.transform_point3(point);
    if moved.abs().cmple(DVec3::splat(MAX_MAGNITUDE)).all() {
        Ok(moved)
    } else {
        Err("a light or camera goes beyond 1e18".to_owned())
    }
}

/// Transforms a light. As in glTF, its strength does not change with the transform's scale.
fn move_light(light: &PunctualLight, transform: &DAffine3) -> Result<PunctualLight, String> {
    let turn = |direction: DVec3| {
        unit(transform.transform_vector3(direction)).ok_or_else(|| "a light's direction becomes 0".to_owned())
    };
    let mut moved = light.clone();
    let parts = moved.parts_mut();
    if let Some((position, _)) = parts.placed {
        *position = move_point(*position, transform)?;
    }
    if let Some(direction) = parts.direction {
        *direction = turn(*direction)?;
    }
    Ok(moved)
}

/// Transforms a camera. Its angles stay, and its own lengths scale as those along its axis do. A
/// transform that mirrors the scene does not mirror the image.
fn move_camera(camera: &CameraPose, transform: &DAffine3) -> Result<CameraPose, String> {
    let axis = camera.look_at - camera.look_from;
    let scale = transform.transform_vector3(axis).length() / axis.length();
    let moved = CameraPose {
        look_from: move_point(camera.look_from, transform)?,
        look_at: move_point(camera.look_at, transform)?,
        up: transform.transform_vector3(camera.up),
        ..camera.map_lengths(|length| length * scale)
    };
    moved.check_together()?;
    Ok(moved)
}
