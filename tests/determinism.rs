//! The same film whatever cuts the work: threads, submissions, chunks; and another one for another seed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::{Renderer, Settings};
use trisect_tests::{Subject, for_each_backend, scene};

fn settings(renderer_scene: &trisect::scene::Scene) -> Settings {
    Settings { width: 96, height: 54, samples: 5, depth: 20, ..renderer_scene.settings() }
}

fn film(renderer: &mut Renderer, settings: &Settings) -> Film {
    renderer.render(settings, &mut ()).unwrap().film
}

/// A frame depends on nothing that an earlier frame left: not on memory, not on the pace that it taught the scheduler.
fn frames_repeat(subject: Subject) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene);
    let first = film(&mut renderer, &settings);
    // Another size between: buffers are made anew.
    film(&mut renderer, &Settings { width: 40, height: 30, samples: 1, ..settings.clone() });
    let second = film(&mut renderer, &settings);
    assert_eq!(first, second);
    assert_eq!(first.counts().unwritten + first.counts().rejected, 0);
    // The twin: another seed must not give the same film.
    let other = film(&mut renderer, &Settings { seed: settings.seed + 1, ..settings });
    assert_ne!(first, other, "a comparison that cannot fail");
}

/// More samples than a chunk holds: the second chunk goes on where the first ended.
fn chunks_add_up(subject: Subject) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 8, height: 6, samples: 300, depth: 8, ..scene.settings() };
    let whole = film(&mut renderer, &settings);
    assert_eq!(whole.counts().samples, 8 * 6 * 300);
    let chunk = film(&mut renderer, &Settings { samples: 256, ..settings.clone() });
    // What the last 44 samples added is positive and finite everywhere.
    for (whole, chunk) in whole.pixels.iter().zip(&chunk.pixels) {
        let added = whole.radiance[1] - chunk.radiance[1];
        assert!(added > 0.0 && added < 45.0, "{added}");
    }
}

for_each_backend!(frames_repeat, chunks_add_up);

#[test]
fn threads_do_not_matter() {
    let scene = scene("rtiow_final.ron");
    let settings = settings(&scene);
    let films: Vec<Film> = [1, 2, 7]
        .map(|threads| {
            let backend = trisect::backend::cpu::Cpu::open(Some(threads)).unwrap();
            film(&mut Renderer::new(Box::new(backend), &scene).unwrap(), &settings)
        })
        .into();
    assert!(films.iter().all(|film| *film == films[0]));
}
