//! Support code of the fuzz targets: files in memory, a temporary folder, a limit on memory, and
//! checks of what the readers return.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use trisect::bvh::Bvh;
use trisect::lights::Lights;
use trisect::scene::description::{Description, Texels};
use trisect::scene::import::{Files, ModelOptions};
use trisect::scene::{Scene, SceneError};

/// Maximum number of triangles of a model that is lowered to a scene. Here and below: a few bytes
/// may describe millions, which take long.
const TRIANGLES: usize = 20_000;
/// Maximum number of primitives of a scene whose BVH is built.
const TREE: usize = 2_000;
/// Maximum number of texels of an image that is decoded.
pub const TEXELS: u64 = 1 << 20;

/// Global allocator that counts the allocated bytes.
struct Counted;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

impl Counted {
    fn more(bytes: usize) {
        let now = NOW.fetch_add(bytes, Relaxed) + bytes;
        PEAK.fetch_max(now, Relaxed);
    }
}

// SAFETY: each call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::more(size);
        NOW.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counted = Counted;

/// Runs `read` on an input of `input` bytes, and checks that it never holds more than 64 MiB plus
/// 20 bytes per byte of input. A reallocation counts twice, because it may copy.
pub fn bounded(input: usize, read: impl FnOnce()) {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    read();
    let taken = PEAK.load(Relaxed).saturating_sub(before);
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

/// Returns whether the bytes are not an image, or an image of at most [`TEXELS`] texels.
pub fn small(bytes: &[u8]) -> bool {
    let Ok(mut reader) = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format() else {
        return true;
    };
    reader.no_limits(); // an image beyond the limits is an error, too
    reader.into_dimensions().map_or(true, |(width, height)| u64::from(width) * u64::from(height) <= TEXELS)
}

/// Checks what a reader guarantees, and builds the scene if the model is small.
pub fn model(read: std::result::Result<Description, SceneError>) {
    let Ok(description) = read else { return };
    promises(&description);
    let placed = |mesh: usize| description.meshes[mesh].triangles.len();
    let triangles: usize = description.instances.iter().map(|instance| placed(instance.mesh)).sum();
    if triangles <= TRIANGLES {
        scene(Scene::from_model(description, "fuzz"));
    }
}

/// Checks the records of a scene, and builds BVH and lights if it is small.
pub fn scene(lowered: std::result::Result<Scene, SceneError>) {
    let Ok(scene) = lowered else { return };
    let sound = |x: f32| x.is_finite();
    for triangle in &scene.triangles {
        let normal = triangle.normal();
        assert!(normal.length_squared() > 0.0 && sound(normal.length_squared()), "{triangle:?}");
    }
    for (index, flat) in scene.flats.iter().enumerate() {
        let sizes = [flat.edge_u, flat.edge_v, flat.dual_u, flat.dual_v, flat.normal];
        assert!(sizes.iter().all(|v| v.is_finite()) && sound(flat.area), "{index}: {flat:?}");
    }
    for material in &scene.materials {
        assert!(material.emission.is_finite() && material.albedo.is_finite(), "{material:?}");
        assert!(sound(material.light_pdf) && material.light_pdf >= 0.0, "{material:?}");
    }
    if (1..=TREE).contains(&scene.primitives()) {
        let bvh = Bvh::build(&scene, None).expect("every scene has a tree");
        assert_eq!(bvh.triangles.len(), scene.triangles.len());
        Lights::new(&scene, &bvh.triangles);
    }
}

fn promises(description: &Description) {
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

/// Returns choices that depend on the input: a time in most cases, so that animations are read.
pub fn options(bytes: &[u8]) -> ModelOptions {
    let time = (bytes.len() % 4 != 0).then_some(bytes.len() as f64 * 0.01);
    ModelOptions { time, ..ModelOptions::default() }
}
