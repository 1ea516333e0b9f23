//! A scene as bytes, to send it to another process and to identify it by a digest.

use super::{CameraPose, Environment, ImageSettings, Scene, SceneError, SharedMeshes};
use bytemuck::{Pod, bytes_of, cast_slice, pod_collect_to_vec};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use trisect_shared::sky::Sky;

/// The parts of a scene that are encoded as JSON.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    warnings: Vec<String>,
    image: ImageSettings,
    /// Width and height of the panorama, in texels.
    environment: Option<(u32, u32)>,
}

/// The bytes that have not been read yet.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (part, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(part)
    }

    fn record<T: Pod>(&mut self) -> Option<T> {
        Some(bytemuck::pod_read_unaligned(self.take(size_of::<T>())?))
    }

    fn array<T: Pod>(&mut self) -> Option<Vec<T>> {
        let count: u64 = self.record()?;
        let length = usize::try_from(count).ok()?.checked_mul(size_of::<T>())?;
        Some(pod_collect_to_vec(self.take(length)?))
    }
}

/// Passes the length of an array and its bytes on.
fn put<T: Pod>(next: &mut impl FnMut(&[u8]), array: &[T]) {
    next(&(array.len() as u64).to_ne_bytes());
    next(cast_slice(array));
}

impl Scene {
    /// Returns the whole scene as bytes, for a process of the same version on a machine of the same
    /// byte order.
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header {
            name: self.name.clone(),
            warnings: self.warnings.clone(),
            image: self.image,
            environment: self.environment.as_ref().map(|environment| (environment.width, environment.height)),
        };
        let mut bytes = Vec::new();
        let mut append = |part: &[u8]| bytes.extend_from_slice(part);
        put(&mut append, &serde_json::to_vec(&header).unwrap_or_default());
        self.put_records(&mut append);
        bytes
    }

    /// Passes on everything that decides the image, except settings.
    fn put_records(&self, bytes: &mut impl FnMut(&[u8])) {
        let environment = self.environment.as_ref();
        let rotation = environment.map_or(0.0, |environment| environment.rotation);
        bytes(bytes_of(&self.camera));
        bytes(bytes_of(&rotation));
        bytes(bytes_of(&self.sky));
        put(bytes, environment.map_or(&[], |environment| &environment.texels));
        put(bytes, &self.spheres);
        put(bytes, &self.flats);
        put(bytes, &self.triangles);
        put(bytes, &self.vertices);
        put(bytes, &self.shared.triangles);
        put(bytes, &self.shared.meshes);
        put(bytes, &self.shared.instances);
        put(bytes, &self.materials);
        let (layers, of_layers): (Vec<_>, Vec<_>) = self.layers.iter().copied().unzip();
        put(bytes, &layers);
        put(bytes, &of_layers);
        put(bytes, &self.textures);
        put(bytes, &self.texels);
        put(bytes, &self.lights);
        put(bytes, &self.portals);
        put(bytes, &self.media);
        bytes(bytes_of(&self.atmosphere));
    }

    /// Decodes a scene from the bytes of [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for any other bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SceneError> {
        let scene = Self::read_bytes(bytes).ok_or_else(|| SceneError::Inconsistent {
            file: "the scene that was sent".to_owned(),
            message: "it is truncated, or from another version of the program".to_owned(),
        })?;
        scene.validate()?;
        Ok(scene)
    }

    fn read_bytes(bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader(bytes);
        let header: Header = serde_json::from_slice(&reader.array::<u8>()?).ok()?;
        let camera: CameraPose = reader.record()?;
        let rotation: f64 = reader.record()?;
        let sky: Sky = reader.record()?;
        let texels = reader.array()?.into();
        let environment =
            header.environment.map(|(width, height)| Environment { width, height, rotation, texels });
        if environment
            .as_ref()
            .is_some_and(|e| e.texels.len() as u64 != u64::from(e.width) * u64::from(e.height))
        {
            return None;
        }
        Some(Self {
            name: header.name,
            camera,
            sky,
            environment,
            spheres: reader.array()?,
            flats: reader.array()?,
            triangles: reader.array()?.into(),
            vertices: reader.array()?.into(),
            shared: SharedMeshes {
                triangles: reader.array()?,
                meshes: reader.array()?,
                instances: reader.array()?,
            },
            materials: reader.array()?,
            layers: {
                let (layers, textures) = (reader.array()?, reader.array()?);
                if layers.len() != textures.len() {
                    return None;
                }
                layers.into_iter().zip(textures).collect()
            },
            textures: reader.array()?,
            texels: reader.array()?.into(),
            lights: reader.array()?,
            portals: reader.array()?,
            media: reader.array()?,
            atmosphere: reader.record()?,
            warnings: header.warnings,
            image: header.image,
        })
    }

    /// Returns the SHA-256 of everything that decides the image, except settings.
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = Sha256::new();
        self.put_records(&mut |part: &[u8]| digest.update(part));
        digest.finalize().into()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use std::path::Path;

    #[test]
    fn a_scene_survives_the_way() {
        let lights = "../tests/scenes/light_punctual.ron";
        for name in ["three_spheres.ron", "materials.ron", lights, "next_week.ron", "room.ron"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
            let Ok(scene) = Scene::load(&path) else { panic!("{}", path.display()) };
            let bytes = scene.to_bytes();
            let other = Scene::from_bytes(&bytes).unwrap();
            assert_eq!(format!("{scene:?}"), format!("{other:?}"));
            assert_eq!((scene.digest(), other.to_bytes()), (other.digest(), bytes.clone()));
            for end in [0, 7, 8, bytes.len() / 2, bytes.len() - 1] {
                assert!(Scene::from_bytes(&bytes[..end]).is_err(), "{name}: {end}");
            }
            let mut brighter = scene.clone();
            brighter.materials[0].albedo.x += 1e-7;
            assert_ne!(brighter.digest(), scene.digest());
        }
    }
}
