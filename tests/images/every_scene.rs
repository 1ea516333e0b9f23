//! Every scene of the project on every backend, compared with the CPU: CUDA has the same bits; wgpu
//! has the same first hits and, from the same random numbers, the same radiance.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::Path;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::path::FirstHit;
use trisect_tests::renders::{apart, brighter, cpu, differing, film, independent, scene_files};
use trisect_tests::statistics::{Blocks, GLOBAL_LIMIT};
use trisect_tests::{BackendUnderTest, for_each_translation};

/// Returns whether a backend that rounds differently shows the CPU's image.
fn is_the_same(got: &Film, want: &Film) -> bool {
    apart(got, want) * 100 <= 3 * want.pixels.len()
        && Blocks::new(got).compare(&Blocks::new(want), 1e-5).whole < GLOBAL_LIMIT
}

/// Returns the number of first hits of another primitive.
fn elsewhere(a: &[FirstHit], b: &[FirstHit]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a.primitive != b.primitive).count()
}

fn one(subject: BackendUnderTest, path: &Path) -> Option<()> {
    let scene = Scene::load(path).unwrap();
    let name = path.file_name().unwrap().display();
    let settings = Settings { width: 24, height: 16, samples: 2, seed: 5, ..independent(&scene) };
    let mut renderer = subject.renderer(&scene)?;
    let mut cpu = cpu(&scene);
    let (got, want) = (film(&mut renderer, &settings), film(&mut cpu, &settings));
    let counts = got.counts();
    assert_eq!((counts.rejected, counts.unwritten), (0, 0), "{name}");
    // First hits are compared for more pixels, as each costs one ray.
    let many = Settings { width: 160, height: 120, ..settings.clone() };
    let (hits, wanted) = (renderer.first_hits(&many, 1).unwrap(), cpu.first_hits(&many, 1).unwrap());
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert_eq!(differing(&got, &want), 0, "{name}");
        assert!(hits == wanted, "{name}: first hits");
    } else {
        let (off, apart) = (elsewhere(&hits, &wanted), apart(&got, &want));
        eprintln!(
            "{subject:?} {name}: {off} of {} first hits and {apart} of {} pixels differ",
            hits.len(),
            want.pixels.len()
        );
        assert!(off * 1000 <= hits.len(), "{name}: {off} of {}", hits.len());
        assert!(is_the_same(&got, &want), "{name}: {apart} pixels differ");
    }
    Some(())
}

fn every_scene_is_the_cpus(subject: BackendUnderTest) {
    let files = scene_files();
    assert!(files.len() >= 12, "{files:?}");
    for path in &files {
        if one(subject, path).is_none() {
            return;
        }
    }
    if matches!(subject, BackendUnderTest::WgpuNaga | BackendUnderTest::WgpuWgsl) {
        return; // another route has the controls: NVIDIA's driver creates about 30 devices per process
    }
    // Negative controls: 1 % more albedo, where there is light and scattering; the rays of another
    // sample.
    let path = files.iter().find(|path| path.ends_with("cornell_box.ron")).unwrap();
    let scene = Scene::load(path).unwrap();
    let settings = Settings { width: 24, height: 16, samples: 2, seed: 5, ..independent(&scene) };
    let want = film(&mut cpu(&scene), &settings);
    let Some(mut renderer) = subject.renderer(&brighter(&scene)) else { return };
    assert!(!is_the_same(&film(&mut renderer, &settings), &want), "negative control not detected");
    let hits = |sample| cpu(&scene).first_hits(&settings, sample).unwrap();
    assert!(elsewhere(&hits(0), &hits(1)) * 1000 > hits(0).len(), "negative control not detected");
}

for_each_translation!(every_scene_is_the_cpus);
