#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use super::*;
use glam::DAffine3;
use trisect_device::cpu::Cpu;
use trisect_scene::Sharing;
use trisect_scene::builder::{Camera, Gradient, Lambertian, SceneBuilder};

const SIZE: (u32, u32) = (48, 32);

/// Places of the things that move.
#[derive(Clone, Copy, Default)]
struct Places {
    ball: DVec3,
    cube: DVec3,
}

/// A ball to the left, a quad in the middle, cubes of a shared mesh to the right, before the sky.
fn scene(places: Places, sharing: Sharing) -> Scene {
    let mut scene = SceneBuilder::new().sharing(sharing);
    let grey = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
    scene.sphere(DVec3::new(-3.0, 0.0, 0.0) + places.ball, 1.0, grey);
    scene.quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], grey);
    // The front of a cube: texture coordinates as of an image, whose top row comes first.
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mesh = trisect_scene::description::Mesh {
        positions: corners.to_vec(),
        normals: vec![[0.6, 0.0, 0.8]; 4],
        uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..trisect_scene::description::Mesh::default()
    };
    let mesh = scene.mesh(mesh, grey);
    scene.instance(mesh, DAffine3::from_translation(DVec3::new(3.0, 0.0, 0.0) + places.cube));
    scene.instance(mesh, DAffine3::from_translation(DVec3::new(0.0, -40.0, 0.0)));
    scene.sky(Gradient::new([1.0; 3], [1.0; 3]));
    scene.camera(camera(0.0));
    scene.build().unwrap()
}

/// Camera at z = 12, turned to look at a point of the plane of the objects.
fn camera(at: f64) -> Camera {
    Camera::look_at([0.0, 0.0, 12.0], [at, 0.0, 0.0]).fov_degrees(30.0)
}

fn frame(scene: Option<Scene>, camera: Camera) -> NeighbourFrame {
    NeighbourFrame { scene: scene.map(Arc::new), camera: camera.into() }
}

/// Layers of a scene at rest in one frame.
fn layers(scenes: &SurfaceScenes) -> Vec<Channel> {
    let mut renderer = Renderer::new(Cpu::open(Some(2)).unwrap(), &scenes.scene).unwrap();
    let settings = Settings { width: SIZE.0, height: SIZE.1, samples: 4, ..Settings::of(&scenes.scene) };
    let aovs = [Aov::GeometricNormal, Aov::Uv, Aov::Motion];
    render(&mut renderer, &settings, scenes, &aovs, &mut ()).unwrap()
}

/// Value of a channel where the camera sees the point (x, y, 0).
fn value(channels: &[Channel], name: &str, x: f64, y: f64) -> f64 {
    let pixel = (0.5 * f64::from(SIZE.0) + x / step(12.0), 0.5 * f64::from(SIZE.1) - y / step(12.0));
    let index = pixel.1 as usize * SIZE.0 as usize + pixel.0 as usize;
    match &channels.iter().find(|channel| channel.name == name).unwrap().samples {
        Samples::F32(values) | Samples::Color(values) => f64::from(values[index]),
        Samples::U32(_) => panic!("{name} has integers"),
    }
}

/// Width of a pixel at a depth.
fn step(depth: f64) -> f64 {
    2.0 * 15f64.to_radians().tan() * depth / f64::from(SIZE.1)
}

#[test]
fn what_moves_has_its_motion_in_pixels() {
    for sharing in [Sharing::Always, Sharing::Never] {
        let at = |ball: f64, cube: f64| {
            let places = Places { ball: DVec3::new(ball, 0.0, 0.0), cube: DVec3::new(0.0, cube, 0.0) };
            scene(places, sharing)
        };
        let neighbours = [frame(Some(at(-0.25, 0.0)), camera(0.0)), frame(Some(at(0.5, 1.0)), camera(0.0))];
        let scenes = SurfaceScenes { scene: Arc::new(at(0.0, 0.0)), neighbours: Some(neighbours) };
        let channels = layers(&scenes);
        let near = |name: &str, x: f64, y: f64, want: f64| {
            let found = value(&channels, name, x, y);
            assert!(
                (found - want).abs() < 0.03 * want.abs() + 1e-5,
                "{name} at {x}, {y}: {found}, not {want}"
            );
        };
        // The camera sees the ball's front, about 0.9 nearer, where the ray to (-3, 0, 0) meets it.
        let front = step(12.0 - 0.94);
        near("forward.u", -3.0, 0.1, 0.5 / front);
        near("backward.u", -3.0, 0.1, -0.25 / front);
        near("forward.v", 3.0, 0.1, 1.0 / step(12.0));
        near("backward.v", 3.0, 0.1, 0.0);
        // What stands still has no motion, without rounding.
        for name in ["forward.u", "forward.v", "backward.u", "backward.v"] {
            assert_eq!((value(&channels, name, 0.1, 0.1), value(&channels, name, 0.1, 2.0)), (0.0, 0.0));
        }
    }
}

#[test]
fn the_camera_moves_all() {
    let scenes = |next: Camera| SurfaceScenes {
        scene: Arc::new(scene(Places::default(), Sharing::Auto)),
        neighbours: Some([frame(None, camera(0.0)), frame(None, next)]),
    };
    // The camera turns to the right: all goes to the left, the sky as what is at a finite distance.
    let turned = layers(&scenes(camera(1.0)));
    for (x, y) in [(0.1, 0.1), (0.1, 3.0)] {
        let moved = value(&turned, "forward.u", x, y);
        assert!((moved + 1.0 / step(12.0)).abs() < 0.05, "{moved}");
    }
    // The camera goes to the right: the sky stays.
    let passed = Camera::look_at([1.0, 0.0, 12.0], [1.0, 0.0, 0.0]).fov_degrees(30.0);
    let passed = layers(&scenes(passed));
    assert!((value(&passed, "forward.u", 0.1, 0.1) + 1.0 / step(12.0)).abs() < 1e-3);
    assert!(value(&passed, "forward.u", 0.1, 3.0).abs() < 1e-4);
    // A camera that has passed the objects does not see them.
    let behind = Camera::look_at([0.0, 0.0, -5.0], [0.0, 0.0, -9.0]).fov_degrees(30.0);
    assert_eq!(value(&layers(&scenes(behind)), "forward.u", 0.1, 0.1), 0.0);
}

#[test]
fn texture_coordinates_and_normals_of_surfaces() {
    for sharing in [Sharing::Always, Sharing::Never] {
        let scene = Arc::new(scene(Places::default(), sharing));
        let channels = layers(&SurfaceScenes { scene, neighbours: None });
        let near = |name: &str, x: f64, y: f64, want: f64| {
            let found = value(&channels, name, x, y);
            assert!((found - want).abs() < 0.08, "{name} at {x}, {y}: {found}, not {want}");
        };
        // Quad and mesh: u to the right, v upwards.
        for middle in [0.0, 3.0] {
            for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5)] {
                near("UV.U", middle + x, y, 0.5 + 0.5 * x);
                near("UV.V", middle + x, y, 0.5 + 0.5 * y);
            }
        }
        // The shading normal of the mesh leans, the geometric one does not.
        near("Ng.Z", 3.0, 0.1, 1.0);
        near("Ng.X", 3.0, 0.1, 0.0);
        // The ball's front: u is a quarter turn from -x by +z, v half way.
        near("UV.U", -3.0, 0.0, 0.25);
        near("UV.V", -3.0, 0.0, 0.5);
        near("UV.V", -3.0, 0.6, 0.5 + 0.6f64.asin() / std::f64::consts::PI);
        assert_eq!((value(&channels, "UV.U", 0.1, 3.0), value(&channels, "Ng.Z", 0.1, 3.0)), (0.0, 0.0));
    }
}

#[test]
fn frames_with_other_objects_have_the_cameras_motion() {
    let mut other = scene(Places { ball: DVec3::X, ..Places::default() }, Sharing::Never);
    other.spheres.push(other.spheres[0]);
    let scene = Arc::new(scene(Places::default(), Sharing::Never));
    let frames = [frame(Some(other.clone()), camera(0.0)), frame(Some(other), camera(0.0))];
    let scenes = SurfaceScenes { scene, neighbours: Some(frames) };
    assert!(!scenes.can_be_compared());
    assert_eq!(value(&layers(&scenes), "forward.u", -3.0, 0.1), 0.0);
}

#[test]
fn parallel_rays_have_motion_too() {
    let parallel = |x: f64| CameraPose {
        look_from: DVec3::new(x, 0.0, 12.0),
        look_at: DVec3::new(x, 0.0, 0.0),
        parallel_height: 8.0,
        ..CameraPose::PINHOLE
    };
    let record = |x: f64| View::new(&crate::camera::record(&parallel(x), SIZE.0, SIZE.1));
    let (now, then) = (record(0.0), record(1.0));
    let place = now.pixel(DVec3::new(1.0, 2.0, -3.0)).unwrap();
    assert!((place - DVec2::new(24.0 + 4.0, 16.0 - 8.0)).length() < 1e-4, "{place}");
    let moved = motion(Some(place), then.pixel(DVec3::new(1.0, 2.0, -3.0)));
    assert!((moved - DVec2::new(-4.0, 0.0)).length() < 1e-4, "{moved}");
    assert!(now.pixel_of_direction(DVec3::Z).is_none());
}
