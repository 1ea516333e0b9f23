//! Fingerprint of an image: the one list of what identifies it. Ranks, checkpoints and the lab's
//! references compare it.

use super::Settings;
use crate::bvh::BvhQuality;
use crate::error::Difference;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

/// Everything that decides the samples of an image, except the device's rounding. Films with equal
/// fingerprints belong to one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Version of the program.
    pub version: String,
    /// Hash of the compiled kernels, hexadecimal. Their sources do not count, so that a comment
    /// changes no fingerprint.
    pub kernels: String,
    /// Hash of the scene and all that it refers to, hexadecimal.
    pub scene: String,
    /// Settings by name.
    pub settings: Map<String, Value>,
}

impl Fingerprint {
    /// Returns the fingerprint of a scene with this [digest](trisect_scene::Scene::digest),
    /// rendered with these settings and a BVH of this quality.
    pub fn new(scene: &[u8; 32], settings: &Settings, quality: Option<BvhQuality>) -> Self {
        // Each field is named, so that whoever adds one decides whether the image depends on it.
        let Settings {
            width,
            height,
            crop,
            samples,
            depth,
            seed,
            roulette,
            roulette_depth,
            fresnel,
            math,
            sampler,
            light_sampling,
            clamp,
            guides,
            hidden_sky,
            // These decide only how the image is computed.
            traversal: _,
            schedule: _,
            tile: _,
            sums: _,
            features: _,
            // The film is not denoised.
            denoise: _,
        } = settings;
        let settings = [
            ("width", Value::from(*width)),
            ("height", Value::from(*height)),
            ("spp", Value::from(*samples)),
            ("depth", Value::from(*depth)),
            ("seed", Value::from(*seed)),
            ("roulette", Value::from(*roulette)),
            ("roulette_depth", Value::from(if *roulette { *roulette_depth } else { 1 })),
            ("fresnel", json!(fresnel)),
            ("math", json!(math)),
            ("sampler", json!(sampler)),
            ("light_sampling", Value::from(*light_sampling)),
            ("clamp", Value::from(*clamp)),
            ("guides", Value::from(*guides)),
            ("hidden_sky", Value::from(*hidden_sky)),
            // The BVH decides which of two coincident surfaces is hit.
            ("bvh_quality", json!(quality)),
        ];
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            kernels: hex(&Sha256::digest(artifacts(trisect_kernels::MANIFEST) + &fast_arithmetic())),
            scene: hex(scene),
            settings: settings
                .into_iter()
                .chain(crop.map(|crop| ("crop", json!(crop))))
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
        }
    }

    /// Returns the first field in which another fingerprint differs; `None` if both are of one
    /// image.
    pub fn difference(&self, other: &Self) -> Option<Difference> {
        let Self { version, kernels, scene, settings } = self;
        let texts = [
            ("version", version, &other.version),
            ("scene", scene, &other.scene),
            ("kernels", kernels, &other.kernels),
        ];
        if let Some((field, one, other)) = texts.into_iter().find(|(_, one, other)| one != other) {
            return Some(Difference::new(field, one, other));
        }
        let mut fields = settings.keys().chain(other.settings.keys());
        let field = fields.find(|field| settings.get(*field) != other.settings.get(*field))?;
        Some(Difference::new(field, &text(settings.get(field)), &text(other.settings.get(field))))
    }

    /// Returns a hash of the fingerprint.
    pub fn sha256(&self) -> [u8; 32] {
        let Self { version, kernels, scene, settings } = self;
        let mut hash = Sha256::new();
        for text in [version, kernels, scene] {
            hash.update(text);
            hash.update([0]);
        }
        for (name, value) in settings {
            hash.update(format!("{name}={value}\0"));
        }
        hash.finalize().into()
    }
}

/// Returns the names and hashes of the compiled kernels that a manifest lists, a line each. Of a
/// text that is no manifest all counts.
fn artifacts(manifest: &str) -> String {
    let Ok(manifest) = serde_json::from_str::<Value>(manifest) else { return manifest.to_owned() };
    let all = manifest["artifacts"].as_object().into_iter().flatten();
    let kernels = all.filter(|(name, _)| name.starts_with("kernels/"));
    kernels.map(|(name, hash)| format!("{name} {hash}\n")).collect()
}

/// Returns how fast kernels are made from the compiled ones.
fn fast_arithmetic() -> String {
    format!("{:?}", trisect_kernels::FAST_MATH)
}

/// Returns a setting's value as a message shows it.
fn text(value: Option<&Value>) -> String {
    match value {
        None => "missing".to_owned(),
        Some(Value::Null) => "not given".to_owned(),
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    }
}

/// Returns the first half of a hash, hexadecimal: enough to tell two apart.
fn hex(hash: &[u8]) -> String {
    hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_scene::Scene;

    #[test]
    fn kernels_count_and_their_sources_do_not() {
        let manifest = trisect_kernels::MANIFEST;
        let all = artifacts(manifest);
        assert!(all.lines().count() > 20 && all.contains("render.spv"), "{all}");
        let mut other: Value = serde_json::from_str(manifest).unwrap_or_default();
        other["sources"]["shared/src/path/mod.rs"] = "a comment".into();
        other["artifacts"]["tests/probes/prebuilt/probes.precise.ptx"] = "another probe".into();
        assert_eq!(artifacts(&other.to_string()), all);
        other["artifacts"]["kernels/prebuilt/spirv/render.spv"] = "another kernel".into();
        assert_ne!(artifacts(&other.to_string()), all);
        assert_ne!(artifacts("no manifest"), artifacts("another"));
    }

    #[test]
    fn another_scene_is_another_image() {
        let settings = Scene::hello_world().map(|scene| Settings::of(&scene));
        let settings = settings.unwrap_or_else(|error| panic!("{error}"));
        let of = |scene| Fingerprint::new(&[scene; 32], &settings, None);
        assert_eq!(of(1).sha256(), of(1).sha256());
        assert_ne!(of(1).sha256(), of(2).sha256());
    }
}
