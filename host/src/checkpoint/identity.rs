//! What films must have in common that are of one image.

use crate::backend::Device;
use crate::bvh::BvhQuality;
use crate::render::{Fingerprint, MathMode, Renderer, Settings};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;

/// Between the roundings of a film of several devices.
const AND: &str = " and ";

/// All that decides the bits of a pixel's chunks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Of the program.
    pub version: String,
    /// SHA-256 of the scene with all that it refers to; its first half.
    pub scene: String,
    /// The same of the kernels.
    pub kernels: String,
    /// CRC-32 of what the host makes of the scene: the camera's record, trees and lights, of which libraries have a part.
    pub prepared: String,
    /// Whose rounding: devices that round alike have the same. Of several, where one went on for another.
    pub arithmetic: String,
    /// Those of the settings that the image depends on.
    pub settings: Value,
}

/// A field in which two differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its path.
    pub field: String,
    /// What the first has.
    pub one: String,
    /// What the other has.
    pub other: String,
}

impl Difference {
    pub(super) fn new(field: &str, one: &impl ToString, other: &impl ToString) -> Self {
        Self { field: field.to_owned(), one: one.to_string(), other: other.to_string() }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} is {} there, and {} here", self.field, self.other, self.one)
    }
}

/// Whose rounding a device has: those that round alike have the same.
pub fn arithmetic(device: &Device, math: MathMode) -> String {
    match (device.backend, math) {
        // The CPU's bits, on any device.
        ("cpu" | "cuda", MathMode::Precise) => "precise".to_owned(),
        // What a driver makes of the rest, another may make otherwise.
        (backend, MathMode::Precise) => {
            format!("{backend}, precise, by {} ({})", device.name, device.details)
        }
        (backend, MathMode::Fast) => format!("{backend}, fast, by {} ({})", device.name, device.details),
    }
}

impl Identity {
    /// Returns the [fingerprint](Fingerprint) of a render of a scene with this
    /// [digest](crate::scene::Scene::digest), with what a file must say besides, as it outlives
    /// program and device: what was made of the scene, and the arithmetic.
    pub fn new(
        scene: &[u8; 32],
        settings: &Settings,
        quality: Option<BvhQuality>,
        renderer: &Renderer,
    ) -> Self {
        let prepared = renderer.prepared_crc(settings.width, settings.height);
        let arithmetic = arithmetic(renderer.backend().device(), settings.math);
        let Fingerprint { version, kernels, scene, mut settings } =
            Fingerprint::new(scene, settings, quality);
        // Part of the arithmetic, of which a film may have several.
        settings.remove("math");
        let prepared = format!("{prepared:08x}");
        Self { version, scene, kernels, prepared, arithmetic, settings: settings.into() }
    }

    /// Who goes on rounds otherwise: then the film is what either of both goes on with.
    pub fn add_rounding(&mut self, arithmetic: &str) {
        for new in arithmetic.split(AND) {
            if !self.arithmetic.split(AND).any(|one| one == new) {
                self.arithmetic = format!("{}{AND}{new}", self.arithmetic);
            }
        }
    }

    /// Whether one of both has no rounding that the other has not.
    fn rounds_like(&self, other: &Self) -> bool {
        let among =
            |some: &str, all: &str| some.split(AND).all(|one| all.split(AND).any(|other| one == other));
        among(&self.arithmetic, &other.arithmetic) || among(&other.arithmetic, &self.arithmetic)
    }

    /// Whether another is of the same image.
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
        let text = |value: Option<&Value>| value.map_or_else(|| "nothing".to_owned(), Value::to_string);
        match one.keys().chain(two.keys()).find(|key| one.get(*key) != two.get(*key)) {
            Some(key) => Err(Difference::new(key, &text(one.get(key)), &text(two.get(key)))),
            None => Ok(()),
        }
    }
}
