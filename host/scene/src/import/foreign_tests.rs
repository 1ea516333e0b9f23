//! Damaged scenes of other renderers.

use super::testing::{Memory, Random, png};
use super::tests::check;
use super::{ParseScene, mitsuba, pbrt};
use crate::{Rebase, SceneDocument};

/// Reads mutations of a scene of another renderer and of the files beside it, and lowers those that
/// can be read.
fn mutate_scene(file: &[u8], files: &[(&'static str, Vec<u8>)], rounds: usize, parse: ParseScene) {
    let mut random = Random(file.len() as u64);
    let (mut usable, mut tried, mut whole) = (0, 0, 0);
    for round in 0..rounds {
        let mut all = vec![("", file.to_vec())];
        all.extend(files.iter().cloned());
        let broken = random.below(all.len());
        match round % 4 {
            0 => {
                let at = random.below(all[broken].1.len());
                all[broken].1.truncate(at);
            }
            _ => random.mutate(&mut all[broken].1),
        }
        let (_, bytes) = all.swap_remove(0);
        if let Ok((description, image)) = parse(&bytes, "test", &mut Memory(all.into_iter().collect())) {
            check(&description);
            usable += 1;
            // Large images take long, and are those of other tests.
            let is_small =
                round % 8 == 1 && description.sky.as_ref().and_then(|sky| sky.panorama()).is_none();
            if is_small {
                let document = SceneDocument::of_foreign_scene(description, image, "test").unwrap();
                tried += 1;
                whole += usize::from(document.lower(Rebase::IDENTITY).is_ok());
            }
        }
    }
    assert!(usable > rounds / 50, "{usable} of {rounds} can be read: too few to have gone deep");
    assert!(tried > 0 && whole > tried / 2, "{whole} of {tried} can be lowered");
    check(&parse(file, "test", &mut Memory(files.iter().cloned().collect())).unwrap().0);
}

/// Returns a small PLY file.
fn triangle() -> Vec<u8> {
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
      element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        .to_vec()
}

#[test]
fn mutations_of_pbrt_do_not_panic() {
    let files = [
        ("b.pbrt", b"Material \"conductor\" \"float roughness\" 0.1\nShape \"disk\"\n".to_vec()),
        ("a.png", png(2, 1, &[[1, 2, 3, 4], [200, 100, 50, 255]])),
        ("m.ply", triangle()),
    ];
    mutate_scene(PBRT.as_bytes(), &files, 400, pbrt::parse);
}

#[test]
fn mutations_of_mitsuba_do_not_panic() {
    let part = "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"part\"/></scene>";
    let files = [
        ("b.xml", part.as_bytes().to_vec()),
        ("a.png", png(2, 1, &[[1, 2, 3, 4], [200, 100, 50, 255]])),
        ("m.ply", triangle()),
    ];
    mutate_scene(MITSUBA.as_bytes(), &files, 400, mitsuba::parse);
}

/// A pbrt scene with one of each construct.
const PBRT: &str = r#"
Option "bool disablepixeljitter" true
Film "rgb" "integer xresolution" [40] "integer yresolution" [30] PixelFilter "box"
Sampler "zsobol" "integer pixelsamples" 4 Integrator "volpath" "integer maxdepth" 3
LookAt 0 1 5 0 0 0 0 1 0
Camera "perspective" "float fov" 45 "float lensradius" 0.1 "float focaldistance" 5
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [.1 .2 .3] "rgb sigma_s" [1 1 1] "float g" 0.5
WorldBegin
Texture "t" "spectrum" "imagemap" "string filename" "a.png" "float uscale" 2 Texture "f" "float" "constant" "float value" 0.5
Texture "c" "spectrum" "checkerboard" "texture tex1" "t" "rgb tex2" [.1 .1 .9]
LightSource "infinite" "blackbody L" 5000 "float scale" 0.5 LightSource "spot" "point3 from" [0 3 0] "point3 to" [0 0 0]
AttributeBegin AreaLightSource "diffuse" "rgb L" [3 2 1] Translate 0 2 0 ReverseOrientation Shape "sphere" "float radius" 0.5
AttributeEnd
MakeNamedMaterial "m" "string type" "coateddiffuse" "texture reflectance" "t" "float roughness" 0.1
NamedMaterial "m" Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2] "point2 uv" [0 0 1 0 0 1]
Material "diffuse" "texture reflectance" "c" Shape "sphere" "float zmax" 0.5 "texture alpha" "f"
Include "b.pbrt"
ObjectBegin "o" Shape "plymesh" "string filename" "m.ply" Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1] ObjectEnd
AttributeBegin Rotate 30 0 1 0 Scale 2 2 2 ObjectInstance "o" ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 1 1 1 1]
ObjectInstance "o" MediumInterface "fog" "" Material "dielectric" "spectrum eta" "glass-BK7" Shape "cylinder" AttributeEnd
Material "diffusetransmission" "spectrum reflectance" [400 .1 700 .9] Shape "disk" "float innerradius" 0.2
"#;

/// A Mitsuba scene with one of each construct.
const MITSUBA: &str = r##"<scene version="3.0.0"><default name="n" value="16"/><include filename="b.xml"/>
<integrator type="volpath"><integer name="max_depth" value="5"/></integrator>
<sensor type="thinlens"><float name="fov" value="45"/><float name="aperture_radius" value="0.1"/>
<transform name="to_world"><lookat origin="0,1,5" target="0,0,0" up="0,1,0"/></transform>
<sampler type="independent"><integer name="sample_count" value="$n"/></sampler>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/></film></sensor>
<bsdf type="mask" id="m"><texture name="opacity" type="bitmap"><string name="filename" value="a.png"/></texture>
<bsdf type="diffuse"><texture name="reflectance" type="checkerboard"><rgb name="color0" value="#ff8800"/></texture></bsdf></bsdf>
<shape type="sphere"><point name="center" value="1,2,3"/><float name="radius" value="0.5"/>
<emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<shape type="shapegroup" id="g"><shape type="cube"><ref id="part"/></shape>
<shape type="ply"><string name="filename" value="m.ply"/><ref id="m"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><rotate y="1" angle="30"/><scale value="2"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><matrix value="1 0 0 0 0 0 1 0 0 -1 0 0 0 0 0 1"/></transform>
<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.1 0.2 0.3"/><float name="alpha" value="0.2"/></bsdf></shape>
<shape type="disk"><bsdf type="principled"><float name="metallic" value="0.5"/><float name="clearcoat" value="0.5"/></bsdf></shape>
<shape type="cylinder"><bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf>
<medium type="homogeneous" name="interior"><float name="sigma_t" value="1"/><phase type="hg"/></medium></shape>
<emitter type="spot"><rgb name="intensity" value="1"/></emitter><emitter type="constant"/></scene>"##;
