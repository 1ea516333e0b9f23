//! The film does not depend on how the work is divided: threads, submissions, chunks. Another seed
//! gives another film.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::{Renderer, Settings};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

fn settings(renderer_scene: &trisect::scene::Scene) -> Settings {
    Settings { width: 96, height: 54, samples: 5, depth: 20, ..Settings::of(renderer_scene) }
}

fn film(renderer: &mut Renderer, settings: &Settings) -> Film {
    renderer.render(settings).unwrap().film
}

/// A frame does not depend on what an earlier frame left, neither in memory nor in the size of
/// submissions.
fn frames_repeat(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene);
    let first = film(&mut renderer, &settings);
    // A frame of another size in between reallocates the buffers.
    film(&mut renderer, &Settings { width: 40, height: 30, samples: 1, ..settings.clone() });
    let second = film(&mut renderer, &settings);
    assert_eq!(first, second);
    // The memory of another film is reused, whether it fits or not.
    for guides in [false, true] {
        renderer.recycle(second.clone());
        assert_eq!(film(&mut renderer, &Settings { guides, ..settings.clone() }).pixels, first.pixels);
    }
    assert_eq!(first.counts().unwritten + first.counts().rejected, 0);
    // Negative control: another seed must give another film.
    let other = film(&mut renderer, &Settings { seed: settings.seed + 1, ..settings });
    assert_ne!(first, other, "negative control not detected");
}

/// The bits of a frame do not depend on its submissions: a kernel continues the sums of the one
/// before.
fn submissions_do_not_matter(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = settings(&scene);
    let mut cut = |samples| {
        renderer.limit_submissions(Some(samples));
        renderer.render(&settings).unwrap()
    };
    let whole = cut(u64::MAX / 2);
    assert_eq!(whole.stats.submissions, 1);
    // Five samples of 5184 pixels, as submissions of one sample of all rows, of two, and of one
    // sample of a band of rows.
    for (samples, least) in [(5184, 5), (2 * 5184, 3), (7 * 96, 35)] {
        let parts = cut(samples);
        assert!(parts.stats.submissions >= least, "{}", parts.stats.submissions);
        assert_eq!(parts.film, whole.film, "{samples} samples a submission");
    }
}

/// With more samples than a chunk holds, the second chunk has the samples that follow, and is added
/// to the first.
fn chunks_add_up(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 8, height: 6, samples: 300, depth: 8, ..Settings::of(&scene) };
    let whole = film(&mut renderer, &settings);
    assert_eq!(whole.counts().samples, 8 * 6 * 300);
    // The second chunk must add 44 samples of at most 1 each, and not the first 44 again.
    let at = |renderer: &mut Renderer, samples| film(renderer, &Settings { samples, ..settings.clone() });
    let (chunk, first) = (at(&mut renderer, 256), at(&mut renderer, 44));
    let mut repeated = 0;
    for ((whole, chunk), first) in whole.pixels.iter().zip(&chunk.pixels).zip(&first.pixels) {
        let added = whole.radiance[1].value() - chunk.radiance[1].value();
        assert!(added > 0.0 && added < 44.01, "{added}");
        repeated += usize::from((added - first.radiance[1].value()).abs() < 1e-4);
    }
    // A pixel of sky alone may come close; the others must not.
    assert!(repeated < whole.pixels.len() / 4, "{repeated} pixels repeat the first samples");
}

for_each_route!(frames_repeat, submissions_do_not_matter, chunks_add_up);

#[test]
fn threads_do_not_matter() {
    let scene = scene("rtiow_final.ron");
    let settings = settings(&scene);
    let films: Vec<Film> = [1, 2, 7]
        .map(|threads| {
            let backend = trisect::device::cpu::Cpu::open(Some(threads)).unwrap();
            film(&mut Renderer::new(backend, &scene).unwrap(), &settings)
        })
        .into();
    assert!(films.iter().all(|film| *film == films[0]));
    let backend = trisect::device::cpu::Cpu::open(Some(2)).unwrap();
    let other = Settings { seed: 1, ..settings };
    let other = film(&mut Renderer::new(backend, &scene).unwrap(), &other);
    assert_ne!(other, films[0], "negative control not detected");
}
