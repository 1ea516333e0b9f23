use super::transform::Transform;
use super::*;
use crate::values::unit;
use glam::{DAffine3, DVec3};

/// A scene file with every construct at least once.
const ALL: &str = r#"Scene(
    version: 1,
    about: "everything",
    image: (width: 8, height: 4, samples: 1),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Image(file: "sky.HDR", scale: 2, rotation: 90),
    textures: {
        "earth": (file: "earth.png"),
        "rough": (
            file: "rough.png", color_space: Linear, wrap: Mirror, filter: Nearest,
            scale: (2, 3), offset: (0.5, 0.25), rotation: 90,
        ),
    },
    materials: {
        "plain": Lambertian(albedo: (0.5, 0.5, 0.5)),
        "globe": Lambertian(albedo: (1, 1, 1), texture: "earth"),
        "brass": Metal(albedo: (0.8, 0.6, 0.3), fuzz: 0.1),
        "glass": Dielectric(ior: 1.5),
        "gold": Conductor(fresnel: Ior(eta: (0.2, 0.4, 1.4), k: (3.9, 2.4, 1.9)), roughness: 0.3),
        "tin": Conductor(fresnel: Schlick(reflectance: (0.9, 0.9, 0.9)), roughness: 0),
        "frost": RoughDielectric(ior: 1.5, roughness: 0.2),
        "lamp": Emissive(radiance: (10, 9, 8), two_sided: true, texture: "earth"),
        "defaults": MetallicRoughness(),
        "gltf": MetallicRoughness(
            base_color: (1, 0.5, 0), metallic: 0.5, roughness: 0.25, ior: 1.4, transmission: 0.75,
            emission: (1, 2, 3), texture: "earth", metallic_roughness_texture: "rough",
            emission_texture: "earth", opacity: 0.5, alpha_cutoff: 0.4, two_sided: true,
        ),
    },
    objects: [
        Sphere(center: (0, 0, 0), radius: 1, material: "globe"),
        Quad(corner: (0, 0, 0), u: (1, 0, 0), v: (0, 1, 0), material: "lamp"),
        Disc(center: (0, 0, 0), normal: (0, 2, 0), radius: 1, material: "gold"),
        Plane(point: (0, 0, 0), normal: (0, 1, 0), material: "plain"),
        Box(min: (0, 0, 0), max: (1, 2, 3), transform: [RotateY(90), Translate((1, 0, 0))], material: "tin"),
        Mesh(file: "a.glb"),
        Mesh(file: "b.ply", transform: [
            Scale(2), ScaleXyz((1, 2, -3)), RotateX(90), RotateY(90), RotateZ(90),
            Rotate(axis: (1, 1, 1), angle: 120), Translate((1, 2, 3)),
            Matrix(((1, 0, 0, 4), (0, 1, 0, 5), (0, 0, 1, 6))),
        ], material: "frost"),
    ],
    lights: [
        Point(position: (0, 1, 0), intensity: (1, 1, 1)),
        Spot(position: (0, 1, 0), direction: (0, -1, 0), intensity: (1, 1, 1), inner_angle: 10, outer_angle: 90),
        Directional(direction: (0, -1, 0), irradiance: (1, 1, 1)),
    ],
)
"#;

/// A scene file with only the fields of the first release of version 1.
const FIRST: &str = r#"Scene(
    version: 1,
    image: (width: 8, height: 4),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
    materials: { "a": Lambertian(albedo: (0.5, 0.5, 0.5)), "g": Dielectric(ior: 1.5) },
    objects: [Sphere(center: (0, 0, 0), radius: 1, material: "a")],
)"#;

#[test]
fn every_construct_is_read() {
    let scene = parse(ALL, "all.ron").unwrap();
    assert_eq!((scene.textures.len(), scene.materials.len(), scene.objects.len()), (2, 10, 7));
    assert_eq!(scene.lights.len(), 3);
    assert!(matches!(&scene.sky, Sky::Image { file, scale, .. } if file.name == "sky.HDR" && scale.0 == 2.0));
    assert!(matches!(scene.objects[2], Object::Disc { normal, .. } if normal.0 == DVec3::Y));
}

#[test]
fn portals_are_read_and_checked() {
    let with =
        |portals: &str| FIRST.replace("version: 1,", &format!("version: 1,\n    portals: [{portals}],"));
    let read = |portals: &str| parse(&with(portals), "portals.ron").map(|scene| scene.portals);
    let portal = "(corner: (-1, 0, 0.5), u: (0, 1, 0), v: (0, 0, 2))";
    let want = Portal { corner: DVec3::new(-1.0, 0.0, 0.5), u: DVec3::Y, v: DVec3::Z * 2.0 };
    assert_eq!(read(portal).unwrap(), [want]);
    for (bad, why) in [
        ("(corner: (0, 0, 0), u: (0, 1, 0), v: (0, 2, 0))", "parallel"),
        ("(corner: (0, 0, 0), u: (0, 1, 0), v: (0, 0, 0))", "at least 1e-18 long"),
        ("(corner: (NaN, 0, 0), u: (0, 1, 0), v: (0, 0, 1))", "NaN"),
        ("(corner: (0, 0, 0), u: (0, 1e19, 0), v: (0, 0, 1))", "1e18"),
        ("(corner: (0, 0, 0), u: (0, 1, 0))", "v"),
        ("(corner: (0, 0, 0), u: (0, 1, 0), v: (0, 0, 1), material: \"a\")", "material"),
    ] {
        let said = read(bad).unwrap_err().to_string();
        assert!(said.contains(why) && said.contains("portals.ron:3"), "{bad}: {said}");
    }
    let many =
        crate::Scene::parse(&with(&format!("{portal},").repeat(65)), "many.ron").unwrap_err().to_string();
    assert!(many.contains("65 portals; at most 64"), "{many}");
}

#[test]
fn a_space_is_read_and_checked() {
    let with = |space: &str| FIRST.replace("version: 1,", &format!("version: 1,\n    space: {space},"));
    let read = |space: &str| parse(&with(space), "space.ron").map(|scene| scene.space.space);
    let space = |origin, scale| crate::Rebase { origin, scale };
    assert_eq!(read("()").unwrap(), space(DVec3::ZERO, 1.0));
    assert_eq!(read("(scale: 0.5, origin: (1, -2, 3e9))").unwrap(), space(DVec3::new(1.0, -2.0, 3e9), 0.5));
    assert_eq!(parse(FIRST, "first.ron").unwrap().space.space, space(DVec3::ZERO, 1.0));
    for (bad, why) in [
        ("(scale: 0)", "0 is not a factor on lengths"),
        ("(scale: -1)", "-1 is not"),
        ("(scale: inf)", "inf is not"),
        ("(scale: 1e19)", "between 1e-18 and 1e18"),
        ("(origin: (0, NaN, 0))", "NaN is not a finite coordinate"),
        ("(size: 2)", "size"),
        ("7", "space"),
    ] {
        let error = read(bad).unwrap_err().to_string();
        assert!(error.starts_with("space.ron:3:") && error.contains(why), "{bad}: {error}");
    }
}

#[test]
fn first_files_read_as_before() {
    let scene = parse(FIRST, "first.ron").unwrap();
    assert!(scene.camera.is_some() && matches!(scene.sky, Sky::Gradient { .. }));
    assert_eq!((scene.image.samples.0, scene.image.depth.0), (64, 50));
    let bare = "Scene(version: 1, image: (width: 1, height: 1), materials: {}, objects: [])";
    let scene = parse(bare, "bare.ron").unwrap();
    assert!(scene.camera.is_none() && matches!(scene.sky, Sky::Black));
    let least = "objects: [Quad(corner: (0, 0, 0), u: (1e-18, 0, 0), v: (0, 0, -1e-18), material: \"a\")]";
    parse(&FIRST.replacen("objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"a\")]", least, 1), "")
        .unwrap();
}

#[test]
fn steps_are_done_in_order() {
    let map = |text: &str| ron::from_str::<Transform>(text).unwrap().0;
    let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
    let p = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(map("[]"), DAffine3::IDENTITY);
    assert_eq!(map("[Translate((1, 0, 0)), Scale(2)]").transform_point3(p), DVec3::new(4.0, 4.0, 6.0));
    assert_eq!(map("[Scale(2), Translate((1, 0, 0))]").transform_point3(p), DVec3::new(3.0, 4.0, 6.0));
    assert_eq!(map("[ScaleXyz((2, -1, 3))]").transform_point3(p), DVec3::new(2.0, -2.0, 9.0));
    // Quarter turns are exact, and counter-clockwise seen against the axis.
    assert_eq!(map("[RotateX(90)]").transform_point3(p), DVec3::new(1.0, -3.0, 2.0));
    assert_eq!(map("[RotateY(-270)]").transform_point3(p), DVec3::new(3.0, 2.0, -1.0));
    assert_eq!(map("[RotateZ(450)]").transform_point3(p), DVec3::new(-2.0, 1.0, 3.0));
    close(map("[Rotate(axis: (2, 2, 2), angle: 120)]").transform_point3(p), DVec3::new(3.0, 1.0, 2.0));
    close(
        map("[RotateX(33)]").transform_point3(p),
        DAffine3::from_rotation_x(33f64.to_radians()).transform_point3(p),
    );
    let matrix = map("[Matrix(((1, 2, 3, 4), (0, 1, 5, 6), (0, 0, 2, 7)))]");
    assert_eq!(matrix.transform_point3(p), DVec3::new(18.0, 23.0, 13.0));
    // A thin object is not flat, and neither is one of the minimum size.
    map("[Scale(-1e-18)]");
    map("[ScaleXyz((1, 1e-15, 1)), RotateZ(90)]");
}

#[test]
fn a_box_looks_outward() {
    let (min, max) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 6.0));
    let turned = DAffine3::from_rotation_y(0.7) * DAffine3::from_translation(DVec3::new(5.0, 0.0, 1.0));
    let mirrored = turned * DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0));
    for map in [DAffine3::IDENTITY, turned, mirrored] {
        let middle = map.transform_point3(0.5 * (min + max));
        let mut area = 0.0;
        for [corner, u, v] in sides(min, max, &map) {
            let center = corner + 0.5 * (u + v);
            let normal = unit(u.cross(v)).unwrap();
            assert!(normal.dot(center - middle) > 0.1);
            // Each side lies on one of the box's faces.
            let back = map.inverse().transform_point3(center);
            let off = (back - 0.5 * (min + max)).abs() / (max - min);
            assert!((off.max_element() - 0.5).abs() < 1e-12 && (off.element_sum() - 0.5).abs() < 1e-12);
            area += u.cross(v).length();
        }
        if map != mirrored {
            assert!((area - 22.0).abs() < 1e-9);
        }
    }
}

#[test]
fn faults_are_placed() {
    // Text, its replacement, the line of the error, and parts of the message.
    let cases: &[(&str, &str, usize, &[&str])] = &[
        ("version: 1", "version: 2", 2, &["version 2", "reads 1"]),
        ("vertical_fov: 40", "vertical_fov: 180", 5, &["179"]),
        (", vertical_fov: 40", "", 5, &["vertical_fov is missing", "height"]),
        ("vertical_fov: 40", "vertical_fov: 40, height: 2", 5, &["leave one out"]),
        ("vertical_fov: 40", "height: 2, defocus_angle: 1", 5, &["no lens"]),
        ("vertical_fov: 40", "height: 0", 5, &["0 is not"]),
        ("look_from: (0, 0, 3)", "look_from: (0, 0, 0)", 5, &["look_from and look_at"]),
        ("look_from: (0, 0, 3)", "look_from: (0, 3, 0)", 5, &["up points along the view"]),
        ("40)", "170, defocus_angle: 1, focus_distance: 1e15)", 5, &["focus_distance", "1e15"]),
        ("sky.HDR", "sky.png", 6, &["sky.png", ".hdr, .exr"]),
        ("scale: 2,", "scale: -2,", 6, &["-2 is not a finite factor"]),
        ("rotation: 90)", "rotation: NaN)", 6, &["NaN is not an angle"]),
        ("sky: Image", "sky: Panorama", 6, &["Panorama", "Gradient"]),
        ("\"earth\": (file: \"earth.png\")", "\"earth\": (fil: \"earth.png\")", 8, &["fil", "color_space"]),
        ("\"rough\": (", "\"earth\": (", 9, &["texture \"earth\" is defined twice"]),
        ("wrap: Mirror", "wrap: Fold", 10, &["Fold", "Repeat"]),
        ("scale: (2, 3)", "scale: (2, 1e7)", 11, &["10000000 is not a number between"]),
        ("texture: \"earth\"),", "texture: \"erth\"),", 16, &["unknown texture \"erth\"", "earth, rough"]),
        ("texture: \"earth\"),", "texture: 5),", 16, &["string"]),
        ("eta: (0.2,", "eta: (0,", 19, &["0 is not a positive real part"]),
        ("k: (3.9,", "k: (-3.9,", 19, &["-3.9 is not"]),
        ("roughness: 0.3", "roughness: 1.3", 19, &["1.3 is not between 0 and 1"]),
        (", roughness: 0)", ")", 20, &["roughness"]),
        ("(10, 9, 8)", "(10, -9, 8)", 22, &["-9 is not a finite radiance"]),
        ("two_sided: true,", "two_sided: 1,", 22, &["oolean"]),
        ("metallic: 0.5", "metallic: 2", 25, &["2 is not between"]),
        (
            "metallic_roughness_texture: \"rough\"",
            "metallic_roughness_texture: \"earth\"",
            26,
            &["color_space: Linear"],
        ),
        ("alpha_cutoff: 0.4", "alpha_cut: 0.4", 27, &["alpha_cut", "metallic", "\"alpha_cutoff\""]),
        ("alpha_cutoff: 0.4", "alpha_cutoff: inf", 27, &["inf is not"]),
        ("radius: 1, material: \"globe\"", "radius: 0, material: \"globe\"", 31, &["0 is not a positive"]),
        (
            "material: \"globe\"",
            "material: \"glob\"",
            31,
            &["unknown material \"glob\": did you mean \"globe\"?", "brass, defaults"],
        ),
        ("v: (0, 1, 0)", "v: (-2, 0, 0)", 32, &["Quad", "parallel"]),
        ("v: (0, 1, 0)", "v: (0, 1e-19, 0)", 32, &["Quad", "1e-18 long"]),
        ("v: (0, 1, 0)", "v: (0, inf, 0)", 32, &["inf is not a finite coordinate"]),
        // A parallelogram that only f64 tells from a line.
        ("v: (0, 1, 0)", "v: (1, 1e-40, 0)", 32, &["Quad", "parallel"]),
        ("normal: (0, 2, 0)", "normal: (0, 0, 0)", 33, &["not a direction"]),
        ("radius: 1, material: \"gold\"", "radius: -1, material: \"gold\"", 33, &["-1 is not a positive"]),
        ("normal: (0, 1, 0)", "normal: (0, 0, -0.0)", 34, &["not a direction"]),
        ("max: (1, 2, 3)", "max: (1, 0, 3)", 35, &["Box", "min must be less"]),
        ("[RotateY(90), ", "[Scale(1e18), ", 35, &["Box", "beyond 1e18"]),
        ("[RotateY(90), ", "[RotateW(90), ", 35, &["RotateW", "ScaleXyz"]),
        ("a.glb", "a.fbx", 36, &["a.fbx", ".gltf, .glb, .obj, .ply"]),
        ("Scale(2), ", "Scale(0), ", 38, &["0 is not a factor"]),
        ("ScaleXyz((1, 2, -3))", "ScaleXyz((1, 2))", 38, &["3"]),
        ("axis: (1, 1, 1)", "axis: (0, 0, 0)", 39, &["not a direction"]),
        ("(0, 0, 1, 6)", "(0, 1, 0, 6)", 41, &["singular"]),
        ("material: \"frost\"", "material: \"fros\"", 41, &["unknown material \"fros\""]),
        ("intensity: (1, 1, 1)),", "intensity: (1, 1, -1)),", 44, &["-1 is not a finite strength"]),
        ("outer_angle: 90", "outer_angle: 91", 45, &["91 is not", "90 degrees"]),
        ("inner_angle: 10", "inner_angle: 90", 45, &["inner_angle 90 must be less"]),
        ("direction: (0, -1, 0), irr", "direction: (0, 0, 0), irr", 46, &["not a direction"]),
        ("lights: [", "lamps: [", 43, &["lamps", "lights"]),
    ];
    for (from, to, line, words) in cases {
        assert!(ALL.contains(from), "{from}");
        let text = ALL.replacen(from, to, 1);
        let message = parse(&text, "all.ron").expect_err(to).to_string();
        assert!(message.starts_with(&format!("all.ron:{line}:")), "{to}: not line {line}: {message}");
        for word in *words {
            assert!(message.contains(word), "{to}: no {word:?} in: {message}");
        }
    }
}

#[test]
fn the_column_is_that_of_the_value() {
    let place = |from: &str, to: &str| match parse(&FIRST.replacen(from, to, 1), "first.ron") {
        Err(SceneError::Invalid { line, column, .. }) => (line, column),
        other => panic!("{other:?}"),
    };
    // Columns count characters, not bytes. A name's column is that of its quotation mark, with or
    // without escapes.
    assert_eq!(place("objects: [Sphere", "/*ä*/objects: [Spher"), (7, 20));
    assert_eq!(
        place("objects: [", "/*ä*/objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"b\"),"),
        (7, 67)
    );
    assert_eq!(place("material: \"a\"", r#"material: "\u{62}""#), (7, 62));
    assert_eq!(place("radius: 1", "radius: 0"), (7, 49));
}

#[test]
fn singular_transforms_are_refused() {
    for text in [
        "[Matrix(((1, 2, 3, 0), (4, 5, 6, 0), (7, 8, 9, 0)))]",
        "[Matrix(((0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0)))]",
        "[Matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 0)))]",
        "[Scale(1e-18), Scale(1e-18)]",
    ] {
        let error = ron::from_str::<Transform>(text).expect_err(text).to_string();
        assert!(error.contains("singular"), "{text}: {error}");
    }
    let error = ron::from_str::<Transform>("[Scale(1e18), Scale(1e18)]").expect_err("large").to_string();
    assert!(error.contains("beyond 1e18"), "{error}");
}

#[test]
fn a_sun_out_of_range_is_refused() {
    let sky = |fields: &str| {
        let text = format!(
            "Scene(version: 1, image: (width: 1, height: 1), materials: {{}}, objects: [],\n  sky: Sun({fields}),\n)"
        );
        parse(&text, "sun.ron").map(|scene| scene.sky.sun().expect("a sun"))
    };
    let default = sky("elevation: 30").expect("defaults");
    assert_eq!(default, crate::sun_sky::SunSky::new(0.0, 30.0));
    let up = sky("direction: (0, 3, 0), sun_disc: false").expect("straight up");
    assert!((up.azimuth, up.elevation, up.sun_disc) == (0.0, 90.0, false));
    for (fields, words) in [
        ("", &["no place of the sun", "elevation and azimuth"][..]),
        ("azimuth: 20", &["no place of the sun"]),
        ("elevation: 20, direction: (0, 1, 0)", &["given twice"]),
        ("azimuth: 20, direction: (0, 1, 0)", &["given twice"]),
        ("direction: (0, -0.1, 1)", &["below the horizon", "its y must be 0 or more"]),
        ("direction: (0, 0, 0)", &["not a direction"]),
        ("elevation: -1", &["-1 is not an elevation between 0 (the horizon) and 90"]),
        ("elevation: 91", &["91 is not an elevation"]),
        ("elevation: NaN", &["NaN is not an elevation"]),
        ("elevation: inf", &["inf is not an elevation"]),
        ("elevation: 9, azimuth: 1e7", &["-1e6 and 1e6 degrees"]),
        ("elevation: 9, turbidity: 0.5", &["0.5 is not a turbidity between 1 (pure air) and 10"]),
        ("elevation: 9, turbidity: 11", &["11 is not a turbidity"]),
        ("elevation: 9, ground_albedo: 1.5", &["1.5 is not between 0 and 1"]),
        ("elevation: 9, sun_radius: 0", &["0 is not an angular radius of the sun between 0.2 and 5"]),
        ("elevation: 9, scale: -1", &["-1 is not a finite factor"]),
        ("elevation: 9, haze: 1", &["haze", "turbidity"]),
    ] {
        let message = sky(fields).expect_err(fields).to_string();
        assert!(message.starts_with("sun.ron:2:"), "{fields}: {message}");
        for word in words {
            assert!(message.contains(word), "{fields}: no {word:?} in: {message}");
        }
    }
}
