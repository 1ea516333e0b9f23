use crate::SceneDocument;

/// Returns the warnings about a scene with a floor of 10 x 10 and the given parts.
fn scene(sky: &str, lights: &str, objects: &str) -> Vec<String> {
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 4),
         camera: (look_from: (0, 1, 9), look_at: (0, 1, 0), vertical_fov: 40), {sky}
         materials: {{ \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)), \"glass\": MetallicRoughness(metallic: 0, transmission: 1, roughness: 0, layers: (volume: (attenuation_distance: 1, attenuation_color: (0.5, 1, 1)))), \"clear\": Dielectric(ior: 1.5), \"wall\": MetallicRoughness(metallic: 0, transmission: 1, roughness: 0),
           \"frost\": RoughDielectric(ior: 1.5, roughness: 0.3),
           \"lamp\": Emissive(radiance: (4, 4, 4)), \"off\": Emissive(radiance: (0, 0, 0)) }},
         objects: [Quad(corner: (-5, 0, 5), u: (10, 0, 0), v: (0, 0, -10), material: \"grey\"), {objects}],
         lights: [{lights}])"
    );
    let described = SceneDocument::parse(&text, "a.ron").unwrap_or_else(|error| panic!("{error}"));
    super::warnings(&described.description, 1.5)
}

#[test]
fn a_scene_without_light() {
    let bright = "sky: Uniform(radiance: (1, 1, 1)),";
    let point = "Point(position: (0, 3, 0), intensity: (1, 1, 1))";
    let ball = |material: &str| format!("Sphere(center: (0, 1, 0), radius: 1, material: \"{material}\")");
    for (sky, lights, object) in [
        ("", "", "grey"),
        ("sky: Uniform(radiance: (0, 0, 0)),", "", "off"),
        ("", &point.replace("(1, 1, 1)", "(0, 0, 0)"), "grey"),
    ] {
        let said = scene(sky, lights, &ball(object));
        assert!(
            said.len() == 1 && said[0].starts_with("no light") && said[0].contains("add a `sky`"),
            "{said:?}"
        );
    }
    // Each scene also has an emitting material that no object uses, which does not count.
    for (sky, lights, object) in [(bright, "", "grey"), ("", point, "grey"), ("", "", "lamp")] {
        assert!(scene(sky, lights, &ball(object)).is_empty(), "{sky} {lights} {object}");
    }
}

/// Portals under a black sky do nothing, which one line says.
#[test]
fn portals_without_a_sky_are_named() {
    let portals = "], portals: [(corner: (-1, 0, 0), u: (0, 1, 0), v: (0, 0, 1))";
    let said = scene("", &format!("{SUN}{portals}"), "");
    assert!(said.len() == 1 && said[0].starts_with("portals: the sky is black"), "{said:?}");
    assert!(scene("sky: Uniform(radiance: (1, 1, 1)),", portals, "").is_empty());
}

const SUN: &str = "Directional(direction: (0, -1, -1), irradiance: (3, 3, 3))";
const LAMP: &str = "Point(position: (0, 4, 4), intensity: (9, 9, 9))";

#[test]
fn a_pane_turns_a_light_off() {
    let quad = "Quad(corner: (-1, 0, 2), u: (2, 0, 0), v: (0, 3, 0), material: \"glass\")";
    let thin = "Box(min: (-1, 0, 0), max: (1, 3, 0.02), transform: [RotateY(10), Translate((0, 0, 2))], material: \"glass\")";
    let disc = "Disc(center: (0, 1, 2), normal: (0, 0, 1), radius: 1, material: \"glass\")";
    let water = "Plane(point: (0, 0.5, 0), normal: (0, 1, 0), material: \"glass\")";
    for glass in [quad, thin, disc, water] {
        for light in [SUN, LAMP] {
            let said = scene("", light, glass);
            assert!(
                said.len() == 1 && said[0].contains("objects[1]") && said[0].contains("lights[0]"),
                "{glass}: {said:?}"
            );
            assert!(
                said[0].contains("use Dielectric") && said[0].contains("give the light an area"),
                "{said:?}"
            );
            for other in ["frost", "clear", "wall"] {
                assert!(scene("", light, &glass.replace("glass", other)).is_empty(), "{glass}: {other}");
            }
        }
        // Light from objects and from the sky passes the glass.
        let lamp = format!("{glass}, Sphere(center: (0, 4, 4), radius: 0.1, material: \"lamp\")");
        assert!(
            scene("", "", &lamp).is_empty()
                && scene("sky: Uniform(radiance: (1, 1, 1)),", "", glass).is_empty()
        );
    }
    // A spot that points elsewhere, and a sun that shines away from the floor.
    let spot = "Spot(position: (0, 1, 4), direction: (0, 0, 1), intensity: (9, 9, 9), outer_angle: 30)";
    assert!(scene("", spot, quad).is_empty());
    assert!(scene("", "Directional(direction: (0, 1, -1), irradiance: (3, 3, 3))", quad).is_empty());
}

#[test]
fn solid_glass_on_a_floor_is_no_pane() {
    let ball = "Sphere(center: (0, 1, 0), radius: 1, material: \"glass\")";
    let block = "Box(min: (-1, 0, -1), max: (1, 2, 1), transform: [RotateY(30)], material: \"glass\")";
    for (glass, light) in [(ball, SUN), (ball, LAMP), (block, SUN), (block, LAMP)] {
        assert!(scene("", light, glass).is_empty(), "{glass} {light}");
        // But objects within it stay dark, and so do objects around a light inside it.
        let within = format!("{glass}, Sphere(center: (0, 1, 0.2), radius: 0.3, material: \"grey\")");
        assert_eq!(scene("", light, &within).len(), 1, "{glass} {light}");
        let bulb = "Point(position: (0, 1, 0), intensity: (9, 9, 9))";
        assert_eq!(scene("", bulb, glass).len(), 1, "{glass}");
    }
}

#[test]
fn a_texture_on_a_plane() {
    let folder = std::env::temp_dir().join(format!("trisect-warnings-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap_or_else(|error| panic!("{error}"));
    let said = |object: &str| {
        let text = format!(
            "Scene(version: 1, image: (width: 8, height: 4),
             camera: (look_from: (0, 1, 9), look_at: (0, 1, 0), vertical_fov: 40),
             sky: Uniform(radiance: (1, 1, 1)), textures: {{ \"t\": (file: \"t.png\") }},
             materials: {{ \"t\": Lambertian(albedo: (1, 1, 1), texture: \"t\"), \"grey\": Lambertian(albedo: (1, 1, 1)) }},
             objects: [{object}])"
        );
        let path = folder.join("a.ron");
        let written = image::RgbImage::new(1, 1).save(folder.join("t.png"));
        assert!(written.is_ok() && std::fs::write(&path, text).is_ok());
        let described = SceneDocument::load(&path).unwrap_or_else(|error| panic!("{error}"));
        super::warnings(&described.description, 1.5)
    };
    let plane = "Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"t\")";
    let found = said(&format!("{plane}, {plane}"));
    assert!(found.len() == 1 && found[0].starts_with("objects[0], a plane of \"t\""), "{found:?}");
    assert!(found[0].contains("use a Quad"), "{found:?}");
    assert!(said(&plane.replace("\"t\"", "\"grey\"")).is_empty());
    assert!(said("Quad(corner: (0, 0, 0), u: (1, 0, 0), v: (0, 0, -1), material: \"t\")").is_empty());
    let _ = std::fs::remove_dir_all(folder);
}
