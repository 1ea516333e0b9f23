//! Scenes that are edited while a renderer has them: the film is that of a new renderer, on each
//! backend, and what an edit does not concern is not written again.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trisect::render::{Renderer, SceneReuse, Settings, Traversal, TreeReuse};
use trisect::scene::{AnimatedScene, LoadOptions, Scene};
use trisect::{Error, bvh::BvhQuality};
use trisect_tests::counting_backend::CountingBackend;
use trisect_tests::fault_injecting_backend::FaultInjectingBackend;
use trisect_tests::models::bending_tube;
use trisect_tests::program::Temporary;
use trisect_tests::{BackendUnderTest, for_each_backend, root};

/// Edits one after another, and the origin of the BVH after each in a scene with many triangles.
const EDITS: [(&str, TreeReuse); 17] = [
    ("materials.clay.albedo=0.1,0.8,0.2", TreeReuse::Kept),
    ("materials.clay=Emissive(radiance: (4, 3, 2))", TreeReuse::Kept),
    ("materials.clay=Lambertian(albedo: (0.7, 0.2, 0.1))", TreeReuse::Kept),
    ("materials.lamp=Metal(albedo: (1, 1, 1), fuzz: 0)", TreeReuse::Kept),
    ("materials.clay=Dielectric(ior: 1.5)", TreeReuse::Kept),
    ("objects.ball.material=floor", TreeReuse::Kept),
    ("sky=Gradient(bottom: (1, 0, 0), top: (0, 0, 1))", TreeReuse::Kept),
    ("textures.floor.file=marble.png", TreeReuse::Kept),
    ("media={ \"air\": (extinction: (0.1, 0.1, 0.1), albedo: (1, 1, 1)) }", TreeReuse::Kept),
    ("atmosphere=\"air\"", TreeReuse::Kept),
    // Boxes are padded for another camera, for none, and for the first one again.
    ("camera.look_from=0,3,60", TreeReuse::Padded),
    ("camera.look_from=0,3,60000", TreeReuse::Padded),
    ("camera.look_from=0,1.2,4", TreeReuse::Padded),
    ("camera.vertical_fov=50", TreeReuse::Kept),
    ("objects.ball.center=0.5,1,1", TreeReuse::Refitted),
    (
        "objects=[Mesh(file: \"tube.gltf\", material: \"stone\"), Sphere(name: \"ball\", center: (0.5, 1, 1), radius: 0.4, material: \"clay\"), Sphere(center: (-0.5, 1, 1), radius: 0.4, material: \"clay\")]",
        TreeReuse::Built,
    ),
    (
        "objects=[Sphere(name: \"ball\", center: (0.5, 1, 1), radius: 0.4, material: \"clay\")]",
        TreeReuse::Built,
    ),
];

/// Returns an OBJ file of a hill of 128 triangles with normals.
fn hill() -> String {
    let (mut vertices, mut faces) = (String::new(), String::new());
    for (x, z) in (0..9).flat_map(|z| (0..9).map(move |x| (x, z))) {
        let (u, v) = (f64::from(x) / 4.0 - 1.0, f64::from(z) / 4.0 - 1.0);
        vertices += &format!("v {u} {} {v}\nvn {} 1 {}\n", -0.5 * (u * u + v * v), u, v);
        if x < 8 && z < 8 {
            let [a, b, c, d] = [0, 1, 9, 10].map(|step| 9 * z + x + 1 + step);
            faces += &format!("f {a}//{a} {c}//{c} {b}//{b}\nf {b}//{b} {c}//{c} {d}//{d}\n");
        }
    }
    vertices + &faces
}

/// Returns a scene of a tube of 2 · `rings` · `sides` triangles, a ball, a hill, a lamp and a floor
/// with a texture, in this folder.
fn scene(folder: &Temporary, rings: u16, sides: u16) -> AnimatedScene {
    std::fs::write(folder.path("tube.gltf"), bending_tube(rings, sides)).unwrap();
    std::fs::write(folder.path("hill.obj"), hill()).unwrap();
    for image in ["checker.png", "marble.png"] {
        std::fs::copy(root().join("scenes/textures").join(image), folder.path(image)).unwrap();
    }
    let path = folder.path("scene.ron");
    std::fs::write(
        &path,
        r#"Scene(
        version: 1,
        image: (width: 24, height: 16, samples: 4, depth: 6),
        camera: (look_from: (0, 1.2, 4), look_at: (0, 0.6, 0), vertical_fov: 40),
        sky: Uniform(radiance: (0.2, 0.2, 0.3)),
        textures: { "floor": (file: "checker.png", color_space: Srgb, wrap: Repeat, filter: Nearest) },
        materials: {
            "floor": Lambertian(albedo: (1, 1, 1), texture: "floor"),
            "stone": Lambertian(albedo: (0.6, 0.6, 0.6)),
            "clay": Lambertian(albedo: (0.7, 0.2, 0.1)),
            "lamp": Emissive(radiance: (9, 9, 9)),
        },
        objects: [
            Mesh(file: "tube.gltf", material: "stone"),
            Sphere(name: "ball", center: (1, 0.5, 0), radius: 0.4, material: "clay"),
            Quad(corner: (-4, -1, 4), u: (8, 0, 0), v: (0, 0, -8), material: "floor"),
            Quad(corner: (-1, 3, -1), u: (2, 0, 0), v: (0, 0, 2), material: "lamp"),
            Mesh(name: "hill", file: "hill.obj", material: "stone", transform: [Translate((0, -0.4, -2))]),
        ],
    )"#,
    )
    .unwrap();
    AnimatedScene::load_moving_or_not(&path, &LoadOptions::default()).unwrap()
}

fn start(animated: &mut AnimatedScene) -> Scene {
    let document = animated.document(0.0).unwrap();
    animated.lower(document).unwrap()
}

fn edit(animated: &mut AnimatedScene, change: &str) -> Scene {
    animated.edit(&[change.parse().unwrap()], 0.0).unwrap_or_else(|error| panic!("{change}: {error}"))
}

fn settings(scene: &Scene) -> Settings {
    Settings { guides: true, ..Settings::of(scene) }
}

/// After each edit, the film is that of a new renderer of the scene, and so is the CRC of BVH,
/// lights and camera, but where the BVH was refitted.
fn films_are_those_of_new_renderers(subject: BackendUnderTest) {
    let folder = Temporary::new("edits", &format!("films-{subject:?}"));
    let mut animated = scene(&folder, 50, 50);
    let mut before = start(&mut animated);
    let Some(mut renderer) = subject.renderer(&before) else { return };
    let mut film = renderer.render(&settings(&before)).unwrap().film;
    for (change, tree) in EDITS {
        let edited = edit(&mut animated, change);
        let reuse = renderer.update_scene(&edited, None).unwrap();
        assert_eq!(reuse.tree, tree, "{change}");
        let other = renderer.render(&settings(&edited)).unwrap().film;
        let mut fresh = subject.renderer(&edited).unwrap();
        assert!(other == fresh.render(&settings(&edited)).unwrap().film, "{change}: another film");
        let crc = |renderer: &Renderer| renderer.prepared_crc(24, 16);
        assert_eq!(crc(&renderer) == crc(&fresh), tree != TreeReuse::Refitted, "{change}");
        // Negative control: an edit without an effect would pass. Media have one once a material or
        // the atmosphere names them.
        assert_eq!(film == other, change.starts_with("media"), "{change}");
        (before, film) = (edited, other);
    }
    // A BVH of another quality is built.
    let fast = renderer.update_scene(&before, Some(BvhQuality::Fast)).unwrap();
    assert_eq!(fast.tree, TreeReuse::Built);
    assert!(renderer.render(&settings(&before)).unwrap().film == film);
}

for_each_backend!(films_are_those_of_new_renderers);

/// Returns the names of the arrays that were written.
fn names(reuse: &SceneReuse) -> Vec<&'static str> {
    reuse.written.iter().map(|array| array.name).collect()
}

/// A device with memory of its own gets what an edit concerns, and nothing else.
#[test]
fn an_edit_of_a_material_writes_no_mesh() {
    for traversal in [Traversal::Stack, Traversal::Wide] {
        let folder = Temporary::new("edits", &format!("bytes-{traversal:?}"));
        let mut animated = scene(&folder, 24, 12);
        let first = start(&mut animated);
        let device = CountingBackend::new(traversal);
        let counts = device.written();
        let mut renderer = Renderer::new(device, &first).unwrap();
        let whole = counts.take();
        let triangles = size_of_val(first.triangles.as_slice()) as u64;
        assert_eq!((whole["the scene's triangles"], first.triangles.len()), (triangles, 576 + 128));
        assert!(first.vertices.len() > 81);
        let wide = ["wide BVH", "wide BVH", "packets of spheres", "packets of triangles"];
        let of_trees = if traversal == Traversal::Wide { &wide[..] } else { &[] };
        let moved = [&["BVH", "spheres"], of_trees].concat();
        let mesh_moved = [&["BVH", "triangles"], of_trees].concat();
        let mesh_turned = [&["BVH", "triangles", "normals and texture coordinates"], of_trees].concat();
        for (change, want) in [
            ("materials.stone.albedo=0.1,0.8,0.2", vec!["materials"]),
            ("materials.clay=Emissive(radiance: (4, 3, 2))", vec!["materials", "lights"]),
            ("objects.ball.material=floor", vec!["materials", "spheres", "lights"]),
            ("sky.radiance=1,1,1", vec![]),
            ("camera.vertical_fov=30", vec![]),
            ("image.samples=5", vec![]),
            ("objects.0.material=floor", vec!["normals and texture coordinates"]),
            // Negative controls: what moves is written, and the trees over it.
            ("objects.ball.material=clay", vec!["materials", "spheres", "lights"]),
            ("objects.ball.center=1,0.6,0", moved),
            ("objects.0.transform=[Translate((0, 0.1, 0)), RotateY(3)]", mesh_moved),
            ("objects.hill.transform=[RotateX(9), Translate((0, -0.4, -2))]", mesh_turned),
        ] {
            let edited = edit(&mut animated, change);
            let reuse = renderer.update_scene(&edited, None).unwrap();
            let found = names(&reuse);
            println!("{traversal:?} {change}: {:?}, {} bytes of {found:?}", reuse.tree, reuse.bytes());
            assert_eq!(found, want, "{traversal:?} {change}");
            let counted = counts.take();
            assert_eq!(counted.values().sum::<u64>(), reuse.bytes(), "{counted:?}");
            for array in &reuse.written {
                assert!(counted.keys().any(|what| what.ends_with(array.name)), "{counted:?}");
            }
            let film = renderer.render(&settings(&edited)).unwrap().film;
            let fresh = BackendUnderTest::Cpu.renderer(&edited).unwrap().render(&settings(&edited)).unwrap();
            assert!(film == fresh.film, "{traversal:?} {change}");
            counts.take();
        }
    }
}

/// After an error of the scene the renderer has the scene before; after one of the device it has
/// none, until one is uploaded.
#[test]
fn errors_leave_a_renderer_that_goes_on() {
    let folder = Temporary::new("edits", "errors");
    let mut animated = scene(&folder, 24, 12);
    let first = start(&mut animated);
    let full = Arc::new(AtomicBool::new(false));
    let backend = FaultInjectingBackend::new(|| Ok(())).full_while(Arc::clone(&full));
    let mut renderer = Renderer::new(backend, &first).unwrap();
    let film = renderer.render(&settings(&first)).unwrap().film;
    let broken = Scene { materials: Vec::new(), ..first.clone() };
    assert!(matches!(renderer.update_scene(&broken, None), Err(Error::Scene(_))));
    assert!(renderer.render(&settings(&first)).unwrap().film == film);

    let green = edit(&mut animated, "materials.clay.albedo=0.1,0.8,0.2");
    full.store(true, Ordering::Relaxed);
    assert!(matches!(renderer.update_scene(&green, None), Err(Error::Backend(_))));
    full.store(false, Ordering::Relaxed);
    let error = renderer.render(&settings(&first)).err().unwrap().to_string();
    assert!(error.contains("could not be uploaded"), "{error}");
    let reuse = renderer.update_scene(&green, None).unwrap();
    assert_eq!(reuse.tree, TreeReuse::Kept);
    assert!(names(&reuse).contains(&"triangles"), "{reuse:?}");
    let alone = BackendUnderTest::Cpu.renderer(&green).unwrap().render(&settings(&green)).unwrap().film;
    assert!(renderer.render(&settings(&green)).unwrap().film == alone);
}
