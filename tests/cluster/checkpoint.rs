//! Films that the root keeps while ranks render them: whichever rank stops or is lost, and however
//! many continue, the film is that of one process.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::process::Output;
use std::thread;
use std::time::SystemTime;
use trisect::checkpoint::Checkpoint;
use trisect::device::cpu::Cpu;
use trisect::film::Film;
use trisect::render::{Renderer, Settings};
use trisect::scene::Scene;
use trisect_cluster::local::Local;
use trisect_cluster::{
    AssembledImage, ClusterPlan, DEFAULT_PATIENCE, Heartbeat, ResumableFilm, Work, render_into_film,
};
use trisect_tests::mpi::{self, Job};
use trisect_tests::program::{Temporary, trisect, wait_for};
use trisect_tests::renders::StopAfterParts;
use trisect_tests::{root, scene};

fn renderer(scene: &Scene) -> Renderer {
    Renderer::new(Cpu::open(Some(1)).unwrap(), scene).unwrap()
}

/// Continues a film over `ranks` ranks until `pieces` pieces were added. The last rank has the
/// second scene.
fn grown(ranks: u32, scenes: [&Scene; 2], settings: &Settings, film: Film, pieces: u32) -> Film {
    let keeper = StopAfterParts::new(pieces);
    let work = Work::for_film(settings.clone(), 3);
    let mut kept = Some(ResumableFilm { film, samples: 0..settings.samples, observer: &keeper });
    thread::scope(|scope| {
        let mut threads = Vec::new();
        for local in Local::ranks(ranks) {
            let (work, kept) = (&work, kept.take());
            let scene = scenes[usize::from(threads.len() as u32 + 1 == ranks)];
            threads.push(scope.spawn(move || {
                let mut link = Heartbeat::new(local, DEFAULT_PATIENCE);
                render_into_film(&mut link, renderer(scene), work, kept, &mut (), &|| false).unwrap().0
            }));
        }
        let mut films: Vec<_> = threads.into_iter().map(|thread| thread.join().unwrap()).collect();
        let finished = films.swap_remove(0).unwrap();
        assert_eq!(finished.report.ranks.len(), ranks as usize);
        match finished.picture {
            AssembledImage::Film(film) => {
                assert_eq!(finished.counts, film.counts());
                *film
            }
            other => panic!("{other:?}"),
        }
    })
}

#[test]
fn any_number_of_ranks_goes_on() {
    let scene = scene("three_spheres.ron");
    for guides in [false, true] {
        let settings =
            Settings { width: 12, height: 19, samples: 5000, depth: 8, guides, ..Settings::of(&scene) };
        let empty = || if guides { Film::with_aovs(12, 19) } else { Film::new(12, 19) };
        let want = renderer(&scene).render(&settings).unwrap().film;
        let (mut film, mut runs) = (empty(), 0);
        while !film.coverage.missing(&(0..5000)).is_empty() {
            film = grown(1 + runs % 4, [&scene; 2], &settings, film, 1);
            runs += 1;
        }
        assert!(runs >= 2, "{runs}");
        assert_eq!(film, want);
        // A complete film is returned without rendering.
        assert_eq!(grown(3, [&scene; 2], &settings, film, 1), want);
        // Negative control: one rank has another scene.
        let mut other = scene.clone();
        other.materials.iter_mut().for_each(|material| material.albedo *= 1.01);
        assert_ne!(
            grown(3, [&scene, &other], &settings, empty(), u32::MAX),
            want,
            "negative control not detected"
        );
    }
}

#[test]
fn what_is_not_kept_so_is_refused() {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 8, height: 8, samples: 256, ..Settings::of(&scene) };
    let refuse = |work: Work, film: Film, words: &str| {
        let local = Local::ranks(1).into_iter().next().unwrap();
        let kept = ResumableFilm { film, samples: 0..256, observer: &() };
        let result = render_into_film(
            &mut Heartbeat::new(local, DEFAULT_PATIENCE),
            renderer(&scene),
            &work,
            Some(kept),
            &mut (),
            &|| false,
        );
        let text = result.map(|_| ()).unwrap_err().error.to_string();
        assert!(text.contains(words), "{text}");
    };
    let work = Work::for_film(settings, 3);
    refuse(work.clone(), Film::new(8, 9), "8x9");
    refuse(work.clone(), Film::with_aovs(8, 8), "the same `aov` and `denoise`");
    refuse(Work { plan: ClusterPlan::default(), ..work }, Film::new(8, 8), "Work::for_film");
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A job that loses a rank, is told to stop, or runs out of time leaves a checkpoint that another
/// number of ranks, or one process, continues.
#[test]
fn a_job_survives_its_ranks() {
    if !mpi::available() {
        return;
    }
    let folder = Temporary::new("cluster", "survives");
    let book = root().join("scenes/rtiow_final.ron").to_str().unwrap().to_owned();
    let image = ["--backend", "cpu", "--resolution", "64x36", "--spp", "16384", "--depth", "8"];
    let (whole, one) = (folder.file("whole.ckpt"), folder.file("one.pfm"));
    let output = trisect(&[&["render", &book, "-o", &one, "--checkpoint", &whole], &image[..]].concat());
    assert!(output.status.success(), "{}", text(&output));
    let want = Checkpoint::read(whole.as_ref()).unwrap().film;
    let (file, many) = (folder.file("a.ckpt"), folder.file("many.pfm"));
    let missing = || {
        let film = Checkpoint::read(file.as_ref()).expect("whole or not there").film;
        film.coverage
            .missing(&(0..16384))
            .iter()
            .map(|part| part.rows.len() * part.samples.len())
            .sum::<usize>()
    };
    let rows = ["--distribute", "rows"];
    let begin = ["render", &book, "-o", &many, "--checkpoint", &file, "--every", "1ms"];

    let start = SystemTime::now();
    let job = Job::start(&folder, &[&begin[..], &image, &rows].concat());
    wait_for(&file, start);
    job.signal("KILL");
    let output = job.end().0;
    assert!(!output.status.success(), "{}", text(&output));
    let mut left = missing();
    assert!((1..36 * 16384).contains(&left), "{left}");

    // Starting the render again is refused.
    let output = mpi::run(2, &[&begin[..], &image, &rows].concat());
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(text(&output).contains("already exists"), "{}", text(&output));

    let resume = ["resume", &file, "--every", "1ms"];
    let output = mpi::run(3, &[&resume[..], &rows, &["--time-limit", "1ms"]].concat());
    assert_eq!(output.status.code(), Some(7), "{}", text(&output));
    assert!(text(&output).contains("% of samples 0 to 16384 are in the checkpoint"), "{}", text(&output));
    assert!((1..=left).contains(&missing()), "{}", missing());
    left = missing();

    // A queue's signal, which mpirun sends to all ranks.
    let start = SystemTime::now();
    let job = Job::start(&folder, &[&resume[..], &rows].concat());
    wait_for(&file, start);
    job.end_by("TERM");
    let output = job.end().0;
    assert!(!output.status.success(), "{}", text(&output));
    assert!((1..=left).contains(&missing()), "{}", missing());

    // Ranks continue, and so does one process with a copy.
    let (copy, alone) = (folder.file("copy.ckpt"), folder.file("alone.pfm"));
    fs::copy(&file, &copy).unwrap();
    let by_ranks = mpi::run(2, &[&resume[..], &rows].concat());
    let by_one = trisect(&["resume", &copy, "-o", &alone]);
    for (output, file, image) in [(by_ranks, &file, &many), (by_one, &copy, &alone)] {
        assert!(output.status.success(), "{}", text(&output));
        assert_eq!(Checkpoint::read(file.as_ref()).unwrap().film, want);
        assert!(fs::read(image).unwrap() == fs::read(&one).unwrap());
    }

    let new = folder.file("b.ckpt");
    let average = ["render", &book, "-o", &many, "--checkpoint", &new, "--distribute", "average"];
    let average = [&average[..], &image].concat();
    let output = mpi::run(2, &average);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(text(&output).contains("--distribute rows"), "{}", text(&output));
    let output = mpi::run(2, &resume);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    let output = mpi::run(2, &[&["resume", "/nowhere/a.ckpt"], &rows[..]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
    assert_eq!(text(&output).matches("error: ").count(), 1, "{}", text(&output));
    assert!(text(&output).contains("/nowhere/a.ckpt"), "{}", text(&output));
}
