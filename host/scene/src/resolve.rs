//! Makes a description from a parsed scene file and the files that it names.

use super::ImageSettings;
use super::camera::Camera;
use super::description::{
    DensityGrid, Description, Filter, Ground, Material, Medium, PlacedGrid, Shape, ShapeKind, Sky,
    TextureUse, Wrap,
};
use super::error::SceneError;
use super::format::{self, Index, Name, Object, SceneFile, Source};
use super::import::Folder;
use super::include::Models;
use super::loader::Loader;
use super::portal::check_count;
use super::values::{MAX_MAGNITUDE, sin_cos_degrees, vector};
use crate::Fresnel;
use glam::{DAffine2, DAffine3, DMat2, DVec2, DVec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// Returns the description and the image settings of a parsed scene file. `folder` is that of the
/// scene file; names of other files are relative to it. The first camera is the one to use.
pub fn describe(
    file: &SceneFile,
    folder: &Folder,
    loader: &mut dyn Loader,
) -> Result<(Description, ImageSettings), SceneError> {
    let source = file.source;
    let mut scene = Description::default();

    scene.media = media(file, folder, loader, &mut scene.files)?;
    let media = Index::new(&file.media);
    scene.atmosphere = file.atmosphere.as_ref().map(|name| media.find(name, source)).transpose()?;
    let textures = textures(file, folder, loader, &mut scene)?;
    let textures = Textures { names: Index::new(&file.textures), uses: textures, source };
    for (name, material) in &file.materials {
        let medium = material.medium.as_ref().map(|name| media.find(name, source)).transpose()?;
        let material = textures.material(name, &material.material, &mut scene.warnings)?;
        scene.materials.push(Material { medium, ..material });
    }

    scene.cameras.extend(file.camera.iter().map(|camera| ("camera".to_owned(), Camera::pose(camera))));
    scene.lights.extend(file.lights.iter().cloned());
    check_count(file.portals.len()).map_err(|fault| source.inconsistent(fault))?;
    scene.portals.extend(&file.portals);
    let materials = Index::new(&file.materials);
    let mut models = Models::of(file, folder);
    for (index, object) in file.objects.iter().enumerate() {
        let material = object.material().map(|name| materials.find(name, source)).transpose()?;
        match (object, material) {
            (Object::Mesh { file, transform, .. }, material) => {
                models.place(&mut scene, (file, &object.options()), &transform.0, material, loader)?;
            }
            (_, Some(material)) => {
                scene.shapes.extend(shapes(object).map(|kind| Shape { kind, material }));
            }
            (_, None) => {}
        }
        scene.shape_objects.resize(scene.shapes.len(), index);
        scene.instance_objects.resize(scene.instances.len(), index);
        scene.object_names.push(object.name().map(str::to_owned));
    }
    if scene.cameras.is_empty() {
        return Err(source.inconsistent(
            "no camera: the file has no `camera`, and no model in `objects` brings one; add a `camera`",
        ));
    }

    scene.sky = match &file.sky {
        format::Sky::Black => None,
        format::Sky::Uniform { radiance } => {
            Some(Sky::Gradient { bottom: vector(*radiance), top: vector(*radiance) })
        }
        format::Sky::Gradient { bottom, top } => {
            Some(Sky::Gradient { bottom: vector(*bottom), top: vector(*top) })
        }
        format::Sky::Image { file, scale, rotation } => {
            let path = source.locate(file, folder)?;
            let image = loader.panorama(&path).map_err(|error| source.in_file(file, error))?;
            scene.files.push(path);
            Some(Sky::Image { image, scale: scale.0, rotation: rotation.0.to_radians() })
        }
        format::Sky::Studio { scale, rotation } => {
            Some(Sky::Studio { scale: scale.0, rotation: rotation.0.to_radians() })
        }
        format::Sky::Sun { .. } => file.sky.sun().map(|sun| Sky::Sun(sun.into())),
    };
    let ground = |ground: &format::Ground| Ground { center: vector(ground.center), size: ground.size.0 };
    scene.ground = file.ground.as_ref().map(ground);
    Ok((scene, settings(file)))
}

/// Reads `media`, in its order. A file that several media name is read once.
fn media(
    file: &SceneFile,
    folder: &Folder,
    loader: &mut dyn Loader,
    files: &mut Vec<PathBuf>,
) -> Result<Vec<Medium>, SceneError> {
    let mut read: HashMap<PathBuf, Arc<DensityGrid>> = HashMap::new();
    let mut media = Vec::with_capacity(file.media.len());
    for (name, medium) in &file.media {
        let mut grid = None;
        if let Some(named) = &medium.grid {
            let path = file.source.locate(&named.file, folder)?;
            let densities = match read.entry(path) {
                Entry::Occupied(known) => Arc::clone(known.get()),
                Entry::Vacant(place) => {
                    let densities = loader
                        .density(place.key())
                        .map_err(|error| file.source.in_file(&named.file, error))?;
                    files.push(place.key().clone());
                    Arc::clone(place.insert(densities))
                }
            };
            let [low, high] = densities.bounds().map(|corner| DVec3::from(corner.map(f64::from)));
            let bounds = DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
            grid = Some(PlacedGrid { grid: densities, transform: named.transform.0 * bounds });
        }
        media.push(Medium {
            name: name.clone(),
            extinction: vector(medium.extinction),
            albedo: vector(medium.albedo),
            anisotropy: medium.anisotropy.0,
            emission: vector(medium.emission),
            grid,
        });
    }
    Ok(media)
}

fn settings(file: &SceneFile) -> ImageSettings {
    ImageSettings {
        width: file.image.width.0,
        height: file.image.height.0,
        samples: file.image.samples.0,
        depth: file.image.depth.0,
        fresnel: match file.fresnel {
            format::Fresnel::Exact => Fresnel::Exact,
            format::Fresnel::Schlick => Fresnel::Schlick,
        },
    }
}

/// Reads `textures`, in its order. A file that several textures name is read once for each colour
/// space. Images in memory stand for files of their names.
fn textures(
    file: &SceneFile,
    folder: &Folder,
    loader: &mut dyn Loader,
    scene: &mut Description,
) -> Result<Vec<TextureUse>, SceneError> {
    let mut read: HashMap<(PathBuf, bool, bool), usize> = HashMap::new();
    let mut uses = Vec::with_capacity(file.textures.len());
    for (_, texture) in &file.textures {
        let in_memory = loader.image_in_memory(&texture.file.name);
        let path = match &in_memory {
            Some(_) => PathBuf::from(&texture.file.name),
            None => file.source.locate(&texture.file, folder)?,
        };
        let linear = texture.color_space == format::ColorSpace::Linear;
        let image = match read.entry((path.clone(), linear, in_memory.is_some())) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(place) => {
                let image = match in_memory {
                    Some(image) => image.encoded(linear),
                    None => {
                        let read = loader.texture(&path, linear);
                        scene.files.push(path);
                        read.map_err(|error| file.source.in_file(&texture.file, error))?
                    }
                };
                scene.images.push(image);
                *place.insert(scene.images.len() - 1)
            }
        };
        let wrap = match texture.wrap {
            format::Wrap::Repeat => Wrap::Repeat,
            format::Wrap::Mirror => Wrap::Mirror,
            format::Wrap::Clamp => Wrap::Clamp,
        };
        let filter = match texture.filter {
            format::Filter::Linear => Filter::Linear,
            format::Filter::Nearest => Filter::Nearest,
        };
        let transform = texture_transform(texture);
        uses.push(TextureUse { wrap: [wrap; 2], filter, transform, ..TextureUse::of(image) });
    }
    Ok(uses)
}

/// Returns a texture's map of coordinates. As in KHR_texture_transform, v points down:
/// counter-clockwise turns +u towards -v.
fn texture_transform(texture: &format::Texture) -> DAffine2 {
    let (sine, cosine) = sin_cos_degrees(texture.rotation.0);
    let rotation = DMat2::from_cols(DVec2::new(cosine, -sine), DVec2::new(sine, cosine));
    let scale = DMat2::from_diagonal(DVec2::new(texture.scale.0.0, texture.scale.1.0));
    DAffine2::from_mat2_translation(rotation * scale, DVec2::new(texture.offset.0.0, texture.offset.1.0))
}

struct Textures<'a> {
    names: Index<'a>,
    uses: Vec<TextureUse>,
    source: Source<'a>,
}

impl Textures<'_> {
    fn material(
        &self,
        name: &str,
        material: &Material<Name>,
        warnings: &mut Vec<String>,
    ) -> Result<Material, SceneError> {
        if material.emission_texture.is_some() && material.emission == DVec3::ZERO {
            warnings.push(format!(
                "material \"{name}\": emission_texture has no effect, because it multiplies emission, which is 0"
            ));
        }
        let find = |name: Name| Ok(self.uses[self.names.find(&name, self.source)?].clone());
        Ok(material.clone().with_textures(find)?.named(name))
    }
}

/// Returns the analytic shapes that make up an object.
fn shapes(object: &Object) -> impl Iterator<Item = ShapeKind> {
    let mut sides = Vec::new();
    let one = match object {
        Object::Sphere { center, radius, .. } => {
            Some(ShapeKind::Sphere { center: vector(*center), radius: radius.0 })
        }
        Object::Quad { corner, u, v, .. } => {
            Some(ShapeKind::Quad { corner: vector(*corner), u: vector(*u), v: vector(*v) })
        }
        Object::Disc { center, normal, radius, .. } => {
            Some(ShapeKind::Disc { center: vector(*center), normal: normal.0, radius: radius.0 })
        }
        Object::Plane { point, normal, .. } => {
            Some(ShapeKind::Disc { center: vector(*point), normal: normal.0, radius: MAX_MAGNITUDE })
        }
        Object::Box { min, max, transform, .. } => {
            sides.extend(format::sides(vector(*min), vector(*max), &transform.0));
            None
        }
        Object::Mesh { .. } => None,
    };
    one.into_iter().chain(sides.into_iter().map(|[corner, u, v]| ShapeKind::Quad { corner, u, v }))
}
