//! Identity of an image: the properties that all films of the image share.
//!
//! Checkpoints store it; `resume` and `merge` compare it.

use crate::bvh::BvhQuality;
use crate::error::Difference;
use crate::render::{Fingerprint, MathMode, Renderer, Settings};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use trisect_device::DeviceInfo;

/// Separator between the arithmetics of a film that several devices rendered.
const AND: &str = " and ";

/// All properties that decide the bits of a pixel's chunks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// First half of the SHA-256 of the loaded scene, with all that it refers to.
    pub scene: String,
    /// First half of the SHA-256 of the compiled kernels' hashes.
    pub kernels: String,
    /// CRC-32 of the data that the host prepares from the scene, which depends on libraries:
    /// camera, BVHs and lights.
    pub prepared: String,
    /// Arithmetic: equal for devices that round alike. A film that a device with other rounding
    /// continued has several.
    pub arithmetic: String,
    /// Settings that the image depends on.
    pub settings: Value,
}

/// Returns the name of a device's arithmetic: devices that round alike have the same name.
pub fn arithmetic(device: &DeviceInfo, math: MathMode) -> String {
    match (device.backend, math) {
        // The CPU's bits, on any device.
        ("cpu" | "cuda", MathMode::Precise) => "precise".to_owned(),
        // Another driver may compile the same kernels to other instructions.
        (backend, MathMode::Precise) => {
            format!("{backend}, precise, by {} ({})", device.name, device.details)
        }
        (backend, MathMode::Fast) => format!("{backend}, fast, by {} ({})", device.name, device.details),
    }
}

impl Identity {
    /// Returns the [fingerprint](Fingerprint) of a render of a scene with this
    /// [digest](trisect_scene::Scene::digest), and what a file must also record because it outlives
    /// program and device: the prepared data and the arithmetic.
    pub fn new(
        scene: &[u8; 32],
        settings: &Settings,
        quality: Option<BvhQuality>,
        renderer: &Renderer,
    ) -> Self {
        let prepared = renderer.prepared_crc(settings.width, settings.height);
        let arithmetic = arithmetic(renderer.device().info(), settings.math);
        let Fingerprint { version, kernels, scene, mut settings } =
            Fingerprint::new(scene, settings, quality);
        // Part of the arithmetic, of which a film may have several.
        settings.remove("math");
        let prepared = format!("{prepared:08x}");
        Self { version, scene, kernels, prepared, arithmetic, settings: settings.into() }
    }

    /// Records that a device with other rounding continued this film: either arithmetic may
    /// continue it then.
    pub fn add_rounding(&mut self, arithmetic: &str) {
        for new in arithmetic.split(AND) {
            if !self.arithmetic.split(AND).any(|one| one == new) {
                self.arithmetic = format!("{}{AND}{new}", self.arithmetic);
            }
        }
    }

    /// Returns whether all arithmetics of one film are among those of the other.
    fn rounds_like(&self, other: &Self) -> bool {
        let among =
            |some: &str, all: &str| some.split(AND).all(|one| all.split(AND).any(|other| one == other));
        among(&self.arithmetic, &other.arithmetic) || among(&other.arithmetic, &self.arithmetic)
    }

    /// Checks that another identity is that of the same image.
    ///
    /// # Errors
    ///
    /// The first field in which they differ.
    pub fn check(&self, other: &Self) -> Result<(), Difference> {
        let fields = [
            ("version", &self.version, &other.version, self.version == other.version),
            ("scene", &self.scene, &other.scene, self.scene == other.scene),
            ("kernels", &self.kernels, &other.kernels, self.kernels == other.kernels),
            ("prepared", &self.prepared, &other.prepared, self.prepared == other.prepared),
            ("arithmetic", &self.arithmetic, &other.arithmetic, self.rounds_like(other)),
        ];
        if let Some((field, one, other, _)) = fields.into_iter().find(|(.., is_same)| !is_same) {
            return Err(Difference::new(field, one, other));
        }
        let empty = serde_json::Map::new();
        let of = |value: &Value| value.as_object().cloned().unwrap_or_else(|| empty.clone());
        let (one, two) = (of(&self.settings), of(&other.settings));
        let text = |value: Option<&Value>| value.map_or_else(|| "not set".to_owned(), Value::to_string);
        match one.keys().chain(two.keys()).find(|key| one.get(*key) != two.get(*key)) {
            Some(key) => Err(Difference::new(key, &text(one.get(key)), &text(two.get(key)))),
            None => Ok(()),
        }
    }
}
