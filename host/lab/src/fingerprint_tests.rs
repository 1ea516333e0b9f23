//! Checkpoints, ranks and references of the lab tell images apart by the same fingerprint.
#![allow(clippy::panic, reason = "this is how a test fails")]

use crate::tradeoff::hash;
use trisect::bvh::BvhQuality;
use trisect::checkpoint::Identity;
use trisect::device::{Device, cpu::Cpu};
use trisect::render::{
    Fresnel, KernelFeatures, MathMode, PreparedScene, Renderer, Sampler, Schedule, Settings, Summation,
    Traversal,
};
use trisect::scene::Scene;

/// Change of one field of the settings, or of the BVH's quality.
type Change = fn(&mut Settings, &mut Option<BvhQuality>);

#[test]
fn ranks_checkpoints_and_references_agree() {
    let scene = Scene::hello_world().unwrap_or_else(|error| panic!("{error}"));
    let digest = scene.digest();
    let cpu = Cpu::open(Some(1)).unwrap_or_else(|error| panic!("{error}"));
    let mut cpu = Some(Box::new(cpu) as Box<dyn Device>);
    let mut all = |settings: &Settings, quality| {
        let mut prepared = PreparedScene::new(&scene, quality).unwrap_or_else(|error| panic!("{error}"));
        let ranks = prepared.fingerprint(settings);
        let device = cpu.take().unwrap_or_else(|| panic!("the device was given back"));
        let renderer = Renderer::upload(device, &mut prepared).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(renderer.fingerprint(&digest, settings).difference(&ranks), None);
        let identity = Identity::new(&digest, settings, &renderer);
        cpu = Some(renderer.into_device());
        (ranks, identity, hash(&scene, settings, quality))
    };
    let first = Settings { roulette: true, roulette_depth: 2, ..Settings::of(&scene) };
    let same = all(&first, None);
    let mut changed = |change: Change| {
        let (mut settings, mut quality) = (first.clone(), None);
        change(&mut settings, &mut quality);
        let (facts, identity, hash) = all(&settings, quality);
        (facts.difference(&same.0).is_some(), identity.check(&same.1).is_err(), hash != same.2)
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
        ("sampler", |s, _| s.sampler = Sampler::Independent),
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
    let ways: [(&str, Change); 5] = [
        ("traversal", |s, _| s.traversal = Some(Traversal::Linear)),
        ("schedule", |s, _| s.schedule = Some(Schedule::Pixel)),
        ("sums", |s, _| s.sums = Summation::Host),
        ("tile", |s, _| s.tile = Some(8)),
        ("features", |s, _| s.features = KernelFeatures::Also(trisect_shared::features::TEXTURES)),
    ];
    for (name, change) in ways {
        assert_eq!(changed(change), (false, false, false), "{name}");
    }
    let off = |roulette_depth| Settings { roulette: false, roulette_depth, ..first.clone() };
    assert_eq!(all(&off(1), None), all(&off(5), None));
}
