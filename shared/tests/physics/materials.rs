//! Materials to test, and their BSDFs in a tilted frame.

use crate::statistics::words;
use glam::Vec3;
use trisect_shared::bsdf::{
    Bsdf, BsdfEval, BsdfNormals, BsdfSample, CONDUCTOR, DIELECTRIC, LAMBERTIAN, METAL, METALLIC_ROUGHNESS,
    ROUGH_DIELECTRIC,
};
use trisect_shared::features::{BOOK, FeatureSet, MICROFACETS};
use trisect_shared::material::{COMPLEX_IOR, Material};
use trisect_shared::math::{basis, normalize};
use trisect_shared::scene::Scene;

/// Empty scene.
pub const NO_SCENE: Scene = Scene {
    spheres: &[],
    nodes: &[],
    materials: &[],
    planars: &[],
    triangles: &[],
    shading: &[],
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
    pub front: bool,
}

impl Setup {
    pub fn new(name: impl Into<String>, material: Material) -> Self {
        Self { name: name.into(), material, front: true }
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
        let bsdf = Bsdf::new(ALL, self.material, -viewer, BsdfNormals::plain(normal), self.front);
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

/// Returns metallic-roughness materials: plastic, smooth plastic, metal, half of both, a film.
pub fn mixes() -> [Setup; 5] {
    [mix(0.0, 0.3, 0.0), mix(0.0, 0.0, 0.0), mix(1.0, 0.4, 0.0), mix(0.5, 0.6, 0.0), mix(0.2, 0.4, 0.6)]
}

/// Returns both sides of glass denser and of glass rarer than its surroundings.
pub fn rough_glasses(roughness: f32) -> [Setup; 4] {
    [(1.5, true), (1.5, false), (0.67, true), (0.67, false)]
        .map(|(ior, front)| rough_glass(ior, roughness, front))
}
