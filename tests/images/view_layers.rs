//! Layers and picks of a viewer's frames: they are those of a film, and reading them changes
//! nothing.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::{CameraPose, Rebase, SceneDocument};
use trisect::view::{Layer, ViewOptions, Viewer};
use trisect_tests::{BackendUnderTest, for_each_route, root};

for_each_route!(layers_are_those_of_a_film);

/// Settings of a small frame of one sample.
fn settings(document: &SceneDocument) -> Settings {
    let of_file: Settings = document.image.into();
    Settings { width: 48, height: 48, samples: 1, depth: 4, guides: true, ..of_file }
}

fn layers_are_those_of_a_film(subject: BackendUnderTest) {
    let document = SceneDocument::load(&root().join("scenes/cornell_box.ron")).unwrap();
    let (names, settings) = (document.part_names(), settings(&document));
    let scene = document.lower(Rebase::IDENTITY).unwrap();
    let Some(renderer) = subject.renderer(&scene) else { return };
    let mut viewer = Viewer::new(renderer);
    let look = ViewOptions::new(settings.clone(), None);
    let mut pixels = Vec::new();
    let frame = |viewer: &mut Viewer, pose: &CameraPose, pixels: &mut Vec<u32>| {
        viewer.frame(&look, pose, pixels).unwrap().live.samples
    };
    assert_eq!(frame(&mut viewer, &scene.camera, &mut pixels), 1);
    let normals = |viewer: &mut Viewer| viewer.layer(Layer::Normal, &names).unwrap().unwrap().pixels;
    let first = normals(&mut viewer);
    // Reading layers and picking leaves the next frame as it is.
    let all = Layer::ALL.map(|(_, layer)| viewer.layer(layer, &names).unwrap().unwrap());
    let picked = viewer.pick((24, 40)).unwrap().unwrap();
    assert_eq!(frame(&mut viewer, &scene.camera, &mut pixels), 2);
    let shown = viewer.layer(Layer::Rays, &names).unwrap().unwrap();
    let errors = viewer.layer(Layer::Noise, &names).unwrap().unwrap();
    let image = viewer.image().unwrap().unwrap();

    // The film of the first sample, and of two.
    let film = |viewer: &mut Viewer, samples: u32| -> Film {
        let settings = Settings { samples, ..settings.clone() };
        viewer.renderer().render(&settings).unwrap().film
    };
    let (one, two) = (film(&mut viewer, 1), film(&mut viewer, 2));
    let camera = viewer.renderer().camera(&settings);
    let pixel = 40 * 48 + 24;
    let aov = one.aovs.iter().nth(pixel).unwrap();
    let position = aov.position();
    for (axis, at) in position.into_iter().enumerate() {
        assert!((picked.position[axis] - at).abs() < 1e-9, "{position:?} {}", picked.position);
    }
    assert_eq!(picked.object, viewer.renderer().object(aov.primitive()));
    assert_eq!(names[picked.object as usize - 1].material, "white", "the floor is white");
    // The camera looks along an axis, z.
    let ahead = (picked.position.z - f64::from(camera.origin.z)).abs();
    assert!((picked.depth - ahead).abs() < 1e-6 * ahead, "{} {ahead}", picked.depth);
    let code = |c: f64| ((c * 0.5 + 0.5) * 255.0).round() as u8;
    for (pixel, aov) in one.aovs.iter().enumerate().filter(|(_, aov)| aov.hits > 0) {
        let [red, green, blue, _] = first[pixel].to_le_bytes();
        assert_eq!([red, green, blue], aov.normal().map(code), "pixel {pixel}");
    }
    // Without a filter the image is the mean of two samples.
    let mean = two.image();
    let worst = image.pixels.iter().flatten().zip(mean.pixels.iter().flatten());
    let worst = worst.map(|(a, b)| (a - b).abs() / (1.0 + b.abs())).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{worst}");
    let most = two.pixels.iter().map(|pixel| pixel.segments as f64 / 2.0).fold(0.0, f64::max);
    let [low, high] = shown.range.unwrap();
    assert!(low == 0.0 && high <= most && high > 0.5 * most, "{high} of {most}");

    // Layers differ from each other; nodes are at least the root's.
    let [.., noise, rays, nodes] = &all;
    assert!(noise.range == Some([0.0; 2]), "one sample has no error: {:?}", noise.range);
    assert!(errors.range.unwrap()[1] > 0.1, "the samples of two frames have errors: {:?}", errors.range);
    assert!(rays.range.unwrap()[1] > 1.0 && nodes.range.unwrap()[1] >= 1.0);
    let mut distinct: Vec<&Vec<u32>> = all.iter().map(|picture| &picture.pixels).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), Layer::ALL.len());
    // Negative control: from elsewhere the layer is another one.
    let moved = CameraPose { look_from: scene.camera.look_from * 0.9, ..scene.camera };
    frame(&mut viewer, &moved, &mut pixels);
    assert_ne!(normals(&mut viewer), first);
}
