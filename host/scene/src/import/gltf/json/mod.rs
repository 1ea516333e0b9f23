//! The part of a glTF file's JSON that is read.
//!
//! Numbers are f64, as in JSON. Indices and ranges are checked where they are used. A document
//! takes little more memory than its text, because lists whose members may be `{}` are bounded and
//! rare members are boxed.

use super::super::source_location::SourceLocation;
use super::version;
use crate::error::SceneError;
use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, SeqAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt::{Formatter, Result as FmtResult};
use std::marker::PhantomData;

/// OpenGL's code of a sampler that repeats its image, the default.
pub const REPEAT: u32 = 10497;

/// OpenGL's code of a primitive of triangles, the default.
pub const TRIANGLES: u32 = 4;

/// Maximum number of materials, textures, samplers, images, cameras, lights and scenes.
const FEW: usize = 1 << 16;
/// Maximum number of nodes.
const MANY: usize = 1 << 22;

/// Parses a document.
pub fn parse(text: &str, name: &str) -> Result<Root, SceneError> {
    let site = SourceLocation::new(name, "asset.version");
    let root: Root = match serde_json::from_str(text) {
        Ok(root) => root,
        Err(_) if version::is_first(text) => return Err(version::convert(&site)),
        Err(error) => {
            let message = error.to_string();
            let message = message.split(" at line ").next().unwrap_or_default();
            return Err(SceneError::at(name, text, error.line(), error.column(), message.to_owned()));
        }
    };
    let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    if root.asset.version.split('.').next() == Some("1") {
        return Err(version::convert(&site));
    }
    if root.asset.version.split('.').next() != Some("2") || version.split('.').next() != Some("2") {
        let version = super::super::source_location::shown(version);
        return Err(site.unsupported(format!("glTF version \"{version}\""), "export glTF 2.0"));
    }
    Ok(root)
}

/// Reads a list of at most `MAX` members.
fn at_most<'de, const MAX: usize, T: Deserialize<'de>, D: Deserializer<'de>>(
    source: D,
) -> Result<Vec<T>, D::Error> {
    struct List<T, const MAX: usize>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>, const MAX: usize> Visitor<'de> for List<T, MAX> {
        type Value = Vec<T>;

        fn expecting(&self, formatter: &mut Formatter) -> FmtResult {
            write!(formatter, "a list of at most {MAX}")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
            let mut members = Vec::new();
            while let Some(member) = list.next_element()? {
                if members.len() == MAX {
                    return Err(A::Error::custom(format!("a list of more than {MAX} members")));
                }
                members.push(member);
            }
            Ok(members)
        }
    }

    source.deserialize_seq(List::<T, MAX>(PhantomData))
}

/// Defines structs whose fields have the names of JSON members, which are in camel case there.
macro_rules! objects {
    ($($(#[$struct_meta:meta])* $name:ident { $($(#[$meta:meta])* $field:ident: $type:ty,)* })*) => {$(
        $(#[$struct_meta])*
        #[derive(Clone, Debug, Deserialize)]
        #[serde(rename_all = "camelCase")]
        pub struct $name { $($(#[$meta])* pub $field: $type,)* }
    )*};
}

mod defaults;
mod material;

pub use defaults::glass;
pub use material::*;

use defaults::{one, quarter_pi, repeat, triangles, unscaled, white, yes};

objects! {
    Root {
        asset: Asset,
        #[serde(default)] extensions_used: Vec<String>,
        #[serde(default)] extensions_required: Vec<String>,
        #[serde(default)] accessors: Vec<Accessor>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] animations: Vec<Animation>,
        #[serde(default)] buffers: Vec<Buffer>,
        #[serde(default)] buffer_views: Vec<BufferView>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] cameras: Vec<Camera>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] images: Vec<Image>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] materials: Vec<Material>,
        #[serde(default)] meshes: Vec<Mesh>,
        #[serde(default, deserialize_with = "at_most::<MANY, _, _>")] nodes: Vec<Node>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] samplers: Vec<Sampler>,
        scene: Option<u32>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] scenes: Vec<Scene>,
        #[serde(default)] skins: Vec<Skin>,
        #[serde(default, deserialize_with = "at_most::<FEW, _, _>")] textures: Vec<Texture>,
        #[serde(default)] extensions: RootExtensions,
    }
    Asset {
        version: String,
        min_version: Option<String>,
    }
    #[derive(Default)]
    RootExtensions {
        #[serde(rename = "KHR_lights_punctual")] lights: Option<LightList>,
        #[serde(rename = "KHR_materials_variants")] variants: Option<VariantList>,
    }
    VariantList {
        #[serde(deserialize_with = "at_most::<FEW, _, _>")] variants: Vec<Variant>,
    }
    Variant {
        name: Box<str>,
    }
    LightList {
        #[serde(deserialize_with = "at_most::<FEW, _, _>")] lights: Vec<Light>,
    }
    Light {
        #[serde(rename = "type")] kind: String,
        #[serde(default = "white")] color: [f64; 3],
        #[serde(default = "one")] intensity: f64,
        range: Option<f64>,
        spot: Option<Spot>,
    }
    Spot {
        #[serde(default)] inner_cone_angle: f64,
        #[serde(default = "quarter_pi")] outer_cone_angle: f64,
    }
    Accessor {
        buffer_view: Option<u32>,
        #[serde(default)] byte_offset: u64,
        component_type: u32,
        #[serde(default)] normalized: bool,
        count: u64,
        #[serde(rename = "type")] kind: String,
        sparse: Option<Box<Sparse>>,
    }
    Sparse {
        count: u64,
        indices: SparseIndices,
        values: SparseValues,
    }
    SparseIndices {
        buffer_view: u32,
        #[serde(default)] byte_offset: u64,
        component_type: u32,
    }
    SparseValues {
        buffer_view: u32,
        #[serde(default)] byte_offset: u64,
    }
    BufferView {
        buffer: u32,
        #[serde(default)] byte_offset: u64,
        byte_length: u64,
        byte_stride: Option<u64>,
        #[serde(default)] extensions: Option<Box<BufferViewExtensions>>,
    }
    BufferViewExtensions {
        #[serde(rename = "EXT_meshopt_compression")] ext_meshopt: Option<Meshopt>,
        #[serde(rename = "KHR_meshopt_compression")] khr_meshopt: Option<Meshopt>,
    }
    Meshopt {
        buffer: u32,
        #[serde(default)] byte_offset: u64,
        byte_length: u64,
        byte_stride: u64,
        count: u64,
        mode: Box<str>,
        filter: Option<Box<str>>,
    }
    Buffer {
        uri: Option<String>,
        byte_length: u64,
        #[serde(default)] extensions: Option<Box<BufferExtensions>>,
    }
    BufferExtensions {
        #[serde(rename = "EXT_meshopt_compression")] ext_meshopt: Option<IgnoredAny>,
        #[serde(rename = "KHR_meshopt_compression")] khr_meshopt: Option<IgnoredAny>,
    }
    Camera {
        name: Option<Box<str>>,
        #[serde(rename = "type")] kind: String,
        perspective: Option<Perspective>,
        orthographic: Option<Orthographic>,
    }
    Perspective {
        yfov: f64,
    }
    Orthographic {
        ymag: f64,
    }
    Image {
        uri: Option<Box<str>>,
        buffer_view: Option<u32>,
    }
    NormalTexture {
        #[serde(flatten)] info: TextureInfo,
        #[serde(default = "one")] scale: f64,
    }
    TextureInfo {
        index: u32,
        #[serde(default)] tex_coord: u32,
        extensions: Option<TextureInfoExtensions>,
    }
    TextureInfoExtensions {
        #[serde(rename = "KHR_texture_transform")] transform: Option<TextureTransform>,
    }
    TextureTransform {
        #[serde(default)] offset: [f64; 2],
        #[serde(default)] rotation: f64,
        #[serde(default = "unscaled")] scale: [f64; 2],
        tex_coord: Option<u32>,
    }
    Mesh {
        name: Option<Box<str>>,
        primitives: Vec<Primitive>,
        weights: Option<Vec<f64>>,
    }
    Primitive {
        attributes: BTreeMap<Box<str>, u32>,
        indices: Option<u32>,
        material: Option<u32>,
        #[serde(default = "triangles")] mode: u32,
        targets: Option<Vec<BTreeMap<Box<str>, u32>>>,
        #[serde(default)] extensions: Option<Box<PrimitiveExtensions>>,
    }
    PrimitiveExtensions {
        #[serde(rename = "KHR_draco_mesh_compression")] draco: Option<DracoExtension>,
        #[serde(rename = "KHR_materials_variants")] variants: Option<VariantMappings>,
    }
    DracoExtension {
        buffer_view: u32,
        #[serde(default)] attributes: BTreeMap<Box<str>, u32>,
    }
    VariantMappings {
        #[serde(deserialize_with = "at_most::<FEW, _, _>")] mappings: Vec<VariantMapping>,
    }
    VariantMapping {
        material: u32,
        variants: Vec<u32>,
    }
    Node {
        name: Option<Box<str>>,
        #[serde(default)] children: Vec<u32>,
        matrix: Option<Box<[f64; 16]>>,
        translation: Option<Box<[f64; 3]>>,
        rotation: Option<Box<[f64; 4]>>,
        scale: Option<Box<[f64; 3]>>,
        camera: Option<u32>,
        mesh: Option<u32>,
        skin: Option<u32>,
        weights: Option<Box<[f64]>>,
        extensions: Option<Box<NodeExtensions>>,
    }
    NodeExtensions {
        #[serde(rename = "KHR_lights_punctual")] light: Option<NodeLight>,
        #[serde(rename = "EXT_mesh_gpu_instancing")] instancing: Option<Instancing>,
        #[serde(rename = "KHR_node_visibility")] visibility: Option<Visibility>,
    }
    Instancing {
        #[serde(default)] attributes: BTreeMap<Box<str>, u32>,
    }
    Visibility {
        #[serde(default = "yes")] visible: bool,
    }
    Skin {
        inverse_bind_matrices: Option<u32>,
        joints: Vec<u32>,
    }
    Animation {
        name: Option<Box<str>>,
        #[serde(default)] channels: Vec<Channel>,
        #[serde(default)] samplers: Vec<ChannelSampler>,
    }
    Channel {
        sampler: u32,
        target: ChannelTarget,
    }
    ChannelTarget {
        node: Option<u32>,
        path: Box<str>,
        #[serde(default)] extensions: Option<Box<TargetExtensions>>,
    }
    TargetExtensions {
        #[serde(rename = "KHR_animation_pointer")] pointer: Option<AnimationPointer>,
    }
    AnimationPointer {
        pointer: Box<str>,
    }
    ChannelSampler {
        input: u32,
        output: u32,
        interpolation: Option<Box<str>>,
    }
    NodeLight {
        light: u32,
    }
    Sampler {
        mag_filter: Option<u32>,
        #[serde(default = "repeat")] wrap_s: u32,
        #[serde(default = "repeat")] wrap_t: u32,
    }
    #[derive(Default)]
    Scene {
        #[serde(default)] nodes: Vec<u32>,
    }
    Texture {
        sampler: Option<u32>,
        source: Option<u32>,
        #[serde(default)] extensions: Option<Box<TextureExtensions>>,
    }
    TextureExtensions {
        #[serde(rename = "KHR_texture_basisu")] ktx2: Option<TextureSource>,
        #[serde(rename = "EXT_texture_webp")] webp: Option<TextureSource>,
    }
    TextureSource {
        source: Option<u32>,
    }
}

impl ChannelTarget {
    /// Returns the pointer of KHR_animation_pointer, if there is one.
    pub fn pointer(&self) -> Option<&str> {
        self.extensions.as_deref().and_then(|of| of.pointer.as_ref()).map(|of| &*of.pointer)
    }
}

// Sizes of the structs that `{}` in a list becomes.
const _: () = assert!(size_of::<Node>() <= 128 && size_of::<Material>() <= 128);
