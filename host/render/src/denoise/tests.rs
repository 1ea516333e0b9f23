#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use crate::render::{Renderer, Sampler, Settings};
use std::ops::Range;
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
            assert!(matches!(named, Err(DenoiseError::Parameter { name: "denoise_depth", .. })), "{named:?}");
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
        let image = FrameView::by(&camera, None, 16, 9);
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
    let view = crate::camera::pinhole_view(&camera, None);
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
    let refused = renderer.denoise(&film, &settings, DenoiseSettings::new(Filter::Svgf));
    assert!(matches!(refused, Err(crate::Error::Denoise(DenoiseError::NoAovs))));
    let film = renderer.render(&Settings { guides: true, ..settings.clone() }).unwrap().film;
    let (image, times) = renderer.denoise(&film, &settings, DenoiseSettings::new(Filter::Svgf)).unwrap();
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
    let by_hand = renderer.denoise(&frame.film, &settings, DenoiseSettings::new(Filter::Svgf)).unwrap().0;
    assert!(frame.image() == by_hand && frame.image() != noisy.image());
    assert!(frame.film.pixels == noisy.film.pixels);
    // The filter's AOVs are rendered without being asked for.
    let only_filter = Settings { guides: false, ..settings.clone() };
    assert!(renderer.render(&only_filter).unwrap().image() == by_hand);
    let wrong = DenoiseSettings { levels: 0, ..DenoiseSettings::new(Filter::Svgf) };
    assert!(renderer.render(&settings.denoise(wrong)).is_err());
}

/// Returns three grey squares side by side, `away` from a camera whose parallel view they fill: one
/// that faces it, one behind that, in the shadow of a wall, and one that is askew.
fn squares(away: f64) -> Scene {
    let text = format!(
        r#"Scene(version: 1, image: (width: 120, height: 40, samples: 4, depth: 2),
        camera: (look_from: (3, 1, {away}), look_at: (3, 1, -9), height: 2), sky: Uniform(radiance: (0, 0, 0)),
        materials: {{ "grey": Lambertian(albedo: (0.5, 0.5, 0.5)), "lamp": Emissive(radiance: (9, 9, 9)) }},
        objects: [
            Quad(corner: (-1, -1, 0), u: (3, 0, 0), v: (0, 4, 0), material: "grey"),
            Quad(corner: (2, -1, -0.8), u: (2, 0, 0), v: (0, 4, 0), material: "grey"),
            Quad(corner: (2, -1, 0), u: (0, 0, -0.8), v: (0, 4, 0), material: "grey"),
            Quad(corner: (4, -1, 0), u: (2, 0, -2), v: (0, 4, 0), material: "grey"),
            Sphere(center: (-1, 1, 1), radius: 0.5, material: "lamp"),
            Sphere(center: (7, 1, 1), radius: 0.5, material: "lamp")])"#
    );
    Scene::parse(&text, "squares").unwrap()
}

/// In a parallel projection the filter smooths a surface that is askew, and keeps the edge between
/// surfaces behind each other, whatever their distance.
#[test]
fn planes_of_a_parallel_projection() {
    // Light does not stop the filter: it must be the planes.
    let denoise = DenoiseSettings { color: f32::INFINITY, levels: 2, ..Filter::Atrous.into() };
    let pixels = |image: &Image, columns: Range<usize>| -> Vec<f64> {
        let width = image.width as usize;
        let row = |y: usize| columns.clone().map(move |x| y * width + x);
        (8..32).flat_map(row).map(|pixel| f64::from(image.pixels[pixel][0])).collect()
    };
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    // Mean square of the differences between neighbours of a row.
    let noise = |image: &Image| {
        let [left, right] = [85..114, 86..115].map(|columns| pixels(image, columns));
        mean(left.iter().zip(right).map(|(a, b)| (a - b).powi(2)).collect())
    };
    for away in [0.2, 3.0, 400.0] {
        let scene = squares(away);
        let mut renderer = Renderer::new(Cpu::open(None).unwrap(), &scene).unwrap();
        // Neighbours of Sobol samples differ more than their noise.
        let sampler = Sampler::Independent;
        let settings = Settings { guides: true, sampler, ..Settings::of(&scene) };
        let exact = renderer.render(&Settings { samples: 512, ..settings.clone() }).unwrap().image();
        let noisy = renderer.render(&settings).unwrap();
        let before = noise(&noisy.image());
        // Returns by which factors the light differs on both sides of the edge between the first
        // square and the dark second one, and the noise of the third.
        let mut filter = |depth: f32| {
            let denoise = DenoiseSettings { depth, ..denoise };
            let smooth = renderer.denoise(&noisy.film, &settings, denoise).unwrap().0;
            let light = |image: &Image, columns| mean(pixels(image, columns));
            let [bright, dark] =
                [37..40, 40..43].map(|of: Range<usize>| light(&smooth, of.clone()) / light(&exact, of));
            (bright, dark, noise(&smooth) / before)
        };
        let (bright, dark, left) = filter(denoise.depth);
        assert!(bright > 0.85 && dark < 3.0 && left < 0.03, "{away}: {bright} {dark} {left}");
        // Negative controls: without planes light bleeds over the edge, and with planes that are
        // too thin noise stays.
        let (bright, dark, _) = filter(f32::INFINITY);
        assert!(bright < 0.8 && dark > 4.0, "{away}: {bright} {dark}");
        assert!(filter(1e-4).2 > 0.03, "{away}");
    }
}
