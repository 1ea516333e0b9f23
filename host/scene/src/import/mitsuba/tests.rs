use super::super::testing::{Memory, png};
use super::parse;
use crate::ImageSettings;
use crate::description::{
    Alpha, Conductor, ConductorFresnel, Description, Dielectric, Lambertian, MetallicRoughness,
    PunctualLight, RoughDielectric, ShapeKind, Sky, Surface, Texels,
};
use crate::error::SceneError;
use glam::{DVec2, DVec3, Vec3};

type Parsed = Result<(Description, ImageSettings), SceneError>;

fn read_with(content: &str, files: &[(&'static str, Vec<u8>)]) -> Parsed {
    let text = format!("<scene version=\"3.0.0\">\n{content}\n</scene>");
    parse(text.as_bytes(), "a.xml", &mut Memory(files.iter().cloned().collect()))
}

fn read(content: &str) -> Description {
    read_with(content, &[]).unwrap().0
}

/// Returns the message of the error, or panics.
fn error(content: &str) -> String {
    read_with(content, &[]).unwrap_err().to_string()
}

/// Returns the surface of a sphere of this material.
fn surface(bsdf: &str) -> Surface {
    let scene = read(&format!("<shape type=\"sphere\">{bsdf}</shape>"));
    scene.materials.last().unwrap().surface.clone()
}

#[test]
fn cameras_and_images_are_read() {
    let content = "<default name=\"w\" value=\"80\"/><integrator type=\"path\"><integer name=\"max_depth\" value=\"7\"/></integrator>
        <sensor type=\"thinlens\"><float name=\"fov\" value=\"60\"/><float name=\"aperture_radius\" value=\"0.5\"/>
        <float name=\"focus_distance\" value=\"2\"/>
        <transform name=\"to_world\"><lookat origin=\"1,2,3\" target=\"1,2,-5\" up=\"0,1,0\"/></transform>
        <sampler type=\"independent\"><integer name=\"sample_count\" value=\"9\"/></sampler>
        <film type=\"hdrfilm\"><integer name=\"width\" value=\"$w\"/><integer name=\"height\" value=\"40\"/></film></sensor>";
    let (scene, image) = read_with(content, &[]).unwrap();
    assert_eq!((image.width, image.height, image.samples, image.depth), (80, 40, 9, 7));
    let camera = scene.cameras[0].1;
    assert_eq!(camera.look_from, DVec3::new(1.0, 2.0, 3.0));
    assert!((camera.look_at - DVec3::new(1.0, 2.0, 2.0)).length() < 1e-12 && camera.up == DVec3::Y);
    // 60 degrees across are twice as wide as high.
    assert!(((0.5 * camera.vertical_fov).tan() - 0.5 * 30f64.to_radians().tan()).abs() < 1e-12);
    assert!((camera.focus_distance * (0.5 * camera.defocus_angle).tan() - 0.5).abs() < 1e-12);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn angles_of_view_have_an_axis() {
    let half = |property: &str| {
        let content = format!(
            "<sensor type=\"perspective\">{property}<film type=\"hdrfilm\"><integer name=\"width\" value=\"80\"/>
            <integer name=\"height\" value=\"40\"/></film></sensor>"
        );
        (0.5 * read(&content).cameras[0].1.vertical_fov).tan()
    };
    let fov = |axis: &str| {
        half(&format!("<float name=\"fov\" value=\"40\"/><string name=\"fov_axis\" value=\"{axis}\"/>"))
    };
    let tangent = 20f64.to_radians().tan();
    for (axis, want) in
        [("x", tangent / 2.0), ("y", tangent), ("larger", tangent / 2.0), ("smaller", tangent)]
    {
        assert!((fov(axis) - want).abs() < 1e-12, "{axis}");
    }
    // Horizontal angles that Mitsuba 3.9.1 computes.
    for (found, want) in [(fov("diagonal"), 36.064788818359375f64), (half(""), 42.31171417236328)] {
        assert!((found - 0.5 * (0.5 * want.to_radians()).tan()).abs() < 1e-6);
    }
}

#[test]
fn transforms_apply_in_their_order() {
    let scene = read(
        "<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/><point name=\"center\" x=\"1\"/><transform name=\"to_world\">
        <rotate y=\"1\" angle=\"90\"/><scale value=\"2\"/><translate value=\"0 3 0\"/></transform></shape>",
    );
    let ShapeKind::Sphere { center, radius } = scene.shapes[0].kind else { panic!() };
    assert_eq!((center, radius), (DVec3::new(0.0, 3.0, -2.0), 4.0));
}

/// Fronts follow Mitsuba's shading normals: that of a rectangle stays in a mirror, that of a mesh
/// without normals does not.
#[test]
fn fronts_are_those_of_mitsuba() {
    let mirror = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
    let quad = |more: &str| {
        let scene =
            read(&format!("<shape type=\"rectangle\">{mirror}{more}<emitter type=\"area\"/></shape>"));
        let ShapeKind::Quad { u, v, .. } = scene.shapes[0].kind else { panic!() };
        u.cross(v).z
    };
    assert!(quad("") > 0.0 && quad("<boolean name=\"flip_normals\" value=\"true\"/>") < 0.0);
    let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let front = |more: &str| {
        let content =
            format!("<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/>{more}</shape>");
        let scene = read_with(&content, &[("a.ply", ply.to_vec())]).unwrap().0;
        let mesh = &scene.meshes[scene.instances[0].mesh];
        let [a, b, c] =
            mesh.triangles[0].map(|corner| Vec3::from(mesh.positions[corner as usize]).as_dvec3());
        // Fronts stay in the renderer.
        (b - a).cross(c - a).z.signum() * scene.instances[0].transform.matrix3.determinant().signum()
    };
    assert_eq!((front(""), front(mirror)), (1.0, 1.0));
    // The reflected triangle is clockwise in the world.
    let cube = read(&format!("<shape type=\"cube\">{mirror}</shape>"));
    for shape in &cube.shapes {
        let ShapeKind::Quad { corner, u, v } = shape.kind else { panic!() };
        assert!((corner + 0.5 * (u + v)).dot(u.cross(v)) > 0.0);
    }
}

/// Materials of models are those of the scene, and faults of models are named.
#[test]
fn models_bring_shapes_only() {
    let obj = b"mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nf 1 2 2\n".to_vec();
    let content = "<shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/></shape>";
    let scene = read_with(content, &[("a.obj", obj)]).unwrap().0;
    assert_eq!(scene.materials[0].surface, Lambertian::rgb(0.5, 0.5, 0.5).into());
    // Mitsuba computes the normals.
    assert_eq!(scene.meshes[0].normals[0], [0.0, 0.0, 1.0]);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].starts_with("a.obj: triangles without area"), "{:?}", scene.warnings);
}

#[test]
fn materials_map_to_surfaces() {
    let bsdf = |kind: &str, properties: &str| surface(&format!("<bsdf type=\"{kind}\">{properties}</bsdf>"));
    let rgb = |name: &str, value: &str| format!("<rgb name=\"{name}\" value=\"{value}\"/>");
    let float = |name: &str, value: &str| format!("<float name=\"{name}\" value=\"{value}\"/>");
    assert_eq!(bsdf("diffuse", &rgb("reflectance", "0.1 0.2 0.3")), Lambertian::rgb(0.1, 0.2, 0.3).into());
    let Surface::Lambertian(hex) = bsdf("diffuse", &rgb("reflectance", "#ff8000")) else { panic!() };
    assert!((hex.albedo - DVec3::new(1.0, 0.2158605, 0.0)).length() < 1e-6);
    let air = float("ext_ior", "1");
    assert_eq!(
        bsdf("dielectric", &(float("int_ior", "1.5") + &air)),
        Surface::Dielectric(Dielectric { ior: 1.5 })
    );
    let rough = float("alpha", "0.09") + "<string name=\"distribution\" value=\"ggx\"/>";
    let Surface::RoughDielectric(RoughDielectric { roughness, multiple_scattering: false, .. }) =
        bsdf("roughdielectric", &rough)
    else {
        panic!()
    };
    assert!((roughness - 0.3).abs() < 1e-12);
    let gold = "<string name=\"material\" value=\"Au\"/>".to_owned();
    let Surface::Conductor(Conductor { fresnel: ConductorFresnel::Ior { eta, .. }, .. }) =
        bsdf("roughconductor", &(gold + &rough))
    else {
        panic!()
    };
    assert!((eta - DVec3::new(0.143, 0.375, 1.442)).length() < 1e-3);
    let Surface::MetallicRoughness(plastic) = bsdf("plastic", &rgb("diffuse_reflectance", "0.5")) else {
        panic!()
    };
    assert_eq!((plastic.base_color, plastic.metallic, plastic.roughness), (DVec3::splat(0.5), 0.0, 0.0));
    let Surface::MetallicRoughness(principled) =
        bsdf("principled", &(float("metallic", "0.25") + &float("specular", "0.5")))
    else {
        panic!()
    };
    assert_eq!((principled.metallic, principled.roughness), (0.25, 0.5));
    assert!((principled.ior - 1.5).abs() < 1e-12);
    let Surface::MetallicRoughness(MetallicRoughness { transmission: 1.0, .. }) = bsdf("thindielectric", "")
    else {
        panic!()
    };
}

#[test]
fn textures_and_masks_become_images() {
    let files = [
        ("a.png", png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 255]])),
        ("b.png", png(2, 1, &[[0; 4], [255; 4]])),
    ];
    let content = "<shape type=\"rectangle\"><bsdf type=\"mask\"><texture name=\"opacity\" type=\"bitmap\">
        <string name=\"filename\" value=\"b.png\"/><boolean name=\"raw\" value=\"true\"/></texture>
        <bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\">
        <string name=\"filename\" value=\"a.png\"/></texture></bsdf></bsdf></bsdf></shape>";
    let scene = read_with(content, &files).unwrap().0;
    let material = &scene.materials[0];
    assert_eq!((material.opacity, material.alpha), (1.0, Alpha::Blend));
    let (texture, _) = material.textures().next().unwrap();
    let Texels::Srgb8(texels) = &scene.images[texture.image].texels else { panic!() };
    assert_eq!(texels[..], [[255, 0, 0, 0], [0, 255, 0, 255]]);
    // The texture needs Mitsuba's coordinates: v grows with y.
    let mesh = &scene.meshes[scene.instances[0].mesh];
    let corner = mesh.positions.iter().position(|p| p[..2] == [1.0, -1.0]).unwrap();
    assert_eq!(mesh.uvs[corner], [1.0, 0.0]);

    let scene = read(
        "<shape type=\"disk\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\">
        <transform name=\"to_uv\"><scale x=\"3\" y=\"5\"/></transform></texture></bsdf></shape>",
    );
    let (texture, _) = scene.materials[0].textures().next().unwrap();
    assert_eq!(texture.transform.transform_point2(DVec2::ONE), DVec2::new(3.0, 5.0));
}

#[test]
fn lights_are_read() {
    let scene = read(
        "<emitter type=\"point\"><point name=\"position\" value=\"1,2,3\"/><rgb name=\"intensity\" value=\"4,5,6\"/></emitter>
        <emitter type=\"directional\"><vector name=\"direction\" y=\"-2\"/></emitter>
        <emitter type=\"spot\"><transform name=\"to_world\"><translate x=\"7\"/></transform></emitter>
        <emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.5\"/></emitter>
        <shape type=\"sphere\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"3\"/></emitter></shape>",
    );
    let [PunctualLight::Point { position, intensity }, PunctualLight::Directional { direction, .. }, spot] =
        &scene.lights[..]
    else {
        panic!()
    };
    assert_eq!((*position, *intensity), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)));
    assert_eq!(*direction, DVec3::NEG_Y);
    let PunctualLight::Spot { position, direction, inner, outer, .. } = *spot else { panic!() };
    assert_eq!((position, direction), (DVec3::X * 7.0, DVec3::Z));
    assert!(inner > 15f64.to_radians() && inner < outer && (outer - 20f64.to_radians()).abs() < 1e-12);
    assert!(matches!(scene.sky, Some(Sky::Gradient { bottom, .. }) if bottom == DVec3::splat(0.5)));
    assert_eq!(scene.materials[0].emission, DVec3::splat(3.0));
    // As in Mitsuba, a light without a material is black.
    assert_eq!(scene.materials[0].surface, Lambertian::rgb(0.0, 0.0, 0.0).into());
}

#[test]
fn groups_are_placed_by_instances() {
    let group = "<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\"/><shape type=\"sphere\"/></shape>";
    let instance = |x: i32| {
        format!(
            "<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate x=\"{x}\"/></transform></shape>"
        )
    };
    let scene = read(&format!("{group}{}{}", instance(3), instance(5)));
    assert_eq!(scene.shapes.len(), 14);
    let centers = scene.shapes.iter().filter_map(|shape| match shape.kind {
        ShapeKind::Sphere { center, .. } => Some(center.x),
        _ => None,
    });
    assert_eq!(centers.collect::<Vec<_>>(), [3.0, 5.0]);
    assert_eq!(read(group).shapes.len(), 0);
}

#[test]
fn included_files_and_old_names_are_read() {
    let part = b"<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"b\"><float name=\"reflectance\" value=\"0.25\"/></bsdf></scene>";
    let content = "<include filename=\"part.xml\"/><shape type=\"sphere\"><ref id=\"b\"/></shape>";
    let scene = read_with(content, &[("part.xml", part.to_vec())]).unwrap().0;
    assert_eq!(scene.materials[0].surface, Lambertian::rgb(0.25, 0.25, 0.25).into());
    let itself = b"<scene version=\"3.0.0\"><include filename=\"part.xml\"/></scene>";
    let error = read_with(content, &[("part.xml", itself.to_vec())]).unwrap_err().to_string();
    assert!(error.contains("part.xml:1:") && error.contains("include each other"), "{error}");
    let old = "<scene version=\"0.6.0\"><shape type=\"sphere\"><transform name=\"toWorld\"><translate x=\"2\"/></transform>
        <bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"1.5\"/></bsdf></shape></scene>";
    let scene = parse(old.as_bytes(), "a.xml", &mut Memory::default()).unwrap().0;
    assert!(matches!(scene.shapes[0].kind, ShapeKind::Sphere { center, .. } if center.x == 2.0));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn media_fill_surfaces_that_light_passes() {
    let medium = "<medium type=\"homogeneous\" name=\"interior\"><float name=\"albedo\" value=\"0.5\"/><float name=\"sigma_t\" value=\"2\"/>
        <float name=\"scale\" value=\"3\"/><phase type=\"hg\"><float name=\"g\" value=\"0.7\"/></phase></medium>";
    let scene = read(&format!("<shape type=\"sphere\"><bsdf type=\"null\"/>{medium}</shape>"));
    assert_eq!((scene.media[0].extinction, scene.media[0].anisotropy), (DVec3::splat(6.0), 0.7));
    assert_eq!(scene.materials[0].medium, Some(0));
    scene.check().unwrap();
    let scene = read(&format!("<shape type=\"sphere\"><bsdf type=\"diffuse\"/>{medium}</shape>"));
    assert!(scene.materials[0].medium.is_none() && scene.warnings[0].contains("no light passes"));
    // A surface that nothing shows is none.
    assert!(read("<shape type=\"sphere\"><bsdf type=\"null\"/></shape>").shapes.is_empty());
}

#[test]
fn what_is_not_modelled_is_named_once() {
    let scene = read(
        "<shape type=\"sphere\"><bsdf type=\"hair\"/></shape><shape type=\"sphere\"><bsdf type=\"hair\"/></shape>
        <shape type=\"serialized\"/><emitter type=\"sunsky\"/><bsdf type=\"diffuse\" id=\"unused\"/>
        <shape type=\"sphere\"><bsdf type=\"diffuse\"><float name=\"shine\" value=\"1\"/></bsdf></shape>",
    );
    let count = |word: &str| scene.warnings.iter().filter(|warning| warning.contains(word)).count();
    assert_eq!(
        [count("hair"), count("serialized"), count("sunsky"), count("shine")],
        [1; 4],
        "{:?}",
        scene.warnings
    );
    assert!(
        scene.warnings.iter().any(|w| w.contains("hair") && w.contains("a.xml: line 2")),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn errors_have_a_place_and_a_remedy() {
    for (content, place, words) in [
        ("<shape type=\"sphere\"><ref id=\"none\"/></shape>", "a.xml:2:22", "no object has the id \"none\""),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"x\"/></shape>",
            "a.xml:2:22",
            "not a finite number",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
            "a.xml:2:1",
            "must be above 0",
        ),
        (
            "<sensor type=\"perspective\"><float name=\"fov\" value=\"180\"/></sensor>",
            "a.xml:2:1",
            "below 180",
        ),
        ("<shape>", "a.xml:3:1", "not XML: expected 'shape'"),
        ("<bsdf id=\"a\"/><bsdf id=\"a\"/>", "a.xml:2:", "occurs twice"),
        ("<include filename=\"none.xml\"/>", "a.xml: line 2", "cannot read \"none.xml\""),
        ("<emitter type=\"area\"/>", "a.xml:2:1", "within a <shape>"),
    ] {
        let error = error(content);
        assert!(error.contains(place) && error.contains(words), "{content}: {error}");
    }
    let error = parse(b"<html/>", "a.xml", &mut Memory::default()).unwrap_err().to_string();
    assert!(error.contains("must be <scene>"), "{error}");
}

/// Files that name themselves, and deep ones, end with an error.
#[test]
fn hostile_files_are_refused() {
    let deep = format!("{}{}", "<shape type=\"merge\">".repeat(100_000), "</shape>".repeat(100_000));
    assert!(error(&deep).contains("nested too deeply"));
    let itself =
        "<shape type=\"shapegroup\" id=\"g\"><shape type=\"instance\"><ref id=\"g\"/></shape></shape>
        <shape type=\"instance\"><ref id=\"g\"/></shape>";
    assert!(error(itself).contains("nested too deeply"));
    let bsdf = "<bsdf type=\"twosided\" id=\"b\"><ref id=\"b\"/></bsdf><shape type=\"sphere\"><ref id=\"b\"/></shape>";
    assert!(error(bsdf).contains("nested too deeply"));
    // 300,000 spheres of a group of 3,000 are more than these files may stand for.
    let group =
        format!("<shape type=\"shapegroup\" id=\"g\">{}</shape>", "<shape type=\"sphere\"/>".repeat(3000));
    let many = format!("{group}{}", "<shape type=\"instance\"><ref id=\"g\"/></shape>".repeat(3000));
    assert!(error(&many).contains("too much memory"));
    // Each default is twice as long as the one before.
    let doubled: String =
        (1..64).map(|i| format!("<default name=\"a{i}\" value=\"$a{0}$a{0}\"/>", i - 1)).collect();
    let _ = read_with(&format!("<default name=\"a0\" value=\"aaaaaaaa\"/>{doubled}"), &[]);
}
