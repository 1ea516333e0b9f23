//! Tests of the camera, the light and the ground that a model without a scene file gets.

use super::*;
use crate::description::{Instance, Lambertian, Material, Mesh, PunctualLight};
use crate::surroundings::{EnvironmentSource, Sun};
use crate::{CameraPose, Rebase, SceneDocument};
use glam::DAffine3;

/// Returns a model of one triangle that stands on y = 2.
fn model() -> Description {
    let mesh = Mesh {
        positions: vec![[0.0, 2.0, 0.0], [1.0, 2.0, 0.0], [0.0, 3.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    Description {
        materials: vec![Material::from(Lambertian::rgb(0.5, 0.5, 0.5))],
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, transform: DAffine3::IDENTITY }],
        ..Description::default()
    }
}

fn with_camera(look_from: DVec3) -> Description {
    let camera = CameraPose { look_from, look_at: DVec3::Y * 2.5, ..CameraPose::PINHOLE };
    Description { cameras: vec![("own".to_owned(), camera)], ..model() }
}

fn completed(model: Description, surroundings: &Surroundings) -> Completed {
    complete(model, surroundings).unwrap()
}

fn by_default(model: Description) -> Completed {
    completed(model, &Surroundings::default())
}

fn ground(on: bool) -> Surroundings {
    Surroundings { ground: Some(on), ..Surroundings::default() }
}

fn sun() -> PunctualLight {
    Sun { azimuth: 150.0, elevation: 40.0, irradiance: Some(3.0) }.light()
}

#[test]
fn a_bare_model_gets_camera_studio_and_ground() {
    let Completed { description, notes, .. } = by_default(model());
    assert_eq!(description.cameras.len(), 1);
    assert!(matches!(description.sky, Some(Sky::Studio { .. })));
    let ground = description.ground.unwrap();
    assert!(ground.center.y < 2.0 && ground.center.y > 1.999, "{ground:?}");
    assert!(description.warnings.is_empty() && notes.len() == 2, "{notes:?}");
}

/// A model with cameras or light is a scene of its own.
#[test]
fn own_cameras_and_lights_need_no_ground() {
    let seen = by_default(with_camera(DVec3::new(0.0, -5.0, 3.0))).description;
    assert!(seen.ground.is_none() && matches!(seen.sky, Some(Sky::Studio { .. })));
    let lit = by_default(Description { lights: vec![sun()], ..model() }).description;
    assert!(lit.ground.is_none() && lit.sky.is_none());
    let sky = Some(Sky::Gradient { bottom: DVec3::ZERO, top: DVec3::ONE });
    let under_sky = by_default(Description { sky, ..model() }).description;
    assert!(under_sky.ground.is_none() && matches!(under_sky.sky, Some(Sky::Gradient { .. })));
    assert!(by_default(Description::default()).description.ground.is_none());
}

#[test]
fn surroundings_override_what_is_given() {
    let Completed { description, notes, .. } =
        completed(with_camera(DVec3::new(0.0, -5.0, 3.0)), &ground(true));
    assert!(description.ground.is_some() && notes.iter().any(|note| note.contains("`ground` off")));
    // Negative control: a camera above the ground.
    let above = completed(with_camera(DVec3::new(0.0, 5.0, 3.0)), &ground(true));
    assert!(!above.notes.iter().any(|note| note.contains("`ground` off")), "{:?}", above.notes);
    assert!(completed(model(), &ground(false)).description.ground.is_none());
    let environment = Some(EnvironmentSource::Uniform);
    let sun = Some(Sun { azimuth: 0.0, elevation: 90.0, irradiance: Some(1.0) });
    let all = Surroundings { environment, sun, ground: None };
    let lit = completed(Description { lights: vec![self::sun()], ..model() }, &all).description;
    assert!(matches!(lit.sky, Some(Sky::Gradient { bottom: DVec3::ONE, .. })));
    assert_eq!(lit.lights.len(), 2);
    // Beside a sun, the studio that a model gets is dimmed; one that was asked for is not.
    let sunlit = Surroundings { sun, ..Surroundings::default() };
    assert!(matches!(completed(model(), &sunlit).description.sky, Some(Sky::Studio { scale: 0.4, .. })));
    let asked = Surroundings { environment: Some(EnvironmentSource::Studio), ..sunlit };
    assert!(matches!(completed(model(), &asked).description.sky, Some(Sky::Studio { scale: 1.0, .. })));
    // The sun is no light of the model itself: the ground stays.
    assert!(completed(model(), &all).description.ground.is_some());
}

#[test]
fn a_model_that_is_too_large_or_too_small_gets_no_ground() {
    for (scale, has) in [(1.0, true), (1e-15, false), (1e12, false)] {
        let mut scaled = model();
        scaled.instances[0].transform = DAffine3::from_scale(DVec3::splat(scale));
        let Completed { description, notes, .. } = by_default(scaled);
        assert_eq!(description.ground.is_some(), has, "{scale}");
        assert_eq!(notes.iter().any(|note| note.starts_with("no ground")), !has, "{notes:?}");
    }
}

#[test]
fn scenes_take_environment_and_sun_but_no_ground() {
    let text = "Scene(version: 1, image: (width: 8, height: 4), materials: {}, objects: [], \
                camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40)FIELDS)";
    let parse = |fields: &str| SceneDocument::parse(&text.replace("FIELDS", fields), "a.ron").unwrap();
    let environment =
        |of: EnvironmentSource| Surroundings { environment: Some(of), ..Surroundings::default() };
    let bright = ", sky: Uniform(radiance: (1, 1, 1))";
    let replaced = parse(bright).surrounded(&environment(EnvironmentSource::Studio)).unwrap().description;
    assert!(matches!(replaced.sky, Some(Sky::Studio { .. })));
    let kept = parse(bright).surrounded(&Surroundings::default()).unwrap().description;
    assert!(matches!(kept.sky, Some(Sky::Gradient { .. })));
    let own = parse(", sky: Studio(scale: 2, rotation: 90), ground: (center: (0, 1, 0), size: 2)");
    assert!(matches!(own.description.sky, Some(Sky::Studio { scale: 2.0, .. })));
    assert_eq!(own.description.ground, Some(Ground { center: DVec3::Y, size: 2.0 }));
    assert!(own.clone().surrounded(&ground(false)).unwrap().description.ground.is_none());
    assert!(own.surrounded(&ground(true)).unwrap().description.ground.is_some());
    let error = parse("").surrounded(&ground(true)).unwrap_err().to_string();
    assert!(error.contains("a.ron: `ground` on is for models"), "{error}");
    let missing = environment(EnvironmentSource::File("none.exr".into()));
    let error = parse("").surrounded(&missing).unwrap_err().to_string();
    assert!(error.contains("none.exr: No such file"), "{error}");
}

/// The ground becomes triangles behind all others, and moves with the scene's space.
#[test]
fn the_ground_is_lowered_after_the_model() {
    let document = SceneDocument::from_model(model(), "a.obj").unwrap();
    let scene = document.clone().lower(Rebase::IDENTITY).unwrap();
    assert!(scene.triangles.len() > 1000 && scene.vertices[0].material == 0);
    let last = scene.triangles[scene.triangles.len() - 1];
    assert!(last.a.y < 2.0 && last.a.y > 1.999 && scene.vertices[last.vertex_a as usize].material == 1);
    let moved = document.lower(Rebase { origin: DVec3::Y * 2.0, scale: 4.0 }).unwrap();
    let there = moved.triangles[moved.triangles.len() - 1];
    assert!((there.a.x / last.a.x - 4.0).abs() < 1e-4 && there.a.y < 0.0 && there.a.y > -0.01);
    // Negative control: without a ground there is the model alone.
    let alone = SceneDocument::from_model_in_surroundings(model(), "a.obj", &ground(false)).unwrap();
    assert_eq!(alone.lower(Rebase::IDENTITY).unwrap().triangles.len(), 1);
}
