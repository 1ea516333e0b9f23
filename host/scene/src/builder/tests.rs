#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use super::*;

/// A scene of each kind of part.
fn whole() -> SceneBuilder {
    let mut scene = SceneBuilder::new();
    let grey = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
    let metal = scene.material(Metal { albedo: DVec3::ONE, fuzz: 0.25 });
    let glass = scene.material(Dielectric { ior: 1.5 });
    let frosted = scene.material(RoughDielectric::new(1.5, 0.5));
    let brass = scene.material(Conductor::schlick([0.9, 0.7, 0.3], 0.25));
    let lamp = scene.material(Emissive::rgb(4.0, 4.0, 4.0));
    scene.plane([0.0; 3], [0.0, 2.0, 0.0], grey).sphere([0.0, 1.0, 0.0], 0.5, metal);
    scene.sphere([1.0, 1.0, 0.0], 0.5, glass).sphere([2.0, 1.0, 0.0], 0.5, frosted);
    scene.disc([3.0, 1.0, 0.0], [0.0, 0.0, 3.0], 0.5, brass);
    scene.quad([0.0, 4.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], lamp);
    let triangle = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let mesh = scene.mesh(triangle, grey);
    scene.instance(mesh, DAffine3::from_translation(DVec3::Y)).instance(mesh, DAffine3::IDENTITY);
    scene.light(PunctualLight::Point { position: DVec3::Y, intensity: DVec3::ONE });
    scene.sky(Gradient::new([0.0; 3], [1.0; 3]));
    scene.camera(Camera::look_at([0.0, 1.0, 5.0], [0.0, 1.0, 0.0]).lens_degrees(1.0, 4.0));
    scene
}

#[test]
fn a_whole_scene() {
    let scene = whole().build().unwrap();
    assert_eq!((scene.spheres.len(), scene.flats.len(), scene.triangles.len()), (3, 3, 2));
    assert_eq!((scene.materials.len(), scene.lights.len()), (6, 1));
    assert_eq!(scene.camera.focus_distance, 4.0);
}

/// The message is about the points that the caller gave, not about a distance that follows.
#[test]
fn a_camera_looks_somewhere() {
    let mut scene = whole();
    scene.camera(Camera::look_at([1.0; 3], [1.0; 3]));
    let error = scene.build().unwrap_err().to_string();
    assert!(error.contains("look_from") && error.contains("look_at"), "{error}");
}

/// A scene file of the same content has the same records.
#[test]
fn a_scene_file_is_the_same() {
    let mut scene = SceneBuilder::new();
    let glass = scene.material(Dielectric { ior: 1.5 });
    scene.sphere([0.0, 0.5, 0.0], 0.5, glass).sky(Gradient::new([1.0; 3], [0.5, 0.7, 1.0]));
    scene.camera(Camera::look_at([0.0, 1.0, 4.0], [0.0, 0.5, 0.0]).fov_degrees(35.0));
    let text = r#"Scene(
        version: 1,
        camera: (look_from: (0, 1, 4), look_at: (0, 0.5, 0), vertical_fov: 35),
        image: (width: 8, height: 4, samples: 1, depth: 3),
        sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
        materials: {"glass": Dielectric(ior: 1.5)},
        objects: [Sphere(center: (0, 0.5, 0), radius: 0.5, material: "glass")],
    )"#;
    let (built, read) = (scene.build().unwrap(), Scene::parse(text, "test").unwrap());
    assert_eq!(
        format!("{:?}{:?}", built.spheres, built.materials),
        format!("{:?}{:?}", read.spheres, read.materials)
    );
    assert_eq!(
        (built.camera.look_from, built.camera.vertical_fov),
        (read.camera.look_from, read.camera.vertical_fov)
    );
}

/// Each number out of range is refused, and named.
#[test]
fn what_is_out_of_range_is_named() {
    type Change = fn(&mut SceneBuilder);
    let changes: [(&str, Change); 14] = [
        ("material \"0\": albedo: 1.5 is not between", |s| {
            s.description.materials[0].surface = Lambertian::rgb(0.5, 1.5, 0.5).into()
        }),
        ("material \"1\": fuzz: NaN", |s| {
            s.description.materials[1].surface = Metal { albedo: DVec3::ONE, fuzz: f64::NAN }.into()
        }),
        ("material \"2\": ior: 0 ", |s| s.description.materials[2].surface = Dielectric { ior: 0.0 }.into()),
        ("material \"5\": emission: -1", |s| s.description.materials[5].emission.x = -1.0),
        ("shape 1, a sphere of \"1\": radius: -0.5", |s| {
            s.description.shapes[1].kind = ShapeKind::Sphere { center: DVec3::ZERO, radius: -0.5 };
        }),
        ("shape 1, a sphere of \"1\": centre: inf", |s| {
            s.description.shapes[1].kind = ShapeKind::Sphere { center: DVec3::INFINITY, radius: 1.0 };
        }),
        ("normal: (0, 0, 0) is not a direction", |s| {
            let grey = MaterialId(0);
            s.disc([0.0; 3], [0.0; 3], 1.0, grey);
        }),
        ("parallel", |s| {
            s.quad([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], MaterialId(0));
        }),
        ("a triangle has the vertices [0, 1, 7], but there are 3", |s| {
            s.description.meshes[0].triangles[0][2] = 7
        }),
        ("a vertex at (NaN", |s| s.description.meshes[0].positions[0][0] = f32::NAN),
        ("flattens", |s| {
            s.description.instances[0].transform = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))
        }),
        ("lights[0]: strength", |s| {
            s.description.lights[0] = PunctualLight::Point { position: DVec3::ZERO, intensity: DVec3::NAN };
        }),
        ("the sky: radiance: -1", |s| {
            s.sky(Gradient::new([-1.0, 0.0, 0.0], [0.0; 3]));
        }),
        ("no camera", |s| s.description.cameras.clear()),
    ];
    for (message, change) in changes {
        let mut scene = whole();
        change(&mut scene);
        match scene.build() {
            Err(error) => assert!(error.to_string().contains(message), "{message}: {error}"),
            Ok(_) => panic!("{message} is accepted"),
        }
    }
}

/// A material of another builder is no index of this one.
#[test]
fn materials_of_others_are_refused() {
    let mut scene = SceneBuilder::new();
    scene.sphere([0.0; 3], 1.0, MaterialId(3)).camera(Camera::look_at([0.0, 0.0, 4.0], [0.0; 3]));
    let error = scene.build().unwrap_err().to_string();
    assert!(error.contains("material 3 of 0 is used"), "{error}");
}

/// Returns a scene of a textured square. The texture is an image in memory, or that of a file.
fn textured(image: TextureImage) -> Scene {
    let mut scene = SceneBuilder::new();
    let texture = Some(scene.texture(image));
    let paint = scene.material(Lambertian { texture, ..Lambertian::rgb(1.0, 1.0, 1.0) });
    let square = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        uvs: vec![[0.0; 2], [1.0, 0.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let square = scene.mesh(square, paint);
    scene.instance(square, DAffine3::IDENTITY).camera(Camera::look_at([0.0, 0.0, 4.0], [0.0; 3]));
    scene.build().unwrap()
}

/// An image in memory gives the records of a PNG file with these texels.
#[test]
fn an_image_in_memory_is_that_of_a_file() {
    let mut texels = [[1, 2, 3, 255], [4, 5, 6, 128]];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    std::fs::write(&path, crate::import::testing::png(2, 1, &texels)).unwrap();
    let linear = |texels: &[[u8; 4]]| textured(TextureImage::new(2, 1, Texels::Linear8(texels.to_vec())));
    let file = textured(crate::import::texture(&path, true).unwrap());
    assert_eq!(linear(&texels).digest(), file.digest());
    // Negative controls: other encoding, other texel.
    let srgb = textured(TextureImage::new(2, 1, Texels::Srgb8(texels.to_vec())));
    assert_ne!(srgb.digest(), file.digest());
    assert_eq!(srgb.digest(), textured(crate::import::texture(&path, false).unwrap()).digest());
    texels[1][2] = 7;
    assert_ne!(linear(&texels).digest(), file.digest());
}

#[test]
fn images_out_of_range_are_named() {
    let float = |texels: &[[f32; 4]]| TextureImage::new(1, 1, Texels::Float(texels.to_vec()));
    for (image, message) in [
        (float(&[[0.5, f32::NAN, 0.5, 1.0]]), "image \"0\": texel 0 has NaN in channel 1"),
        (float(&[[0.5, 0.5, f32::INFINITY, 1.0]]), "texel 0 has inf in channel 2"),
        (float(&[[-0.5, 0.5, 0.5, 1.0]]), "has -0.5 in channel 0; it must be from 0 to 65,504"),
        (float(&[[0.5, 0.5, 0.5, 65505.0]]), "has 65505 in channel 3"),
        (float(&[]), "image \"0\": 1 x 1 texels, but 0 are given"),
        (TextureImage::new(0, 0, Texels::Srgb8(Vec::new())).named("none"), "image \"none\": 0 x 0 texels"),
    ] {
        let mut scene = whole();
        scene.texture(image);
        let error = scene.build().unwrap_err().to_string();
        assert!(error.contains(message), "{message}: {error}");
    }
    let mut scene = whole();
    scene.texture(float(&[[0.0, 1.0, 65504.0, 1.0]]));
    assert!(scene.build().is_ok());
}
