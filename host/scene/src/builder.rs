//! Scenes made by a program, instead of read from a file.

pub use super::material::Emissive;
pub use super::material::surface::{
    Conductor, ConductorFresnel, Dielectric, Interface, Lambertian, Metal, MetallicRoughness, RoughDielectric,
};
pub use super::medium::{DensityGrid, Medium};
pub use super::sun_sky::SunSky;
pub use super::texture::{Filter, Texels, TextureImage, TextureUse, Wrap};

use super::description::{
    Description, Instance, Material, Mesh, Portal, PunctualLight, Shape, ShapeKind, Sky,
};
use super::values::{MAX_MAGNITUDE, unit};
use super::{CameraPose, Fresnel, ImageSettings, Rebase, Scene, SceneDocument, SceneError, Sharing};
use glam::{DAffine3, DVec3};

/// Name of a built scene in messages.
const NAME: &str = "the built scene";

/// Builder of a scene: adds materials, shapes, meshes and lights, and validates them at the end.
///
/// Lengths are in scene units, colours in linear Rec. 709; y is up.
///
/// ```
/// use trisect_scene::builder::{Camera, Dielectric, Gradient, Lambertian, SceneBuilder};
///
/// let mut scene = SceneBuilder::new();
/// let ground = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
/// let glass = scene.material(Dielectric { ior: 1.5 });
/// scene.plane([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], ground);
/// scene.sphere([0.0, 0.5, 0.0], 0.5, glass);
/// scene.sky(Gradient::new([1.0, 1.0, 1.0], [0.5, 0.7, 1.0]));
/// scene.camera(Camera::look_at([0.0, 1.0, 4.0], [0.0, 0.5, 0.0]).fov_degrees(35.0));
/// let scene = scene.build()?;
/// assert_eq!(scene.primitives(), 2);
///
/// // An error names the part of the scene and the number.
/// let mut scene = SceneBuilder::new();
/// let glass = scene.material(Dielectric { ior: -1.5 });
/// scene.sphere([0.0, 0.5, 0.0], 0.5, glass);
/// let error = scene.build().unwrap_err().to_string();
/// assert!(error.contains("material \"0\": ior: -1.5 is not a positive index of refraction"));
/// # Ok::<(), trisect_scene::SceneError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    description: Description,
    sharing: Sharing,
}

/// Material of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(usize);

/// Medium of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumId(usize);

/// Mesh of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshId(usize);

impl SceneBuilder {
    /// Returns a builder of an empty scene under a black sky.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a material.
    pub fn material(&mut self, material: impl Into<Material>) -> MaterialId {
        let index = self.description.materials.len();
        let mut material = material.into();
        if material.name.is_empty() {
            material.name = index.to_string();
        }
        self.description.materials.push(material);
        MaterialId(index)
    }

    /// Adds an image, and returns its use as a texture, which repeats it and interpolates between
    /// its texels. Materials have clones of it, with other fields where they read it differently.
    pub fn texture(&mut self, image: TextureImage) -> TextureUse {
        let index = self.description.images.len();
        let name = if image.name.is_empty() { index.to_string() } else { image.name.clone() };
        self.description.images.push(image.named(name).into());
        TextureUse::of(index)
    }

    /// Adds a medium, for [`Material::medium`] or as the [`atmosphere`](Self::atmosphere).
    pub fn medium(&mut self, medium: Medium) -> MediumId {
        let index = self.description.media.len();
        let name = if medium.name.is_empty() { index.to_string() } else { medium.name.clone() };
        self.description.media.push(Medium { name, ..medium });
        MediumId(index)
    }

    /// Adds a material whose surfaces have a medium inside.
    pub fn filled(&mut self, material: impl Into<Material>, medium: MediumId) -> MaterialId {
        self.material(Material { medium: Some(medium.0), ..material.into() })
    }

    /// Surrounds all objects, and the camera, with a medium.
    pub fn atmosphere(&mut self, medium: MediumId) -> &mut Self {
        self.description.atmosphere = Some(medium.0);
        self
    }

    fn shape(&mut self, kind: ShapeKind, material: MaterialId) -> &mut Self {
        self.description.shapes.push(Shape { kind, material: material.0 });
        self
    }

    /// Adds a sphere.
    pub fn sphere(&mut self, center: impl Into<DVec3>, radius: f64, material: MaterialId) -> &mut Self {
        self.shape(ShapeKind::Sphere { center: center.into(), radius }, material)
    }

    /// Adds a parallelogram with a corner and the edges `u` and `v`. Its front is where u × v
    /// points.
    pub fn quad(
        &mut self,
        corner: impl Into<DVec3>,
        u: impl Into<DVec3>,
        v: impl Into<DVec3>,
        material: MaterialId,
    ) -> &mut Self {
        self.shape(ShapeKind::Quad { corner: corner.into(), u: u.into(), v: v.into() }, material)
    }

    /// Adds a disc; its front is where the normal points.
    pub fn disc(
        &mut self,
        center: impl Into<DVec3>,
        normal: impl Into<DVec3>,
        radius: f64,
        material: MaterialId,
    ) -> &mut Self {
        let normal = normal.into();
        let normal = unit(normal).unwrap_or(normal);
        self.shape(ShapeKind::Disc { center: center.into(), normal, radius }, material)
    }

    /// Adds a plane through a point; its front is where the normal points.
    pub fn plane(
        &mut self,
        point: impl Into<DVec3>,
        normal: impl Into<DVec3>,
        material: MaterialId,
    ) -> &mut Self {
        self.disc(point, normal, MAX_MAGNITUDE, material)
    }

    /// Adds a mesh, which is visible where [`instance`](Self::instance) places it. Its material is
    /// `material`, whatever [`Mesh::material`] says.
    pub fn mesh(&mut self, mesh: Mesh, material: MaterialId) -> MeshId {
        self.description.meshes.push(Mesh { material: material.0, ..mesh });
        MeshId(self.description.meshes.len() - 1)
    }

    /// Places a mesh in the world.
    pub fn instance(&mut self, mesh: MeshId, transform: DAffine3) -> &mut Self {
        self.description.instances.push(Instance { mesh: mesh.0, transform });
        self
    }

    /// Adds a light without extent.
    pub fn light(&mut self, light: PunctualLight) -> &mut Self {
        self.description.lights.push(light);
        self
    }

    /// Adds an opening through which a room sees the sky: a parallelogram with a corner and the
    /// edges `u` and `v`, whose front, where u × v points, is on the side of the room.
    pub fn portal(
        &mut self,
        corner: impl Into<DVec3>,
        u: impl Into<DVec3>,
        v: impl Into<DVec3>,
    ) -> &mut Self {
        self.description.portals.push(Portal { corner: corner.into(), u: u.into(), v: v.into() });
        self
    }

    /// Sets the radiance from infinity, which is black otherwise.
    pub fn sky(&mut self, sky: impl Into<Sky>) -> &mut Self {
        self.description.sky = Some(sky.into());
        self
    }

    /// Sets the camera.
    pub fn camera(&mut self, camera: impl Into<CameraPose>) -> &mut Self {
        self.description.cameras = vec![("camera".to_owned(), camera.into())];
        self
    }

    /// Chooses whether instances share their mesh.
    #[must_use]
    pub fn sharing(self, sharing: Sharing) -> Self {
        Self { sharing, ..self }
    }

    /// Validates the scene and makes its device records.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a scene without a camera, or with a number or an index out
    /// of range; the message names it.
    pub fn build(self) -> Result<Scene, SceneError> {
        for image in &self.description.images {
            let inconsistent = |message| SceneError::Inconsistent { file: NAME.to_owned(), message };
            image.check_range().map_err(inconsistent)?;
        }
        let image =
            ImageSettings { width: 640, height: 360, samples: 64, depth: 50, fresnel: Fresnel::Exact };
        let document = SceneDocument::of_description(self.description, image, NAME);
        let document = SceneDocument { sharing: self.sharing, ..document };
        document.lower(Rebase::IDENTITY)
    }
}

/// Sky whose radiance is linear in the y of the direction, from straight down to straight up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// Radiance straight down.
    pub bottom: DVec3,
    /// Radiance straight up.
    pub top: DVec3,
}

impl Gradient {
    /// Returns the sky from `bottom` to `top`.
    pub fn new(bottom: impl Into<DVec3>, top: impl Into<DVec3>) -> Self {
        Self { bottom: bottom.into(), top: top.into() }
    }
}

impl From<Gradient> for Sky {
    fn from(Gradient { bottom, top }: Gradient) -> Self {
        Self::Gradient { bottom, top }
    }
}

impl From<SunSky> for Sky {
    fn from(sky: SunSky) -> Self {
        Self::Sun(sky.into())
    }
}

/// Pinhole camera, or with a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera(CameraPose);

impl Camera {
    /// Returns a pinhole camera at `from` that looks at `at`, upright, with a vertical angle of 40
    /// degrees.
    pub fn look_at(from: impl Into<DVec3>, at: impl Into<DVec3>) -> Self {
        let (look_from, look_at) = (from.into(), at.into());
        let focus_distance = (look_at - look_from).length();
        let vertical_fov = 40f64.to_radians();
        Self(CameraPose { look_from, look_at, vertical_fov, focus_distance, ..CameraPose::PINHOLE })
    }

    /// Returns the camera with this up direction of the image.
    #[must_use]
    pub fn up(self, up: impl Into<DVec3>) -> Self {
        Self(CameraPose { up: up.into(), ..self.0 })
    }

    /// Returns the camera with this vertical angle of the whole image.
    #[must_use]
    pub fn fov_degrees(self, angle: f64) -> Self {
        Self(CameraPose { vertical_fov: angle.to_radians(), ..self.0 })
    }

    /// Returns the camera with a lens that is seen from a point in focus under this angle, and with
    /// the plane in focus at this distance.
    #[must_use]
    pub fn lens_degrees(self, angle: f64, focus_distance: f64) -> Self {
        Self(CameraPose { defocus_angle: angle.to_radians(), focus_distance, ..self.0 })
    }
}

impl From<Camera> for CameraPose {
    fn from(camera: Camera) -> Self {
        camera.0
    }
}

#[cfg(test)]
mod tests;
