//! Identity of an image: the properties that all films of the image share.
//!
//! Checkpoints store it; `resume` and `merge` compare it.

use crate::error::Difference;
use crate::render::{Crop, Fingerprint, MathMode, Renderer, Settings};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use trisect_device::DeviceInfo;

/// Separator between the arithmetics of a film that several devices rendered.
const AND: &str = " and ";

/// All properties that decide the bits of a pixel's chunks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Fingerprint of the image, without the setting `math`, which is part of the arithmetic.
    #[serde(flatten)]
    pub fingerprint: Fingerprint,
    /// CRC-32 of the data that the host prepares from the scene, which depends on libraries:
    /// camera, BVHs and lights.
    pub prepared: String,
    /// Arithmetic: equal for devices that round alike. A film that a device with other rounding
    /// continued has several.
    pub arithmetic: String,
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
    pub fn new(scene: &[u8; 32], settings: &Settings, renderer: &Renderer) -> Self {
        let prepared = renderer.prepared_crc(settings.width, settings.height);
        let arithmetic = arithmetic(renderer.device().info(), settings.math);
        Self::of_parts(renderer.fingerprint(scene, settings), prepared, arithmetic)
    }

    /// Returns the identity of an image with this [fingerprint](Renderer::fingerprint),
    /// [CRC-32 of the prepared data](Renderer::prepared_crc) and [arithmetic](arithmetic()), for
    /// callers that no longer have the renderer.
    pub fn of_parts(mut fingerprint: Fingerprint, prepared: u32, arithmetic: String) -> Self {
        // A film may have several arithmetics.
        fingerprint.settings.remove("math");
        Self { fingerprint, prepared: format!("{prepared:08x}"), arithmetic }
    }

    /// Returns the place of the image in a larger one, if it is a part.
    pub fn crop(&self) -> Option<Crop> {
        let crop = self.fingerprint.settings.get("crop")?;
        serde_json::from_value(crop.clone()).ok()
    }

    /// Returns the fingerprint of a render with this `math`, as [`Renderer::fingerprint`] does.
    pub fn fingerprint_with(&self, math: MathMode) -> Fingerprint {
        let mut fingerprint = self.fingerprint.clone();
        fingerprint.settings.insert("math".to_owned(), json!(math));
        fingerprint
    }

    /// Returns the samples per pixel of the complete image; `None` if they are not recorded.
    pub(super) fn samples(&self) -> Option<u64> {
        self.fingerprint.settings.get("spp").and_then(Value::as_u64)
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
        let differs = |field, one: &String, other: &String| Some(Difference::new(field, one, other));
        let difference = self.fingerprint.difference(&other.fingerprint).or_else(|| {
            if self.prepared != other.prepared {
                differs("prepared", &self.prepared, &other.prepared)
            } else if !self.rounds_like(other) {
                differs("arithmetic", &self.arithmetic, &other.arithmetic)
            } else {
                None
            }
        });
        difference.map_or(Ok(()), Err)
    }
}
