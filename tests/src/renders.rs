//! Rendering and comparing films.

use crate::BackendUnderTest;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use trisect::film::{Film, PixelTotals};
use trisect::render::{FilmObserver, Renderer, Sampler, Settings};
use trisect::scene::Scene;

/// Returns a renderer of the scene on the CPU.
///
/// # Panics
///
/// If the scene cannot be rendered.
pub fn cpu(scene: &Scene) -> Renderer {
    match BackendUnderTest::Cpu.renderer(scene) {
        Some(renderer) => renderer,
        None => panic!("the CPU is always there"),
    }
}

/// Returns the settings of a scene with independent samples, for tests whose statistics take the
/// variance of a film: with the Sobol sequence it overestimates the noise.
pub fn independent(scene: &Scene) -> Settings {
    Settings { sampler: Sampler::Independent, ..Settings::of(scene) }
}

/// Renders a film.
///
/// # Panics
///
/// If the backend fails.
pub fn film(renderer: &mut Renderer, settings: &Settings) -> Film {
    match renderer.render(settings) {
        Ok(frame) => frame.film,
        Err(error) => panic!("{error}"),
    }
}

/// Returns the scene with 1 % more albedo, a fault that comparisons must detect.
pub fn brighter(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.materials.iter_mut().for_each(|material| material.albedo *= 1.01);
    scene
}

/// Returns the scene with each light, the sky included, brighter by `factor`.
pub fn lit(scene: &Scene, factor: f32) -> Scene {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        material.emission *= factor;
        material.light_pdf *= factor;
    }
    scene.lights.iter_mut().for_each(|light| light.intensity *= factor);
    scene.sky.bottom *= factor;
    scene.sky.top *= factor;
    if let Some(environment) = &mut scene.environment {
        for texel in Arc::make_mut(&mut environment.texels) {
            texel.radiance *= factor;
        }
    }
    scene
}

/// Returns the number of pixels whose radiance differs by more than rounding. The same random
/// numbers give the same paths, except for a few that one ULP sends another way at an edge, at the
/// choice of a lobe, or at a texel's border.
pub fn apart(a: &Film, b: &Film) -> usize {
    let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-3 * a.abs().max(b.abs()) + 1e-6;
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.filter(|(a, b)| !a.mean().into_iter().zip(b.mean()).all(near)).count()
}

/// Returns the number of pixels that differ in a bit of a sum, or in a count.
///
/// # Panics
///
/// If the films have different sizes.
pub fn differing(a: &Film, b: &Film) -> usize {
    assert_eq!(a.pixels.len(), b.pixels.len());
    let bits = |p: PixelTotals| {
        let sums = [p.radiance, p.squares].map(|sums| {
            sums.map(|sum| {
                let (high, low) = sum.parts();
                (high.to_bits(), low.to_bits())
            })
        });
        (sums, [p.samples, p.rejected, p.segments, p.unwritten])
    };
    a.pixels.iter().zip(&b.pixels).filter(|&(a, b)| bits(a) != bits(b)).count()
}

/// Returns all scene files of the project, those of the tests among them, and its glTF model.
/// `mesh.ron` is left out with a message if its mesh has not been generated.
///
/// # Panics
///
/// If the folder cannot be read.
pub fn scene_files() -> Vec<PathBuf> {
    let folder = crate::root().join("scenes");
    let Ok(entries) = std::fs::read_dir(&folder) else { panic!("{}", folder.display()) };
    let of_tests = std::fs::read_dir(crate::root().join("tests/scenes")).into_iter().flatten();
    let entries = entries.chain(of_tests);
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    files.push(folder.join("gltf/features.gltf"));
    files.sort_by_key(|path| path.file_name().map(ToOwned::to_owned));
    let mesh = folder.join("generated/asteroid.ply");
    files.retain(|path| {
        let there = !path.ends_with("mesh.ron") || mesh.exists();
        if !there {
            eprintln!("SKIPPED {}: {} is not generated", path.display(), mesh.display());
        }
        there
    });
    files
}

/// Stops a render after a number of parts.
pub struct StopAfterParts(AtomicU32);

impl StopAfterParts {
    /// Creates an observer that stops after `parts` parts.
    pub fn new(parts: u32) -> Self {
        Self(AtomicU32::new(parts))
    }
}

impl FilmObserver for StopAfterParts {
    fn should_continue(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }

    fn part_added(&self, film: &Film) {
        assert!(!film.coverage.parts().is_empty());
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
    }
}
