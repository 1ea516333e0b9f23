//! Films: parts, chunks and their sums (6, 7, 21).

use std::ops::Range;
use trisect::Error;
use trisect::film::{Film, FilmError, PixelTotals};
use trisect::render::{Renderer, SampleBlock, Settings, SettingsError};
use trisect::scene::Scene;
use trisect_shared::film::{CHUNK_SAMPLES, PixelSums};
use trisect_shared::rng::PathKey;
use trisect_tests::renders::{film, independent};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// Number of samples: three chunks, the last of them not full.
const SAMPLES: u32 = 2 * CHUNK_SAMPLES + 44;

/// Returns the scene of three spheres, with settings for few pixels and short paths.
fn hello() -> (Scene, Settings) {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 7, height: 10, samples: SAMPLES, depth: 6, ..independent(&scene) };
    (scene, settings)
}

fn render(renderer: &mut Renderer, settings: &Settings, rows: Range<u32>, samples: Range<u32>) -> Film {
    renderer.render_part(settings, &SampleBlock { rows, samples }, &mut ()).unwrap().film
}

/// Returns the sum of `films`, added two at a time in the random order that `seed` gives, which may
/// form any tree.
fn sum(films: &[Film], seed: u32) -> Result<Film, FilmError> {
    let mut films = films.to_vec();
    let mut step = 0;
    while films.len() > 1 {
        step += 1;
        let random = PathKey { seed, pixel: step, sample: 0 }.words(0);
        let other = films.swap_remove(random.x as usize % films.len());
        let index = random.y as usize % films.len();
        films[index].add(&other)?;
    }
    Ok(films.remove(0))
}

/// A film has the same bits whether its rows are rendered in 1, 2, 3, 7 or height + 1 parts, and in
/// whatever order and grouping tiles of rows and chunks are added.
fn t06_parts_chunks_and_groupings(subject: BackendUnderTest) {
    let (scene, settings) = hello();
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let whole = film(&mut renderer, &settings);
    assert_eq!(whole.counts().samples, settings.total_samples());
    let height = settings.height;
    for parts in [1, 2, 3, 7, height + 1] {
        let mut films = Vec::new();
        for part in 0..parts {
            let rows = height * part / parts..height * (part + 1) / parts;
            if rows.is_empty() {
                let part = SampleBlock { rows, samples: 0..SAMPLES };
                let refused = renderer.render_part(&settings, &part, &mut ());
                assert!(matches!(refused, Err(Error::Settings(SettingsError::NoSuchPart { .. }))));
                films.push(Film::new(settings.width, height)); // what a rank without rows has
            } else {
                films.push(render(&mut renderer, &settings, rows, 0..SAMPLES));
            }
        }
        for seed in 0..4 {
            assert!(sum(&films, seed).unwrap() == whole, "{parts} parts, grouping {seed}");
        }
    }
    let mut tiles = Vec::new();
    for rows in [6..10, 0..1, 1..6] {
        for chunk in [2, 0, 1] {
            let samples = chunk * CHUNK_SAMPLES..SAMPLES.min((chunk + 1) * CHUNK_SAMPLES);
            tiles.push(render(&mut renderer, &settings, rows.clone(), samples));
        }
    }
    for seed in 0..64 {
        assert!(sum(&tiles, seed).unwrap() == whole, "tiles, grouping {seed}");
    }
    // Negative controls: a tile of another seed, a missing tile, and a tile that is added twice.
    let other = Settings { seed: 1, ..settings.clone() };
    let fault = render(&mut renderer, &other, 1..6, 0..CHUNK_SAMPLES);
    let spoilt = [&tiles[..7], &[fault], &tiles[8..]].concat();
    assert!(sum(&spoilt, 0).unwrap() != whole, "negative control not detected");
    assert!(sum(&tiles[1..], 0).unwrap() != whole, "negative control not detected");
    assert!(matches!(sum(&[&tiles[..], &tiles[..1]].concat(), 0), Err(FilmError::Overlap { .. })));
    report(
        6,
        subject,
        Outcome::Passed,
        "rows over 1, 2, 3, 7, 11 parts and 64 groupings of 9 tiles: the same bits",
    );
}

/// A film of whole chunks has the same bits over any number of parts. A part that splits a chunk is
/// refused, because the f32 sum of a chunk in two pieces would be rounded twice.
fn t07_samples_over_parts(subject: BackendUnderTest) {
    let (scene, settings) = hello();
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let whole = film(&mut renderer, &settings);
    let chunks = SAMPLES.div_ceil(CHUNK_SAMPLES);
    for parts in [2, 3] {
        let bound = |part: u32| SAMPLES.min((chunks * part / parts) * CHUNK_SAMPLES);
        let films: Vec<Film> = (0..parts)
            .map(|part| render(&mut renderer, &settings, 0..settings.height, bound(part)..bound(part + 1)))
            .collect();
        assert!(sum(&films, 7).unwrap() == whole, "{parts} parts");
        // Negative control: one part's samples are of another seed.
        let other = Settings { seed: 1, ..settings.clone() };
        let fault = render(&mut renderer, &other, 0..settings.height, 0..bound(1));
        assert!(sum(&[&[fault], &films[1..]].concat(), 7).unwrap() != whole, "negative control not detected");
    }
    let third = SAMPLES / 3;
    for samples in [0..third, third..2 * third, 2 * third..SAMPLES] {
        let part = SampleBlock { rows: 0..settings.height, samples };
        let refused = renderer.render_part(&settings, &part, &mut ());
        assert!(matches!(refused, Err(Error::Settings(SettingsError::SplitsChunk { .. }))));
    }
    report(
        7,
        subject,
        Outcome::Passed,
        "556 samples over 2 and 3 parts of whole chunks: the same bits; parts of chunks are refused",
    );
}

/// Returns an empty scene of one pixel under a uniform sky.
fn void(radiance: f32) -> Scene {
    let text = "Scene(version: 1, image: (width: 1, height: 1, samples: 1), \
                camera: (look_from: (0, 0, 1), look_at: (0, 0, 0), vertical_fov: 40), materials: {}, objects: [])";
    let mut scene = Scene::parse(text, "void").unwrap();
    // Set in the records, because no file can have a negative radiance.
    (scene.sky.bottom, scene.sky.top) = (glam::Vec3::splat(radiance), glam::Vec3::splat(radiance));
    scene
}

/// Returns the sums of the only pixel over one chunk, as the device had them.
fn chunk(subject: BackendUnderTest, radiance: f32, samples: u32) -> Option<PixelSums> {
    let scene = void(radiance);
    let settings = Settings { samples, ..independent(&scene) };
    let PixelTotals { radiance, squares, samples, segments, .. } =
        film(&mut subject.renderer(&scene)?, &settings).pixels.exact()[0];
    let sums =
        |sums: [trisect::film::ExactSum; 3]| glam::Vec3::from_array(sums.map(|sum| sum.value() as f32));
    Some(PixelSums {
        radiance: sums(radiance),
        samples: samples as u32,
        squares: sums(squares),
        segments: segments as u32,
    })
}

fn merged(chunks: impl IntoIterator<Item = PixelSums>) -> PixelTotals {
    let mut film = Film::new(1, 1);
    let mut first = 0;
    for sums in chunks {
        let samples = first..first + sums.samples;
        first = samples.end;
        film.merge(&SampleBlock { rows: 0..1, samples }, &[sums]).unwrap();
    }
    film.pixels.exact()[0]
}

/// Maximum relative error of a chunk's sum, which rounds once, by at most 2^-24. A plain f32 sum of
/// 256 samples exceeds it.
const CHUNK_ERROR: f64 = 1e-6;

/// The mean of 2^25 samples of 0.1 is off by at most 1e-6. A device sums a chunk of 256 samples,
/// and the film sums 2^17 such chunks without any error of its own, so that the error is that of
/// the kernel's sum.
fn t21_accumulator_ladder(subject: BackendUnderTest) {
    let Some(chunk) = chunk(subject, 0.1, CHUNK_SAMPLES) else { return };
    let error = |mean: f64| (mean / f64::from(0.1f32) - 1.0).abs();
    let one = error(f64::from(chunk.radiance.x) / f64::from(CHUNK_SAMPLES));
    for log2 in [0, 4, 8, 12, 17] {
        let totals = merged(std::iter::repeat_n(chunk, 1 << log2));
        let off = error(totals.mean()[0]);
        assert!(totals.samples == 256 << log2 && off <= CHUNK_ERROR, "2^{log2} chunks: {off:e}");
        // Sums of equal numbers are exact, so the film adds nothing to the chunk's error.
        assert_eq!(off, one, "2^{log2} chunks");
    }
    let in_f32 = (0..1 << 17).fold(0.0f32, |sum, _| sum + chunk.radiance.x) / (1 << 25) as f32;
    assert!(error(f64::from(in_f32)) > CHUNK_ERROR, "not detected: chunks summed in f32: {in_f32}");
    let outcome = if one <= 1e-6 { Outcome::Passed } else { Outcome::Bounded };
    report(
        21,
        subject,
        outcome,
        format!("2^25 samples of 0.1: off by {one:.1e}, all of it in the f32 sums of chunks"),
    );
}

for_each_route!(t06_parts_chunks_and_groupings, t07_samples_over_parts, t21_accumulator_ladder,);
