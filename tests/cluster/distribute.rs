//! One image over several ranks, here threads of one process, is the image of a single process.
//! Covers torture tests 6 and 7 over ranks.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::sync::Arc;
use std::thread;
use trisect::denoise::{DenoiseSettings, Filter, TemporalSettings};
use trisect::device::cpu::Cpu;
use trisect::film::{Film, RowSet};
use trisect::image::Image;
use trisect::output::{Encoding, Picture};
use trisect::render::{DisplayOptions, Renderer, Settings, Summation};
use trisect::scene::Scene;
use trisect_cluster::local::Local;
use trisect_cluster::{
    AssembledImage, Balance, ClusterPlan, DEFAULT_PATIENCE, DistributionMode, Finished, Heartbeat,
    WireFormat, Work, render_image,
};
use trisect_tests::renders::independent;
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

fn renderer(scene: &Scene) -> Renderer {
    Renderer::new(Cpu::open(Some(1)).unwrap(), scene).unwrap()
}

/// Renders the image over `ranks` ranks, each with the scene that `scene_of` returns for it.
fn by_ranks(ranks: u32, scene_of: &(dyn Fn(u32) -> Scene + Sync), work: &Work) -> Finished {
    let work = Arc::new(work.clone());
    let mut threads = Vec::new();
    for local in Local::ranks(ranks) {
        let (work, scene) = (work.clone(), scene_of(threads.len() as u32));
        threads.push(thread::spawn(move || {
            let mut link = Heartbeat::new(local, DEFAULT_PATIENCE);
            render_image(&mut link, renderer(&scene), &work, &mut (), &|| false).unwrap().0
        }));
    }
    let mut images: Vec<_> = threads.into_iter().map(|thread| thread.join().unwrap()).collect();
    assert!(images[1..].iter().all(Option::is_none));
    images.swap_remove(0).unwrap()
}

fn work(settings: &Settings, plan: ClusterPlan, travels: WireFormat) -> Work {
    Work { settings: settings.clone(), plan, wire_format: travels, choice: String::new() }
}

fn whole(scene: &Scene, settings: &Settings) -> Film {
    renderer(scene).render(settings).unwrap().film
}

fn color(finished: Finished) -> Image {
    match finished.picture {
        AssembledImage::Color(image) => image,
        other => panic!("{other:?}"),
    }
}

fn bits(image: &Image) -> Vec<u32> {
    image.pixels.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Returns the number of pixels that differ, among those that both images have.
fn differing(a: &Image, b: &Image) -> usize {
    a.pixels.iter().zip(&b.pixels).filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).count()
}

/// Torture test 6 over ranks: rows over 1, 2, 3, 7 and rows + 1 ranks give the same film.
#[test]
fn rows_give_the_same_film() {
    let scene = scene("rtiow_final.ron");
    let settings = Settings { width: 40, height: 23, samples: 5, ..Settings::of(&scene) };
    let want = whole(&scene, &settings);
    let image = want.image();
    for balance in [Balance::Static, Balance::Dynamic] {
        for (ranks, block_shift) in [(1, 3), (2, 3), (2, 0), (3, 1), (7, 2), (24, 0)] {
            let plan = ClusterPlan { mode: DistributionMode::Rows, balance, block_shift };
            let same = |_: u32| scene.clone();
            let finished = by_ranks(ranks, &same, &work(&settings, plan, WireFormat::Color));
            assert_eq!(finished.counts, want.counts(), "{ranks} {balance:?}");
            assert_eq!(finished.report.ranks.len(), ranks as usize);
            assert_eq!(bits(&color(finished)), bits(&image), "{ranks} {balance:?}");
        }
    }
    // Negative control: one rank has another scene.
    let mut other = scene.clone();
    other.materials.iter_mut().for_each(|material| material.albedo *= 1.01);
    let mixed = |rank: u32| if rank == 1 { other.clone() } else { scene.clone() };
    let finished = by_ranks(3, &mixed, &work(&settings, ClusterPlan::default(), WireFormat::Color));
    let share = differing(&color(finished), &image) as f64 / f64::from(40 * 23);
    assert!((0.1..0.5).contains(&share), "a third of the rows should differ, not {share}");
}

/// Each wire format gives the same output as one process.
#[test]
fn all_that_travels_gives_the_same() {
    let scene = scene("three_spheres.ron");
    // More samples than a chunk holds.
    let settings = Settings { width: 16, height: 9, samples: 300, ..Settings::of(&scene) };
    let want = whole(&scene, &settings);
    let plan = ClusterPlan { block_shift: 0, ..ClusterPlan::default() };
    let same = |_: u32| scene.clone();
    for sums in [Summation::Host, Summation::Device] {
        let settings = Settings { sums, ..settings.clone() };
        let finished = by_ranks(2, &same, &work(&settings, plan, WireFormat::Bytes));
        assert_eq!(finished.counts, want.counts(), "{sums:?}");
        let AssembledImage::Bytes { width, height, bytes } = finished.picture else { panic!("no bytes") };
        let image = want.image();
        let png = Picture::from(&image).encode("a.png".as_ref(), &Encoding::default()).unwrap();
        assert_eq!(trisect::output::encode_bytes(width, height, &bytes).unwrap(), png, "{sums:?}");
    }

    let guided = Settings { guides: true, ..settings.clone() };
    let want = whole(&scene, &guided);
    for (mode, travels, settings) in [
        (DistributionMode::Rows, WireFormat::Sums, &settings),
        (DistributionMode::Rows, WireFormat::SumsAndAovs, &guided),
        (DistributionMode::Average, WireFormat::SumsAndAovs, &guided),
    ] {
        let finished = by_ranks(2, &same, &work(settings, ClusterPlan { mode, ..plan }, travels));
        let AssembledImage::Film(film) = finished.picture else { panic!("no film") };
        let film = *film;
        if mode == DistributionMode::Rows {
            assert_eq!(film.pixels, want.pixels, "{travels:?}");
        }
        assert_eq!(film.coverage, want.coverage);
        if travels == WireFormat::SumsAndAovs && mode == DistributionMode::Rows {
            assert_eq!(film.aovs, want.aovs);
        }
    }
}

/// Torture test 7 over ranks: averages over any number of ranks have the same bits where chunks
/// stay whole, also where a rank's chunks add up on its device.
#[test]
fn averages_give_the_same_film() {
    [Summation::Host, Summation::Device].into_iter().for_each(averages_by);
}

fn averages_by(sums: Summation) {
    let scene = scene("rtiow_final.ron");
    let same = |_: u32| scene.clone();
    let plan = ClusterPlan { mode: DistributionMode::Average, ..ClusterPlan::default() };
    for (samples, ranks, whole_chunks) in [
        (1024, 1, true),
        (1024, 2, true),
        (768, 3, true),
        (1024, 4, true),
        (100, 3, false),
        (7, 4, false),
        (3, 5, false),
    ] {
        let settings = Settings { width: 12, height: 17, samples, sums, ..Settings::of(&scene) };
        let want = whole(&scene, &Settings { sums: Summation::Host, ..settings.clone() });
        let travels = if samples.div_ceil(ranks) > 256 { WireFormat::Mean } else { WireFormat::Chunk };
        let finished = by_ranks(ranks, &same, &work(&settings, plan, travels));
        assert_eq!(finished.counts, want.counts(), "{samples} {ranks}");
        let (image, want) = (color(finished), want.image());
        if whole_chunks {
            assert_eq!(bits(&image), bits(&want), "{samples} {ranks}");
        } else {
            // Each rank's f32 sum rounds by at most 2^-24 of itself, so all of them together by at
            // most 2^-24 of the whole sum.
            for (a, b) in image.pixels.iter().flatten().zip(want.pixels.iter().flatten()) {
                assert!((a - b).abs() <= 1.3e-7 * b.abs(), "{samples} {ranks}: {a} {b}");
            }
        }
        if ranks == 2 {
            // Negative control: one rank has 0.01 % more albedo, which is invisible to the eye.
            let mut other = scene.clone();
            other.materials.iter_mut().for_each(|material| material.albedo *= 1.0001);
            let mixed = |rank: u32| if rank == 1 { other.clone() } else { scene.clone() };
            let finished = by_ranks(2, &mixed, &work(&settings, plan, travels));
            assert!(differing(&color(finished), &want) > 100);
        }
    }
}

/// Noise falls with the root of the number of ranks, if each adds the same number of independent
/// samples. Those of Sobol's sequence reduce it faster.
#[test]
fn noise_falls_with_the_root_of_the_ranks() {
    let scene = scene("rtiow_final.ron");
    let same = |_: u32| scene.clone();
    let plan = ClusterPlan { mode: DistributionMode::Average, ..ClusterPlan::default() };
    // Noise is the difference of two images with different seeds over the root of 2. Values are
    // clamped to 1, because a single bright path would dominate otherwise.
    let noise = |ranks: u32, per_rank: u32| {
        let image = |seed: u32| {
            let settings =
                Settings { width: 160, height: 90, samples: ranks * per_rank, seed, ..independent(&scene) };
            color(by_ranks(ranks, &same, &work(&settings, plan, WireFormat::Chunk)))
        };
        let (a, b) = (image(1), image(2));
        let squares = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        let sum: f64 = squares.map(|(a, b)| f64::from(a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)).powi(2)).sum();
        (sum / (2.0 * a.pixels.len() as f64 * 3.0)).sqrt()
    };
    let one = noise(1, 4);
    for ranks in [2, 3, 4] {
        let ratio = noise(ranks, 4) * f64::from(ranks).sqrt() / one;
        assert!((ratio - 1.0).abs() <= 0.05, "{ranks} ranks: {ratio}");
    }
    // Negative control: ranks that share the samples of one do not reduce the noise.
    let ratio = noise(2, 2) * 2f64.sqrt() / one;
    assert!((ratio - 1.0).abs() > 0.05, "{ratio}");
}

for_each_backend!(shares_are_rows_of_the_film, bands_are_rows_of_the_frame, second_streams_render_the_same);

/// A renderer and its second stream, which run at the same time with different cameras, each give
/// the frames that they give alone. Backends without a second stream are skipped.
fn second_streams_render_the_same(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let Some(mut twin) = renderer.second_stream().unwrap() else {
        eprintln!("{subject:?} has no second stream");
        return;
    };
    let settings = Settings { width: 97, height: 61, samples: 4, ..Settings::of(&scene) };
    let rows = RowSet::from(0..settings.height);
    let mut aside = scene.camera;
    aside.look_from.x += 1.0;
    let frames = |renderer: &mut Renderer| -> Vec<Vec<u32>> {
        let mut frame = || {
            let mut pixels = Vec::new();
            renderer.frame(&settings, &rows, &DisplayOptions::default(), &mut pixels).unwrap();
            pixels
        };
        (0..20).map(|_| frame()).collect()
    };
    let here = frames(&mut renderer);
    twin.set_camera(aside).unwrap();
    let there = frames(&mut twin);
    thread::scope(|scope| {
        let other = scope.spawn(|| frames(&mut twin));
        assert!(frames(&mut renderer) == here, "{subject:?}");
        assert!(other.join().unwrap() == there, "{subject:?}, the second stream");
    });
    twin.set_camera(scene.camera).unwrap();
    assert!(frames(&mut twin) == here, "{subject:?}, the second stream with the first camera");
    // Negative control: another camera gives another image.
    assert_ne!(here[0], there[0]);
}

/// Chunks and frames of a rank's rows are those of the whole image.
fn shares_are_rows_of_the_film(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 41, height: 29, samples: 3, ..Settings::of(&scene) };
    let width = settings.width as usize;
    let (mut screen, mut pixels) = (Vec::new(), Vec::new());
    let film = renderer.render(&settings).unwrap().film;
    let all = RowSet::from(0..settings.height);
    renderer.frame(&settings, &all, &DisplayOptions::default(), &mut screen).unwrap();
    for (shown, pixel) in screen.iter().zip(&film.image().pixels) {
        for (byte, value) in shown.to_le_bytes().into_iter().zip(pixel) {
            assert!(byte.abs_diff(trisect::metrics::srgb::encode_u8(*value)) <= 1);
        }
    }
    for (shift, ranks) in [(0, 2), (2, 3), (3, 2)] {
        for rank in 0..ranks {
            let rows = RowSet::interleaved(settings.height, shift, rank, ranks);
            let sums = renderer.render_chunk(&settings, &rows, 0..3, &mut ()).unwrap();
            for (row, own) in rows.iter().zip(sums.pixels.chunks_exact(width)) {
                for (sums, total) in own.iter().zip(&film.pixels.exact()[row as usize * width..]) {
                    assert_eq!(trisect::film::PixelTotals::of(sums, 3), *total, "{subject:?} row {row}");
                }
            }
            renderer.frame(&settings, &rows, &DisplayOptions::default(), &mut pixels).unwrap();
            for (row, own) in rows.iter().zip(pixels.chunks_exact(width)) {
                assert_eq!(
                    own,
                    &screen[row as usize * width..(row as usize + 1) * width],
                    "{subject:?} row {row}"
                );
            }
        }
    }
    // Negative control: another rank's rows. The first ones show a sky that is the same over a row,
    // so the middle of the image is compared.
    let other = RowSet::interleaved(settings.height, 0, 1, 2);
    renderer.frame(&settings, &other, &DisplayOptions::default(), &mut pixels).unwrap();
    let middle = other.iter().count() / 2;
    assert_ne!(pixels[middle * width..][..width], screen[2 * middle * width..][..width]);
}

/// Bands of rows, rendered with the rows around them that the filters read, are the rows of the
/// whole frame. This also holds for consecutive frames with a resting camera.
fn bands_are_rows_of_the_frame(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 24, height: 300, samples: 1, ..Settings::of(&scene) };
    let width = settings.width as usize;
    for denoise in
        [Some(DenoiseSettings::new(Filter::Svgf)), Some(DenoiseSettings::new(Filter::Atrous)), None]
    {
        let mut frames = |rows: std::ops::Range<u32>| {
            let mut shown = Vec::new();
            for _ in 0..3 {
                let live = renderer
                    .live_rows(&settings, denoise.as_ref(), Some(&TemporalSettings::DEFAULT), &rows)
                    .unwrap();
                let mut pixels = Vec::new();
                renderer.show(&live, &DisplayOptions::default(), &mut pixels).unwrap();
                shown.push(pixels);
            }
            shown
        };
        let whole = frames(0..settings.height);
        for rows in [0..100, 100..101, 101..300] {
            let pixels = rows.start as usize * width..rows.end as usize * width;
            for (frame, (own, whole)) in frames(rows.clone()).iter().zip(&whole).enumerate() {
                assert!(
                    own[..] == whole[pixels.clone()],
                    "{subject:?} {denoise:?} frame {frame} rows {rows:?}"
                );
            }
        }
        assert!(whole[0] != whole[2], "the frames do not differ");
    }
}
