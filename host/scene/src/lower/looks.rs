//! Records of materials, textures and sky, which do not change when a scene moves.

use super::super::description::{Description, Material, Medium, Mesh, Sky, TextureImage};
use super::super::{Environment, Scene};
use super::medium::Media;
use super::{environment, material, medium, texture, uniform};
use glam::Vec3;
use std::collections::HashSet;
use std::sync::Arc;
use trisect_shared::layers::{LayerTextures, MaterialLayers};
use trisect_shared::material::Material as Record;
use trisect_shared::sky;
use trisect_shared::texture::{Texel, Texture};

/// Records of materials, textures and sky, with what they were made of.
#[derive(Clone, Debug)]
pub struct Looks {
    materials: Vec<Material>,
    /// Materials of meshes that have vertices of an opacity below 1.
    fading: HashSet<usize>,
    images: Vec<Arc<TextureImage>>,
    sky: Option<Sky>,
    media: Vec<Medium>,
    atmosphere: Option<usize>,
    records: Records,
}

#[derive(Clone, Debug)]
struct Records {
    sky: sky::Sky,
    environment: Option<Environment>,
    materials: Vec<Record>,
    layers: Vec<(MaterialLayers, LayerTextures)>,
    textures: Vec<Texture>,
    texels: Arc<[Texel]>,
    media: Media,
}

impl Looks {
    /// Makes the records of a description. The panorama of the same sky is taken from `before`.
    ///
    /// # Errors
    ///
    /// A message that names the material or the sky.
    pub fn of(description: &Description, before: Option<&Self>) -> Result<Self, String> {
        let sky = match &description.sky {
            Some(Sky::Gradient { bottom, top }) => {
                sky::Sky { bottom: bottom.as_vec3(), strength: 0.0, top: top.as_vec3(), pad1: 0 }
            }
            _ => uniform(Vec3::ZERO),
        };
        let known = before.filter(|of| is_same_sky(of.sky.as_ref(), description.sky.as_ref()));
        let environment = match (known, description.sky.as_ref().and_then(Sky::panorama)) {
            (Some(known), _) => known.records.environment.clone(),
            (None, Some((image, scale, rotation))) => Some(environment::lower(image, scale, rotation)?),
            (None, None) => None,
        };
        let mut textures = texture::Packer::default();
        let mut layers = Vec::new();
        let mut materials = Vec::with_capacity(description.materials.len());
        let fading = fading(description);
        for (index, material) in description.materials.iter().enumerate() {
            let fades = fading.contains(&index);
            let record = material::lower(material, fades, &description.images, (&mut textures, &mut layers))?;
            materials.push(record);
        }
        let texture::Packer { textures, mut texels, .. } = textures;
        let media = medium::lower(description, &mut materials, &mut layers, &mut texels)?;
        let records = Records { sky, environment, materials, layers, textures, texels: texels.into(), media };
        let Description { materials, images, sky, media, atmosphere, .. } = description.clone();
        Ok(Self { materials, fading, images, sky, media, atmosphere, records })
    }

    /// Returns whether the records are those of a description.
    pub fn are_of(&self, description: &Description) -> bool {
        let images = self.images.iter().zip(&description.images);
        self.images.len() == description.images.len()
            && images.into_iter().all(|(a, b)| Arc::ptr_eq(a, b))
            && is_same_sky(self.sky.as_ref(), description.sky.as_ref())
            && self.materials == description.materials
            && self.media == description.media
            && self.atmosphere == description.atmosphere
            && self.fading == fading(description)
    }

    /// Gives the records to a scene. Its texels are shared.
    pub fn give(&self, scene: &mut Scene) {
        let Records { sky, environment, materials, layers, textures, texels, media } = self.records.clone();
        (scene.sky, scene.environment) = (sky, environment);
        (scene.materials, scene.layers) = (materials, layers);
        (scene.textures, scene.texels) = (textures, texels);
        (scene.media, scene.atmosphere) = (media.records, media.atmosphere);
    }
}

/// Returns the materials of meshes that have vertices of an opacity below 1.
fn fading(description: &Description) -> HashSet<usize> {
    let fading = |mesh: &&Mesh| mesh.colors.iter().any(|color| color[3] < 1.0);
    description.meshes.iter().filter(fading).map(|mesh| mesh.material).collect()
}

fn is_same_sky(a: Option<&Sky>, b: Option<&Sky>) -> bool {
    match (a, b) {
        (None, None) => true,
        (
            Some(Sky::Gradient { bottom, top }),
            Some(Sky::Gradient { bottom: other_bottom, top: other_top }),
        ) => (bottom, top) == (other_bottom, other_top),
        (
            Some(Sky::Image { image, scale, rotation }),
            Some(Sky::Image { image: other_image, scale: other_scale, rotation: other_rotation }),
        ) => Arc::ptr_eq(image, other_image) && (scale, rotation) == (other_scale, other_rotation),
        (
            Some(Sky::Studio { scale, rotation }),
            Some(Sky::Studio { scale: other_scale, rotation: other_rotation }),
        ) => (scale, rotation) == (other_scale, other_rotation),
        (Some(Sky::Sun(sky)), Some(Sky::Sun(other))) => sky.parameters() == other.parameters(),
        _ => false,
    }
}
