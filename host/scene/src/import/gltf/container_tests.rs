//! Compressed geometry and textures against the same model without compression. The files are those
//! of tests/reference/containers/make.py, which uses the codecs' own encoders.

use super::*;
use crate::description::{Mesh, Texels};
use crate::error::SceneError;
use crate::import::NoFiles;
use glam::Vec3;

const PLAIN: &[u8] = include_bytes!("../../../assets/containers/plain.glb");
const DRACO: &[u8] = include_bytes!("../../../assets/containers/draco.glb");
const EXT_MESHOPT: &[u8] = include_bytes!("../../../assets/containers/ext_meshopt.glb");
const KHR_MESHOPT: &[u8] = include_bytes!("../../../assets/containers/khr_meshopt.glb");
const WEBP: &[u8] = include_bytes!("../../../assets/containers/webp.glb");
const ETC1S: &[u8] = include_bytes!("../../../assets/containers/etc1s.glb");
const UASTC: &[u8] = include_bytes!("../../../assets/containers/uastc.glb");

fn read(bytes: &[u8]) -> Result<Description, SceneError> {
    parse(bytes, "a.glb", &ModelOptions::default(), &mut NoFiles)
}

fn mesh(bytes: &[u8]) -> Mesh {
    let scene = read(bytes).unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    scene.meshes[0].clone()
}

fn texels(bytes: &[u8]) -> Vec<[u8; 4]> {
    match &read(bytes).unwrap().images[0].texels {
        Texels::Srgb8(texels) => texels.clone(),
        _ => panic!("a base colour is sRGB-encoded"),
    }
}

#[test]
fn meshopt_gives_the_same_numbers() {
    let plain = mesh(PLAIN);
    for (name, file) in [("EXT", EXT_MESHOPT), ("KHR", KHR_MESHOPT)] {
        let found = mesh(file);
        assert_eq!(found.positions, plain.positions, "{name}");
        assert_eq!((found.normals, found.uvs), (plain.normals.clone(), plain.uvs.clone()), "{name}");
        // Triangles may begin at another of their vertices.
        let turned = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
        let sorted = |triangles: &[[u32; 3]]| triangles.iter().map(|&of| turned(of)).collect::<Vec<_>>();
        assert_eq!(sorted(&found.triangles), sorted(&plain.triangles), "{name}");
    }
}

/// Draco sorts and rounds vertices (14 bits here): each must still be one of the ball, with its
/// normal and its height on the texture.
#[test]
fn draco_gives_the_same_ball() {
    let (plain, found) = (mesh(PLAIN), mesh(DRACO));
    assert_eq!(found.triangles.len(), plain.triangles.len());
    for ((position, normal), [_, v]) in found.positions.iter().zip(&found.normals).zip(&found.uvs) {
        let position = Vec3::from(*position);
        assert!((position.length() - 1.0).abs() < 1e-3, "{position}");
        assert!((Vec3::from(*normal) - position).length() < 2e-3, "{position} {normal:?}");
        let height = position.y.clamp(-1.0, 1.0).acos() * std::f32::consts::FRAC_1_PI;
        assert!((height - v).abs() < 0.01, "{position} {v}");
    }
    for corners in &found.triangles {
        let [a, b, c] = corners.map(|corner| Vec3::from(found.positions[corner as usize]));
        assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "a triangle is turned inside out");
    }
}

#[test]
fn textures_are_the_same_or_near() {
    let plain = texels(PLAIN);
    assert_eq!(texels(WEBP), plain);
    // Of lossy codecs; ETC1S has one hue for a block of 4 x 4 texels.
    for (name, file, mean_allowed, allowed) in [("UASTC", UASTC, 4.0, 20), ("ETC1S", ETC1S, 10.0, 60)] {
        let found = texels(file);
        assert_eq!(found.len(), plain.len(), "{name}");
        let apart = found.as_flattened().iter().zip(plain.as_flattened()).map(|(a, b)| a.abs_diff(*b));
        let (sum, most) = apart.fold((0u32, 0), |(sum, most), by| (sum + u32::from(by), most.max(by)));
        let mean = f64::from(sum) / (4 * plain.len()) as f64;
        assert!(mean < mean_allowed && most <= allowed, "{name}: {mean} {most}");
        // Negative control: the picture turned upside down is not near.
        let turned = found.iter().rev().zip(&plain).map(|(a, b)| u32::from(a[1].abs_diff(b[1])));
        assert!(turned.sum::<u32>() > 20 * plain.len() as u32, "{name}");
    }
}

/// Returns a file with bytes replaced, and its JSON kept as long as before.
fn replaced(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert!(to.len() <= from.len());
    let at = file.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
    let mut changed = file.to_vec();
    changed[at..at + from.len()].fill(b' ');
    changed[at..at + to.len()].copy_from_slice(to.as_bytes());
    changed
}

#[test]
fn broken_compression_names_the_place() {
    let message = |file: Vec<u8>| read(&file).err().map(|error| error.to_string()).unwrap_or_default();
    let found = message(replaced(EXT_MESHOPT, r#""mode":"TRIANGLES""#, r#""mode":"TRIANGLED""#));
    assert!(found.contains("bufferViews[3] (meshopt): mode is \"TRIANGLED\""), "{found}");
    let found = message(replaced(KHR_MESHOPT, r#""byteStride":12"#, r#""byteStride":13"#));
    assert!(found.contains("bufferViews[0] (meshopt): byteStride is 13"), "{found}");
    let found =
        message(replaced(EXT_MESHOPT, r#""byteStride":12,"count":231"#, r#""byteStride":12,"count":99"#));
    assert!(found.contains("bufferViews[0] (meshopt): its meshopt data cannot be decoded"), "{found}");
    let found = message(replaced(DRACO, r#""NORMAL":1,"TEXCOORD_0":0}"#, r#""NORMAL":9,"TEXCOORD_0":0}"#));
    assert!(found.contains("its data has no attribute"), "{found}");
    let fewer = replaced(DRACO, r#""count":229"#, r#""count":228"#);
    for file in [replaced(&fewer, r#"{"POSITION":2"#, r#"{"POSITIOM":2"#), fewer] {
        let found = message(file);
        assert!(found.contains("its data holds more than 228 vertices or 1080 indices"), "{found}");
    }
    let mut short = ETC1S.to_vec();
    let at = short.windows(8).position(|window| window == b"\xabKTX 20\xbb").unwrap();
    short[at + 44] = 9; // the scheme of supercompression
    let found = message(short);
    assert!(found.contains("images[0]: KTX2 with a format that glTF does not have"), "{found}");
}

#[test]
fn mutations_of_compressed_files_do_not_panic() {
    for (name, file) in [
        ("draco", DRACO),
        ("ext", EXT_MESHOPT),
        ("khr", KHR_MESHOPT),
        ("webp", WEBP),
        ("etc1s", ETC1S),
        ("uastc", UASTC),
    ] {
        let mut random = super::super::testing::Random(file.len() as u64);
        let mut usable = 0;
        for _ in 0..500 {
            let mut bytes = file.to_vec();
            random.mutate(&mut bytes);
            usable += u32::from(read(&bytes).is_ok());
        }
        assert!(usable > 5, "{name}: {usable} of 500 can be read: too few to have gone deep");
    }
}
