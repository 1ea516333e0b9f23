#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use crate::render::{Renderer, Settings};
use trisect_device::cpu::Cpu;
use trisect_scene::Scene;
use trisect_shared::rng::Words;

#[test]
fn parameters() {
    for filter in [Filter::Atrous, Filter::Svgf] {
        let good = DenoiseSettings::new(filter);
        assert_eq!(good.check(), Ok(()));
        assert_eq!(DenoiseSettings { color: f32::INFINITY, normal: 0.0, ..good }.check(), Ok(()));
        for levels in [0, 11] {
            assert_eq!(DenoiseSettings { levels, ..good }.check(), Err(DenoiseError::Levels { levels }));
        }
        for bad in [-1.0, f32::NAN, f32::NEG_INFINITY] {
            let named = DenoiseSettings { depth: bad, ..good }.check();
            assert!(matches!(named, Err(DenoiseError::Parameter { name: "depth", .. })), "{named:?}");
        }
    }
}

/// Each pass reads what the previous one wrote; steps double; the à-trous filter's colour distance
/// is halved from level to level.
#[test]
fn passes_are_chained() {
    let scene = Scene::hello_world().unwrap();
    let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let settings = Settings { width: 16, height: 9, ..Settings::of(&scene) };
    let camera = renderer.camera(&settings);
    for filter in [Filter::Atrous, Filter::Svgf] {
        let image = FrameView::by(&camera, 16, 9);
        let denoise = DenoiseSettings { levels: 4, ..DenoiseSettings::new(filter) };
        let passes = passes(Some(&denoise), &image, &TemporalInputs::none(&image), &(0..9));
        assert!(passes.windows(2).all(|pair| pair[1].from == pair[0].to));
        assert!(passes.iter().all(|pass| pass.from + pass.to == 1));
        let levels: Vec<&Pass> = passes.iter().filter(|pass| pass.kernel.is_level()).collect();
        assert_eq!(levels.iter().map(|pass| pass.params.step).collect::<Vec<_>>(), [1, 2, 4, 8]);
        let halved = if filter == Filter::Atrous { 4.0 } else { 1.0 };
        assert!(
            levels.windows(2).all(|pair| pair[1].params.color_factor == halved * pair[0].params.color_factor)
        );
    }
}

/// The view has its pixels where the camera's rays go.
#[test]
fn the_view_is_the_cameras() {
    let scene = Scene::hello_world().unwrap();
    let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let camera = renderer.camera(&Settings { width: 160, height: 90, ..Settings::of(&scene) });
    let view = crate::camera::pinhole_view(&camera);
    assert_eq!(view.origin, camera.origin);
    for (x, y) in [(0, 0), (159, 0), (31, 89)] {
        let half = 1 << 31;
        // The middle of the pixel, through the middle of the lens.
        let ray = camera.ray(x, y, Words { x: half, y: half, z: 0, w: 0 });
        let to = view.first_pixel + view.right * x as f32 + view.down * y as f32;
        assert!((to.normalize() - ray.direction).length() < 1e-6, "{x} {y}");
        assert!((to.dot(view.axis) - 1.0).abs() < 1e-6);
    }
    assert!(view.axis.dot(camera.corner) > 0.0);
}

#[test]
fn a_film_without_guides_is_refused() {
    let scene = Scene::hello_world().unwrap();
    let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let settings = Settings { width: 4, height: 3, samples: 1, ..Settings::of(&scene) };
    let film = renderer.render(&settings).unwrap().film;
    let refused = renderer.denoise(&film, &settings, &DenoiseSettings::new(Filter::Svgf));
    assert!(matches!(refused, Err(crate::Error::Denoise(DenoiseError::NoAovs))));
    let film = renderer.render(&Settings { guides: true, ..settings.clone() }).unwrap().film;
    let (image, times) = renderer.denoise(&film, &settings, &DenoiseSettings::new(Filter::Svgf)).unwrap();
    assert_eq!((image.width, image.height, times.len()), (4, 3, 8));
}

/// Settings with a filter give the image that the filter makes of the film.
#[test]
fn a_frame_is_denoised() {
    let scene = Scene::hello_world().unwrap();
    let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
    let settings = Settings::of(&scene).size(16, 9).spp(2);
    let noisy = renderer.render(&settings).unwrap();
    assert!(noisy.denoised.is_none() && noisy.image() == noisy.film.image());
    let settings = settings.denoise(Filter::Svgf);
    let frame = renderer.render(&settings).unwrap();
    let by_hand = renderer.denoise(&frame.film, &settings, &DenoiseSettings::new(Filter::Svgf)).unwrap().0;
    assert!(frame.image() == by_hand && frame.image() != noisy.image());
    assert!(frame.film.pixels == noisy.film.pixels);
    // The filter's AOVs are rendered without being asked for.
    let only_filter = Settings { guides: false, ..settings.clone() };
    assert!(renderer.render(&only_filter).unwrap().image() == by_hand);
    let wrong = DenoiseSettings { levels: 0, ..DenoiseSettings::new(Filter::Svgf) };
    assert!(renderer.render(&settings.denoise(wrong)).is_err());
}
