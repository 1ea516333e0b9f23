//! `kill -9` at random moments: the checkpoint is complete or missing, and a render that continues
//! from it gives the same film.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "this is how a test fails")]

use std::fs;
use std::time::Instant;
use trisect::checkpoint::Checkpoint;
use trisect_shared::rng::PathKey;
use trisect_tests::BackendUnderTest;
use trisect_tests::program::{Temporary, trisect};
use trisect_tests::running::{Running, program};
use trisect_tests::{root, scene};

/// Kills at least `least` renders: while they start, render, write or end, and while they are
/// resumed.
fn killed_at_any_moment(subject: BackendUnderTest, resolution: &str, spp: u32, least: u32) {
    if subject.renderer(&scene("three_spheres.ron")).is_none() {
        return;
    }
    let folder = Temporary::new("killed", subject.name());
    let book = root().join("scenes/rtiow_final.ron");
    let (spp_text, device) = (spp.to_string(), subject.index().to_string());
    let mut image = vec!["render", book.to_str().unwrap(), "--backend", subject.name(), "--depth", "8"];
    image.extend(["--resolution", resolution, "--spp", &spp_text]);
    if subject != BackendUnderTest::Cpu {
        image.extend(["--device", &device]);
    }
    let run = |arguments: &[&str]| {
        let output = trisect(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };

    let (file, out) = (folder.file("whole.ckpt"), folder.file("whole.pfm"));
    run(&[&image[..], &["-o", &out, "--checkpoint", &file]].concat());
    let whole = Checkpoint::read(file.as_ref()).unwrap().film;
    let whole_image = fs::read(out).unwrap();

    let (file, out) = (folder.file("a.ckpt"), folder.file("a.pfm"));
    let begin = [&image[..], &["-o", &out, "--checkpoint", &file, "--every", "1ms"]].concat();
    let time = |_| {
        let _ = fs::remove_file(&file);
        let clock = Instant::now();
        run(&begin);
        clock.elapsed()
    };
    let once = (0..3).map(time).min().unwrap();
    let (mut kills, mut parts) = (0, 0);
    for attempt in 0..3 * least {
        let _ = fs::remove_file(&file);
        let mut arguments = begin.clone();
        for again in 0..4 {
            let word = PathKey { seed: 9, pixel: attempt, sample: again }.words(0).x;
            let running = Running::start(&mut program(&arguments));
            std::thread::sleep(once.mul_f64(f64::from(word) / 2f64.powi(32)));
            let killed = running.kill();
            kills += u32::from(killed);
            if fs::exists(&file).unwrap() {
                let found = Checkpoint::read(file.as_ref()).expect("whole or not there");
                parts += u32::from(!found.film.coverage.missing(&(0..spp)).is_empty());
                arguments = vec!["resume", &file, "--every", "1ms"];
            }
            if !killed {
                break;
            }
        }
        run(&arguments);
        assert_eq!(Checkpoint::read(file.as_ref()).unwrap().film, whole);
        assert_eq!(fs::read(&out).unwrap(), whole_image);
        if kills >= least && parts > least / 5 {
            break;
        }
    }
    // Negative control: another seed.
    let (file, out) = (folder.file("other.ckpt"), folder.file("other.pfm"));
    run(&[&image[..], &["-o", &out, "--checkpoint", &file, "--seed", "1"]].concat());
    assert_ne!(Checkpoint::read(file.as_ref()).unwrap().film, whole, "negative control not detected");
    assert_ne!(fs::read(&out).unwrap(), whole_image);
    eprintln!("{kills} kills, {parts} checkpoints of a part, a render takes {once:?}");
    assert!(kills >= least && parts > least / 5, "{kills}, {parts}");
}

#[test]
fn cpu() {
    killed_at_any_moment(BackendUnderTest::Cpu, "96x54", 1024, 20);
}

#[test]
fn wgpu() {
    let (resolution, spp) =
        if BackendUnderTest::Wgpu.is_software() { ("48x27", 1024) } else { ("960x540", 4096) };
    killed_at_any_moment(BackendUnderTest::Wgpu, resolution, spp, 5);
}

#[test]
fn cuda() {
    killed_at_any_moment(BackendUnderTest::Cuda, "960x540", 4096, 5);
}
