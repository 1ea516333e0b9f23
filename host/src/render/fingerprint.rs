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
    /// Hash of the kernels, hexadecimal.
    pub kernels: String,
    /// Hash of the scene and all that it refers to, hexadecimal.
    pub scene: String,
    /// Settings by name.
    pub settings: Map<String, Value>,
}

impl Fingerprint {
    /// Returns the fingerprint of a scene with this [digest](crate::scene::Scene::digest), rendered
    /// with these settings and a BVH of this quality.
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
            variant: _,
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
            kernels: hex(&Sha256::digest(trisect_kernels::MANIFEST)),
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
    use crate::backend::cpu::Cpu;
    use crate::checkpoint::Identity;
    use crate::cluster::handshake::fingerprint;
    use crate::render::{Fresnel, MathMode, Renderer, Sampler, Schedule, Traversal};
    use crate::scene::Scene;
    use crate::tradeoff::hash;

    /// Change of one field of the settings, or of the BVH's quality.
    type Change = fn(&mut Settings, &mut Option<BvhQuality>);

    #[test]
    fn ranks_checkpoints_and_references_agree() {
        let scene = Scene::hello_world().unwrap_or_else(|error| panic!("{error}"));
        let digest = scene.digest();
        let cpu = Cpu::open(Some(1)).unwrap_or_else(|error| panic!("{error}"));
        let renderer = Renderer::new(Box::new(cpu), &scene).unwrap_or_else(|error| panic!("{error}"));
        let all = |settings: &Settings, quality| {
            (
                fingerprint(&digest, settings, quality),
                Identity::new(&digest, settings, quality, &renderer),
                hash(&scene, settings, quality),
            )
        };
        let first = Settings { roulette: true, roulette_depth: 2, ..scene.settings() };
        let same = all(&first, None);
        let changed = |change: Change| {
            let (mut settings, mut quality) = (first.clone(), None);
            change(&mut settings, &mut quality);
            let (facts, identity, hash) = all(&settings, quality);
            (facts != same.0, identity.check(&same.1).is_err(), hash != same.2)
        };
        let decisive: [(&str, Change); 14] = [
            ("width", |s, _| s.width += 1),
            ("height", |s, _| s.height += 1),
            ("samples", |s, _| s.samples += 1),
            ("depth", |s, _| s.depth += 1),
            ("seed", |s, _| s.seed += 1),
            ("roulette", |s, _| s.roulette = false),
            ("roulette_depth", |s, _| s.roulette_depth += 1),
            ("fresnel", |s, _| s.fresnel = Fresnel::Schlick),
            ("math", |s, _| s.math = MathMode::Fast),
            ("sampler", |s, _| s.sampler = Sampler::Sobol),
            ("light_sampling", |s, _| s.light_sampling = false),
            ("clamp", |s, _| s.clamp = Some(1.0)),
            ("guides", |s, _| s.guides = true),
            ("bvh_quality", |_, quality| *quality = Some(BvhQuality::Fast)),
        ];
        for (name, change) in decisive {
            assert_eq!(changed(change), (true, true, true), "{name}");
        }
        // Fields that decide only how the image is computed, and the start of a roulette that is
        // off.
        let ways: [(&str, Change); 4] = [
            ("traversal", |s, _| s.traversal = Some(Traversal::Linear)),
            ("schedule", |s, _| s.schedule = Some(Schedule::Pixel)),
            ("tile", |s, _| s.tile = Some(8)),
            ("variant", |s, _| s.variant = Some("render")),
        ];
        for (name, change) in ways {
            assert_eq!(changed(change), (false, false, false), "{name}");
        }
        let off = |roulette_depth| Settings { roulette: false, roulette_depth, ..first.clone() };
        assert_eq!(all(&off(1), None), all(&off(5), None));
    }

    #[test]
    fn another_scene_is_another_image() {
        let settings = Scene::hello_world().map(|scene| scene.settings());
        let settings = settings.unwrap_or_else(|error| panic!("{error}"));
        let of = |scene| Fingerprint::new(&[scene; 32], &settings, None);
        assert_eq!(of(1).sha256(), of(1).sha256());
        assert_ne!(of(1).sha256(), of(2).sha256());
    }
}
