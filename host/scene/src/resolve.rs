//! Makes a description from a parsed scene file and the files that it names.

use super::ImageSettings;
use super::description::{
    Alpha, ConductorFresnel, Description, Filter, Material, PunctualLight, Shape, ShapeKind, Sky, Surface,
    TextureUse, Wrap,
};
use super::error::SceneError;
use super::format::{self, Camera, Index, Light, Name, Object, SceneFile, Source};
use super::import::Folder;
use super::include::Models;
use super::loader::Loader;
use super::values::{MAX_MAGNITUDE, sin_cos_degrees, vector};
use crate::Fresnel;
use glam::{DAffine2, DMat2, DVec2, DVec3};
use std::collections::HashMap;
use std::path::PathBuf;

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

    let textures = textures(file, folder, loader, &mut scene)?;
    let textures = Textures { names: Index::new(&file.textures), uses: textures, source };
    for (name, material) in &file.materials {
        scene.materials.push(textures.material(name, material, &mut scene.warnings)?);
    }

    scene.cameras.extend(file.camera.iter().map(|camera| ("camera".to_owned(), Camera::pose(camera))));
    scene.lights.extend(file.lights.iter().map(light));
    let materials = Index::new(&file.materials);
    let mut models = Models::of(file, folder);
    for (index, object) in file.objects.iter().enumerate() {
        let material = object.material().map(|name| materials.find(name, source)).transpose()?;
        match (object, material) {
            (Object::Mesh { file, transform, .. }, material) => {
                models.place(&mut scene, file, &transform.0, material, loader)?;
            }
            (_, Some(material)) => {
                scene.shapes.extend(shapes(object).map(|kind| Shape { kind, material }));
            }
            (_, None) => {}
        }
        scene.shape_objects.resize(scene.shapes.len(), index);
        scene.instance_objects.resize(scene.instances.len(), index);
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
    };
    Ok((scene, settings(file)))
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
/// space.
fn textures(
    file: &SceneFile,
    folder: &Folder,
    loader: &mut dyn Loader,
    scene: &mut Description,
) -> Result<Vec<TextureUse>, SceneError> {
    let mut read: HashMap<(PathBuf, bool), usize> = HashMap::new();
    let mut uses = Vec::with_capacity(file.textures.len());
    for (_, texture) in &file.textures {
        let path = file.source.locate(&texture.file, folder)?;
        let linear = texture.color_space == format::ColorSpace::Linear;
        let image = match read.get(&(path.clone(), linear)) {
            Some(&image) => image,
            None => {
                let image = loader
                    .texture(&path, linear)
                    .map_err(|error| file.source.in_file(&texture.file, error))?;
                scene.images.push(image);
                scene.files.push(path.clone());
                read.insert((path, linear), scene.images.len() - 1);
                scene.images.len() - 1
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
        uses.push(TextureUse { image, wrap: [wrap; 2], filter, transform: texture_transform(texture) });
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
    fn find(&self, name: Option<&Name>) -> Result<Option<TextureUse>, SceneError> {
        name.map(|name| Ok(self.uses[self.names.find(name, self.source)?].clone())).transpose()
    }

    fn material(
        &self,
        name: &str,
        material: &format::Material,
        warnings: &mut Vec<String>,
    ) -> Result<Material, SceneError> {
        let plain = |surface, base_color| Material {
            name: name.to_owned(),
            surface,
            base_color,
            base_color_texture: None,
            emission: DVec3::ZERO,
            emission_texture: None,
            emits_both_sides: false,
            opacity: 1.0,
            alpha: Alpha::Opaque,
        };
        Ok(match material {
            format::Material::Lambertian { albedo, texture } => Material {
                base_color_texture: self.find(texture.as_ref())?,
                ..plain(Surface::Lambertian, vector(*albedo))
            },
            format::Material::Metal { albedo, fuzz } => {
                plain(Surface::Metal { fuzz: fuzz.0 }, vector(*albedo))
            }
            format::Material::Dielectric { ior } => plain(Surface::Dielectric { ior: ior.0 }, DVec3::ONE),
            format::Material::RoughDielectric { ior, roughness } => {
                plain(Surface::RoughDielectric { ior: ior.0, roughness: roughness.0 }, DVec3::ONE)
            }
            format::Material::Conductor { fresnel, roughness } => {
                let (fresnel, base_color) = match fresnel {
                    format::ConductorFresnel::Ior { eta, k } => {
                        (ConductorFresnel::Ior { eta: vector(*eta), k: vector(*k) }, DVec3::ONE)
                    }
                    format::ConductorFresnel::Schlick { reflectance } => {
                        (ConductorFresnel::Schlick, vector(*reflectance))
                    }
                };
                plain(Surface::Conductor { fresnel, roughness: roughness.0 }, base_color)
            }
            format::Material::Emissive { radiance, two_sided, texture } => Material {
                emission: vector(*radiance),
                emission_texture: self.find(texture.as_ref())?,
                emits_both_sides: *two_sided,
                ..plain(Surface::Lambertian, DVec3::ZERO)
            },
            format::Material::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                ior,
                transmission,
                emission,
                texture,
                metallic_roughness_texture,
                emission_texture,
                opacity,
                alpha_cutoff,
                two_sided,
            } => {
                if emission_texture.is_some() && vector(*emission) == DVec3::ZERO {
                    warnings.push(format!(
                        "material \"{name}\": emission_texture has no effect, because it multiplies emission, which is 0"
                    ));
                }
                let surface = Surface::MetallicRoughness {
                    metallic: metallic.0,
                    roughness: roughness.0,
                    metallic_roughness_texture: self.find(metallic_roughness_texture.as_ref())?,
                    ior: ior.0,
                    transmission: transmission.0,
                    transmission_texture: None,
                };
                Material {
                    base_color_texture: self.find(texture.as_ref())?,
                    emission: vector(*emission),
                    emission_texture: self.find(emission_texture.as_ref())?,
                    emits_both_sides: *two_sided,
                    opacity: opacity.0,
                    alpha: match alpha_cutoff {
                        Some(cutoff) => Alpha::Mask { cutoff: cutoff.0 },
                        None if opacity.0 < 1.0 => Alpha::Blend,
                        None => Alpha::Opaque,
                    },
                    ..plain(surface, vector(*base_color))
                }
            }
        })
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

fn light(light: &Light) -> PunctualLight {
    match light {
        Light::Point { position, intensity } => {
            PunctualLight::Point { position: vector(*position), intensity: vector(*intensity) }
        }
        Light::Spot { position, direction, intensity, inner_angle, outer_angle } => PunctualLight::Spot {
            position: vector(*position),
            direction: direction.0,
            intensity: vector(*intensity),
            inner: inner_angle.0.to_radians(),
            outer: outer_angle.0.to_radians(),
        },
        Light::Directional { direction, irradiance } => {
            PunctualLight::Directional { direction: direction.0, irradiance: vector(*irradiance) }
        }
    }
}
