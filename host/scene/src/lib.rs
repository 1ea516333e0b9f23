//! Scenes: reading, validation and device records.
//!
//! A reader (RON in `format`, models and scenes of other renderers in [`import`]) makes a
//! [`description::Description`], and `lower` makes a [`Scene`] of device records from it.

pub mod alias;
mod animated_scene;
pub mod builder;
mod camera;
mod camera_choice;
mod camera_path;
mod check;
pub mod description;
mod error;
mod field_edit;
mod format;
mod ground;
mod image_settings;
pub mod import;
mod include;
mod library;
pub mod light;
mod light_groups;
mod limits;
mod load_options;
mod loader;
mod lower;
pub mod material;
pub mod medium;
mod memory_budget;
mod mesh_boxes;
mod missing_file;
mod model;
mod own_light;
mod part_names;
mod portal;
pub mod precision;
mod ranges;
mod records;
mod resolve;
mod ron_edit;
mod ron_error;
mod ron_text;
mod scene_document;
mod shared_meshes;
mod shared_vec;
mod shown_text;
mod similar;
mod source;
mod space;
mod studio;
mod sun_sky;
mod surroundings;
pub mod texture;
mod validate;
mod values;
mod version;
mod warnings;

pub use animated_scene::AnimatedScene;
pub use camera::CameraPose;
pub(crate) use camera::{Camera, camera_value};
pub use camera_choice::CameraChoice;
pub use camera_path::CameraPath;
pub use error::SceneError;
pub use field_edit::FieldEdit;
pub(crate) use field_edit::apply as apply_edits;
pub use format::parse_transform;
pub use image_settings::{Fresnel, ImageSettings};
pub use import::Includes;
pub use import::is_model;
pub use light_groups::{LightGroup, REST};
pub use load_options::LoadOptions;
pub use part_names::PartName;
pub(crate) use ron_edit::{insert_camera, insert_space};
pub use scene_document::SceneDocument;
pub use shared_meshes::{SharedInstance, SharedMesh, SharedMeshes, Sharing};
pub use shared_vec::SharedVec;
pub use space::Rebase;
pub(crate) use space::triple;
pub use surroundings::{EnvironmentSource, Sun, Surroundings};

use description::Description;
use glam::Vec3;
use std::path::Path;
use std::sync::Arc;
use trisect_shared::attributes::{MeshVertex, VertexAttributes};
use trisect_shared::bsdf::METALLIC_ROUGHNESS;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::features::{self, Features};
use trisect_shared::layers::{LayerTextures, MaterialLayers};
use trisect_shared::light::Light;
use trisect_shared::material::{BLENDED, MASKED, Material};
use trisect_shared::math::max_component;
use trisect_shared::medium::Medium;
use trisect_shared::microfacet::MIN_ROUGH_ALPHA;
use trisect_shared::planar::Planar;
use trisect_shared::sky::Sky;
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{NO_TEXTURE, SECOND_SET, Texel, Texture};
use trisect_shared::triangle::Triangle;

/// A panorama (environment map).
#[derive(Clone, Debug)]
pub struct Environment {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Rotation about +y in radians, counter-clockwise seen from above.
    pub rotation: f64,
    /// `width * height` texels with their alias table. Scenes of one file at several times share
    /// them.
    pub texels: Arc<[EnvironmentTexel]>,
}

/// A validated scene: every number is finite and in range, and every index is in range.
#[derive(Clone, Debug)]
pub struct Scene {
    /// File of the scene, or the name that stands for it, for messages.
    pub name: String,
    /// Camera of the image.
    pub camera: CameraPose,
    /// Radiance from infinity if there is no panorama.
    pub sky: Sky,
    /// Panorama; replaces `sky`.
    pub environment: Option<Environment>,
    /// Spheres in the file's order. Their indices are their primitive ids.
    pub spheres: Vec<Sphere>,
    /// Quads and discs; their primitive ids follow those of the spheres.
    pub flats: Vec<Planar>,
    /// Triangles; their primitive ids follow those of the quads and discs.
    pub triangles: SharedVec<Triangle>,
    /// Vertices of triangles, in the world and of shared meshes. The attributes of a vertex that
    /// has some follow it.
    pub vertices: SharedVec<MeshVertex>,
    /// Meshes that are stored once and placed by instances. Their triangles' primitive ids follow
    /// those of the triangles, and those of the instances come last.
    pub shared: SharedMeshes,
    /// Materials, indexed by primitives.
    pub materials: Vec<Material>,
    /// Layers of layered materials, with their textures.
    pub layers: Vec<(MaterialLayers, LayerTextures)>,
    /// Textures, indexed by materials.
    pub textures: Vec<Texture>,
    /// Texels of all textures. Scenes of one file at several times share them.
    pub texels: Arc<[Texel]>,
    /// Participating media. Materials and `atmosphere` number them from 1 on.
    pub media: Vec<Medium>,
    /// Medium around all objects; 0 for none.
    pub atmosphere: u32,
    /// Lights without extent, before their rows of the alias table are filled in.
    pub lights: Vec<Light>,
    /// Openings through which rooms see the sky. Their records follow those of `flats` on a
    /// device, and are no primitives.
    pub portals: Vec<Planar>,
    /// Warnings for people: what was left out or changed.
    pub warnings: Vec<String>,
    /// Image settings that the scene states; the command line overrides them.
    pub image: ImageSettings,
}

/// Returns whether a material is a thin wall of clear glass that may have no roughness: a texture
/// may multiply it by 0.
fn may_be_pane(material: &Material) -> bool {
    let is_smooth = material.roughness * material.roughness < MIN_ROUGH_ALPHA;
    material.kind == METALLIC_ROUGHNESS
        && material.transmission > 0.0
        && (is_smooth || material.metallic_roughness_texture != NO_TEXTURE)
}

impl Scene {
    /// Reads a scene file, a scene of pbrt or Mitsuba (`.pbrt`, `.xml`), or a model (`.gltf`,
    /// `.glb`, `.obj`, `.ply`, `.stl`). A model without a
    /// camera gets one that shows all of it, a model whose own lights do not carry the image gets
    /// the light of a studio, and a model with neither gets a ground.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_in(path, Rebase::IDENTITY)
    }

    /// Reads a scene as [`Self::load`] does, then moves and scales it to `space`, after the space
    /// that the file itself states. The image stays (see [`Rebase`]): the intensity of point and
    /// spot lights scales with the square of lengths, while emitted radiance, the irradiance of
    /// directional lights, the sky and panoramas stay as they are.
    pub fn load_in(path: &Path, space: Rebase) -> Result<Self, SceneError> {
        SceneDocument::load(path)?.lower(space)
    }

    /// Reads a scene from text; `name` stands for the file in messages. Files that it names are
    /// relative to the current folder.
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        Self::parse_in(text, name, Rebase::IDENTITY)
    }

    /// Reads a scene from text as [`Self::parse`] does, then moves and scales it to `space` as
    /// [`Self::load_in`] does.
    pub fn parse_in(text: &str, name: &str, space: Rebase) -> Result<Self, SceneError> {
        SceneDocument::parse(text, name)?.lower(space)
    }

    /// Makes a scene of a model that was read from elsewhere. As with [`Self::load`], it gets the
    /// camera, the light and the ground that it lacks. A model with a sky of its own gets neither
    /// light nor ground.
    pub fn from_model(model: Description, name: &str) -> Result<Self, SceneError> {
        SceneDocument::from_model(model, name)?.lower(Rebase::IDENTITY)
    }

    /// Returns the built-in scene, `scenes/three_spheres.ron`.
    pub fn hello_world() -> Result<Self, SceneError> {
        SceneDocument::hello_world()?.lower(Rebase::IDENTITY)
    }

    /// Returns the number of primitives of all kinds; those of a shared mesh count once.
    pub fn primitives(&self) -> usize {
        self.world_primitives() + self.shared.triangles.len()
    }

    /// Returns the number of primitives of all kinds in the world, without shared meshes.
    pub fn world_primitives(&self) -> usize {
        self.spheres.len() + self.flats.len() + self.triangles.len()
    }

    /// Returns the triangles as they are numbered: those in the world, then those of shared meshes.
    pub fn numbered_triangles(&self) -> SharedVec<Triangle> {
        match self.shared.triangles.as_slice() {
            [] => self.triangles.clone(),
            shared => [&self.triangles, shared].concat().into(),
        }
    }

    /// Returns the records of quads and discs, then those of portals.
    pub fn flats_and_portals(&self) -> Vec<Planar> {
        [self.flats.as_slice(), &self.portals].concat()
    }

    /// Returns the features that a kernel needs to render the scene; not
    /// [`NEE`](features::NEE), which the settings decide on.
    pub fn features(&self) -> Features {
        let mut all = 0;
        let has_attributes = self.attributes().next().is_some();
        let mut needs = |feature: Features, needed: bool| all |= if needed { feature } else { 0 };
        needs(features::SPHERES, !self.spheres.is_empty());
        needs(features::PLANAR, !self.flats.is_empty());
        needs(features::TRIANGLES, !self.triangles.is_empty() || !self.shared.instances.is_empty());
        needs(features::SMOOTH, self.has_vertex_normals());
        needs(features::INSTANCES, !self.shared.instances.is_empty());
        needs(features::ENVIRONMENT, self.environment.is_some());
        needs(features::PUNCTUAL, !self.lights.is_empty());
        needs(features::PORTALS, !self.portals.is_empty());
        // Paths and shadow rays pass the boundaries of media as they pass holes.
        needs(features::MEDIA | features::HOLES, !self.media.is_empty());
        for material in &self.materials {
            needs(features::of_material(material.kind), true);
            needs(features::EMITTERS, max_component(material.emission) > 0.0);
            needs(features::TEXTURES, material.textures().iter().any(|&texture| texture != NO_TEXTURE));
            needs(features::HOLES, material.flags & (MASKED | BLENDED) != 0);
            needs(features::PANES, may_be_pane(material));
            needs(features::NORMAL_MAPS, material.normal_texture != NO_TEXTURE && has_attributes);
        }
        let of_layers = |(_, textures): &(MaterialLayers, LayerTextures)| textures.all();
        needs(features::TEXTURES, self.layers.iter().flat_map(of_layers).any(|of| of != NO_TEXTURE));
        let has_coat_map = self.layers.iter().any(|(_, textures)| textures.coat_normal != NO_TEXTURE);
        needs(features::NORMAL_MAPS, has_coat_map && has_attributes);
        // Directions of facets need the tangents.
        needs(features::ATTRIBUTES, self.layers.iter().any(|(of, _)| of.anisotropy > 0.0) && has_attributes);
        let second_set = self.textures.iter().any(|texture| texture.flags & SECOND_SET != 0);
        needs(features::ATTRIBUTES, second_set || self.attributes().any(|of| of.color != Texel::WHITE));
        all
    }

    /// Returns whether a vertex of a mesh has a normal.
    fn has_vertex_normals(&self) -> bool {
        let mut rest = self.vertices.iter();
        while let Some(vertex) = rest.next() {
            if vertex.normal != Vec3::ZERO {
                return true;
            }
            if vertex.attributes != 0 {
                rest.next();
            }
        }
        false
    }

    /// Returns the further attributes of the vertices that have some.
    pub fn attributes(&self) -> impl Iterator<Item = VertexAttributes> {
        let mut rest = self.vertices.iter();
        std::iter::from_fn(move || {
            rest.by_ref().find(|vertex| vertex.attributes != 0)?;
            rest.next().map(|record| bytemuck::cast(*record))
        })
    }
}
