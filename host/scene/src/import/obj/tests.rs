//! Tests of whole OBJ files.

use super::super::testing::{FAR, Memory, ROUNDED, error_in_space, far_vertices, png, rounded_in_world};
use super::*;
use crate::description::{
    Alpha, Conductor, ConductorFresnel, Dielectric, Lambertian, Material, MetallicRoughness, Surface, Texels,
};
use crate::import::NoFiles;
use glam::{DVec2, DVec3};

fn read(text: &str) -> Description {
    parse(text.as_bytes(), "a.obj", &mut NoFiles).unwrap()
}

fn error(text: &str) -> String {
    parse(text.as_bytes(), "a.obj", &mut NoFiles).unwrap_err().to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvn 0 0 2\n";

#[test]
fn polygons_become_fans_and_corners_vertices() {
    let scene = read(&format!("# square\n{SQUARE}o one\nf 1/1/1 2/2/1 \\\n3/2/1 -1/1/-1 # end\r\n"));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.name, "one");
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
    assert_eq!(mesh.uvs, [[0.0, 1.0], [1.0, 0.75], [1.0, 0.75], [0.0, 1.0]]);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4]);
    assert_eq!(scene.materials[0].surface, Lambertian::rgb(0.8, 0.8, 0.8).into());
    assert_eq!((scene.instances.len(), scene.warnings.len()), (1, 0));
}

#[test]
fn faces_with_and_without_normals_are_apart() {
    let scene = read(&format!("{SQUARE}f 1//1 2//1 3//1\nf 1 3 4\nf 1//1 3 4\nf 1 2\nl 1 2\n"));
    assert_eq!(scene.meshes.len(), 2);
    assert_eq!(scene.meshes[0].normals.len(), 3);
    assert!(scene.meshes[1].normals.is_empty());
    assert_eq!(scene.meshes[1].triangles.len(), 2);
    assert_eq!(
        scene.warnings,
        [
            "the OBJ statement \"l\" is not supported and ignored",
            "faces with fewer than three vertices, dropped: 1, the first in line 11"
        ]
    );
}

#[test]
fn errors_name_line_and_column() {
    for (text, expected) in [
        ("v 0 0\n", "a.obj:1:1: v has 2 numbers, it takes 3"),
        ("\nv 0 0 x\n", "a.obj:2:7: \"x\" is not a number"),
        ("v 0 nan 0\n", "a.obj:1:1: (0e0, NaN, 0e0) is not finite"),
        ("v 0 2e18 0\n", "is beyond 1e18"),
        ("v 0 0 0\nf 1 1 2\n", "a.obj:2:7: v 2 does not exist, there are 1 before this line"),
        ("v 0 0 0\nf 0 1 1\n", "v 0 does not exist"),
        ("v 0 0 0\nf 1 1 -2\n", "v -2 does not exist"),
        ("v 0 0 0\nf 1/1 1 1\n", "a.obj:2:3: vt 1 does not exist, there are 0"),
        ("f a\n", "\"a\" is not a vertex"),
    ] {
        let message = error(text);
        assert!(message.contains(expected), "{message}");
    }
}

/// Returns the materials of an MTL file, in order, and the scene that uses them.
fn materials(library: &str) -> (Vec<Material>, Description) {
    let mut obj = format!("mtllib my lib.mtl\n{SQUARE}");
    for line in library.lines() {
        if let Some(name) = line.strip_prefix("newmtl ") {
            obj += &format!("usemtl {name}\nf 1/1 2/2 3/1\n");
        }
    }
    let image = png(1, 1, &[[1, 2, 3, 4]]);
    let mut files = Memory([("my lib.mtl", library.as_bytes().to_vec()), ("maps/a b.png", image)].into());
    let scene = parse(obj.as_bytes(), "a.obj", &mut files).unwrap();
    (scene.materials.clone(), scene)
}

#[test]
fn mtl_materials() {
    let (all, scene) = materials(
        "newmtl diffuse\nKd 0.1 0.2 0.3\nKs 1 1 1\nillum 1\nd 0.5\n\
         newmtl light\nKe 4 5 6\n\
         newmtl glass\nillum 7\nNi 1.33\nd 0.1\n\
         newmtl tinted\nTf 1 0 0\nTr 0.25\nNi 1.2\n\
         newmtl mirror\nillum 3\nKs 0.9 0.8 0.7\nNs 6\n\
         newmtl pbr\nKd 0.5\nPr 0.25\nPm 1\nmap_d x.png\n\
         newmtl mapped\nmap_Kd -s 2 4 -o 0.5 0.25 -clamp on -bm 1 maps\\a b.png\n",
    );
    let [diffuse, light, glass, tinted, mirror, pbr, mapped] = &all[..] else { panic!() };
    assert_eq!(diffuse.surface, Surface::from(Lambertian::rgb(0.1, 0.2, 0.3)));
    assert_eq!((diffuse.opacity, diffuse.alpha), (0.5, Alpha::Blend));
    assert_eq!((light.emission, light.emits_both_sides), (DVec3::new(4.0, 5.0, 6.0), true));
    assert_eq!((&glass.surface, glass.alpha), (&Dielectric { ior: 1.33 }.into(), Alpha::Opaque));
    assert_eq!(tinted.surface, Dielectric { ior: 1.2 }.into());
    let Surface::Conductor(Conductor { fresnel, roughness, .. }) = mirror.surface else { panic!() };
    assert!((roughness - 0.5f64.sqrt()).abs() < 1e-12);
    assert_eq!(fresnel, ConductorFresnel::Schlick { reflectance: DVec3::new(0.9, 0.8, 0.7) });
    let Surface::MetallicRoughness(pbr) = &pbr.surface else { panic!() };
    assert_eq!((pbr.metallic, pbr.roughness, pbr.ior), (1.0, 0.25, 1.5));
    let Surface::Lambertian(Lambertian { albedo: DVec3::ONE, texture: Some(map) }) = &mapped.surface else {
        panic!()
    };
    // The bottom left, (0, 1) in the description, moves to (0.5, 0.25) from the bottom left.
    assert!(map.transform.transform_point2(DVec2::Y).abs_diff_eq(DVec2::new(0.5, 0.75), 1e-12));
    assert!(map.transform.transform_point2(DVec2::X).abs_diff_eq(DVec2::new(2.5, -3.25), 1e-12));
    assert_eq!(scene.images[0].name, "maps/a b.png");
    assert_eq!(
        scene.warnings,
        [
            "the MTL statement \"map_d\" is not supported and ignored",
            "the option \"-bm\" of MTL maps is not supported and ignored",
            "coloured glass (Tf) is not supported: glass is clear",
        ]
    );
}

fn metallic_roughness(material: &Material) -> &MetallicRoughness {
    let Surface::MetallicRoughness(surface) = &material.surface else { panic!("{material:?}") };
    surface
}

/// `Ks` and `Ns` make a dielectric glossy: grey `Ks` by its index of refraction, others by a layer.
#[test]
fn highlights() {
    let (all, scene) = materials(
        "newmtl neutral\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 6\nillum 2\n\
         newmtl strong\nKs 1\nNs 30\nNi 1\n\
         newmtl gold\nKs 0.5 0.25 0\nNs 30\n\
         newmtl matt\nKs 0 0 0\nNs 250\nillum 2\n\
         newmtl off\nKs 1\nNs 250\nillum 0\n",
    );
    let [neutral, strong, gold, matt, off] = &all[..] else { panic!() };
    let neutral = metallic_roughness(neutral);
    assert_eq!((neutral.base_color, neutral.metallic, neutral.ior), (DVec3::X, 0.0, 1.5));
    assert!((neutral.roughness - 0.5f64.sqrt()).abs() < 1e-12 && neutral.layers.is_empty());
    let reflectance = |ior: f64| ((ior - 1.0) / (ior + 1.0)).powi(2);
    let strong = metallic_roughness(strong);
    assert!((reflectance(strong.ior) / reflectance(1.5) - 2.0).abs() < 1e-9, "{}", strong.ior);
    let gold = metallic_roughness(gold);
    assert_eq!(gold.layers.specular.as_ref().map(|layer| layer.color), Some(DVec3::new(1.0, 0.5, 0.0)));
    // Negative controls: black Ks, and illum without highlights.
    for plain in [matt, off] {
        assert_eq!(plain.surface, Lambertian::rgb(0.8, 0.8, 0.8).into());
    }
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!(scene.materials.iter().all(|material| material.check(0).is_ok()));
}

/// Returns the materials of an MTL file that names the images `height.png`, `normal.png`, `two.png`
/// and `one.png`.
fn mapped(library: &str) -> Result<Description, SceneError> {
    let heights: Vec<[u8; 4]> = (0..16u8).map(|i| [16 * (i % 4), 16 * (i % 4), 16 * (i % 4), 255]).collect();
    let mut files = Memory(
        [
            ("a.mtl", library.as_bytes().to_vec()),
            ("height.png", png(4, 4, &heights)),
            ("normal.png", png(1, 1, &[[128, 128, 255, 255]])),
            ("two.png", png(2, 1, &[[10, 0, 0, 255], [20, 0, 0, 255]])),
            ("one.png", png(1, 1, &[[30, 0, 0, 255]])),
        ]
        .into(),
    );
    parse(format!("mtllib a.mtl\n{SQUARE}usemtl a\nf 1/1 2/2 3/1\n").as_bytes(), "a.obj", &mut files)
}

#[test]
fn bump_maps_are_normal_maps_or_become_some() {
    let normals = |library: &str| {
        let scene = mapped(&format!("newmtl a\n{library}\n")).unwrap();
        let map = scene.materials[0].normal_texture.clone().unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        (scene.images[map.image].clone(), scene.materials[0].normal_scale, scene)
    };
    let (image, scale, _) = normals("map_Bump -bm 2.5 normal.png");
    assert!(scale == 2.5 && matches!(image.texels, Texels::Linear8(_)) && image.name == "normal.png");
    let (image, scale, scene) = normals("bump height.png");
    let Texels::Float(texels) = &image.texels else { panic!() };
    // Heights rise to the right, so the normals lean to the left, but for the border.
    assert!(scale == 1.0 && texels[1][0] < 0.5 && texels[1][1] == 0.5 && texels[1][2] > 0.9, "{texels:?}");
    assert!(texels[0][0] > 0.5);
    crate::Scene::from_model(scene, "a.obj").unwrap();
    // `norm` is a normal map whatever its texels are.
    assert!(matches!(normals("norm height.png").0.texels, Texels::Linear8(_)));
    let error = mapped("newmtl a\nbump -bm x height.png\n").unwrap_err().to_string();
    assert!(error.contains("a.mtl:2:10: \"x\" is not a number"), "{error}");
    let error = mapped("newmtl a\nbump -bm 1e9 height.png\n").unwrap_err().to_string();
    assert!(error.contains("from -1e6 to 1e6"), "{error}");
    let error = mapped("newmtl a\nmap_Bump none.png\n").unwrap_err().to_string();
    assert!(error.contains("a.mtl: line 2, map_Bump: cannot read \"none.png\""), "{error}");
    let both = mapped("newmtl a\nnorm normal.png\nbump height.png\n").unwrap();
    assert!(both.warnings[0].contains("show the normal map alone"), "{:?}", both.warnings);
}

#[test]
fn roughness_and_metalness_share_an_image() {
    let scene = mapped("newmtl a\nPr 0.5\nmap_Pr two.png\nmap_Pm one.png\nmap_Ks one.png\n").unwrap();
    let surface = metallic_roughness(&scene.materials[0]);
    assert_eq!((surface.roughness, surface.metallic), (0.5, 1.0));
    let map = surface.metallic_roughness_texture.as_ref().unwrap();
    let Texels::Linear8(texels) = &scene.images[map.image].texels else { panic!() };
    assert_eq!(texels[..], [[255, 10, 30, 255], [255, 20, 30, 255]]);
    assert!(scene.warnings[0].contains("(map_Ks) of materials whose Ks and Ns"), "{:?}", scene.warnings);
    // Without a map its number counts, and a map of Ks makes a material glossy.
    let scene = mapped("newmtl a\nPm 0.5\nmap_Pr -s 2 2 one.png\n").unwrap();
    let surface = metallic_roughness(&scene.materials[0]);
    let map = surface.metallic_roughness_texture.as_ref().unwrap();
    assert!(
        matches!(&scene.images[map.image].texels, Texels::Linear8(of) if of[..] == [[255, 30, 255, 255]])
    );
    assert_eq!((surface.metallic, map.transform.matrix2.x_axis.x), (0.5, 2.0));
    let scene = mapped("newmtl a\nmap_Ks one.png\nNs 30\n").unwrap();
    let layer = metallic_roughness(&scene.materials[0]).layers.specular.as_ref().unwrap();
    assert!(layer.color == DVec3::splat(2.0) && layer.color_texture.is_some() && scene.warnings.is_empty());
}

/// A file that is not a library may contain anything, such as secrets.
#[test]
fn text_of_other_files_is_not_quoted() {
    let mut files = Memory([("a.mtl", b"root:secret".to_vec())].into());
    let text =
        parse(format!("mtllib a.mtl\n{SQUARE}").as_bytes(), "a.obj", &mut files).unwrap_err().to_string();
    assert!(text.contains("a.mtl: line 1: no newmtl") && !text.contains("secret"), "{text}");
}

#[test]
fn materials_in_no_library_are_grey() {
    let scene = read(&format!("{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nf 1 2 2\n"));
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(
        scene.warnings[0],
        "materials that no library (mtllib) has, diffuse grey: 2, the first in usemtl a"
    );
    assert!(
        scene.warnings[1].starts_with("triangles without area or with a vertex twice, dropped: 1"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn models_far_from_the_origin_keep_their_shape() {
    let scene = read(&format!("v 0 0 0\n{}f 2 3 4 5\n", far_vertices("v ")));
    let error = error_in_space(scene.clone());
    assert!(error <= ROUNDED, "{error:e}");
    let control = error_in_space(rounded_in_world(scene));
    assert!(control > 0.1, "{control:e}");
}

#[test]
fn meshes_of_a_file_share_an_origin() {
    let scene = read(&format!("{}o a\nf 1 2 3\no b\nf 1 3 4\n", far_vertices("v ")));
    let [a, b] = &scene.instances[..] else { panic!() };
    assert_eq!(a.transform, b.transform);
    assert!(a.transform.translation.abs_diff_eq(FAR, 1e-3));
    let corners =
        |mesh: usize| scene.meshes[mesh].triangles[0].map(|i| scene.meshes[mesh].positions[i as usize]);
    let ([a1, _, a3], [b1, b3, _]) = (corners(0), corners(1));
    assert_eq!((a1, a3), (b1, b3));
}

/// Includes a small part of a model that is at the origin.
#[test]
fn models_near_the_origin_keep_their_bits() {
    let scene =
        read("v 0.1 -0 0\nv 10.1 0.3 0\nv 10.1001 0.3 0\nv 10.1 0.3001 -0\no a\nf 1 2 3\no b\nf 2 3 4\n");
    assert!(scene.instances.iter().all(|instance| instance.transform == DAffine3::IDENTITY));
    assert_eq!(scene.meshes[1].positions, [[10.1, 0.3, 0.0], [10.1001, 0.3, 0.0], [10.1, 0.3001, 0.0]]);
    assert_eq!(scene.meshes[0].positions[0].map(f32::to_bits), [0.1f32, -0.0, 0.0].map(f32::to_bits));
}
