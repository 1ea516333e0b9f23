//! Models within a scene: each file is read once, and stands wherever an object names it.

use super::CameraPose;
use super::description::{Description, Instance, Material, Mesh, PunctualLight, Surface, TextureUse};
use super::error::SceneError;
use super::format::{self, Name, Object, SceneFile, Source};
use super::import::Folder;
use super::memory_budget::MemoryBudget;
use super::resolve::Loader;
use super::values::{MAX_MAGNITUDE, unit};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::{Path, PathBuf};

/// The models of a scene file.
pub struct Models<'a> {
    folder: &'a Folder,
    source: Source<'a>,
    /// Whether any object shows a file's own materials.
    shows_its_own: HashMap<PathBuf, bool>,
    read: HashMap<PathBuf, Model>,
    budget: MemoryBudget,
}

/// A model that is part of the scene, except for what each of its copies has for itself.
struct Model {
    /// The file, for messages.
    name: String,
    /// Of its meshes, in the scene.
    materials: Vec<usize>,
    /// The first of the meshes that have an object's material, or their own.
    meshes: HashMap<Option<usize>, usize>,
    instances: Vec<Instance>,
    lights: Vec<PunctualLight>,
    cameras: Vec<(String, CameraPose)>,
}

impl<'a> Models<'a> {
    /// Those of a file, none of them read yet.
    pub fn of(file: &'a SceneFile, folder: &'a Folder) -> Self {
        let mut shows_its_own = HashMap::new();
        for object in &file.objects {
            // What lies outside is an error when it is placed.
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

    /// Adds a copy of a model to the scene; `material` replaces its own.
    pub fn place(
        &mut self,
        scene: &mut Description,
        file: &Name,
        transform: &DAffine3,
        material: Option<usize>,
        loader: &mut dyn Loader,
    ) -> Result<(), SceneError> {
        let source = self.source;
        let path = source.locate(file, self.folder)?;
        let model = match self.read.entry(path) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let part = loader.model(entry.key()).map_err(|error| source.in_file(file, error))?;
                if !part.shapes.is_empty() {
                    return Err(source.at(file, "a model must consist of triangles".to_owned()));
                }
                let own = self.shows_its_own.get(entry.key()).copied().unwrap_or(true);
                entry.insert(Model::merge(scene, file.name.clone(), part, own, material))
            }
        };
        let meshes = &scene.meshes;
        model.reserve(meshes, material, &mut self.budget).map_err(|fault| source.at(file, fault))?;
        model
            .copy(scene, transform, material)
            .map_err(|fault| source.at(file, format!("\"{}\" with this transform: {fault}", file.name)))
    }
}

impl Model {
    /// Moves a model's parts to the scene. `own` says whether its materials will be seen.
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
        Self {
            name,
            materials,
            meshes: HashMap::from([(material, first)]),
            instances: part.instances,
            lights: part.lights,
            cameras: part.cameras,
        }
    }

    /// Whether there is room for a copy.
    fn reserve(
        &self,
        meshes: &[Mesh],
        material: Option<usize>,
        room: &mut MemoryBudget,
    ) -> Result<(), String> {
        let from = self.meshes.values().min().copied().unwrap_or_default();
        if !self.meshes.contains_key(&material) {
            meshes[from..from + self.materials.len()].iter().try_for_each(|mesh| room.store(mesh))?;
        }
        self.instances.iter().try_for_each(|instance| room.place(&meshes[from + instance.mesh]))
    }

    fn copy(
        &mut self,
        scene: &mut Description,
        transform: &DAffine3,
        material: Option<usize>,
    ) -> Result<(), String> {
        // A mesh has one material, so another material makes another mesh.
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
            if !format::in_range(&transform) {
                return Err("a mesh goes beyond 1e18".to_owned());
            }
            if format::is_singular(&transform) {
                flat += 1;
                continue;
            }
            scene.instances.push(Instance { mesh: first + instance.mesh, transform });
        }
        if flat > 0 {
            // Some models hide parts so.
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

/// Adds a warning that is not there yet.
fn warn(scene: &mut Description, warning: String) {
    if !scene.warnings.contains(&warning) {
        scene.warnings.push(warning);
    }
}

/// A material whose images stand further back.
fn offset(mut material: Material, images: usize) -> Material {
    let shift = |texture: &mut Option<TextureUse>| {
        if let Some(texture) = texture {
            texture.image += images;
        }
    };
    shift(&mut material.base_color_texture);
    shift(&mut material.emission_texture);
    if let Surface::MetallicRoughness { metallic_roughness_texture, transmission_texture, .. } =
        &mut material.surface
    {
        shift(metallic_roughness_texture);
        shift(transmission_texture);
    }
    material
}

fn move_point(point: DVec3, transform: &DAffine3) -> Result<DVec3, String> {
    let moved = transform.transform_point3(point);
    if moved.abs().cmple(DVec3::splat(MAX_MAGNITUDE)).all() {
        Ok(moved)
    } else {
        Err("a light or camera goes beyond 1e18".to_owned())
    }
}

/// As glTF has it, a light's strength does not change with its transform's scale.
fn move_light(light: &PunctualLight, transform: &DAffine3) -> Result<PunctualLight, String> {
    let turn = |direction: DVec3| {
        unit(transform.transform_vector3(direction)).ok_or_else(|| "a light's direction is lost".to_owned())
    };
    let mut moved = light.clone();
    match &mut moved {
        PunctualLight::Point { position, .. } => *position = move_point(*position, transform)?,
        PunctualLight::Spot { position, direction, .. } => {
            *position = move_point(*position, transform)?;
            *direction = turn(*direction)?;
        }
        PunctualLight::Directional { direction, .. } => *direction = turn(*direction)?,
    }
    Ok(moved)
}

/// A camera keeps its angles; its distances scale as those along its axis do. What mirrors the scene does not mirror the image.
fn move_camera(camera: &CameraPose, transform: &DAffine3) -> Result<CameraPose, String> {
    let axis = camera.look_at - camera.look_from;
    let moved = CameraPose {
        look_from: move_point(camera.look_from, transform)?,
        look_at: move_point(camera.look_at, transform)?,
        up: transform.transform_vector3(camera.up),
        focus_distance: camera.focus_distance * transform.transform_vector3(axis).length() / axis.length(),
        ..*camera
    };
    format::check_camera(&moved)?;
    Ok(moved)
}
