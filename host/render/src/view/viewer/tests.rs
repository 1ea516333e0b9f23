//! Tests of the series of frames.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use crate::denoise::Filter;
use crate::render::Restart;
use trisect_device::cpu::Cpu;
use trisect_image::metrics::srgb;
use trisect_scene::Scene;

#[test]
fn a_series_ends_where_it_is_enough() {
    let scene = Scene::hello_world().unwrap();
    let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let mut viewer = Viewer::new(renderer);
    let settings = Settings { width: 32, height: 18, samples: 2, ..Settings::of(&scene) };
    let mut look = ViewOptions {
        scale: 0.5,
        max_samples: 6,
        ..ViewOptions::new(settings, Some(DenoiseSettings::new(Filter::Svgf)))
    };
    let mut pose = scene.camera;
    let mut pixels = Vec::new();
    let mut counts = Vec::new();
    let mut since = Vec::new();
    while !viewer.is_converged(&look, &pose) {
        let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
        assert_eq!((shot.size, pixels.len()), ((16, 9), 16 * 9));
        counts.push(shot.live.samples);
        since.push(shot.live.since);
    }
    assert_eq!(counts, [2, 4, 6]);
    assert_eq!(since, [Restart::First; 3]);
    // Another pose starts a new series; another display option continues the same one.
    pose.look_from.x += 0.5;
    assert!(!viewer.is_converged(&look, &pose));
    let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
    assert_eq!((shot.live.samples, shot.live.since), (2, Restart::Camera));
    look.screen.split = 1.0;
    let shot = viewer.frame(&look, &pose, &mut pixels).unwrap();
    assert_eq!((shot.live.samples, shot.live.since), (4, Restart::Camera));
    assert!(shot.denoise() > 0.0 && shot.whole >= shot.present);
    // What starts anew says why.
    let mut after = |change: &dyn Fn(&mut ViewOptions)| {
        change(&mut look);
        let live = viewer.frame(&look, &pose, &mut pixels).unwrap().live;
        (live.samples, live.since)
    };
    assert_eq!(after(&|look| look.scale = 1.0), (2, Restart::Setting("the resolution")));
    assert_eq!(after(&|_| ()), (4, Restart::Setting("the resolution")));
    assert_eq!(after(&|look| look.settings.depth = 3), (2, Restart::Setting("the depth")));
    assert_eq!(after(&|look| look.settings.samples = 1), (1, Restart::Setting("the samples of a frame")));
    assert_eq!(after(&|look| look.denoise = None), (2, Restart::Setting("the samples of a frame")));
}

/// Checks that a series also ends if the samples of a frame do not divide the maximum number.
#[test]
fn a_series_ends_where_no_more_is_kept() {
    let scene = Scene::hello_world().unwrap();
    let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let mut viewer = Viewer::new(renderer);
    let settings = Settings { width: 2, height: 1, samples: 255, ..Settings::of(&scene) };
    let look = ViewOptions::new(settings, None);
    let mut frames = 0;
    while !viewer.is_converged(&look, &scene.camera) {
        viewer.frame(&look, &scene.camera, &mut Vec::new()).unwrap();
        frames += 1;
        assert!(frames <= MAX_ACCUMULATED_SAMPLES / 255, "it never rests");
    }
    assert_eq!(frames, MAX_ACCUMULATED_SAMPLES / 255);
}

/// Checks that without a filter both sides of the split show the pixels of an image file.
#[test]
fn the_screen_shows_the_image() {
    let scene = Scene::hello_world().unwrap();
    let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let settings = Settings { width: 32, height: 18, samples: 2, ..Settings::of(&scene) };
    let image = renderer.render(&settings).unwrap().film.image();
    let mut viewer = Viewer::new(renderer);
    for split in [0.0, 0.5, 1.0] {
        let mut look = ViewOptions::new(settings.clone(), None);
        look.screen.split = split;
        let mut pixels = Vec::new();
        viewer.frame(&look, &scene.camera, &mut pixels).unwrap();
        if split > 0.0 {
            viewer.frame(&look, &scene.camera, &mut pixels).unwrap();
            continue; // later frames have other samples
        }
        for (shown, pixel) in pixels.iter().zip(&image.pixels) {
            for (byte, value) in shown.to_le_bytes().into_iter().zip(pixel) {
                assert!(byte.abs_diff(srgb::encode_u8(*value)) <= 1);
            }
        }
    }
}
