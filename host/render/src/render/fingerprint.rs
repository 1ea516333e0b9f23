//! Fingerprint of an image: the one list of what identifies it. Ranks, checkpoints and the lab's
//! references compare it.

use super::Settings;
use crate::bvh::BvhQuality;
use serde::Serialize;
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

/// Everything that decides the samples of an image, except the device's rounding. Films with equal
/// fingerprints belong to one image.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
            // These decide only how the image is computed.
            traversal: _,
            schedule: _,
            tile: _,
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
            ("fresnel", value(fresnel)),
            ("math", value(math)),
            ("sampler", value(sampler)),
            ("light_sampling", Value::from(*light_sampling)),
            ("clamp", Value::from(*clamp)),
            ("guides", Value::from(*guides)),
            // The BVH decides which of two coincident surfaces is hit.
            ("bvh_quality", value(&quality)),
        ];
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            kernels: hex(&Sha256::digest(artifacts(trisect_kernels::MANIFEST))),
            scene: hex(scene),
            settings: settings.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
        }
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

/// Returns the names and hashes of the compiled kernels that a manifest lists, a line each.
fn artifacts(manifest: &str) -> String {
    let manifest: Value = serde_json::from_str(manifest).unwrap_or_default();
    let all = manifest["artifacts"].as_object().into_iter().flatten();
    let kernels = all.filter(|(name, _)| name.starts_with("kernels/"));
    kernels.map(|(name, hash)| format!("{name} {hash}\n")).collect()
}

/// Returns the JSON value of an enum without data.
fn value(of: &impl Serialize) -> Value {
    serde_json::to_value(of).unwrap_or_default()
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
        assert!(all.lines().count() > 30 && all.contains("render.spv"), "{all}");
        let mut other: Value = serde_json::from_str(manifest).unwrap_or_default();
        other["sources"]["shared/src/path/mod.rs"] = "a comment".into();
        other["artifacts"]["tests/probes/prebuilt/probes.precise.ptx"] = "another probe".into();
        assert_eq!(artifacts(&other.to_string()), all);
        other["artifacts"]["kernels/prebuilt/spirv/render.spv"] = "another kernel".into();
        assert_ne!(artifacts(&other.to_string()), all);
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
