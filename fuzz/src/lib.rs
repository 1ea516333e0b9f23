//! Support code of the fuzz targets: files in memory, a temporary folder, a limit on memory, and
//! checks of what the readers return.

#[path = "../../host/render/tests/counted/mod.rs"]
mod counted;

use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};
use trisect::bvh::{Bvh, BvhQuality, Wide};
use trisect::glam::DVec3;
use trisect::lights::Lights;
use trisect::scene::description::{Description, Texels};
use trisect::scene::import::{Files, ModelOptions};
use trisect::scene::{
    EnvironmentSource, ImageSettings, Rebase, Scene, SceneDocument, SceneError, Sharing, Sun, Surroundings,
};

/// Maximum number of triangles of a model that is lowered to a scene. Here and below: a few bytes
/// may describe millions, which take long.
const TRIANGLES: usize = 20_000;
/// Maximum number of primitives of a scene whose BVH is built.
const TREE: usize = 2_000;
/// Maximum number of texels of an image that is decoded.
pub const TEXELS: u64 = 1 << 20;

/// Runs `read` on an input of `input` bytes, and checks that it never holds more than 64 MiB plus
/// 20 bytes per byte of input. A reallocation counts twice, because it may copy.
pub fn bounded(input: usize, read: impl FnOnce()) {
    let taken = counted::held(read).1.peak;
    assert!(taken <= (64 << 20) + 20 * input, "{input} bytes took {taken} bytes of memory");
}

/// Files that all have the same content.
pub struct Same<'a>(pub &'a [u8]);

impl Files for Same<'_> {
    fn read(&mut self, _: &str, limit: u64) -> Result<Vec<u8>> {
        if self.0.len() as u64 > limit || !small(self.0) {
            return Err(ErrorKind::FileTooLarge.into());
        }
        Ok(self.0.to_vec())
    }
}

/// Files beside a scene of another renderer: `b.pbrt` and `b.xml` are the second part of an input,
/// the others are the same for all inputs.
pub struct Beside<'a>(pub &'a [u8]);

impl Files for Beside<'_> {
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>> {
        let bytes: &[u8] = match path {
            "b.pbrt" | "b.xml" => self.0,
            "a.png" => include_bytes!("../../scenes/gltf/features_tiles.png"),
            "m.obj" => b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n",
            "m.ply" => include_bytes!("../corpus/ply/ascii.ply"),
            "s.pfm" => b"PF\n1 1\n-1\n\0\0\0\x3f\0\0\0\x3f\0\0\0\x3f",
            _ => return Err(ErrorKind::NotFound.into()),
        };
        if bytes.len() as u64 > limit { Err(ErrorKind::FileTooLarge.into()) } else { Ok(bytes.to_vec()) }
    }
}

/// Splits an input at its first byte 0.
pub fn parts(bytes: &[u8]) -> (&[u8], &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    (parts.next().unwrap_or_default(), parts.next().unwrap_or_default())
}

/// Checks what a reader of scenes of other renderers guarantees, and builds the scene if it is
/// small.
pub fn foreign_scene(
    read: std::result::Result<(Description, ImageSettings), SceneError>,
    choices: &Choices,
) {
    let Ok((description, image)) = read else { return };
    promises(&description);
    if has_few_triangles(&description) {
        let document = SceneDocument::of_foreign_scene(description, image, "fuzz");
        scene(document.and_then(|document| choices.lower(document)));
    }
}

/// Returns whether the bytes are not an image, or an image of at most [`TEXELS`] texels. WebP and
/// KTX2 count as no image: those of textures are small in these builds.
pub fn small(bytes: &[u8]) -> bool {
    let Ok(mut reader) = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format() else {
        return true;
    };
    reader.no_limits(); // an image beyond the limits is an error, too
    reader.into_dimensions().map_or(true, |(width, height)| u64::from(width) * u64::from(height) <= TEXELS)
}

/// Choices of who renders a scene.
pub struct Choices {
    /// Time, animation and variant of models.
    pub options: ModelOptions,
    /// Environment, sun and ground.
    pub surroundings: Surroundings,
    /// Choice of the meshes that instances share.
    pub sharing: Sharing,
    /// Space that the renderer computes in.
    pub space: Rebase,
}

impl Choices {
    /// Returns choices that follow from the length of an input, so that each comes up for each kind
    /// of input, and an input has the same ones again. The animation "walk" and the variant "Night"
    /// are chosen only from inputs that name them.
    pub fn of(bytes: &[u8]) -> Self {
        let length = bytes.len();
        let named = |name: &str| {
            let quoted = format!("\"{name}\"");
            bytes.windows(quoted.len()).any(|part| part == quoted.as_bytes()).then(|| name.to_owned())
        };
        let time = [None, Some(0.4), Some(0.01 * length as f64), Some(-1.0)][length % 4];
        let animation = if length.is_multiple_of(5) { named("walk") } else { None };
        let variant = if length.is_multiple_of(3) { named("Night") } else { None };
        // The panorama of the studio has many texels, so that lowering it takes long.
        let environment = match length % 128 {
            0 => None,
            1 => Some(EnvironmentSource::Studio),
            _ => Some(EnvironmentSource::Uniform),
        };
        let sun = length.is_multiple_of(7).then_some(Sun { azimuth: 30.0, elevation: 40.0, irradiance: None });
        let ground = [None, Some(true), Some(false)][length % 3];
        let far = Rebase { origin: DVec3::new(10.0, -2e3, 0.5), scale: 0.125 };
        Self {
            options: ModelOptions { time, animation, variant },
            surroundings: Surroundings { environment, sun, ground },
            sharing: if length.is_multiple_of(2) { Sharing::Auto } else { Sharing::Always },
            space: if length.is_multiple_of(11) { far } else { Rebase::IDENTITY },
        }
    }

    /// Makes the device records of a scene.
    pub fn lower(&self, document: SceneDocument) -> std::result::Result<Scene, SceneError> {
        SceneDocument { sharing: self.sharing, ..document }.lower(self.space)
    }
}

/// Checks what a reader guarantees, and builds the scene if the model is small.
pub fn model(read: std::result::Result<Description, SceneError>, choices: &Choices) {
    let Ok(description) = read else { return };
    promises(&description);
    if !has_few_triangles(&description) {
        return;
    }
    let document = SceneDocument::from_model_in_surroundings(description, "fuzz", &choices.surroundings);
    scene(document.and_then(|document| choices.lower(document)));
}

/// Returns whether a description has at most [`TRIANGLES`] triangles, counting each instance.
pub fn has_few_triangles(description: &Description) -> bool {
    let placed = |mesh: usize| description.meshes[mesh].triangles.len();
    let triangles: usize = description.instances.iter().map(|instance| placed(instance.mesh)).sum();
    triangles <= TRIANGLES
}

/// Checks the records of a scene, and builds BVH and lights if it is small.
pub fn scene(lowered: std::result::Result<Scene, SceneError>) {
    let Ok(scene) = lowered else { return };
    records(&scene);
    if is_small(&scene) {
        // The default quality takes most of the time of an input.
        let quality = if scene.primitives().is_multiple_of(16) { None } else { Some(BvhQuality::Fast) };
        let bvh = Bvh::build(&scene, quality).expect("every scene has a tree");
        Wide::new(&scene, &bvh).expect("every tree can be made wide");
        Lights::new(&scene);
    }
}

/// Returns whether a scene has primitives, and few enough for a BVH.
pub fn is_small(scene: &Scene) -> bool {
    (1..=TREE).contains(&(scene.primitives() + scene.shared.instances.len()))
}

/// Checks the records of a scene.
pub fn records(scene: &Scene) {
    let sound = |x: f32| x.is_finite();
    for triangle in scene.triangles.iter().chain(&scene.shared.triangles) {
        let normal = triangle.normal();
        assert!(normal.length_squared() > 0.0 && sound(normal.length_squared()), "{triangle:?}");
    }
    for instance in &scene.shared.instances {
        assert!(instance.map().inverse().is_finite(), "{instance:?}");
        assert!(scene.shared.corners(instance).all(|corner| corner.is_finite()), "{instance:?}");
    }
    for (index, flat) in scene.flats.iter().chain(&scene.portals).enumerate() {
        let sizes = [flat.edge_u, flat.edge_v, flat.dual_u, flat.dual_v, flat.normal];
        assert!(sizes.iter().all(|v| v.is_finite()) && sound(flat.area), "{index}: {flat:?}");
    }
    for material in &scene.materials {
        assert!(material.emission.is_finite() && material.albedo.is_finite(), "{material:?}");
        assert!(sound(material.light_pdf) && material.light_pdf >= 0.0, "{material:?}");
    }
    for (layers, _) in &scene.layers {
        let colors =
            [layers.specular_color, layers.sheen_color, layers.absorption, layers.diffuse_transmission_color];
        assert!(colors.iter().all(|color| color.is_finite() && color.min_element() >= 0.0), "{layers:?}");
        let shares = [layers.coat, layers.coat_roughness, layers.anisotropy, layers.film];
        assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{layers:?}");
        let numbers = [layers.dispersion, layers.film_ior, layers.film_min, layers.film_thickness];
        assert!(numbers.iter().all(|x| sound(*x)), "{layers:?}");
    }
    for vertex in &scene.vertices {
        assert!((vertex.attributes as usize) < scene.vertices.len(), "{vertex:?}");
    }
    assert!(scene.attributes().all(|of| sound(of.u) && sound(of.v)));
}

/// Checks what a reader guarantees.
pub fn promises(description: &Description) {
    for mesh in &description.meshes {
        let fits = |length: usize| length == 0 || length == mesh.positions.len();
        assert!(mesh.material < description.materials.len());
        assert!(fits(mesh.normals.len()) && fits(mesh.uvs.len()) && fits(mesh.second_uvs.len()));
        assert!(fits(mesh.colors.len()) && fits(mesh.tangents.len()));
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|corner| (*corner as usize) < vertices));
        assert!(mesh.positions.iter().flatten().all(|x| x.abs() <= 1e18));
        let uvs = mesh.uvs.iter().chain(&mesh.second_uvs);
        assert!(mesh.normals.iter().flatten().chain(uvs.flatten()).all(|x| x.is_finite()));
        assert!(mesh.colors.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
    }
    for instance in &description.instances {
        assert!(instance.mesh < description.meshes.len());
        assert!(instance.transform.inverse().is_finite());
    }
    for material in &description.materials {
        assert!(material.textures().all(|(texture, _)| texture.image < description.images.len()));
        assert!(material.emission.is_finite() && (0.0..=1.0).contains(&material.opacity));
    }
    for image in &description.images {
        let texels = match &image.texels {
            Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.len(),
            Texels::Float(texels) => texels.len(),
        };
        assert_eq!(texels, image.width as usize * image.height as usize);
    }
    assert!(description.cameras.iter().all(|(_, pose)| pose.look_from != pose.look_at));
}

const PREFIX: &str = "trisect-fuzz-";

/// Removes the folders of processes that have ended: a fuzzer may end too suddenly to do so.
fn remove_abandoned(parent: &Path) {
    if !Path::new("/proc/self").exists() {
        return;
    }
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process =
            name.to_str().and_then(|name| name.strip_prefix(PREFIX)).and_then(|id| id.parse::<u32>().ok());
        if process.is_some_and(|id| !Path::new(&format!("/proc/{id}")).exists()) {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Creates a folder for this process and makes it the current one, so that relative file names lead
/// nowhere else. Returns its path.
pub fn enter_folder() -> PathBuf {
    let memory = PathBuf::from("/dev/shm");
    let parent = if memory.is_dir() { memory } else { std::env::temp_dir() };
    remove_abandoned(&parent);
    let folder = parent.join(format!("{PREFIX}{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    std::env::set_current_dir(&folder).expect("the folder can be entered");
    folder
}

/// Returns a GLB file of JSON and a buffer that the first byte 0 separates.
pub fn glb(bytes: &[u8]) -> Vec<u8> {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (json, binary) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let chunk = |kind: &[u8; 4], content: &[u8], filler: u8| {
        let mut content = content.to_vec();
        content.resize(content.len().next_multiple_of(4), filler);
        [&(content.len() as u32).to_le_bytes()[..], kind, &content].concat()
    };
    let chunks = [chunk(b"JSON", json, b' '), chunk(b"BIN\0", binary, 0)].concat();
    let length = chunks.len() as u32 + 12;
    [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &chunks].concat()
}
