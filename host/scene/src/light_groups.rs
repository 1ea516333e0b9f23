//! Light groups: named parts of a scene's lights, whose light is rendered apart.

use super::description::{Description, ShapeKind};
use super::part_names;
use super::similar::nearest;
use super::{SceneDocument, SceneError};
use glam::DVec3;
use std::collections::HashMap;
use std::str::FromStr;

/// Name of the group of all lights that no other group has.
pub const REST: &str = "rest";

/// Maximum number of characters of a group's name, which names of channels in a file contain.
const MAX_NAME: usize = 64;

/// Name of the sky among the lights.
const SKY: &str = "sky";

/// Name of a group, and the names of its lights: those of objects that emit, `lights[3]` for a
/// light without extent, counted from 0, and `sky`. A name that ends in `*` stands for all that
/// begin so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// Name of the group.
    pub name: String,
    /// Names of its lights.
    pub lights: Vec<String>,
}

impl FromStr for LightGroup {
    type Err = String;

    /// Parses `NAME=LIGHT,LIGHT`.
    fn from_str(text: &str) -> Result<Self, String> {
        let form = || "must be NAME=LIGHT,LIGHT, such as key=lamp,window".to_owned();
        let (name, lights) = text.split_once('=').ok_or_else(form)?;
        let lights: Vec<String> = lights.split(',').map(|light| light.trim().to_owned()).collect();
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(is_name) {
            return Err(format!("the name \"{name}\" must have letters, digits, - and _ alone"));
        }
        if name.len() > MAX_NAME {
            return Err(format!("the name is longer than {MAX_NAME} characters"));
        }
        if name == REST {
            return Err(format!("{REST} is the group of all other lights; choose another name"));
        }
        if lights.iter().any(String::is_empty) {
            return Err(form());
        }
        Ok(Self { name: name.to_owned(), lights })
    }
}

impl LightGroup {
    fn has(&self, light: &str) -> bool {
        self.lights.iter().any(|name| match name.strip_suffix('*') {
            Some(start) => light.starts_with(start),
            None => light == name,
        })
    }
}

/// Lights of a scene by their names, with the parts of the description that they are.
struct Lights {
    /// Names of the shapes that emit, and their indices.
    shapes: Vec<(usize, String)>,
    /// Names of the mesh instances that emit, and their indices.
    instances: Vec<(usize, String)>,
    /// Number of lights without extent.
    punctual: usize,
    has_sky: bool,
    /// True if a medium emits, which is part of no group but the rest.
    has_glow: bool,
}

impl Lights {
    fn of(scene: &Description) -> Self {
        let emits = |material: usize| {
            scene.materials.get(material).is_some_and(|material| material.emission != DVec3::ZERO)
        };
        // Names come in the order of renderers: spheres, other shapes, instances.
        let is_sphere = |index: &usize| matches!(scene.shapes[*index].kind, ShapeKind::Sphere { .. });
        let (spheres, others): (Vec<usize>, Vec<usize>) = (0..scene.shapes.len()).partition(is_sphere);
        let mut names = part_names::all(scene).into_iter().map(|name| name.object);
        let shapes = spheres.into_iter().chain(others).zip(names.by_ref());
        let shapes = shapes.filter(|(index, _)| emits(scene.shapes[*index].material)).collect();
        let instances = scene.instances.iter().enumerate().zip(names);
        let instances = instances
            .filter(|((_, of), _)| scene.meshes.get(of.mesh).is_some_and(|mesh| emits(mesh.material)))
            .map(|((index, _), name)| (index, name))
            .collect();
        let punctual = scene.lights.len();
        let has_glow = scene.media.iter().any(|medium| medium.emission != DVec3::ZERO);
        Self { shapes, instances, punctual, has_sky: scene.sky.is_some(), has_glow }
    }

    fn names(&self) -> Vec<String> {
        let objects = self.shapes.iter().chain(&self.instances).map(|(_, name)| name.clone());
        let punctual = (0..self.punctual).map(|index| format!("lights[{index}]"));
        let mut names: Vec<String> =
            objects.chain(punctual).chain(self.has_sky.then(|| SKY.to_owned())).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

impl SceneDocument {
    /// Returns the names of the scene's lights, as [`LightGroup`] takes them, in alphabetical
    /// order.
    pub fn light_names(&self) -> Vec<String> {
        Lights::of(&self.description).names()
    }

    /// Returns the names of the groups, and, if there are lights in none of them, [`REST`] at the
    /// end. The images with the light of each add up to that of the scene, up to noise.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a group of no light, with the names of lights; for a light
    /// in two groups, and for two groups of one name.
    pub fn light_group_names(&self, groups: &[LightGroup]) -> Result<Vec<String>, SceneError> {
        let refused = |message: String| {
            Err(SceneError::Inconsistent {
                file: self.name.clone(),
                message: format!("`light_group`: {message}"),
            })
        };
        let lights = Lights::of(&self.description);
        let names = lights.names();
        for (index, group) in groups.iter().enumerate() {
            if groups[..index].iter().any(|other| other.name == group.name) {
                return refused(format!("two groups have the name {}", group.name));
            }
            let is_there = |light: &&String| {
                let alone = LightGroup { name: String::new(), lights: vec![(*light).clone()] };
                names.iter().any(|name| alone.has(name))
            };
            if let Some(missing) = group.lights.iter().find(|light| !is_there(light)) {
                if names.is_empty() {
                    return refused(format!("there is no light \"{missing}\": the scene has none"));
                }
                let near = nearest(missing, names.iter().map(String::as_str));
                let near = near.map_or_else(String::new, |near| format!("; did you mean \"{near}\"?"));
                let shown = names.iter().take(20).map(String::as_str).collect::<Vec<_>>().join(", ");
                let more = if names.len() > 20 { ", …" } else { "" };
                return refused(format!(
                    "there is no light \"{missing}\"{near}; the scene has {shown}{more}"
                ));
            }
        }
        for name in &names {
            if groups.iter().filter(|group| group.has(name)).count() > 1 {
                return refused(format!("the light \"{name}\" is in two groups"));
            }
        }
        let in_none = |name: &str| !groups.iter().any(|group| group.has(name));
        let has_rest = lights.has_glow || names.iter().any(|name| in_none(name));
        let rest = has_rest.then(|| REST.to_owned());
        Ok(groups.iter().map(|group| group.name.clone()).chain(rest).collect())
    }

    /// Returns the scene with the lights of the group of this index alone; an index beyond the last
    /// stands for the lights that are in none.
    #[must_use]
    pub fn with_light_group(&self, groups: &[LightGroup], index: usize) -> Self {
        let lights = Lights::of(&self.description);
        match groups.get(index) {
            Some(group) => self.lit_by(&lights, &|name| group.has(name), false),
            None => self.lit_by(&lights, &|name| !groups.iter().any(|group| group.has(name)), true),
        }
    }

    /// Returns the scene with the lights that `shines` accepts by name, and with media that emit if
    /// `glows`.
    fn lit_by(&self, lights: &Lights, shines: &dyn Fn(&str) -> bool, glows: bool) -> Self {
        let mut scene = self.description.clone();
        let mut dark_materials: HashMap<usize, usize> = HashMap::new();
        let mut dark = |scene: &mut Description, material: usize| {
            *dark_materials.entry(material).or_insert_with(|| {
                let mut copy = scene.materials[material].clone();
                (copy.emission, copy.emission_texture) = (DVec3::ZERO, None);
                scene.materials.push(copy);
                scene.materials.len() - 1
            })
        };
        for (index, _) in lights.shapes.iter().filter(|(_, name)| !shines(name)) {
            let material = scene.shapes[*index].material;
            scene.shapes[*index].material = dark(&mut scene, material);
        }
        let mut dark_meshes: HashMap<usize, usize> = HashMap::new();
        for (index, _) in lights.instances.iter().filter(|(_, name)| !shines(name)) {
            let mesh = scene.instances[*index].mesh;
            let copy = match dark_meshes.get(&mesh) {
                Some(copy) => *copy,
                None => {
                    let mut copy = scene.meshes[mesh].clone();
                    copy.material = dark(&mut scene, copy.material);
                    scene.meshes.push(copy);
                    dark_meshes.insert(mesh, scene.meshes.len() - 1);
                    scene.meshes.len() - 1
                }
            };
            scene.instances[*index].mesh = copy;
        }
        let mut number = 0..;
        scene.lights.retain(|_| number.next().is_some_and(|n: usize| shines(&format!("lights[{n}]"))));
        if !shines(SKY) {
            scene.sky = None;
        }
        if !glows {
            scene.media.iter_mut().for_each(|medium| medium.emission = DVec3::ZERO);
        }
        Self { description: scene, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    const SCENE: &str = "Scene(version: 1, image: (width: 8, height: 8), \
        camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
        sky: Uniform(radiance: (1, 1, 1)), \
        materials: { \"lamp\": Emissive(radiance: (2, 2, 2)), \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
        objects: [\
            Quad(corner: (-9, -9, -2), u: (9, 0, 0), v: (0, 18, 0), material: \"grey\"), \
            Quad(corner: (0, 0, 3), u: (1, 0, 0), v: (0, 1, 0), material: \"lamp\", name: \"panel\"), \
            Sphere(center: (0, 0, 0), radius: 1, material: \"lamp\", name: \"bulb\"), \
            Sphere(center: (3, 0, 0), radius: 1, material: \"lamp\")], \
        lights: [Point(position: (0, 3, 0), intensity: (1, 1, 1))])";

    fn group(text: &str) -> LightGroup {
        text.parse().unwrap()
    }

    #[test]
    fn lights_have_names() {
        let scene = SceneDocument::parse(SCENE, "a.ron").unwrap();
        assert_eq!(scene.light_names(), ["bulb", "lights[0]", "objects[3]", "panel", "sky"]);
    }

    #[test]
    fn groups_share_the_lights() {
        let scene = SceneDocument::parse(SCENE, "a.ron").unwrap();
        let groups = [group("key=panel,lights[0]"), group("balls=b*,objects[3]")];
        assert_eq!(scene.light_group_names(&groups).unwrap(), ["key", "balls", REST]);
        let scenes = [0, 1, 2].map(|index| scene.with_light_group(&groups, index));
        let lights = scenes.each_ref().map(SceneDocument::light_names);
        assert_eq!(lights[0], ["lights[0]", "panel"]);
        assert_eq!(lights[1], ["bulb", "objects[3]"]);
        assert_eq!(lights[2], ["sky"]);
        for part in &scenes {
            assert_eq!(part.description.shapes.len(), scene.description.shapes.len());
        }
        // Without a light left there is no rest.
        let all = [group("all=*")];
        assert_eq!(scene.light_group_names(&all).unwrap(), ["all"]);
        assert_eq!(scene.with_light_group(&all, 0).light_names(), scene.light_names());
    }

    #[test]
    fn wrong_groups_are_refused() {
        let scene = SceneDocument::parse(SCENE, "a.ron").unwrap();
        let refused = |groups: &[&str]| {
            let groups: Vec<LightGroup> = groups.iter().map(|text| group(text)).collect();
            scene.light_group_names(&groups).unwrap_err().to_string()
        };
        assert!(refused(&["a=panle"]).contains("no light \"panle\"; did you mean \"panel\"?"));
        assert!(refused(&["a=objects[0]"]).contains("the scene has bulb, lights[0]"), "a quad that is grey");
        assert!(refused(&["a=panel", "b=p*"]).contains("\"panel\" is in two groups"));
        assert!(refused(&["a=panel", "a=bulb"]).contains("two groups have the name a"));
        let long = format!("{}=sky", "n".repeat(65));
        for bad in ["", "a", "=b", "a b=c", "rest=sky", "a=", "a=b,,c", "a.b=c", &long] {
            assert!(bad.parse::<LightGroup>().is_err(), "{bad}");
        }
    }
}
