use super::super::CameraPose;
use super::super::description::{
    Alpha, Conductor, Instance, Lambertian, Mesh, MetallicRoughness, PunctualLight, RoughDielectric, Surface,
    Texels,
};
use super::*;
use crate::description::TextureImage;
use crate::import::ModelOptions;
use crate::medium::DensityGrid;
use glam::DAffine3;
use std::path::Path;
use std::sync::Arc;
use trisect_image::Image;

/// Stands for the file system; records the files that were requested.
#[derive(Default)]
struct Files {
    asked: Vec<String>,
}

impl Files {
    fn ask(&mut self, path: &Path) -> Result<(), SceneError> {
        self.asked.push(path.display().to_string());
        if path.ends_with("missing.glb") || path.ends_with("missing.png") || path.ends_with("missing.hdr") {
            let source = std::io::Error::new(std::io::ErrorKind::NotFound, "no such file");
            return Err(SceneError::Read { path: path.to_owned(), source });
        }
        Ok(())
    }
}

impl Loader for Files {
    fn model(&mut self, path: &Path, _: &ModelOptions) -> Result<Description, SceneError> {
        self.ask(path)?;
        let texture = TextureUse {
            image: 0,
            wrap: [Wrap::Clamp; 2],
            filter: Filter::Linear,
            transform: DAffine2::IDENTITY,
            second_uvs: false,
        };
        let texture = || Some(texture.clone());
        let material = |name: &str| {
            let surface = MetallicRoughness {
                texture: texture(),
                metallic_roughness_texture: texture(),
                transmission_texture: texture(),
                ..MetallicRoughness::default()
            };
            Material { emission_texture: texture(), ..Material::from(surface) }.named(name)
        };
        let mesh = |material| Mesh { material, ..Mesh::default() };
        let camera = CameraPose { vertical_fov: 1.0, focus_distance: 2.0, ..CameraPose::PINHOLE };
        Ok(Description {
            cameras: vec![("front".to_owned(), camera), ("back".to_owned(), camera)],
            materials: vec![material("first"), material("second")],
            images: vec![self.texture(path, true)?],
            meshes: vec![mesh(1), mesh(0)],
            instances: vec![
                Instance { mesh: 1, transform: DAffine3::from_translation(DVec3::X) },
                Instance { mesh: 0, transform: DAffine3::from_scale(DVec3::ZERO) },
            ],
            lights: vec![PunctualLight::Directional { direction: DVec3::X, irradiance: DVec3::ONE }],
            warnings: vec![format!("{}: no animations", path.display())],
            ..Description::default()
        })
    }

    fn panorama(&mut self, path: &Path) -> Result<Arc<Image>, SceneError> {
        self.ask(path)?;
        Ok(Arc::new(Image { width: 1, height: 1, pixels: vec![[1.0; 3]] }))
    }

    fn density(&mut self, path: &Path) -> Result<Arc<DensityGrid>, SceneError> {
        self.ask(path)?;
        let grid = DensityGrid::new([1, 1, 1], vec![2.0]);
        Ok(Arc::new(grid.unwrap_or_else(|error| panic!("{error}"))))
    }

    fn texture(&mut self, path: &Path, linear: bool) -> Result<Arc<TextureImage>, SceneError> {
        self.ask(path)?;
        let texels = vec![[255; 4]];
        let texels = if linear { Texels::Linear8(texels) } else { Texels::Srgb8(texels) };
        Ok(Arc::new(TextureImage { name: path.display().to_string(), width: 1, height: 1, texels }))
    }

    fn image_in_memory(&self, name: &str) -> Option<Arc<TextureImage>> {
        let texels = Texels::Srgb8(vec![[7; 4]]);
        (name == "memory.png").then(|| TextureImage::new(1, 1, texels).named(name).into())
    }
}

const CAMERA: &str = "camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 90),";

fn with(camera: &str, rest: &str) -> (Result<(Description, ImageSettings), SceneError>, Vec<String>) {
    let text = format!("Scene(version: 1, image: (width: 8, height: 4, depth: 3),\n{camera}\n{rest})");
    let mut files = Files::default();
    let result =
        format::parse(&text, "s.ron").and_then(|file| describe(&file, &Folder::new("at".into()), &mut files));
    (result, files.asked)
}

fn scene(rest: &str) -> Description {
    with(CAMERA, rest).0.unwrap().0
}

#[test]
fn settings_camera_and_sky() {
    let (result, _) = with(CAMERA, "fresnel: Schlick, materials: {}, objects: []");
    let (scene, settings) = result.unwrap();
    let expected = ImageSettings { width: 8, height: 4, samples: 64, depth: 3, fresnel: Fresnel::Schlick };
    assert_eq!(settings, expected);
    assert_eq!(scene.cameras[0].1.look_from, DVec3::new(0.0, 0.0, 3.0));
    assert_eq!(scene.cameras[0].1.vertical_fov, 90f64.to_radians());
    assert!(scene.sky.is_none());

    let rest = "sky: Uniform(radiance: (1, 2, 3)), materials: {}, objects: []";
    let grey = DVec3::new(1.0, 2.0, 3.0);
    assert!(
        matches!(self::scene(rest).sky, Some(Sky::Gradient { bottom, top }) if bottom == grey && top == grey)
    );
    let rest = "sky: Image(file: \"a.exr\", rotation: 180), materials: {}, objects: []";
    let (result, asked) = with(CAMERA, rest);
    let sky = result.unwrap().0.sky;
    assert!(matches!(sky, Some(Sky::Image { scale: 1.0, rotation: std::f64::consts::PI, .. })), "{sky:?}");
    assert_eq!(asked, ["at/a.exr"]);
}

#[test]
fn materials() {
    let scene = scene(
        r#"materials: {
            "a": Emissive(radiance: (1, 2, 3), two_sided: true),
            "b": MetallicRoughness(),
            "c": MetallicRoughness(opacity: 0.5),
            "d": MetallicRoughness(opacity: 0.5, alpha_cutoff: 0.25),
            "e": Conductor(fresnel: Schlick(reflectance: (0.5, 0.6, 0.7)), roughness: 0.5),
            "f": RoughDielectric(ior: 1.25, roughness: 0.5),
        }, objects: []"#,
    );
    let m = &scene.materials;
    assert_eq!(m[0].surface, Lambertian::rgb(0.0, 0.0, 0.0).into());
    assert!(m[0].emits_both_sides && m[0].emission == DVec3::new(1.0, 2.0, 3.0));
    assert_eq!((m[1].alpha, m[1].opacity), (Alpha::Opaque, 1.0));
    assert_eq!(m[1].surface, MetallicRoughness::default().into());
    assert_eq!((m[2].alpha, m[3].alpha), (Alpha::Blend, Alpha::Mask { cutoff: 0.25 }));
    assert_eq!(m[4].surface, Conductor::schlick([0.5, 0.6, 0.7], 0.5).into());
    assert_eq!(m[5].surface, RoughDielectric::new(1.25, 0.5).into());
    assert_eq!(m[5].name, "f");
}

#[test]
fn textures_are_read_once_for_each_meaning() {
    let (result, asked) = with(
        CAMERA,
        r#"textures: {
            "a": (file: "t.png"),
            "b": (file: "t.png", wrap: Clamp, offset: (0, 1), scale: (0.5, 0.5), rotation: 90),
            "c": (file: "t.png", color_space: Linear, filter: Nearest),
        },
        materials: {
            "m": MetallicRoughness(texture: "b", metallic_roughness_texture: "c", emission_texture: "a"),
        }, objects: []"#,
    );
    let scene = result.unwrap().0;
    assert_eq!((asked, scene.images.len()), (vec!["at/t.png".to_owned(); 2], 2));
    assert!(matches!(scene.images[1].texels, Texels::Linear8(_)));
    let Surface::MetallicRoughness(surface) = &scene.materials[0].surface else { panic!() };
    let base = surface.texture.as_ref().unwrap();
    assert_eq!((base.image, base.wrap, base.filter), (0, [Wrap::Clamp; 2], Filter::Linear));
    // Example of KHR_texture_transform: the lower left quadrant, turned clockwise by 90 degrees.
    let image = |u, v| base.transform.transform_point2(DVec2::new(u, v));
    assert_eq!([image(0.0, 0.0), image(1.0, 0.0)], [DVec2::new(0.0, 1.0), DVec2::new(0.0, 0.5)]);
    assert_eq!(image(1.0, 1.0), DVec2::new(0.5, 0.5));
    assert!(scene.warnings[0].contains("emission_texture has no effect"), "{:?}", scene.warnings);
}

#[test]
fn shapes_and_lights() {
    let scene = scene(
        r#"materials: { "x": Dielectric(ior: 1.5), "y": Emissive(radiance: (1, 1, 1)) },
        objects: [
            Quad(corner: (1, 2, 3), u: (1, 0, 0), v: (0, 1, 0), material: "y"),
            Plane(point: (0, 1, 0), normal: (0, 5, 0), material: "x"),
            Box(min: (0, 0, 0), max: (1, 1, 1), material: "y"),
            Disc(center: (0, 1, 0), normal: (0, 0, 1e-200), radius: 2, material: "x"),
        ],
        lights: [
            Spot(position: (1, 2, 3), direction: (0, -2, 0), intensity: (1, 2, 3)),
            Directional(direction: (2, 0, 0), irradiance: (1, 2, 3)),
        ]"#,
    );
    assert_eq!(scene.shapes.len(), 9);
    assert!(scene.shapes.iter().map(|shape| shape.material).eq([1, 0, 1, 1, 1, 1, 1, 1, 0]));
    let plane = ShapeKind::Disc { center: DVec3::Y, normal: DVec3::Y, radius: 1e18 };
    assert_eq!(scene.shapes[1].kind, plane);
    assert_eq!(scene.shapes[8].kind, ShapeKind::Disc { center: DVec3::Y, normal: DVec3::Z, radius: 2.0 });
    let (position, intensity) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 3.0));
    let outer = std::f64::consts::FRAC_PI_4;
    let spot = PunctualLight::Spot { position, direction: DVec3::NEG_Y, intensity, inner: 0.0, outer };
    assert_eq!(scene.lights[0], spot);
    assert_eq!(scene.lights[1], PunctualLight::Directional { direction: DVec3::X, irradiance: intensity });
}

#[test]
fn a_model_is_read_once_and_stands_often() {
    let (result, asked) = with(
        CAMERA,
        r#"textures: { "t": (file: "t.png") }, materials: { "red": Lambertian(albedo: (1, 0, 0), texture: "t") },
        objects: [
            Mesh(file: "m.glb", material: "red"),
            Mesh(file: "m.glb", transform: [Scale(2), RotateZ(90)]),
            Mesh(file: "m.glb", transform: [Translate((0, 0, 1))], material: "red"),
            Mesh(file: "n.obj"),
            Mesh(file: "o.ply", material: "red"),
        ]"#,
    );
    let scene = result.unwrap().0;
    assert_eq!(asked.iter().filter(|path| *path == "at/m.glb").count(), 2, "the model and its image");
    // red, two of m, two of n; the materials of o are never seen.
    let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["red", "first", "second", "first", "second"]);
    assert_eq!(scene.images.len(), 3);
    let of_n = &scene.materials[3];
    assert_eq!(of_n.textures().map(|(texture, _)| texture.image).collect::<Vec<_>>(), [2; 4]);
    // m in red, m in its own materials, n, o in red.
    let materials: Vec<usize> = scene.meshes.iter().map(|mesh| mesh.material).collect();
    assert_eq!(materials, [0, 0, 2, 1, 4, 3, 0, 0]);
    let meshes: Vec<usize> = scene.instances.iter().map(|instance| instance.mesh).collect();
    assert_eq!(meshes, [1, 3, 1, 5, 7]);
    let origin = |index: usize| scene.instances[index].transform.translation;
    assert_eq!([origin(0), origin(1)], [DVec3::X, DVec3::new(0.0, 2.0, 0.0)]);
    assert_eq!(origin(2), DVec3::new(1.0, 0.0, 1.0));
    // For each file, its own warning and one about the mesh that is scaled to nothing.
    assert_eq!(scene.warnings.len(), 6);
    assert_eq!(scene.warnings.iter().filter(|warning| warning.contains("no animations")).count(), 3);
    assert!(
        scene.warnings.contains(&"n.obj: 1 instances of meshes are scaled to nothing: left out".to_owned())
    );
    assert_eq!(scene.lights.len(), 5);
    assert_eq!(scene.lights[1], PunctualLight::Directional { direction: DVec3::Y, irradiance: DVec3::ONE });
    // The scene file's own camera comes first.
    assert_eq!((scene.cameras.len(), scene.cameras[0].0.as_str()), (11, "camera"));
}

#[test]
fn a_model_may_bring_the_camera() {
    let rest = "materials: {}, objects: [Mesh(file: \"m.glb\", transform: [Scale(3), Translate((0, 1, 0))])]";
    let scene = with("", rest).0.unwrap().0;
    let (name, camera) = &scene.cameras[0];
    assert_eq!((name.as_str(), camera.look_from, camera.focus_distance), ("front", DVec3::Y, 6.0));
    assert_eq!(camera.look_at, DVec3::new(0.0, 1.0, -3.0));
    let error = with("", "materials: {}, objects: []").0.expect_err("no camera").to_string();
    assert!(error.contains("no camera") && error.starts_with("s.ron: "), "{error}");
}

#[test]
fn faults_in_other_files_are_placed() {
    for (rest, place) in [
        (
            "materials: {},\nobjects: [Mesh(file: \"missing.glb\")]",
            "s.ron:4:22: at/missing.glb: no such file",
        ),
        (
            "textures: { \"a\": (file: \"missing.png\") }, materials: {}, objects: []",
            "s.ron:3:25: at/missing.png",
        ),
        ("sky: Image(file: \"missing.hdr\"), materials: {}, objects: []", "s.ron:3:18: at/missing.hdr"),
        (
            "materials: {}, objects: [Mesh(file: \"m.glb\", transform: [Scale(1e18), Translate((1e18, 0, 0))])]",
            "s.ron:3:37: \"m.glb\" with this transform",
        ),
    ] {
        let error = with(CAMERA, rest).0.expect_err(rest).to_string();
        assert!(error.starts_with(place), "{error}");
    }
}

/// Returns the contents of a page's fences that begin with the line `start`.
fn fences<'a>(page: &'a str, start: &str) -> Vec<&'a str> {
    page.split(start).skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

/// Returns a scene of whole top-level fields, with the required fields that they lack.
fn completed(fields: &str) -> String {
    let required = ["version: 1,", "image: (width: 8, height: 8),", CAMERA, "materials: {},", "objects: [],"];
    let is_missing = |line: &&str| {
        let name = line.split_inclusive(':').next().unwrap();
        !fields.lines().any(|field| field.starts_with(name))
    };
    let missing: Vec<&str> = required.into_iter().filter(is_missing).collect();
    format!("Scene(\n{}\n{fields})", missing.join("\n"))
}

/// Complete scenes (`ron` fences) and fields of scenes (`ron fragment` fences) in the reference of
/// the scene format, and its example of an error.
#[test]
fn the_documented_scenes_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/scene-format");
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let mut counts = [0; 2];
    for entry in std::fs::read_dir(&folder).unwrap() {
        let page = entry.unwrap().file_name().into_string().unwrap();
        if !page.ends_with(".md") {
            continue;
        }
        let content = text(&page);
        let complete = fences(&content, "```ron\n").into_iter().map(str::to_owned);
        let fragments = fences(&content, "```ron fragment\n").into_iter().map(completed);
        for (kind, scene) in complete.map(|scene| (0, scene)).chain(fragments.map(|scene| (1, scene))) {
            let described = format::parse(&scene, &page)
                .and_then(|file| describe(&file, &Folder::new("at".into()), &mut Files::default()));
            described.unwrap_or_else(|error| panic!("{error}\n{scene}"));
            counts[kind] += 1;
        }
    }
    assert!(counts[0] >= 1 && counts[1] >= 20, "complete scenes and fragments: {counts:?}");

    let overview = text("README.md");
    let minimal = fences(&overview, "```ron\n")[0];
    assert_eq!(minimal, text("pictures/minimal.ron"));
    // The page shows the message of the program.
    let limits = text("errors-and-limits.md");
    let example = fences(&limits, "```text\nerror: ")[0];
    let broken = minimal.replacen("material: \"glass\"", "material: \"glas\"", 1);
    let error = format::parse(&broken, "scene.ron").expect_err("unknown").to_string();
    assert_eq!(error, example.trim_end());
}

/// Each material but `Emissive` may emit, and have opacity.
#[test]
fn materials_share_fields() {
    let scene = scene(
        r#"materials: {
            "lit": Lambertian(emission: (1, 2, 3), albedo: (0.5, 0.5, 0.5), two_sided: true),
            "thin": Metal(opacity: 0.25, albedo: (1, 1, 1)),
            "cut": Conductor(fresnel: Schlick(reflectance: (1, 1, 1)), alpha_cutoff: 0.5, roughness: 0),
        }, objects: []"#,
    );
    let [lit, thin, cut] = &scene.materials[..] else { panic!() };
    assert_eq!(lit.surface, Lambertian::rgb(0.5, 0.5, 0.5).into());
    assert_eq!(
        (lit.emission, lit.emits_both_sides, lit.alpha),
        (DVec3::new(1.0, 2.0, 3.0), true, Alpha::Opaque)
    );
    assert_eq!((thin.opacity, thin.alpha), (0.25, Alpha::Blend));
    assert_eq!((cut.opacity, cut.alpha), (1.0, Alpha::Mask { cutoff: 0.5 }));
    for (fields, message) in [
        ("albedo: (0, 0, 0), opacity: 1, opacity: 1", "opacity"),
        ("albedo: (0, 0, 0), opacity: 2", "2 is not between 0 and 1"),
        ("albedo: (0, 0, 0), fuzz: 1", "fuzz"),
        ("emission: (0, 0, 0)", "albedo"),
    ] {
        let (result, _) = with(CAMERA, &format!("materials: {{\n\"a\": Lambertian({fields})}}, objects: []"));
        let error = result.unwrap_err().to_string();
        assert!(
            error.contains(message) && error.contains("Lambertian") || error.contains("between"),
            "{error}"
        );
    }
}

/// A texture whose file is in memory is not read, and has the encoding of the scene file.
#[test]
fn images_in_memory_stand_for_files() {
    let rest = r#"textures: {
        "a": (file: "memory.png"),
        "b": (file: "memory.png", color_space: Linear),
        "c": (file: "memory.png", wrap: Clamp),
        "d": (file: "./memory.png"),
    }, materials: {}, objects: []"#;
    let (result, asked) = with(CAMERA, rest);
    let images = result.unwrap().0.images;
    assert_eq!(images.len(), 3);
    assert_eq!(images[0].texels, Texels::Srgb8(vec![[7; 4]]));
    assert_eq!(images[1].texels, Texels::Linear8(vec![[7; 4]]));
    // Negative control: another name is that of a file.
    assert_eq!(images[2].texels, Texels::Srgb8(vec![[255; 4]]));
    assert_eq!(asked.len(), 1, "{asked:?}");
}
