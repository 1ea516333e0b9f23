//! Materials to test, and their BSDFs in a tilted frame.

use crate::statistics::words;
use glam::Vec3;
use trisect_shared::bsdf::{
    Bsdf, BsdfEval, BsdfNormals, BsdfSample, CONDUCTOR, DIELECTRIC, LAMBERTIAN, LAYERED, METAL,
    METALLIC_ROUGHNESS, ROUGH_DIELECTRIC,
};
use trisect_shared::features::{BOOK, FeatureSet, MICROFACETS};
use trisect_shared::layers::{MaterialLayers, SOLID};
use trisect_shared::material::{COMPLEX_IOR, Material, SINGLE_SCATTERING};
use trisect_shared::math::{basis, normalize};
use trisect_shared::scene::Scene;

/// Empty scene.
pub const NO_SCENE: Scene = Scene {
    spheres: &[],
    nodes: &[],
    materials: &[],
    planars: &[],
    triangles: &[],
    vertices: &[],
    lights: &[],
    textures: &[],
    texels: &[],
    environment: &[],
    wide: trisect_shared::wide::WideTree::NONE,
};

/// Materials of all kinds.
const ALL: FeatureSet<{ BOOK | MICROFACETS }> = FeatureSet::ALL;

/// Material seen from its front or its back.
#[derive(Clone)]
pub struct Setup {
    pub name: String,
    pub material: Material,
    pub layers: MaterialLayers,
    pub front: bool,
}

impl Setup {
    pub fn new(name: impl Into<String>, material: Material) -> Self {
        Self { name: name.into(), material, layers: MaterialLayers::NONE, front: true }
    }

    /// Returns this setup with alpha, or fuzz, multiplied by `factor`.
    pub fn with_alpha(&self, factor: f32) -> Self {
        let mut other = self.clone();
        other.material.roughness *= factor.sqrt();
        other.material.fuzz *= factor;
        other
    }

    /// Returns the BSDF seen at cosine `cos` and azimuth 0.7 in the frame of a normal that is no
    /// axis.
    pub fn view(&self, cos: f32) -> BsdfView {
        let normal = normalize(Vec3::new(0.48, 0.6, -0.64));
        let (x, y) = basis(normal);
        let sine = (1.0 - cos * cos).max(0.0).sqrt();
        let viewer = normalize((x * 0.7f32.cos() + y * 0.7f32.sin()) * sine + normal * cos);
        self.view_from(viewer, normal)
    }

    pub fn view_from(&self, viewer: Vec3, normal: Vec3) -> BsdfView {
        // A tangent that is not perpendicular to the normal.
        let tangent = Vec3::new(0.8, -0.5, 0.3);
        let bsdf = Bsdf::new(ALL, self.material, -viewer, BsdfNormals::plain(normal), self.front)
            .with_layers(ALL, self.layers, tangent, -1.0, Vec3::ONE);
        BsdfView { bsdf, viewer, normal }
    }
}

pub struct BsdfView {
    pub bsdf: Bsdf,
    pub viewer: Vec3,
    pub normal: Vec3,
}

impl BsdfView {
    pub fn sample(&self, stream: u32, i: u32) -> BsdfSample {
        self.bsdf.sample(ALL, words(stream, i))
    }

    pub fn evaluate(&self, direction: Vec3) -> BsdfEval {
        self.bsdf.evaluate(ALL, direction)
    }

    pub fn mirrored(&self) -> Vec3 {
        self.normal * (2.0 * self.viewer.dot(self.normal)) - self.viewer
    }
}

pub fn lambertian() -> Setup {
    Setup::new("lambertian", Material::new(LAMBERTIAN, Vec3::ONE))
}

pub fn metal(fuzz: f32) -> Setup {
    Setup::new(format!("metal, fuzz {fuzz}"), Material { fuzz, ..Material::new(METAL, Vec3::ONE) })
}

pub fn glass(ior: f32, front: bool) -> Setup {
    let material = Material { ior, ..Material::new(DIELECTRIC, Vec3::ONE) };
    Setup { front, ..Setup::new(format!("glass {ior}, front {front}"), material) }
}

/// Returns a white conductor: Schlick's approximation with reflectance 1.
pub fn conductor(roughness: f32) -> Setup {
    let material = Material { roughness, ..Material::new(CONDUCTOR, Vec3::ONE) };
    Setup::new(format!("conductor, roughness {roughness}"), material)
}

pub fn copper(roughness: f32) -> Setup {
    let (eta, k) = (Vec3::new(0.2, 0.924, 1.102), Vec3::new(3.91, 2.45, 2.14));
    let mut setup = conductor(roughness);
    setup.material = Material { eta, k, flags: COMPLEX_IOR, ..setup.material };
    setup
}

pub fn rough_glass(ior: f32, roughness: f32, front: bool) -> Setup {
    let material = Material { ior, roughness, ..Material::new(ROUGH_DIELECTRIC, Vec3::ONE) };
    Setup {
        front,
        ..Setup::new(format!("rough glass {ior}, roughness {roughness}, front {front}"), material)
    }
}

/// Returns glass whose facets lose what they send to others.
pub fn single_scattering_glass(ior: f32, roughness: f32, front: bool) -> Setup {
    let mut setup = rough_glass(ior, roughness, front);
    setup.material.flags = SINGLE_SCATTERING;
    setup
}

pub fn mix(metallic: f32, roughness: f32, transmission: f32) -> Setup {
    let material = Material {
        metallic,
        roughness,
        transmission,
        ior: 1.5,
        ..Material::new(METALLIC_ROUGHNESS, Vec3::ONE)
    };
    let name = format!("metallic {metallic}, roughness {roughness}, transmission {transmission}");
    Setup::new(name, material)
}

/// Returns a layered material of white, on the base of [`mix`].
pub fn layered(base: Setup, name: &str, layers: MaterialLayers) -> Setup {
    let material = Material { kind: LAYERED, layers: 1, ..base.material };
    Setup { name: format!("{name}, {}", base.name), material, layers, ..base }
}

/// Returns layered materials, one layer or lobe each, and all at once.
pub fn layers() -> Vec<Setup> {
    let none = MaterialLayers::NONE;
    let coat = MaterialLayers { coat: 1.0, coat_roughness: 0.3, ..none };
    let sheen = MaterialLayers { sheen_color: Vec3::ONE, sheen_roughness: 0.5, ..none };
    let specular = MaterialLayers { specular: 0.5, specular_color: Vec3::new(3.0, 1.0, 0.5), ..none };
    let stretched = MaterialLayers { anisotropy: 0.8, anisotropy_cos: 0.6, anisotropy_sin: 0.8, ..none };
    let film = MaterialLayers { film: 1.0, film_ior: 1.6, film_thickness: 450.0, ..none };
    let leaf = MaterialLayers { diffuse_transmission: 0.6, ..none };
    let solid = MaterialLayers { flags: SOLID, ..none };
    let all = MaterialLayers {
        coat: 0.7,
        coat_roughness: 0.2,
        sheen_color: Vec3::splat(0.4),
        sheen_roughness: 0.7,
        anisotropy: 0.5,
        film: 0.6,
        diffuse_transmission: 0.3,
        ..none
    };
    let mut setups = vec![
        layered(mix(0.0, 0.4, 0.0), "no layer", none),
        layered(mix(0.0, 0.5, 0.0), "coat", coat),
        layered(mix(1.0, 0.3, 0.0), "coat", MaterialLayers { coat_roughness: 0.6, ..coat }),
        layered(mix(0.0, 0.6, 0.0), "sheen", sheen),
        layered(mix(0.0, 0.6, 0.0), "smooth sheen", MaterialLayers { sheen_roughness: 0.25, ..sheen }),
        layered(mix(0.0, 0.4, 0.0), "specular", specular),
        layered(mix(1.0, 0.4, 0.0), "anisotropy", stretched),
        layered(mix(0.0, 0.5, 0.0), "film", film),
        layered(mix(1.0, 0.5, 0.0), "film", film),
        layered(mix(0.0, 0.4, 0.0), "leaf", leaf),
        layered(mix(0.0, 0.4, 0.8), "wall", none),
        layered(mix(0.3, 0.5, 0.5), "all", all),
    ];
    for front in [true, false] {
        let glass = layered(mix(0.0, 0.4, 1.0), "rough glass of a solid", solid);
        setups.push(Setup { front, ..glass });
    }
    setups
}

/// Returns metallic-roughness materials: plastic, smooth plastic, metal, half of both, a film.
pub fn mixes() -> [Setup; 5] {
    [mix(0.0, 0.3, 0.0), mix(0.0, 0.0, 0.0), mix(1.0, 0.4, 0.0), mix(0.5, 0.6, 0.0), mix(0.2, 0.4, 0.6)]
}

/// Indices and sides: of glass denser and of glass rarer than its surroundings.
pub const SIDES: [(f32, bool); 4] = [(1.5, true), (1.5, false), (0.67, true), (0.67, false)];

/// Returns rough glass of all [`SIDES`].
pub fn rough_glasses(roughness: f32) -> [Setup; 4] {
    SIDES.map(|(ior, front)| rough_glass(ior, roughness, front))
}
