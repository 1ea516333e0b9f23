//! Films that are continued part by part, on each backend: neither stops nor existing parts change
//! the result.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use trisect::film::{Film, SampleBlock};
use trisect::render::Settings;
use trisect_tests::renders::StopAfterParts;
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

/// A film that was stopped after each part and continued by a new renderer is that of an
/// uninterrupted render.
fn ends_do_not_show(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    for guides in [false, true] {
        let settings =
            Settings { width: 40, height: 24, samples: 600, depth: 8, guides, ..Settings::of(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let whole = renderer.render(&settings).unwrap();
        let mut film = if guides { Film::with_aovs(40, 24) } else { Film::new(40, 24) };
        let mut runs = 0;
        while !film.coverage.missing(&(0..600)).is_empty() {
            let mut renderer = subject.renderer(&scene).unwrap();
            let once = StopAfterParts::new(1);
            let stats = renderer.render_missing(&mut film, &settings, &(0..600), &once, &mut ()).unwrap();
            assert_eq!(stats.samples, film.counts().samples);
            runs += 1;
        }
        assert!(runs >= 2, "{runs}");
        assert_eq!(film, whole.film);
        // A complete film is returned without rendering.
        let stats = renderer.render_missing(&mut film, &settings, &(0..600), &(), &mut ()).unwrap();
        assert_eq!((stats.submissions, &film), (0, &whole.film));
        // Negative control: one chunk has another seed.
        let mut other = if guides { Film::with_aovs(40, 24) } else { Film::new(40, 24) };
        let strange = Settings { seed: settings.seed + 1, ..settings.clone() };
        renderer.render_missing(&mut other, &strange, &(0..256), &(), &mut ()).unwrap();
        renderer.render_missing(&mut other, &settings, &(0..600), &(), &mut ()).unwrap();
        assert_ne!(other, whole.film, "negative control not detected");
    }
}

/// Whatever parts a film has, the missing ones are rendered.
fn any_part_may_be_there(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 24, height: 32, samples: 512, depth: 8, ..Settings::of(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let whole = renderer.render(&settings).unwrap().film;
    let mut film = Film::new(24, 32);
    for (rows, samples) in [(3..5, 0..256), (5..20, 256..512), (0..1, 0..512)] {
        let part = renderer.render_part(&settings, &SampleBlock { rows, samples }, &mut ()).unwrap();
        film.add(&part.film).unwrap();
    }
    renderer.render_missing(&mut film, &settings, &(0..512), &(), &mut ()).unwrap();
    assert_eq!(film, whole);
    for wrong in [Film::new(24, 31), Film::with_aovs(24, 32)] {
        assert!(renderer.render_missing(&mut wrong.clone(), &settings, &(0..512), &(), &mut ()).is_err());
    }
    let split = renderer.render_missing(&mut Film::new(24, 32), &settings, &(0..300), &(), &mut ());
    assert!(split.is_err(), "a chunk in two");
}

/// Blocks that are asked for are rendered, without the samples that the film has.
fn blocks_are_rendered_alone(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 24, height: 32, samples: 512, depth: 8, ..Settings::of(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let whole = renderer.render(&settings).unwrap().film;
    let rows = |rows| SampleBlock { rows, samples: 0..512 };
    let mut film = Film::new(24, 32);
    let mut render = |film: &mut Film, blocks: &[SampleBlock]| {
        renderer.render_parts(film, &settings, blocks, &(), &mut ())
    };
    render(&mut film, &[rows(8..16), rows(0..4)]).unwrap();
    assert_eq!(film.coverage.parts(), [rows(0..4), rows(8..16)]);
    let before = film.clone();
    assert_eq!(render(&mut film, &[]).unwrap().rendered_samples, 0);
    render(&mut film, &[rows(0..10), rows(10..32)]).unwrap();
    assert_eq!(film, whole);
    assert_ne!(before, whole, "negative control not detected");
    let beyond = SampleBlock { rows: 30..33, samples: 0..512 };
    for wrong in [&[rows(0..4), rows(2..6)][..], &[beyond]] {
        assert!(render(&mut Film::new(24, 32), wrong).is_err());
    }
}

for_each_backend!(ends_do_not_show, any_part_may_be_there, blocks_are_rendered_alone);
