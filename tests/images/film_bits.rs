//! Bits of films and images of each scene, compared with those on record in
//! `tests/reference/film_bits.txt`: a change of structure must not change them. By wgpu only some
//! scenes have more than a film.
//!
//! A change of kernels or scenes may. Then the record is made anew, and the difference reviewed:
//! `UPDATE_BITS=1 cargo test --release -p trisect-tests --test images film_bits`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::collections::BTreeMap;
use std::path::PathBuf;
use trisect::denoise::{DenoiseSettings, Filter, TemporalSettings};
use trisect::device::DeviceKind;
use trisect::film::Film;
use trisect::image::Image;
use trisect::render::{DisplayOptions, MathMode, Renderer, Sampler, Settings};
use trisect::scene::Scene;
use trisect_tests::renders::{brighter, film, independent, scene_files};
use trisect_tests::{BackendUnderTest, root};

/// CRC-32 by what was rendered: scene, backend and kind of result.
type Record = BTreeMap<String, String>;

fn path() -> PathBuf {
    let folder = [root().join("tests/reference"), root().join("reference")]; // the second in a bundle
    let folder = folder.into_iter().find(|folder| folder.exists()).expect("tests/reference");
    folder.join("film_bits.txt")
}

/// Returns the CRC-32 of each pixel's sums and counts, and of its AOV sums.
fn film_crc(film: &Film) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    for pixel in &film.pixels {
        for sum in pixel.radiance.iter().chain(&pixel.squares) {
            let (high, low) = sum.parts();
            crc.update(&high.to_bits().to_le_bytes());
            crc.update(&low.to_bits().to_le_bytes());
        }
        for count in [pixel.samples, pixel.rejected, pixel.segments, pixel.unwritten] {
            crc.update(&count.to_le_bytes());
        }
    }
    for pixel in &film.aovs {
        for value in [pixel.normal(), pixel.albedo(), pixel.position(), pixel.emission()].as_flattened() {
            crc.update(&value.to_bits().to_le_bytes());
        }
        crc.update(&pixel.primitive().map_or(u32::MAX, |primitive| primitive).to_le_bytes());
    }
    crc.finalize()
}

fn image_crc(image: &Image) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    image.pixels.iter().flatten().for_each(|value| crc.update(&value.to_bits().to_le_bytes()));
    crc.finalize()
}

/// Returns the CRC-32 of some live frames. The camera moves before those in `moves`; the history
/// counts as `history` frames.
fn live_crc(renderer: &mut Renderer, settings: &Settings, history: u32, frames: u32, moves: &[u32]) -> u32 {
    let history = TemporalSettings { frames: history, ..TemporalSettings::DEFAULT };
    let mut crc = crc32fast::Hasher::new();
    let filter = DenoiseSettings::new(Filter::Svgf);
    let mut pixels = Vec::new();
    let start = *renderer.pose();
    let mut pose = start;
    for frame in 0..frames {
        if moves.contains(&frame) {
            pose.look_from += 0.01 * (pose.look_at - pose.look_from);
            renderer.set_camera(pose).unwrap();
        }
        let live = renderer.live(settings, Some(&filter), Some(&history)).unwrap();
        crc.update(&image_crc(&renderer.read_live(&live).unwrap()).to_le_bytes());
        let screen = DisplayOptions { split: 0.5, stops: 1.0 };
        renderer.show(&live, &screen, &mut pixels).unwrap();
        pixels.iter().for_each(|pixel| crc.update(&pixel.to_le_bytes()));
    }
    renderer.set_camera(start).unwrap();
    crc.finalize()
}

/// Scenes that have all kinds of results where kernels are compiled at run time, which takes
/// seconds for each; the others have a film.
const WITH_ALL_KINDS: [&str; 6] =
    ["three_spheres.ron", "cornell_box.ron", "next_week.ron", "features.gltf", "fog_lamps.ron", "room.ron"];

/// Returns the CRC-32 of each kind of result of a scene, by name; only that of the film unless
/// `has_all`.
fn results(renderer: &mut Renderer, settings: &Settings, has_all: bool) -> Vec<(&'static str, u32)> {
    let gpu = renderer.device().info().kind != DeviceKind::Cpu;
    if !has_all {
        return vec![("film", film_crc(&film(renderer, settings)))];
    }
    let guides = Settings { guides: true, ..settings.clone() };
    let sobol = Settings { sampler: Sampler::Sobol, roulette: true, clamp: Some(4.0), ..settings.clone() };
    let with_aovs = film(renderer, &guides);
    let mut results = vec![
        ("film", film_crc(&film(renderer, settings))),
        ("film with AOVs", film_crc(&with_aovs)),
        ("film by Sobol", film_crc(&film(renderer, &sobol))),
    ];
    for (name, filter) in [("à-trous", Filter::Atrous), ("SVGF", Filter::Svgf)] {
        let (image, _) = renderer.denoise(&with_aovs, &guides, DenoiseSettings::new(filter)).unwrap();
        results.push((name, image_crc(&image)));
    }
    results.push(("live frames", live_crc(renderer, settings, TemporalSettings::DEFAULT.frames, 4, &[2])));
    // From the third frame at rest on, the history no longer counts.
    results.push(("live frames after a rest", live_crc(renderer, settings, 2, 10, &[1, 7])));
    if gpu {
        let fast = Settings { math: MathMode::Fast, ..settings.clone() };
        results.push(("film by fast math", film_crc(&film(renderer, &fast))));
    }
    results
}

fn settings(scene: &Scene) -> Settings {
    Settings { width: 33, height: 19, samples: 3, seed: 7, ..independent(scene) }
}

/// Adds the results of each scene on a backend. One backend renders them all, so that it compiles
/// each kernel once.
fn add(record: &mut Record, subject: BackendUnderTest) {
    let hello = Scene::hello_world().unwrap();
    let Some(mut renderer) = subject.renderer(&hello) else { return };
    if renderer.device().info().kind == DeviceKind::Gpu {
        eprintln!("SKIPPED for {subject:?}: the record has the bits of the CPU and of a software adapter");
        return;
    }
    for path in scene_files() {
        let scene = Scene::load(&path).unwrap();
        renderer = Renderer::new(renderer.into_device(), &scene).unwrap();
        let file = path.file_name().unwrap().to_str().unwrap();
        let has_all = subject == BackendUnderTest::Cpu || WITH_ALL_KINDS.contains(&file);
        for (name, crc) in results(&mut renderer, &settings(&scene), has_all) {
            record.insert(format!("{file}, {}, {name}", subject.name()), format!("{crc:08x}"));
        }
    }
}

fn written(record: &Record) -> String {
    record.iter().map(|(name, crc)| format!("{crc} {name}\n")).collect()
}

fn read() -> Record {
    let text = std::fs::read_to_string(path()).unwrap();
    text.lines().map(|line| (line[9..].to_owned(), line[..8].to_owned())).collect()
}

#[test]
fn films_and_images_have_the_bits_on_record() {
    let mut record = Record::new();
    for subject in [BackendUnderTest::Cpu, BackendUnderTest::Wgpu] {
        add(&mut record, subject);
    }
    if std::env::var_os("UPDATE_BITS").is_some() {
        std::fs::write(path(), written(&record)).unwrap();
        return;
    }
    let expected = read();
    // A mesh that was not generated, or a missing adapter, was reported above.
    let differ: Vec<_> = record.iter().filter(|(name, crc)| expected.get(*name) != Some(crc)).collect();
    assert!(differ.is_empty(), "{} of {} differ: {differ:#?}", differ.len(), record.len());
    assert!(record.len() >= 12 * 6, "{}", record.len());
    if record.keys().any(|name| name.contains(", wgpu, ")) {
        for scene in WITH_ALL_KINDS {
            assert!(record.contains_key(&format!("{scene}, wgpu, SVGF")), "{scene}");
        }
    }
}

/// Negative control: 1 % more albedo changes the bits of each kind of result.
#[test]
fn other_scenes_have_other_bits() {
    let scene = trisect_tests::scene("cornell_box.ron");
    let of = |scene: &Scene| {
        let mut renderer = BackendUnderTest::Cpu.renderer(scene).unwrap();
        results(&mut renderer, &settings(scene), true)
    };
    for (a, b) in of(&scene).iter().zip(of(&brighter(&scene))) {
        assert!(a.0 == b.0 && a.1 != b.1, "{}", a.0);
    }
}
