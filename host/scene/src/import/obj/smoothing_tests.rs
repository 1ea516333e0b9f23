//! Tests of smoothing groups.

use super::super::NoFiles;
use super::super::testing::Memory;
use super::{parse, parse_unsmoothed};
use crate::description::Description;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;
use std::fmt::Write;

const SIDES: usize = 12;

fn read(text: &str) -> Description {
    parse(text.as_bytes(), "a.obj", &mut NoFiles).unwrap()
}

/// Returns the vertices of a cylinder around y: those of the lower rim have odd numbers.
fn rims() -> String {
    (0..SIDES).fold(String::new(), |mut text, side| {
        let (z, x) = (TAU * side as f64 / SIDES as f64).sin_cos();
        writeln!(text, "v {x} -1 {z}\nv {x} 1 {z}").unwrap();
        text
    })
}

/// Returns a side of the cylinder as a face.
fn side(number: usize) -> String {
    let [low, next] = [2 * number + 1, 2 * ((number + 1) % SIDES) + 1];
    format!("f {low} {} {} {next}\n", low + 1, next + 1)
}

fn sides() -> String {
    (0..SIDES).map(side).collect()
}

/// Returns the upper end of the cylinder as a face.
fn end() -> String {
    let corners: Vec<String> = (1..=SIDES).rev().map(|corner| (2 * corner).to_string()).collect();
    format!("f {}\n", corners.join(" "))
}

/// Returns each vertex with a normal: its position and the normal.
fn normals(scene: &Description) -> Vec<(DVec3, DVec3)> {
    let double = |v: &[f32; 3]| Vec3::from(*v).as_dvec3();
    let of = scene.meshes.iter().flat_map(|mesh| mesh.positions.iter().zip(&mesh.normals));
    of.map(|(position, normal)| (double(position), double(normal))).collect()
}

/// Returns the largest distance of a normal from that of the round cylinder.
fn error(scene: &Description) -> f64 {
    let far = |(p, normal): (DVec3, DVec3)| normal.distance(DVec3::new(p.x, 0.0, p.z).normalize());
    normals(scene).into_iter().map(far).fold(0.0, f64::max)
}

#[test]
fn a_group_is_smooth() {
    let scene = read(&format!("{}s 1\n{}", rims(), sides()));
    assert_eq!((scene.meshes[0].positions.len(), scene.meshes[0].normals.len()), (2 * SIDES, 2 * SIDES));
    assert!(error(&scene) < 1e-6, "{}", error(&scene));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // Control: the normals of the faces are far from those.
    let faces = (0..SIDES).map(|side| (TAU * (side as f64 + 0.5) / SIDES as f64).sin_cos());
    assert!(faces.zip(0..).all(|((z, x), side)| {
        let (round_z, round_x) = (TAU * f64::from(side) / SIDES as f64).sin_cos();
        DVec3::new(x, 0.0, z).distance(DVec3::new(round_x, 0.0, round_z)) > 0.2
    }));
    // Control: without a group, the faces are flat.
    for flat in ["", "s off\n", "s 0\n", "s 1\ns off\n", "s 1\ns 0 # none\n"] {
        let scene = read(&format!("{}{flat}{}", rims(), sides()));
        assert!(scene.meshes[0].normals.is_empty() && scene.warnings.is_empty(), "{flat}");
    }
    // A statement is for the faces after it.
    let scene = read(&format!("{}{}s 1\n{}", rims(), side(0), side(1)));
    assert_eq!(scene.meshes.iter().map(|mesh| mesh.normals.len()).collect::<Vec<_>>(), [0, 4]);
}

#[test]
fn groups_meet_in_an_edge() {
    let model = |group: &str| read(&format!("{}s 1\n{}{group}{}", rims(), sides(), end()));
    let apart = model("s 2\n");
    let (up, around): (Vec<_>, _) = normals(&apart).into_iter().partition(|(_, normal)| normal.y > 0.5);
    assert!(up.len() == SIDES && up.iter().all(|(_, normal)| normal.distance(DVec3::Y) < 1e-6));
    assert!(around.len() == 2 * SIDES && around.iter().all(|(_, normal)| normal.y.abs() < 1e-6));
    // Control: in one group the rim is round. A group continues after another one.
    for joined in ["", "s 2\ns 1\n"] {
        let joined = normals(&model(joined));
        let rim = joined.iter().filter(|(_, normal)| (0.3..0.9).contains(&normal.y));
        assert_eq!((joined.len(), rim.count()), (2 * SIDES, SIDES));
    }
}

/// Materials, objects and groups make meshes, whose borders stay smooth.
#[test]
fn meshes_of_a_group_are_joined() {
    for change in ["usemtl", "o", "g"] {
        let halves = [sides(), sides()].concat();
        let faces: Vec<&str> = halves.lines().take(SIDES).collect();
        let (first, second) = faces.split_at(SIDES / 2);
        let scene = read(&format!(
            "{}{change} a\ns 1\n{}\n{change} b\n{}\n",
            rims(),
            first.join("\n"),
            second.join("\n")
        ));
        assert_eq!(scene.meshes.len(), 2, "{change}");
        assert!(error(&scene) < 1e-6, "{change}: {}", error(&scene));
    }
}

/// A corner of a cube has one face at one side that is two triangles, and they count as one face.
#[test]
fn faces_count_by_their_angles() {
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 0\nv 1 0 1\nv 0 1 1\ns 1\n\
         f 1 3 5\nf 1 5 2\nf 1 2 6 4\nf 1 4 7 3\n";
    let at_corner = |text: &str| {
        let all = normals(&read(text));
        all.iter().find(|(position, _)| *position == DVec3::ZERO).unwrap().1
    };
    assert!(at_corner(cube).distance(DVec3::NEG_ONE.normalize()) < 1e-6);
    // Control: another triangle on the same side leans the normal to it.
    assert!(at_corner(&format!("{cube}f 1 3 5\n")).distance(DVec3::NEG_ONE.normalize()) > 0.1);
}

#[test]
fn given_normals_stay_and_count() {
    // The second face leans, and has a normal that is not its own.
    let roof = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv -1 -1 0\nvn 1 0 0\ns 1\nf 1 2 3\n";
    let scene = read(&format!("{roof}f 1//1 4//1 2//1\n"));
    let [smooth, given] = &scene.meshes[..] else { panic!() };
    assert_eq!(given.normals, [[1.0, 0.0, 0.0]; 3]);
    let ridge = Vec3::from(smooth.normals[0]);
    assert!(ridge.x < -0.1 && ridge.y > 0.5, "{ridge}");
    // Control: the face alone has its own normal.
    assert_eq!(read(roof).meshes[0].normals, [[0.0, 1.0, 0.0]; 3]);
}

/// Faces without area add nothing, and where normals cancel each face has its own.
#[test]
fn positions_without_a_mean_are_flat() {
    let triangle = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 2 0 0\ns 1\nf 1 2 3\n";
    let scene = read(&format!("{triangle}f 1 3 4\nf 1 1 2\n"));
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert!(scene.meshes[0].normals.iter().take(3).all(|normal| *normal == [0.0, 1.0, 0.0]));
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    let both = read(&format!("{triangle}f 3 2 1\n"));
    let ys: Vec<f32> = both.meshes[0].normals.iter().map(|normal| normal[1]).collect();
    assert_eq!(ys, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
    assert_eq!(both.meshes[0].triangles.len(), 2);
}

/// Mitsuba's own normals do not depend on the groups.
#[test]
fn groups_may_be_ignored() {
    let text = format!("{}s 1\n{}", rims(), sides());
    let scene = parse_unsmoothed(text.as_bytes(), "a.obj", &mut Memory::default()).unwrap();
    assert!(scene.meshes[0].normals.is_empty() && scene.warnings.is_empty(), "{:?}", scene.warnings);
}
