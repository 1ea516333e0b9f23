//! Damaged and hostile files.

use super::ModelOptions;
use super::testing::{Memory, ROUNDED, Random, error_in_space, far_vertices, floats, glb, png, shorts};
use super::{Parse, is_model, load, texture};
use super::{gltf, obj, ply};
use crate::SceneDocument;
use crate::description::{Description, Texels};
use crate::error::SceneError;
use glam::DVec3;
use std::path::Path;

/// Checks the invariants of a description.
pub(super) fn check(description: &Description) {
    for mesh in &description.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.material < description.materials.len());
        assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices);
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == vertices);
        assert!(mesh.triangles.iter().flatten().all(|corner| (*corner as usize) < vertices));
        assert!(mesh.positions.iter().flatten().all(|x| x.abs() <= 1e18));
        assert!(mesh.normals.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|x| x.is_finite()));
    }
    for instance in &description.instances {
        assert!(instance.mesh < description.meshes.len());
        assert!(instance.transform.inverse().is_finite());
    }
    for material in &description.materials {
        assert!(material.textures().all(|(texture, _)| texture.image < description.images.len()));
        assert!(material.emission.is_finite() && (0.0..=1.0).contains(&material.opacity));
    }
    assert!(description.cameras.iter().all(|(_, pose)| pose.look_from != pose.look_at));
}

/// Parses mutations of a file and of the files beside it, then the file itself, which must be
/// valid.
/// Returns choices that read all that a file holds.
fn options() -> ModelOptions {
    ModelOptions { time: Some(0.5), ..ModelOptions::default() }
}

fn mutate(file: &[u8], files: &[(&'static str, Vec<u8>)], rounds: usize, parse: Parse) {
    let mut random = Random(file.len() as u64);
    let mut usable = 0;
    for _ in 0..rounds {
        let mut all = vec![("", file.to_vec())];
        all.extend(files.iter().cloned());
        let broken = random.below(all.len());
        random.mutate(&mut all[broken].1);
        let (_, bytes) = all.swap_remove(0);
        if let Ok(description) = parse(&bytes, "test", &options(), &mut Memory(all.into_iter().collect())) {
            check(&description);
            usable += 1;
        }
    }
    assert!(usable > rounds / 100, "{usable} of {rounds} can be read: too few to have gone deep");
    check(&parse(file, "test", &options(), &mut Memory(files.iter().cloned().collect())).unwrap());
}

/// Returns a GLB file with one of each construct.
fn everything() -> Vec<u8> {
    let mut data = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]); // 48 bytes so far
    data.extend(floats(&[0.0, 0.0, 1.0].repeat(4))); // 96
    data.extend(floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0])); // 128
    data.extend(shorts(&[0, 1, 2, 2, 1, 3, 1, 0])); // 144
    data.extend(floats(&[2.0, 0.0, 0.0])); // 156
    let image = png(2, 2, &[[200, 100, 50, 255]; 4]);
    let length = image.len();
    data.extend(image);
    data.resize(data.len().next_multiple_of(4), 0);
    let at = data.len();
    data.extend(floats(&[0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])); // times, rotations
    data.extend([0u8; 16]); // joints
    data.extend(floats(&[1.0, 0.0, 0.0, 0.0].repeat(4)));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"extensionsUsed":["KHR_texture_transform","KHR_lights_punctual","X_other"],"buffers":[{{"byteLength":{}}}],
"bufferViews":[{{"buffer":0,"byteLength":96,"byteStride":12}},{{"buffer":0,"byteOffset":96,"byteLength":32}},
{{"buffer":0,"byteOffset":128,"byteLength":16}},{{"buffer":0,"byteOffset":144,"byteLength":12}},
{{"buffer":0,"byteOffset":156,"byteLength":{length}}},{{"buffer":0,"byteOffset":{at},"byteLength":120}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":1,
"indices":{{"bufferView":2,"byteOffset":12,"componentType":5123}},"values":{{"bufferView":3}}}}}},
{{"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3"}},
{{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
{{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}},
{{"bufferView":5,"componentType":5126,"count":2,"type":"SCALAR"}},
{{"bufferView":5,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC4"}},
{{"bufferView":5,"byteOffset":40,"componentType":5121,"count":4,"type":"VEC4"}},
{{"bufferView":5,"byteOffset":56,"componentType":5126,"count":4,"type":"VEC4"}}],
"animations":[{{"samplers":[{{"input":4,"output":5}},{{"input":4,"output":4,"interpolation":"STEP"}}],
"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}},{{"sampler":1,"target":{{"node":1,"path":"weights"}}}}]}}],
"skins":[{{"joints":[0,2]}}],
"images":[{{"bufferView":4}},{{"uri":"a.png"}}],"samplers":[{{"magFilter":9728,"wrapS":33071}}],
"textures":[{{"source":0,"sampler":0}},{{"source":1}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"metallicRoughnessTexture":{{"index":1,
"extensions":{{"KHR_texture_transform":{{"offset":[1,2],"rotation":3,"scale":[4,5]}}}}}}}},"emissiveFactor":[1,2,3],
"alphaMode":"MASK","extensions":{{"KHR_materials_ior":{{"ior":1.4}},"KHR_materials_transmission":{{"transmissionFactor":1}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}},
{{"attributes":{{"POSITION":0}},"mode":5}}]}},{{"weights":[0.5],"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":6,
"WEIGHTS_0":7}},"targets":[{{"POSITION":1}}],"material":0,"extensions":{{"KHR_materials_variants":{{"mappings":[
{{"material":0,"variants":[0]}}]}}}}}}]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.7}}}}],
"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":7,"spot":{{"outerConeAngle":0.5}}}}]}},
"KHR_materials_variants":{{"variants":[{{"name":"v"}}]}}}},
"nodes":[{{"children":[1,2,3],"scale":[2,2,2]}},{{"mesh":0,"rotation":[0,0,0,1]}},
{{"camera":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,3,4,5,1],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
{{"mesh":1,"skin":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"ROTATION":5}}}},
"KHR_node_visibility":{{"visible":true}}}}}}]}}"#,
        data.len()
    );
    glb(&json, Some(&data))
}

#[test]
fn mutations_of_gltf_do_not_panic() {
    mutate(&everything(), &[("a.png", png(1, 1, &[[1, 2, 3, 4]]))], 2000, gltf::parse);
}

#[test]
fn mutations_of_obj_do_not_panic() {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvt 1 0\nvn 0 0 1\nvn 0 1 0\no a\nusemtl a\n\
               f 1/1/1 2/2/2 3/1/1 \\\n4/2/2\ng b\nusemtl b\nf -4 -3 -2\nf 1//1 2//2 3//1\ns 1\nf 1/1 2/2 4/1\n";
    let mtl = "newmtl a\nKd 0.5 0.25 1\nmap_Kd -s 1 2 -o 3 4 5 -clamp on a.png\nillum 2\nd 0.5\nKe 1 2 3\n\
               newmtl b\nillum 7\nNi 1.5\nPr 0.25\nTf 1 1 1\nKs 0.5 0.5 0.5\nNs 10\n";
    let files = [("a.mtl", mtl.as_bytes().to_vec()), ("a.png", png(1, 1, &[[1, 2, 3, 4]]))];
    mutate(obj.as_bytes(), &files, 2000, |bytes, name, _, files| obj::parse(bytes, name, files));
}

#[test]
fn mutations_of_ply_do_not_panic() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\nproperty uchar x\nproperty char y\nproperty uchar z\nproperty char nx\n\
             property char ny\nproperty char nz\nproperty uchar u\nproperty uchar v\nproperty uchar red\nelement face 2\n\
             property list uchar uchar vertex_indices\nelement edge 1\nproperty list uchar short a\nend_header\n"
        )
    };
    let mut numbers = Vec::new();
    for [x, y] in [[0u8, 0], [1, 0], [1, 1], [0, 1]] {
        numbers.extend([x, y, 0, 0, 0, 1, x, y, 200]);
    }
    numbers.extend([4, 0, 1, 2, 3, 3, 0, 1, 3, 0]);
    let words: Vec<String> = numbers.iter().map(u8::to_string).collect();
    let parse: Parse = |bytes, name, _, _| ply::parse(bytes, name);
    mutate((header("ascii") + &words.join(" ")).as_bytes(), &[], 3000, parse);
    for format in ["binary_little_endian", "binary_big_endian"] {
        mutate(&[header(format).as_bytes(), &numbers].concat(), &[], 2000, parse);
    }
}

#[test]
fn extensions_choose_the_format() {
    let root = std::env::temp_dir().join(format!("trisect-import-{}", std::process::id()));
    std::fs::create_dir_all(&root).unwrap();
    std::fs::write(root.join("a.GLB"), everything()).unwrap();
    std::fs::write(root.join("a.png"), png(1, 1, &[[1, 2, 3, 4]])).unwrap();
    assert_eq!(load(&root.join("a.GLB"), &ModelOptions::default()).unwrap().meshes.len(), 3);
    assert!(matches!(
        load(&root.join("a.fbx"), &ModelOptions::default()),
        Err(SceneError::UnknownFormat { .. })
    ));
    assert!(is_model(Path::new("a.Ply")) && !is_model(Path::new("a.ron")) && !is_model(Path::new("ply")));
    assert!(matches!(texture(&root.join("a.png"), true).unwrap().texels, Texels::Linear8(_)));
    assert!(matches!(texture(&root.join("a.GLB"), false), Err(SceneError::Malformed { .. })));
    assert!(matches!(load(Path::new("none.ply"), &ModelOptions::default()), Err(SceneError::Read { .. })));
    std::fs::remove_dir_all(root).unwrap();
}

/// Models far from the origin in a scene, whose transform comes after the file's own, and without
/// one.
#[test]
fn far_models_of_a_scene_keep_their_shape() {
    let root = std::env::temp_dir().join(format!("trisect-import-far-{}", std::process::id()));
    std::fs::create_dir_all(&root).unwrap();
    std::fs::write(root.join("a.obj"), far_vertices("v ") + "f 1 2 3 4\n").unwrap();
    let scene = |transform: &str| {
        let text = format!(
            "Scene(version: 1, image: (width: 8, height: 4), materials: {{}}, objects: [Mesh(file: \"a.obj\"{transform})], \
             camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40))"
        );
        let path = root.join("a.ron");
        std::fs::write(&path, text).unwrap();
        SceneDocument::load(&path).unwrap().description
    };
    let error = error_in_space(scene(""));
    assert!(error <= ROUNDED, "{error:e}");
    let error = error_in_space(SceneDocument::load(&root.join("a.obj")).unwrap().description);
    assert!(error <= ROUNDED, "{error:e}");
    let moved = &scene(", transform: [Scale(2), Translate((-2e5, 4e5, -6))]").instances[0];
    assert!(moved.transform.translation.abs_diff_eq(DVec3::splat(1e-3), 1e-3), "{}", moved.transform);
    std::fs::remove_dir_all(root).unwrap();
}
