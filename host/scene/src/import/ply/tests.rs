//! Tests of whole PLY files.

use super::super::testing::{DETAILS, FAR, ROUNDED, error_in_space, far_vertices, rounded_in_world};
use super::*;

fn header(format: &str, vertex: &str, count: &str, index: &str, faces: usize) -> String {
    let properties: String =
        vertex.split(' ').map(|p| format!("property {}\n", p.replace(':', " "))).collect();
    format!(
        "ply\nformat {format} 1.0\ncomment a\nelement vertex 4\n{properties}element face {faces}\n\
         property list {count} {index} vertex_indices\nend_header\n"
    )
}

fn error(bytes: &[u8]) -> String {
    parse(bytes, "a.ply").unwrap_err().to_string()
}

const VERTICES: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn text() {
    let body = "0 0 0 9 0 0\n1 0 0 9 1 0\n1 1 0 9 1 1\r\n0 1 0 9 0 0.25\n4 0 1 2 3\n3 0 1 1\n2 0 1";
    let vertex = "float:x float:y double:z uchar:red float:s float:t";
    let scene = parse((header("ascii", vertex, "uchar", "int", 3) + body).as_bytes(), "a.ply").unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!((&mesh.positions[..], &mesh.triangles[..]), (&VERTICES[..], &[[0, 1, 2], [0, 2, 3]][..]));
    assert_eq!(mesh.uvs[3], [0.0, 0.75]);
    assert!(mesh.normals.is_empty());
    assert_eq!(scene.materials[0].name, "default");
    assert_eq!(
        scene.warnings,
        [
            "these properties of PLY vertices are not supported and ignored: red",
            "faces with fewer than three vertices, dropped: 1, the first in face 2",
            "triangles without area or with a vertex twice, dropped: 1, the first in face"
        ]
    );
}

#[test]
fn binary_of_both_orders() {
    for big in [false, true] {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let vertex = "float:x float:y float:z float:nx float:ny float:nz";
        let mut file = header(format, vertex, "ushort", "uint", 1).into_bytes();
        let mut push = |mut bytes: Vec<u8>| {
            if big {
                bytes.reverse();
            }
            file.extend(bytes);
        };
        for [x, y, z] in VERTICES {
            for number in [x, y, z, 0.0, 0.0, 2.0] {
                push(number.to_le_bytes().to_vec());
            }
        }
        push(4u16.to_le_bytes().to_vec());
        for index in 0..4u32 {
            push(index.to_le_bytes().to_vec());
        }
        let scene = parse(&file, "a.ply").unwrap();
        assert_eq!(scene.meshes[0].positions, VERTICES);
        assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, 1.0]; 4]);
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
        for length in 0..file.len() {
            assert!(parse(&file[..length], "a.ply").is_err(), "{length}");
        }
    }
}

#[test]
fn faces_may_come_first_and_others_are_skipped() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\n\
                element edge 1\nproperty list int float a\nproperty int b\nelement nothing 18446744073709551615\n\
                element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
                7 3 0 1 2 2 0.5 0.5 1 0 0 0 1 0 0 0 1 0";
    let scene = parse(text.as_bytes(), "a.ply").unwrap();
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(scene.warnings.len(), 3);
}

#[test]
fn errors_say_what_and_where() {
    let file = |vertex: &str, body: &str| header("ascii", vertex, "uchar", "int", 1) + body;
    let xyz = "float:x float:y float:z";
    let four = "0 0 0 1 0 0 1 1 0 0 1 0 ";
    for (text, expected) in [
        (file("float:x float:y", four), "vertex: it has no x, y and z"),
        (file(xyz, &format!("{four} 3 0 1 4")), "face 0: it has vertex 4, and there are 4"),
        (file(xyz, &format!("{four} 3 0 1 -1")), "face 0: it has vertex -1"),
        (file(xyz, &format!("{four} 3 0 1 0.5")), "face 0: it has vertex 0.5"),
        (file(xyz, &format!("{four} 250 0 1 2")), "the length of a list is 250 members"),
        (file(xyz, &format!("{four} -3 0 1 2")), "the length of a list is -3 members"),
        (
            file(xyz, &four.replace("1 1 0", "1 nan 0")),
            "vertex 2: its position (1e0, NaN, 0e0) is not finite",
        ),
        (file(xyz, "0 0 0"), "element vertex: 4 members need at least 6 bytes each, but 5 bytes are left"),
        (file(xyz, &four.replace("1 1 0", "1 one 0")), "\"one\" is not a number"),
        (file("float:x half:y", ""), "line 6: \"property half y\" is of an unknown type"),
        (header("ascii", xyz, "uchar", "float", 1), "must be of an integer type"),
        ("ply\n".to_owned(), "line 2: the header has no end"),
        ("plx\n".to_owned(), "line 1: this is not a PLY file"),
        ("ply\nend_header\n".to_owned(), "header: it has no line \"format\""),
    ] {
        let message = error(text.as_bytes());
        assert!(message.contains(expected), "{message}");
    }
}

/// Text files, whatever type their header names, and binary files of doubles.
#[test]
fn models_far_from_the_origin_keep_their_shape() {
    let text =
        header("ascii", "float:x float:y float:z", "uchar", "int", 1) + &far_vertices("") + "4 0 1 2 3\n";
    let mut binary =
        header("binary_little_endian", "double:x double:y double:z", "uchar", "uchar", 1).into_bytes();
    binary.extend(DETAILS.iter().flat_map(|&p| (FAR + p).to_array()).flat_map(f64::to_le_bytes));
    binary.extend([4, 0, 1, 2, 3]);
    for file in [text.into_bytes(), binary] {
        let scene = parse(&file, "a.ply").unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let error = error_in_space(scene.clone());
        assert!(error <= ROUNDED, "{error:e}");
        let control = error_in_space(rounded_in_world(scene));
        assert!(control > 0.1, "{control:e}");
    }
}

#[test]
fn single_precision_far_from_the_origin_is_a_warning() {
    let read = |place: f32, size: f32| {
        let mut file =
            header("binary_little_endian", "float:x float:y float:z", "uchar", "uchar", 1).into_bytes();
        let numbers = VERTICES.as_flattened().iter().map(|x| place + size * x);
        file.extend(numbers.flat_map(f32::to_le_bytes));
        file.extend([4, 0, 1, 2, 3]);
        parse(&file, "a.ply").unwrap()
    };
    let scene = read(1e5, 0.125);
    let message = "meshes in single precision far from the origin, whose small details the file has lost; export double \
                   precision, or move the model to the origin first: 1, the first in vertex";
    assert_eq!(scene.warnings, [message]);
    assert!(read(1e5, 1e-3).warnings.contains(&message.to_owned()));
    for (place, size) in [(0.0, 1.0), (1e5, 64.0)] {
        let scene = read(place, size);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!(scene.instances[0].transform, DAffine3::IDENTITY);
    }
}

#[test]
fn models_near_the_origin_keep_their_bits() {
    let body = "0.1 -0 0\n16.7 0 0\n1 0.3 0\n0 1 1e-9\n4 0 1 2 3\n";
    let text = header("ascii", "double:x double:y double:z", "uchar", "int", 1) + body;
    let scene = parse(text.as_bytes(), "a.ply").unwrap();
    assert_eq!(scene.instances[0].transform, DAffine3::IDENTITY);
    let expected = [[0.1f32, -0.0, 0.0], [16.7, 0.0, 0.0], [1.0, 0.3, 0.0], [0.0, 1.0, 1e-9]];
    let bits = |positions: &[[f32; 3]]| positions.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
    assert_eq!(bits(&scene.meshes[0].positions), bits(&expected));
}
