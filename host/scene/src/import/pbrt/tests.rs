use super::super::testing::{Memory, png};
use super::parse;
use crate::ImageSettings;
use crate::description::{
    Alpha, Conductor, ConductorFresnel, Description, Dielectric, Lambertian, MetallicRoughness,
    PunctualLight, RoughDielectric, ShapeKind, Sky, Surface, Texels,
};
use crate::error::SceneError;
use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DVec2, DVec3, Vec3};
use std::io::Write;

type Parsed = Result<(Description, ImageSettings), SceneError>;

/// Camera of a right-handed world, so that nothing is reflected.
const CAMERA: &str = "Scale -1 1 1\nCamera \"perspective\"\n";

fn read_with(text: &str, files: &[(&'static str, Vec<u8>)]) -> Parsed {
    parse(text.as_bytes(), "a.pbrt", &mut Memory(files.iter().cloned().collect()))
}

/// Reads a world.
fn world(content: &str) -> Description {
    read_with(&format!("{CAMERA}WorldBegin\n{content}"), &[]).unwrap().0
}

fn error(text: &str) -> String {
    read_with(text, &[]).unwrap_err().to_string()
}

fn surface(material: &str) -> Surface {
    world(&format!("{material} Shape \"sphere\"")).materials.last().unwrap().surface.clone()
}

#[test]
fn cameras_and_images_are_read() {
    let text = "Scale -1 1 1 LookAt 1 2 3  1 2 -5  0 1 0
        Camera \"perspective\" \"float fov\" 60 \"float lensradius\" [0.5] \"float focaldistance\" 2 # a comment
        Film \"rgb\" \"integer xresolution\" [80] \"integer yresolution\" [40] \"string filename\" \"a.exr\"
        Sampler \"halton\" \"integer pixelsamples\" 9 Integrator \"volpath\" \"integer maxdepth\" 7
        WorldBegin";
    let (scene, image) = read_with(text, &[]).unwrap();
    // pbrt counts scatterings, Trisect segments.
    assert_eq!((image.width, image.height, image.samples, image.depth), (80, 40, 9, 8));
    let camera = scene.cameras[0].1;
    assert!((camera.look_from - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12, "{}", camera.look_from);
    assert!((camera.look_at - DVec3::new(1.0, 2.0, 2.0)).length() < 1e-12 && camera.up == DVec3::Y);
    assert!((camera.vertical_fov - 60f64.to_radians()).abs() < 1e-12);
    assert!((camera.focus_distance * (0.5 * camera.defocus_angle).tan() - 0.5).abs() < 1e-12);
    assert!(scene.warnings.is_empty() && scene.notes.is_empty(), "{:?}", scene.warnings);
}

/// The angle of view is that of the shorter axis, and a window widens it.
#[test]
fn the_shorter_axis_has_the_angle() {
    let half = |more: &str, width: u32| {
        let text = format!(
            "Camera \"perspective\" \"float fov\" 40 {more} Film \"rgb\" \"integer xresolution\" {width} \
             \"integer yresolution\" 40 WorldBegin"
        );
        (0.5 * read_with(&text, &[]).unwrap().0.cameras[0].1.vertical_fov).tan() / 20f64.to_radians().tan()
    };
    assert!((half("", 80) - 1.0).abs() < 1e-12 && (half("", 20) - 2.0).abs() < 1e-12);
    assert!((half("\"float screenwindow\" [-1 1 -0.5 0.5]", 80) - 0.5).abs() < 1e-12);
}

/// Without the usual `Scale -1 1 1`, +x is at the right of a view along +z.
#[test]
fn left_handed_worlds_are_reflected() {
    let text = "Camera \"perspective\" WorldBegin Translate 1 0 5 Shape \"sphere\"
        LightSource \"point\" \"point3 from\" [1 0 0] Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";
    let (scene, _) = read_with(text, &[]).unwrap();
    let camera = scene.cameras[0].1;
    let right = (camera.look_at - camera.look_from).cross(camera.up);
    let ShapeKind::Sphere { center, .. } = scene.shapes[0].kind else { panic!() };
    assert!(center.dot(right) > 0.0 && center.z == 5.0, "{center} {right}");
    assert!(scene.lights[0].position().unwrap().dot(right) > 0.0);
    assert!(scene.instances[0].transform.matrix3.determinant() < 0.0);
    assert_eq!(scene.notes.len(), 1);
}

#[test]
fn transforms_and_scopes() {
    let scene = world(
        "Translate 1 0 0 CoordinateSystem \"here\" AttributeBegin Rotate 90 0 0 1 Scale 2 2 2 Translate 1 0 0
        Shape \"sphere\" AttributeEnd Shape \"sphere\" Identity Shape \"sphere\" CoordSysTransform \"here\" Shape \"sphere\"
        Transform [1 0 0 0  0 1 0 0  0 0 1 0  4 5 6 1] Shape \"sphere\"
        TransformBegin ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 1 1 1 1] Shape \"sphere\" TransformEnd Shape \"sphere\"",
    );
    let centers: Vec<DVec3> = scene
        .shapes
        .iter()
        .map(|shape| match shape.kind {
            ShapeKind::Sphere { center, .. } => center,
            _ => panic!(),
        })
        .collect();
    let want = [[1, 2, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0], [4, 5, 6], [5, 6, 7], [4, 5, 6]];
    assert_eq!(centers, want.map(|p| DVec3::from(p.map(f64::from))));
}

#[test]
fn materials_map_to_surfaces() {
    let rgb = "\"rgb reflectance\" [0.1 0.2 0.3]";
    assert_eq!(surface(&format!("Material \"diffuse\" {rgb}")), Lambertian::rgb(0.1, 0.2, 0.3).into());
    assert_eq!(
        surface("Material \"dielectric\" \"float eta\" 1.25"),
        Surface::Dielectric(Dielectric { ior: 1.25 })
    );
    let glass = surface("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\" \"float roughness\" 0.0625");
    let Surface::RoughDielectric(RoughDielectric { ior, roughness, multiple_scattering: false }) = glass
    else {
        panic!()
    };
    // alpha is the root of pbrt's roughness, the roughness here that of alpha.
    assert!((ior - 1.5168).abs() < 1e-12 && (roughness - 0.5).abs() < 1e-12);
    let rough = "\"float roughness\" 0.25 \"bool remaproughness\" false";
    let metal = surface(&format!(
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" {rough}"
    ));
    let Surface::Conductor(Conductor { fresnel: ConductorFresnel::Ior { eta, k }, roughness, .. }) = metal
    else {
        panic!()
    };
    assert!((eta.y - 0.375).abs() < 1e-3 && (k.x - 3.98).abs() < 0.01 && (roughness - 0.5).abs() < 1e-12);
    let mirror = surface("Material \"conductor\" \"rgb reflectance\" [0.5 0.6 0.7]");
    let Surface::Conductor(Conductor { fresnel: ConductorFresnel::Ior { eta, k }, .. }) = mirror else {
        panic!()
    };
    let normal = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
    assert!((normal - DVec3::new(0.5, 0.6, 0.7)).length() < 1e-9);
    let Surface::MetallicRoughness(plastic) =
        surface("Material \"coateddiffuse\" \"rgb reflectance\" [1 0.5 0]")
    else {
        panic!()
    };
    // Light that the coating sends back makes the base darker and more saturated.
    assert!(
        (plastic.base_color.x - 1.0).abs() < 1e-12 && plastic.base_color.y < 0.3 && plastic.metallic == 0.0
    );
    let Surface::MetallicRoughness(coated) = surface("Material \"coatedconductor\"") else { panic!() };
    assert!(coated.layers.coat.is_some() && coated.metallic == 1.0);
    let Surface::MetallicRoughness(leaf) = surface(
        "Material \"diffusetransmission\" \"rgb reflectance\" [0.2 0.2 0.2] \"rgb transmittance\" [0.6 0.3 0.3]",
    ) else {
        panic!()
    };
    let layer = leaf.layers.diffuse_transmission.unwrap();
    assert!((layer.share * layer.color - DVec3::new(0.6, 0.3, 0.3)).length() < 1e-12);
    assert!(((1.0 - layer.share) * leaf.base_color - DVec3::splat(0.2)).length() < 1e-12);
    let Surface::MetallicRoughness(MetallicRoughness { transmission: 1.0, .. }) =
        surface("Material \"thindielectric\"")
    else {
        panic!()
    };
    let named =
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [0 0 0] Material \"diffuse\"
        NamedMaterial \"a\"";
    assert_eq!(surface(named), Lambertian::rgb(0.0, 0.0, 0.0).into());
}

/// A spectrum may be in a file.
#[test]
fn spectra_are_read_from_files() {
    let files = [("g.spd", b"# reflectance\n300 0.25\n900 0.25\n".to_vec())];
    let shape = |name: &str| {
        format!(
            "{CAMERA}WorldBegin Material \"diffuse\" \"spectrum reflectance\" \"{name}\" Shape \"sphere\""
        )
    };
    let scene = read_with(&shape("g.spd"), &files).unwrap().0;
    let Surface::Lambertian(grey) = &scene.materials[0].surface else { panic!() };
    assert!((grey.albedo - 0.25).length() < 1e-9, "{}", grey.albedo);
    let wrong = [("g.spd", b"300 0.25\n200 0.25\n".to_vec())];
    assert!(read_with(&shape("g.spd"), &wrong).unwrap_err().to_string().contains("ascending wavelengths"));
}

#[test]
fn shapes_are_read() {
    let scene = world(
        "Shape \"disk\" \"float radius\" 2 \"float height\" 3 Shape \"disk\" \"float innerradius\" 0.5 Shape \"cylinder\"
        ReverseOrientation Shape \"sphere\" Shape \"sphere\" \"float zmax\" 0.5
        Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]
        Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 -1 0 0 -1 0 0 -1] \"point2 uv\" [0 0 1 0 0 1]",
    );
    assert!(matches!(scene.shapes[0].kind, ShapeKind::Disc { center, radius: 2.0, .. } if center.z == 3.0));
    // Only a sphere that shines inwards, or is hollow glass, must be a mesh.
    assert_eq!((scene.shapes.len(), scene.meshes.len()), (2, 6), "{:?}", scene.shapes);
    let mesh = scene.meshes.last().unwrap();
    let [a, b, c] = mesh.triangles[0].map(|corner| Vec3::from(mesh.positions[corner as usize]));
    // The front follows the normals, and both are reversed.
    assert!((b - a).cross(c - a).z > 0.0 && mesh.normals[0] == [0.0, 0.0, 1.0]);
    assert_eq!(mesh.uvs[..], [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    assert_eq!([3, 4].map(|mesh| scene.meshes[mesh].triangles.len()), [2, 512]);
    let lamp = "AreaLightSource \"diffuse\" ReverseOrientation Shape \"sphere\"";
    assert_eq!(world(lamp).meshes.len(), 1);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn meshes_of_compressed_files_are_read_once() {
    let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(ply).unwrap();
    let files = [("m.ply.gz", encoder.finish().unwrap())];
    let shape = "Shape \"plymesh\" \"string filename\" \"m.ply.gz\"";
    let text = format!("{CAMERA}WorldBegin {shape} Translate 1 0 0 {shape}");
    let scene = read_with(&text, &files).unwrap().0;
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!(scene.instances[1].transform.translation, DVec3::X);
}

#[test]
fn objects_are_placed_by_instances() {
    let scene = world(
        "Translate 1 0 0 ObjectBegin \"o\" Translate 0 1 0 Shape \"sphere\"
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ObjectEnd
        Identity Scale 2 2 2 ObjectInstance \"o\" ObjectInstance \"o\"",
    );
    assert_eq!((scene.shapes.len(), scene.meshes.len(), scene.instances.len()), (2, 1, 2));
    let ShapeKind::Sphere { center, radius } = scene.shapes[0].kind else { panic!() };
    assert_eq!((center, radius), (DVec3::new(2.0, 2.0, 0.0), 2.0));
}

#[test]
fn lights_are_read() {
    let scene = world(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"float scale\" 2 \"bool twosided\" true Shape \"sphere\"
        AttributeEnd Shape \"sphere\" LightSource \"point\" \"rgb I\" [1 1 1] \"float power\" 12.566370614359172
        LightSource \"distant\" \"point3 from\" [0 5 0] \"point3 to\" [0 0 0] \"blackbody L\" 6500 \"float scale\" 3
        LightSource \"spot\" \"point3 to\" [1 0 0] LightSource \"infinite\" \"rgb L\" [0.5 0.5 0.5]",
    );
    let [lamp, plain] = &scene.materials[..] else { panic!() };
    assert_eq!(
        (lamp.emission, lamp.emits_both_sides, plain.emission),
        (DVec3::new(2.0, 4.0, 6.0), true, DVec3::ZERO)
    );
    let [PunctualLight::Point { intensity, .. }, PunctualLight::Directional { direction, irradiance }, spot] =
        &scene.lights[..]
    else {
        panic!()
    };
    assert!((*intensity - 1.0).length() < 1e-12 && *direction == DVec3::NEG_Y);
    assert!((irradiance.dot(DVec3::new(0.2126, 0.7152, 0.0722)) - 3.0).abs() < 1e-9);
    assert!(matches!(spot, PunctualLight::Spot { direction, .. } if *direction == DVec3::X));
    assert!(matches!(scene.sky, Some(Sky::Gradient { top, .. }) if top == DVec3::splat(0.5)));
}

#[test]
fn textures_are_read() {
    let files = [("a.png", png(1, 2, &[[255, 0, 0, 255], [0, 255, 0, 255]]))];
    let text = format!(
        "{CAMERA}WorldBegin Texture \"i\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\" \"float vscale\" 2
        Texture \"s\" \"spectrum\" \"scale\" \"texture tex\" \"i\" \"float scale\" 0.5
        Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 0 1] \"float uscale\" 8
        Texture \"a\" \"float\" \"constant\" \"float value\" 0.25
        Material \"diffuse\" \"texture reflectance\" \"s\" Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]
        Material \"diffuse\" \"texture reflectance\" \"c\" Shape \"sphere\" \"texture alpha\" \"a\""
    );
    let scene = read_with(&text, &files).unwrap().0;
    let Surface::Lambertian(image) = &scene.materials[0].surface else { panic!() };
    assert_eq!(image.albedo, DVec3::splat(0.5));
    // v = 0 of pbrt is at the bottom of the image, and 1 of the mesh here.
    let map = image.texture.as_ref().unwrap().transform;
    assert!((map.transform_point2(DVec2::new(0.5, 1.0)) - DVec2::new(0.5, 1.0)).length() < 1e-12);
    assert!((map.transform_point2(DVec2::new(0.5, 0.75)) - DVec2::new(0.5, 0.5)).length() < 1e-12);
    let Surface::Lambertian(checks) = &scene.materials[1].surface else { panic!() };
    let use_ = checks.texture.as_ref().unwrap();
    let Texels::Float(texels) = &scene.images[use_.image].texels else { panic!() };
    // (s, t) = (0.5, 0.5) is in the first field of both.
    let place = use_.transform.transform_point2(DVec2::new(0.5 / 8.0, 0.5));
    assert!((place - DVec2::new(0.25, 0.25)).length() < 1e-12 && texels[0] == [1.0, 0.0, 0.0, 1.0]);
    assert_eq!((scene.materials[1].opacity, scene.materials[1].alpha), (0.25, Alpha::Blend));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn media_and_attributes() {
    let scene = world(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [3 3 3] \"float g\" 0.5
        Attribute \"shape\" \"float radius\" 3 AttributeBegin MediumInterface \"fog\" \"\" Material \"interface\" Shape \"sphere\"
        AttributeEnd Material \"interface\" Shape \"sphere\" Material \"diffuse\" Shape \"sphere\" \"float radius\" 1",
    );
    assert_eq!((scene.media[0].extinction, scene.media[0].albedo), (DVec3::splat(4.0), DVec3::splat(0.75)));
    let radius = |index: usize| match scene.shapes[index].kind {
        ShapeKind::Sphere { radius, .. } => radius,
        _ => panic!(),
    };
    assert_eq!((scene.shapes.len(), radius(0), radius(1)), (2, 3.0, 1.0));
    assert_eq!(scene.materials[0].medium, Some(0));
    scene.check().unwrap();
}

#[test]
fn what_is_not_modelled_is_named_once() {
    let scene = world(
        "Material \"hair\" Shape \"sphere\" Material \"hair\" Shape \"sphere\" Shape \"curve\"
        LightSource \"goniometric\" LightSource \"infinite\" \"string shine\" \"a\"",
    );
    let count = |word: &str| scene.warnings.iter().filter(|warning| warning.contains(word)).count();
    assert_eq!(
        [count("hair"), count("curve"), count("goniometric"), count("shine")],
        [1; 4],
        "{:?}",
        scene.warnings
    );
    assert!(
        scene.warnings.iter().any(|w| w.contains("hair") && w.contains("a.pbrt: line 4")),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn errors_have_a_place_and_a_remedy() {
    for (text, place, words) in [
        ("WorldBegin\nShape \"sphere\" \"float radius\" x", "a.pbrt:2:31", "a finite number"),
        ("WorldBegin Shapes", "a.pbrt:1:12", "unknown directive \"Shapes\""),
        ("WorldBegin NamedMaterial \"m\"", "a.pbrt:1:12", "MakeNamedMaterial must define it"),
        ("WorldBegin Shape \"sphere\" \"radius\" 1", "a.pbrt:1:27", "a type and a name"),
        ("WorldBegin Shape \"sphere\" \"float radius\" [1 2]", "a.pbrt:1:27", "needs one number"),
        ("WorldBegin AttributeBegin", "a.pbrt:1:12", "has no AttributeEnd"),
        ("WorldBegin AttributeEnd", "a.pbrt:1:12", "no AttributeBegin"),
        ("WorldBegin Shape \"sphere", "a.pbrt:1:18", "no end"),
        ("Shape \"sphere\"", "a.pbrt:1:1", "must stand after WorldBegin"),
        ("Scale 1 0 1 Camera \"perspective\" WorldBegin", "a.pbrt:1:13", "flattens"),
        ("LookAt 1 2 3 1 2 3 0 1 0", "a.pbrt:1:1", "the same"),
        ("Translate 1 2", "a.pbrt:1:1", "the file ends"),
        ("Film \"rgb\" \"integer xresolution\" 0", "a.pbrt:1:12", "from 1"),
        (
            "WorldBegin Shape \"trianglemesh\" \"point P\" [0 0 0] \"integer indices\" [0 1 2]",
            "a.pbrt:1:12",
            "from 0 to 0",
        ),
        ("Include \"none.pbrt\"", "a.pbrt: line 1", "cannot read \"none.pbrt\""),
        ("Camera \"perspective\"", "a.pbrt:1:", "no WorldBegin"),
    ] {
        let error = error(text);
        assert!(error.contains(place) && error.contains(words), "{text}: {error}");
    }
    let itself = [("b.pbrt", b"\n Include \"b.pbrt\"".to_vec())];
    let error = read_with("Include \"b.pbrt\"", &itself).unwrap_err().to_string();
    assert!(error.contains("b.pbrt:2:2") && error.contains("include each other"), "{error}");
    let wrong = [("b.pbrt", b"\n\nShapes".to_vec())];
    let error = read_with("Include \"b.pbrt\"", &wrong).unwrap_err().to_string();
    assert!(error.contains("b.pbrt:3:1"), "{error}");
}

/// Small files that stand for much are refused.
#[test]
fn hostile_files_are_refused() {
    let many = format!(
        "WorldBegin ObjectBegin \"o\" {} ObjectEnd {}",
        "Shape \"sphere\" ".repeat(3000),
        "ObjectInstance \"o\" ".repeat(3000)
    );
    assert!(error(&many).contains("too much memory"));
    assert!(error(&"AttributeBegin ".repeat(2000)).contains("nested too deeply"));
    assert!(error(&format!("WorldBegin {}", "Scale 1e200 1 1 ".repeat(4))).contains("beyond all numbers"));
    let twice = b"Include \"c.pbrt\" Include \"c.pbrt\" Include \"c.pbrt\" Include \"c.pbrt\"".to_vec();
    let files = [("b.pbrt", b"Include \"b.pbrt\"".to_vec()), ("c.pbrt", [twice.clone(), twice].concat())];
    let error = read_with("Include \"c.pbrt\"", &files).unwrap_err().to_string();
    assert!(error.contains("include"), "{error}");
}
