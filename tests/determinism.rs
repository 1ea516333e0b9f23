//! The same film whatever cuts the work: threads, submissions, chunks; and another one for another seed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::{Renderer, Settings};
use trisect_tests::{BackendUnderTest, for_each_backend, scene};

fn settings(renderer_scene: &trisect::scene::Scene) -> Settings {
    Settings { width: 96, height: 54, samples: 5, depth: 20, ..renderer_scene.settings() }
}

fn film(renderer: &mut Renderer, settings: &Settings) -> Film {
    renderer.render(settings, &mut ()).unwrap().film
}

/// A frame depends on nothing that an earlier frame left: not on memory, not on the pace that it taught the scheduler.
fn frames_repeat(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene);
    let first = film(&mut renderer, &settings);
    // Another size between: buffers are made anew.
    film(&mut renderer, &Settings { width: 40, height: 30, samples: 1, ..settings.clone() });
    let second = film(&mut renderer, &settings);
    assert_eq!(first, second);
    // In the memory of another film, and of one that does not fit.
    for guides in [false, true] {
        renderer.recycle(second.clone());
        assert_eq!(film(&mut renderer, &Settings { guides, ..settings.clone() }).pixels, first.pixels);
    }
    assert_eq!(first.counts().unwritten + first.counts().rejected, 0);
    // The twin: another seed must not give the same film.
    let other = film(&mut renderer, &Settings { seed: settings.seed + 1, ..settings });
    assert_ne!(first, other, "a comparison that cannot fail");
}

/// How a frame is cut into submissions does not touch its bits: a kernel resumes the sums that the last one left.
fn submissions_do_not_matter(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene);
    let mut cut = |samples| {
        renderer.limit_submissions(Some(samples));
        renderer.render(&settings, &mut ()).unwrap()
    };
    let whole = cut(u64::MAX / 2);
    assert_eq!(whole.stats.submissions, 1);
    // Five samples of 5184 pixels: one sample of all rows, two and a rest, one of a band of rows.
    for (samples, least) in [(5184, 5), (2 * 5184, 3), (7 * 96, 35)] {
        let parts = cut(samples);
        assert!(parts.stats.submissions >= least, "{}", parts.stats.submissions);
        assert_eq!(parts.film, whole.film, "{samples} samples a submission");
    }
}

/// More samples than a chunk holds: the second chunk holds the samples that follow, and is added to the first.
fn chunks_add_up(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 8, height: 6, samples: 300, depth: 8, ..scene.settings() };
    let whole = film(&mut renderer, &settings);
    assert_eq!(whole.counts().samples, 8 * 6 * 300);
    // What the second chunk adds is 44 samples between black and white, and (the fault to find) not the first 44 once more.
    let at = |renderer: &mut Renderer, samples| film(renderer, &Settings { samples, ..settings.clone() });
    let (chunk, first) = (at(&mut renderer, 256), at(&mut renderer, 44));
    let mut repeated = 0;
    for ((whole, chunk), first) in whole.pixels.iter().zip(&chunk.pixels).zip(&first.pixels) {
        let added = whole.radiance[1].value() - chunk.radiance[1].value();
        assert!(added > 0.0 && added < 44.01, "{added}");
        repeated += usize::from((added - first.radiance[1].value()).abs() < 1e-4);
    }
    // A pixel of bare sky may come close; the rest must not.
    assert!(repeated < whole.pixels.len() / 4, "{repeated} pixels repeat the first samples");
}

for_each_backend!(frames_repeat, submissions_do_not_matter, chunks_add_up);

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
    let backend = trisect::backend::cpu::Cpu::open(Some(2)).unwrap();
    let other = Settings { seed: 1, ..settings };
    let other = film(&mut Renderer::new(Box::new(backend), &scene).unwrap(), &other);
    assert_ne!(other, films[0], "a comparison that cannot fail");
}
