//! Scenes that move: films of several moments, refitted BVHs, and the profile of a square in
//! motion against its closed form, on each backend.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::path::{Path, PathBuf};
use trisect::film::Film;
use trisect::render::{PreparedScene, Renderer, SceneTree, Settings, Shutter};
use trisect::scene::{AnimatedScene, LoadOptions, Scene};
use trisect_tests::models::{bending_tube, sliding_square};
use trisect_tests::program::Temporary;
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Writes a file to a folder, and returns its path.
fn write(folder: &Temporary, name: &str, text: &str) -> PathBuf {
    let path = folder.path(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn load(path: &Path) -> AnimatedScene {
    AnimatedScene::load(path, &LoadOptions::default()).unwrap()
}

fn at(animated: &mut AnimatedScene, time: f64) -> Scene {
    let document = animated.document(time).unwrap();
    animated.lower(document).unwrap()
}

/// A renderer of a scene that moves, with the BVH of its last moment.
struct Moving {
    renderer: Renderer,
    tree: Option<SceneTree>,
    refitted: u32,
}

impl Moving {
    fn new(subject: BackendUnderTest, scene: &Scene) -> Option<Self> {
        let mut renderer = subject.renderer(scene)?;
        let mut prepared = PreparedScene::new(scene, None).unwrap();
        renderer.set_scene(&mut prepared).unwrap();
        Some(Self { renderer, tree: Some(prepared.into_tree()), refitted: 0 })
    }

    fn set(&mut self, scene: &Scene) {
        let mut prepared = PreparedScene::moved(scene, None, self.tree.take().unwrap()).unwrap();
        self.refitted += u32::from(prepared.is_refitted());
        self.renderer.set_scene(&mut prepared).unwrap();
        self.tree = Some(prepared.into_tree());
    }

    fn moment(&mut self, film: &mut Film, settings: &Settings, samples: std::ops::Range<u32>) {
        let mut none = |_: &_, _: &Film, _: &mut Settings| None;
        let settings = &mut settings.clone();
        self.renderer.render_moment(film, settings, &samples, &(), &mut (), &mut none).unwrap();
    }
}

/// Returns the mean red of each column of a film of the square while a shutter is open for a second
/// and divides `samples` samples over `steps` moments.
fn profile(subject: BackendUnderTest, seconds: f64, samples: u32, steps: u32) -> Option<Vec<f64>> {
    let folder = Temporary::new("motion", &format!("square-{subject:?}-{seconds}"));
    write(&folder, "square.gltf", &sliding_square([1.0, -0.5, 0.0]));
    let scene = write(
        &folder,
        "square.ron",
        "Scene(version: 1, image: (width: 64, height: 16, samples: 1), camera: (look_from: (0.5, 0, 100), look_at: (0.5, 0, 0), vertical_fov: 0.572953),
            materials: {}, objects: [Mesh(file: \"square.gltf\")])",
    );
    let mut animated = load(&scene);
    let first = at(&mut animated, 0.0);
    // 64 pixels for 4 units across: from -1.5 to 2.5.
    let settings = Settings { width: 64, height: 16, samples, depth: 1, ..Settings::of(&first) };
    let mut moving = Moving::new(subject, &first)?;
    let mut film = Film::new(64, 16);
    for moment in Shutter::new(seconds, Some(steps), samples).unwrap().moments(samples) {
        moving.set(&at(&mut animated, moment.after));
        moving.moment(&mut film, &settings, moment.samples);
    }
    assert_eq!(film.counts().samples, 64 * 16 * u64::from(samples));
    let image = film.image();
    let columns = (0..64).map(|x| {
        let rows = (4..12).map(|y| f64::from(image.pixels[y * 64 + x][0]));
        rows.sum::<f64>() / 8.0
    });
    Some(columns.collect())
}

/// Returns the share of a second in which a column of pixels is covered by the square.
fn covered(column: usize) -> f64 {
    let x = -1.5 + (column as f64 + 0.5) / 16.0;
    // The left edge is at -1 + 2t: it covers x from t = x / 2 to t = (x + 1) / 2.
    (((x + 1.0) / 2.0).clamp(0.0, 1.0) - (x / 2.0).clamp(0.0, 1.0)).max(0.0)
}

/// A square that moves by twice its side while the shutter is open has the profile of a trapezoid:
/// its edges rise over a side, and between them half of the time is covered.
fn a_moving_square_covers_what_its_way_says(subject: BackendUnderTest) {
    let Some(blurred) = profile(subject, 1.0, 128, 64) else { return };
    let difference = |profile: &[f64]| {
        let columns = profile.iter().enumerate().map(|(column, found)| (found - covered(column)).abs());
        columns.fold(0.0, f64::max)
    };
    // A step of 1/64 of the time, the width of a column, and the noise of 1024 samples.
    assert!(difference(&blurred) < 0.03, "{} {blurred:?}", difference(&blurred));
    let mean = blurred.iter().sum::<f64>() / 64.0;
    assert!((mean - 0.25).abs() < 0.002, "the square covers a quarter of the width: {mean}");
    // Negative control: with a shutter of 0 the square is sharp, at its start.
    let sharp = profile(subject, 0.0, 128, 64).unwrap();
    assert!(difference(&sharp) > 0.4, "{sharp:?}");
    for (column, value) in sharp.iter().enumerate() {
        let x = -1.5 + column as f64 / 16.0;
        assert_eq!(*value, if (-1.0..0.0).contains(&x) { 1.0 } else { 0.0 }, "{column}");
    }
}

/// The film of an image is the sum of those of its moments: whatever was rendered before with a
/// renderer, and whether its BVH was refitted or built.
fn a_film_is_the_sum_of_its_moments(subject: BackendUnderTest) {
    let folder = Temporary::new("motion", &format!("tube-{subject:?}"));
    let tube = write(&folder, "tube.gltf", &bending_tube(24, 12));
    let mut animated = load(&tube);
    let first = at(&mut animated, 0.0);
    let settings =
        Settings { width: 24, height: 32, samples: 24, depth: 4, guides: true, ..Settings::of(&first) };
    let Some(mut moving) = Moving::new(subject, &first) else { return };
    let moments: Vec<_> = Shutter::new(0.5, Some(3), 24).unwrap().moments(24).collect();
    let mut film = Film::with_aovs(24, 32);
    let mut sum = Film::with_aovs(24, 32);
    let mut other = Film::with_aovs(24, 32);
    for moment in &moments {
        let scene = at(&mut animated, moment.after);
        moving.set(&scene);
        moving.moment(&mut film, &settings, moment.samples.clone());
        // A renderer with a BVH that is built for the moment.
        let mut alone = Moving::new(subject, &scene).unwrap();
        let mut part = Film::with_aovs(24, 32);
        alone.moment(&mut part, &settings, moment.samples.clone());
        sum.add(&part).unwrap();
        // Negative control: the scene does not move.
        let mut still = Moving::new(subject, &first).unwrap();
        let mut part = Film::with_aovs(24, 32);
        still.moment(&mut part, &settings, moment.samples.clone());
        other.add(&part).unwrap();
    }
    assert!(moving.refitted > 0, "no BVH was refitted");
    assert_eq!(film.coverage, sum.coverage);
    // The index of a triangle, of which only the object is used, is that of its BVH.
    assert!(film.pixels == sum.pixels, "the moments differ from those that are rendered alone");
    assert!(film.pixels != other.pixels, "negative control not detected");
    assert!(film.aovs.iter().zip(other.aovs.iter()).any(|(a, b)| a.position() != b.position()));
}

/// A renderer that showed another time renders the scene as one that was made for it.
fn a_renderer_shows_the_time_that_was_set(subject: BackendUnderTest) {
    let folder = Temporary::new("motion", &format!("time-{subject:?}"));
    let mut animated = load(&write(&folder, "tube.gltf", &bending_tube(24, 12)));
    let scenes = [0.0, 1.0, 0.25].map(|time| at(&mut animated, time));
    let settings = Settings { width: 24, height: 32, samples: 4, depth: 4, ..Settings::of(&scenes[0]) };
    let Some(mut moving) = Moving::new(subject, &scenes[0]) else { return };
    let mut films = Vec::new();
    for scene in &scenes {
        moving.set(scene);
        films.push(moving.renderer.render(&settings).unwrap().film);
        let alone = subject.renderer(scene).unwrap().render(&settings).unwrap().film;
        assert_eq!(*films.last().unwrap(), alone);
    }
    // Negative control: the times differ.
    assert_ne!(films[0], films[1]);
    // A scene with another number of triangles gets a new BVH.
    let tube = write(&folder, "other.gltf", &bending_tube(12, 12));
    let other = at(&mut load(&tube), 0.0);
    let refitted = moving.refitted;
    moving.set(&other);
    assert_eq!(moving.refitted, refitted);
    let alone = subject.renderer(&other).unwrap().render(&settings).unwrap().film;
    assert_eq!(moving.renderer.render(&settings).unwrap().film, alone);
}

for_each_backend!(
    a_moving_square_covers_what_its_way_says,
    a_film_is_the_sum_of_its_moments,
    a_renderer_shows_the_time_that_was_set
);
