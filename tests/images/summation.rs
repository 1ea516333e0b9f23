//! Films whose chunks add up on the device, against those that the host adds: the same bits, over
//! any cutting.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::ops::ControlFlow;
use trisect::adaptive::{self, Adaptive, Free, Goal, Request};
use trisect::film::{Film, SampleBlock, SampleCoverage, Totals};
use trisect::render::{FilmObserver, Frame, RenderObserver, Renderer, Settings, Summation};
use trisect_tests::fault_injecting_backend::FaultInjectingBackend;
use trisect_tests::renders::{self, StopAfterParts, differing};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// Four chunks, the last of them not full, of an odd size.
fn settings(scene: &trisect::scene::Scene, guides: bool) -> Settings {
    Settings { width: 17, height: 11, samples: 800, depth: 6, guides, ..Settings::of(scene) }
}

fn same(device: &Film, host: &Film) -> bool {
    differing(device, host) == 0 && device.aovs == host.aovs && device.coverage == host.coverage
}

/// Returns samples, rejected samples, segments and unwritten pixels.
fn counts(frame: &Frame) -> [u64; 4] {
    let of = &frame.stats;
    [of.samples, of.rejected_samples, of.segments, of.unwritten_pixels]
}

fn the_device_adds_as_the_host(subject: BackendUnderTest) {
    for (file, guides) in [("three_spheres.ron", false), ("materials.ron", true), ("cornell_box.ron", true)] {
        let scene = scene(file);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let host = Settings { sums: Summation::Host, ..settings(&scene, guides) };
        let device = Settings { sums: Summation::Device, ..host.clone() };
        let want = renderer.render(&host).unwrap();
        let got = renderer.render(&device).unwrap();
        assert_eq!((want.stats.sums, got.stats.sums), (Summation::Host, Summation::Device));
        assert!(same(&got.film, &want.film), "{file}");
        assert_eq!((counts(&got), want.stats.unwritten_pixels), (counts(&want), 0));
        // In parts of rows and samples.
        let mut sum = if guides { Film::with_aovs(17, 11) } else { Film::new(17, 11) };
        for (rows, samples) in [(3..11, 256..800), (0..3, 0..800), (3..11, 0..256)] {
            let part = renderer.render_part(&device, &SampleBlock { rows, samples }, &mut ()).unwrap();
            sum.add(&part.film).unwrap();
        }
        assert!(same(&sum, &want.film), "{file} in parts");
        // A frame after another has nothing of it.
        for _ in 0..2 {
            let again = renderer.render(&device).unwrap();
            assert!(same(&again.film, &want.film), "{file} again");
            assert_eq!(counts(&again), counts(&want), "{file} again");
        }
        // The memory of a film serves the next one, which has nothing of it, also in other rows.
        for settings in [&device, &host] {
            let film = renderer.render(&Settings { seed: 2, ..settings.clone() }).unwrap().film;
            let place = |film: &Film| film.pixels.exact().as_ptr();
            let used = place(&film);
            renderer.recycle(film);
            let part = SampleBlock { rows: 3..11, samples: 0..800 };
            let again = renderer.render_part(settings, &part, &mut ()).unwrap().film;
            assert_eq!(place(&again), used, "{file}");
            renderer.recycle(again);
            let rest = SampleBlock { rows: 0..3, samples: 0..800 };
            let mut again = renderer.render_part(settings, &rest, &mut ()).unwrap().film;
            assert_eq!(place(&again), used, "{file}");
            again.add(&renderer.render_part(settings, &part, &mut ()).unwrap().film).unwrap();
            assert!(same(&again, &want.film), "{file} in used memory");
        }
        // Negative control: another seed.
        let other = renderer.render(&Settings { seed: 1, ..device }).unwrap().film;
        assert!(!same(&other, &want.film), "negative control not detected");
    }
}

/// A film of one chunk is the chunk, which has the bits of the sums over it.
fn one_chunk_is_the_film(subject: BackendUnderTest) {
    let scene = scene("materials.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    for (guides, samples) in [(false, 1), (true, 100)] {
        let auto = Settings { samples, ..settings(&scene, guides) };
        let frame = renderer.render(&auto).unwrap();
        let host = renderer.render(&Settings { sums: Summation::Host, ..auto.clone() }).unwrap();
        assert!(matches!(frame.film.pixels, Totals::Chunk { .. }));
        assert!(matches!(host.film.pixels, Totals::Exact(_)));
        assert!(same(&frame.film, &host.film));
        assert_eq!(frame.film.image().pixels, host.film.image().pixels);
        let counts = frame.film.counts();
        assert_eq!(counts, host.film.counts());
        assert_eq!((frame.stats.samples, frame.stats.segments), (counts.samples, counts.segments));
        // Its memory serves the next frame.
        renderer.recycle(frame.film);
        let again = renderer.render(&auto).unwrap().film;
        assert!(same(&again, &host.film));
        // It is added to others as any film.
        let more = Settings { samples: samples + 256, ..auto.clone() };
        let first = SampleBlock { rows: 0..11, samples: 0..256 };
        let mut sum = renderer.render_part(&more, &first, &mut ()).unwrap().film;
        let rest = SampleBlock { rows: 0..11, samples: 256..samples + 256 };
        sum.add(&renderer.render_part(&more, &rest, &mut ()).unwrap().film).unwrap();
        let whole = renderer.render(&Settings { sums: Summation::Host, ..more }).unwrap().film;
        assert!(same(&sum, &whole));
        assert!(!same(&sum, &host.film), "negative control not detected");
    }
}

/// Wants the film after some parts only, and stops after a number of them.
struct Seldom {
    parts: StopAfterParts,
    wanted: u32,
}

impl FilmObserver for Seldom {
    fn should_continue(&self) -> bool {
        self.parts.should_continue()
    }

    fn wants_film(&self, coverage: &SampleCoverage) -> bool {
        coverage.samples(0).last().is_some_and(|samples| samples.end >= self.wanted)
    }

    fn part_added(&self, film: &Film) {
        assert!(film.coverage.missing(&(0..self.wanted)).is_empty(), "it was not wanted yet");
        self.parts.part_added(film);
    }
}

/// Cancels after a number of samples.
struct CancelAfter(u64);

impl RenderObserver for CancelAfter {
    fn progress(&mut self, done: u64, _: u64) -> ControlFlow<()> {
        if done > self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Whenever the host reads the film, and wherever the render ends, chunks neither get lost nor
/// count twice.
fn reads_do_not_show(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let device = Settings { sums: Summation::Device, ..settings(&scene, true) };
    let want = renderer.render(&Settings { sums: Summation::Host, ..device.clone() }).unwrap().film;
    for wanted in [256, 512, 768, 800] {
        let mut film = Film::with_aovs(17, 11);
        let observer = Seldom { parts: StopAfterParts::new(1), wanted };
        let stats = renderer.render_missing(&mut film, &device, &(0..800), &observer, &mut ()).unwrap();
        assert_eq!(film.coverage.missing(&(0..wanted)), [], "{wanted}");
        assert_eq!(stats.samples, film.counts().samples);
        renderer.render_missing(&mut film, &device, &(0..800), &(), &mut ()).unwrap();
        assert!(same(&film, &want), "{wanted}");
    }
    // The film is read after each chunk from the second on, while the render continues.
    let mut film = Film::with_aovs(17, 11);
    let observer = Seldom { parts: StopAfterParts::new(9), wanted: 512 };
    renderer.render_missing(&mut film, &device, &(0..800), &observer, &mut ()).unwrap();
    assert!(same(&film, &want));
    // A cancelled render keeps the chunks before it.
    let mut film = Film::with_aovs(17, 11);
    let mut cancel = CancelAfter(17 * 11 * 600);
    renderer.limit_submissions(Some(17 * 11 * 50));
    let error = renderer.render_missing(&mut film, &device, &(0..800), &(), &mut cancel).unwrap_err();
    assert!(matches!(error, trisect::Error::Cancelled), "{error}");
    assert_eq!(film.coverage.parts(), [SampleBlock { rows: 0..11, samples: 0..512 }]);
    renderer.render_missing(&mut film, &device, &(0..800), &(), &mut ()).unwrap();
    assert!(same(&film, &want));
}

/// A device without the memory streams its chunks to the host, and says so; one that is asked to
/// add them refuses.
#[test]
fn without_memory_the_host_adds() {
    let scene = scene("three_spheres.ron");
    let want = renders::cpu(&scene).render(&settings(&scene, true)).unwrap().film;
    for (lacks, by_device) in
        [("nothing", true), ("the film's totals", false), ("the film's AOV totals", false)]
    {
        let device = FaultInjectingBackend::new(|| Ok(())).as_gpu().without_memory_for(lacks);
        let mut renderer = Renderer::new(device, &scene).unwrap();
        let frame = renderer.render(&settings(&scene, true)).unwrap();
        assert!(same(&frame.film, &want), "{lacks}");
        assert_eq!(frame.stats.sums == Summation::Device, by_device, "{lacks}");
        let warned = frame.stats.warnings().iter().any(|text| text.contains("the host adds the chunks up"));
        assert_eq!(warned, !by_device, "{lacks}");
        let forced = Settings { sums: Summation::Device, ..settings(&scene, true) };
        assert_eq!(renderer.render(&forced).is_ok(), by_device, "{lacks}");
        // The renderer still works after a refusal.
        assert!(same(&renderer.render(&settings(&scene, true)).unwrap().film, &want), "{lacks}");
    }
}

/// Halves of an adaptive image add up on the host where the device lacks memory for them.
#[test]
fn without_memory_the_host_adds_halves() {
    let scene = scene("three_spheres.ron");
    let goal = Goal::Error { target: 1e-6, max_samples: 20 };
    let request = Request { goal, adaptive: Adaptive::On, free: Free::default(), denoisers: Vec::new() };
    let host = Settings { sums: Summation::Host, ..settings(&scene, false) };
    let want = adaptive::render(&mut renders::cpu(&scene), &host, &request, &mut ()).unwrap().film;
    for (lacks, by_device) in
        [("nothing", true), ("the film's totals", false), ("the halves' sums", false), ("the noise", false)]
    {
        let device = FaultInjectingBackend::new(|| Ok(())).as_gpu().without_memory_for(lacks);
        let mut renderer = Renderer::new(device, &scene).unwrap();
        let mut of =
            |sums| adaptive::render(&mut renderer, &Settings { sums, ..host.clone() }, &request, &mut ());
        let got = of(Summation::Auto).unwrap();
        assert_eq!(differing(&got.film, &want), 0, "{lacks}");
        assert_eq!(got.stats.sums == Summation::Device, by_device, "{lacks}");
        let warned = got.stats.warnings().iter().any(|text| text.contains("the host adds the chunks up"));
        assert_eq!(warned, !by_device, "{lacks}");
        assert_eq!(of(Summation::Device).is_ok(), by_device, "{lacks}");
    }
}

/// A film that is read in several bands, by copies of the host on a GPU.
#[test]
fn films_of_several_bands() {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 640, height: 481, samples: 1, depth: 2, ..Settings::of(&scene) };
    // Not the whole image, so that the film is not just the chunk.
    let part = SampleBlock { rows: 0..480, samples: 0..1 };
    let of = |renderer: &mut Renderer, sums| {
        let settings = Settings { sums, ..settings.clone() };
        renderer.render_part(&settings, &part, &mut ()).unwrap().film
    };
    let mut cpu = renders::cpu(&scene);
    let want = of(&mut cpu, Summation::Host);
    assert!(same(&of(&mut cpu, Summation::Device), &want));
    let gpu = FaultInjectingBackend::new(|| Ok(())).as_gpu();
    let mut gpu = Renderer::new(gpu, &scene).unwrap();
    assert!(same(&of(&mut gpu, Summation::Device), &want));
    let other = Settings { seed: 1, ..settings.clone() };
    let other = gpu.render_part(&other, &part, &mut ()).unwrap().film;
    assert!(!same(&other, &want), "negative control not detected");
}

for_each_route!(the_device_adds_as_the_host, one_chunk_is_the_film, reads_do_not_show);
