//! Compiled kernels, as `cargo kernels` wrote them to `prebuilt/`. The host's backends load them.

use crate::fast_math;
use std::borrow::Cow;
use trisect_shared::denoise::DenoiseParams;
use trisect_shared::display::DisplayParams;
use trisect_shared::features::{
    Features, HEAVY, LAYERS, OF_BOOK, PERSISTENT, RARE, REGENERATE, WIDE, has_any, is_of_many_materials,
};
use trisect_shared::params::RenderParams;
use trisect_shared::scene::SceneLengths;
use trisect_shared::totals::TotalsParams;

/// Hashes of the kernels' sources and artifacts, as JSON.
pub const MANIFEST: &str = include_str!("../prebuilt/manifest.json");

/// Threads of a work group, across and down, of all entry points but [levels](is_level) of the
/// denoiser.
pub const WORKGROUP: (u32, u32) = (8, 8);

/// Name of the entry point that makes an image for a screen.
pub const DISPLAY: &str = "display";

/// Name of the entry point that adds a chunk to a film's totals, or AOV totals.
pub const FILM_ADD: &str = "film_add";

/// Name of the entry point that counts samples and segments of a chunk.
pub const FILM_COUNT: &str = "film_count";

/// Name of the entry point that measures the noise of tiles.
pub const FILM_NOISE: &str = "film_noise";

/// Name of the entry point that requests samples by tile.
pub const FILM_REQUEST: &str = "film_request";

/// Name of the entry point that rounds totals to the sums of a chunk.
pub const FILM_SUMS: &str = "film_sums";

/// Name of the entry point that writes totals for the host.
pub const FILM_READ: &str = "film_read";

/// Name of the entry point that writes first hits.
pub const FIRST_HIT: &str = "first_hit";

/// Entry point: what a device must know to compile and launch it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EntryPoint {
    /// Name of the entry point.
    pub name: &'static str,
    /// Features of a render kernel: the constant for which the driver specialises the module; 0 for
    /// other kernels, which have no constant.
    pub features: Features,
    /// Bytes of its launch parameters.
    pub params: usize,
    /// Bytes of the record with the numbers of records of the arrays, which CUDA's form of the
    /// kernel gets by value; 0 if all arrays have a record for each pixel.
    pub lengths: usize,
    /// Number of arrays that it only reads, which are bound first.
    pub reads: usize,
    /// Number of arrays that it writes, too.
    pub writes: usize,
    /// Number of arrays of the wide BVH, which only the CPU binds, after all others; 0 for a kernel
    /// that does not trace it.
    pub extra: usize,
    /// Maximum number of registers of a lane on CUDA. More lanes at a time gain more than spilling
    /// costs (docs/notebook/kernels-and-schedules.md).
    pub registers: Option<u32>,
    /// True if its lanes take pixels from a queue, so that the device decides on their number.
    pub queue: bool,
}

impl EntryPoint {
    /// Returns the number of arrays.
    pub fn arrays(self) -> usize {
        self.reads + self.writes + self.extra
    }

    /// Returns whether the arrays that it only reads are those of a scene, which SPIR-V binds as
    /// [`SCENE_BINDINGS`] says.
    pub fn reads_scene(self) -> bool {
        self.lengths > 0
    }

    /// Returns the threads of a work group, across and down.
    pub fn workgroup(self) -> (u32, u32) {
        workgroup(self.name)
    }

    /// Returns whether it has any of these features.
    pub fn has(self, some: Features) -> bool {
        has_any(self.features, some)
    }
}

/// Arrays of a scene, by index, that share a binding in SPIR-V: WebGPU guarantees eight storage
/// buffers, and a render kernel without a queue writes three. The first array of a binding begins
/// its buffer; [`FirstRows`](trisect_shared::scene::FirstRows) has the places of the others.
/// Materials, of eight rows, are read faster from a buffer of their own (docs/notebook/vulkan.md).
pub const SCENE_BINDINGS: [&[usize]; 5] = [&[1], &[4, 5], &[8], &[2], &[3, 0, 6, 7, 9]];

/// Index of the counter of a queue among the arrays that a render kernel writes. SPIR-V binds it
/// last, because a kernel without a queue does not bind it, and wgpu numbers bindings without gaps.
pub const COUNTER: usize = 2;

/// Bindings of the entry points of one list.
const fn bindings(params: usize, reads: usize, writes: usize) -> EntryPoint {
    EntryPoint {
        name: "",
        features: 0,
        params,
        lengths: 0,
        reads,
        writes,
        extra: 0,
        registers: None,
        queue: false,
    }
}

const RENDER_BINDINGS: EntryPoint =
    EntryPoint { lengths: size_of::<SceneLengths>(), ..bindings(size_of::<RenderParams>(), 10, 4) };
const PASS_BINDINGS: EntryPoint = bindings(size_of::<DenoiseParams>(), 3, 2);
const LEVEL_BINDINGS: EntryPoint = EntryPoint { registers: Some(96), ..PASS_BINDINGS };
const ACCUMULATION_BINDINGS: EntryPoint = bindings(size_of::<DenoiseParams>(), 2, 4);
const TEMPORAL_BINDINGS: EntryPoint = bindings(size_of::<DenoiseParams>(), 5, 2);
const DISPLAY_BINDINGS: EntryPoint = bindings(size_of::<DisplayParams>(), 2, 1);
const TOTAL_BINDINGS: EntryPoint = bindings(size_of::<TotalsParams>(), 0, 4);

/// Maximum number of bytes of the launch parameters of any entry point.
pub const MAX_PARAMS: usize = {
    let (mut most, mut list) = (0, 0);
    while list < LISTS.len() {
        let params = LISTS[list].1.params;
        most = if params > most { params } else { most };
        list += 1;
    }
    most
};

/// Arrays of the wide BVH: root, nodes, packets of spheres and of triangles.
const WIDE_ARRAYS: usize = 4;

/// Entry points of each list, and their bindings.
const LISTS: [(&[Modules], EntryPoint); 8] = [
    (RENDER, RENDER_BINDINGS),
    (FIRST_HITS, RENDER_BINDINGS),
    (PASSES, PASS_BINDINGS),
    (LEVELS, LEVEL_BINDINGS),
    (ACCUMULATIONS, ACCUMULATION_BINDINGS),
    (TEMPORAL, TEMPORAL_BINDINGS),
    (DISPLAYS, DISPLAY_BINDINGS),
    (TOTALS, TOTAL_BINDINGS),
];

/// Returns the entry point with this name, if there is one; a render kernel has no features yet
/// (see [`render_kernel`]).
pub fn entry_point(name: &str) -> Option<EntryPoint> {
    LISTS.into_iter().find_map(|(list, bindings)| {
        let modules = list.iter().find(|modules| modules.name == name)?;
        Some(EntryPoint { name: modules.name, ..bindings })
    })
}

/// Returns the maximum number of registers of a lane of a render kernel
/// (docs/notebook/specialisation.md).
fn registers(features: Features) -> u32 {
    match () {
        () if has_any(features, LAYERS) || is_of_many_materials(features) => 128,
        () if has_any(features, HEAVY) => 80,
        () => 64,
    }
}

/// Returns the render kernel with these features. With [`WIDE`], which only the CPU has, it reads
/// the arrays of the wide BVH after all others.
pub fn render_kernel(features: Features) -> EntryPoint {
    let queue = has_any(features, PERSISTENT);
    EntryPoint {
        name: match (has_any(features, RARE), queue) {
            (false, false) => "render",
            (false, true) => "render_persistent",
            (true, false) => "render_general",
            (true, true) => "render_general_persistent",
        },
        features,
        extra: if has_any(features, WIDE) { WIDE_ARRAYS } else { 0 },
        registers: Some(registers(features)),
        queue,
        ..RENDER_BINDINGS
    }
}

/// Compiled modules of an entry point.
struct Modules {
    name: &'static str,
    spirv: &'static [u8],
    ptx: &'static str,
}

/// Embeds the SPIR-V of an entry point; not of those with a queue where WGSL is made of it, which
/// has no such kernels.
macro_rules! embedded_spirv {
    ("render_persistent") => {
        if cfg!(target_family = "wasm") { &[] } else { embedded_spirv!(always "render_persistent") }
    };
    ("render_general_persistent") => {
        if cfg!(target_family = "wasm") { &[] } else { embedded_spirv!(always "render_general_persistent") }
    };
    ($text:tt) => { embedded_spirv!(always $text) };
    (always $text:tt) => { include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv")) };
}

/// Embeds the PTX of an entry point, where there may be CUDA.
macro_rules! embedded_ptx {
    ($text:tt) => {
        if cfg!(target_family = "wasm") {
            ""
        } else {
            include_str!(concat!("../prebuilt/ptx/", $text, ".ptx"))
        }
    };
}

macro_rules! modules {
    ($($name:ident $text:tt: $what:expr, $possible:expr, $certain:expr,)*) => { modules! { $($name $text: $what,)* } };
    ($($name:ident $text:tt: $what:expr,)*) => {
        &[$(Modules {
            name: $text,
            spirv: embedded_spirv!($text),
            ptx: embedded_ptx!($text),
        },)*]
    };
}

const RENDER: &[Modules] = for_each_render!(modules);

macro_rules! book_modules {
    ($($name:ident $text:tt: $what:expr, $possible:expr, $certain:expr,)*) => {
        &[$(($text, embedded_ptx!($text)),)*]
    };
}

/// PTX modules for scenes of the book, by name, in the order of [`RENDER`].
const BOOK_PTX: &[(&str, &str)] = for_each_book_render!(book_modules);

const PASSES: &[Modules] = for_each_pass!(modules);
const LEVELS: &[Modules] = for_each_level!(modules);
const ACCUMULATIONS: &[Modules] = for_each_accumulation!(modules);
const TEMPORAL: &[Modules] = for_each_temporal!(modules);
const DISPLAYS: &[Modules] = for_each_display!(modules);
const TOTALS: &[Modules] = for_each_total!(modules);
const FIRST_HITS: &[Modules] = modules!(first_hit "first_hit": (),);

/// Returns the compiled modules of an entry point.
fn modules_of(entry_point: &str) -> Option<&'static Modules> {
    LISTS.into_iter().flat_map(|(list, _)| list).find(|modules| modules.name == entry_point)
}

/// Returns whether an entry point is a render kernel.
pub(crate) fn is_render(entry_point: &str) -> bool {
    RENDER.iter().any(|kernel| kernel.name == entry_point)
}

/// Returns whether an entry point is a level of the denoiser's filters, of which a thread computes
/// [`PIXELS_PER_THREAD`](trisect_shared::denoise::PIXELS_PER_THREAD) pixels.
pub fn is_level(entry_point: &str) -> bool {
    LEVELS.iter().any(|level| level.name == entry_point)
}

/// Returns the threads of a work group of an entry point, across and down.
pub fn workgroup(entry_point: &str) -> (u32, u32) {
    if is_level(entry_point) { (64, 1) } else { WORKGROUP }
}

/// Returns the SPIR-V module, for Vulkan 1.2, that has only this entry point, in its form for all
/// features (see [`specialise::spirv`](crate::specialise::spirv)); `None` if there is no such entry
/// point.
pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
    modules_of(entry_point).map(|modules| modules.spirv).filter(|module| !module.is_empty())
}

/// Returns the PTX module that has only this entry point, in its form for all features (see
/// [`specialise::ptx`](crate::specialise::ptx)): with the CPU's bits (no contraction, correctly
/// rounded division and square root), or with fused multiply-add and approximate division and
/// square root. Returns `None` if there is no such entry point.
pub fn ptx(entry_point: &str, fast: bool) -> Option<Cow<'static, str>> {
    let of_book = BOOK_PTX.iter().find(|(name, _)| *name == entry_point).map(|(_, module)| *module);
    let module = of_book.or_else(|| modules_of(entry_point).map(|modules| modules.ptx))?;
    if module.is_empty() {
        return None;
    }
    Some(if fast { Cow::Owned(fast_math::fast(module)) } else { Cow::Borrowed(module) })
}

/// Returns the name of the [PTX module](ptx) of a kernel, and of the entry point in it.
pub fn ptx_name(of: EntryPoint) -> &'static str {
    let is_of_book = !has_any(of.features, !OF_BOOK) && has_any(of.features, REGENERATE);
    let render = RENDER.iter().position(|kernel| kernel.name == of.name);
    let book = render.filter(|_| is_of_book).and_then(|index| BOOK_PTX.get(index));
    book.map_or(of.name, |(name, _)| name)
}

/// Returns the names of all [PTX modules](ptx).
pub fn ptx_names() -> impl Iterator<Item = &'static str> {
    entry_points().chain(BOOK_PTX.iter().map(|(name, _)| *name))
}

/// Returns the names of all entry points.
pub fn entry_points() -> impl Iterator<Item = &'static str> {
    LISTS.into_iter().flat_map(|(list, _)| list).map(|modules| modules.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::features::{PLANAR, ROULETTE, SPHERES};

    /// The host's kernels are those of devices.
    #[test]
    fn each_entry_point_is_native() {
        for name in entry_points() {
            let entry_point = entry_point(name).expect(name);
            assert!(entry_point.name == name && crate::native::native(entry_point).is_some(), "{name}");
        }
        let none = EntryPoint { name: "none", ..DISPLAY_BINDINGS };
        assert!(crate::native::native(none).is_none() && entry_point("none").is_none());
    }

    /// The book's modules trace spheres by `regenerate` and by queues, and nothing else.
    #[test]
    fn modules_of_the_book_are_for_the_book() {
        let of_book = SPHERES | ROULETTE | REGENERATE;
        for (features, name) in [
            (of_book, "render_book"),
            (of_book | PERSISTENT, "render_book_persistent"),
            (of_book & !REGENERATE, "render"),
            (of_book | PLANAR, "render"),
            (of_book | PLANAR | PERSISTENT, "render_persistent"),
        ] {
            assert_eq!(ptx_name(render_kernel(features)), name);
        }
    }

    #[test]
    fn each_entry_point_is_in_each_artifact() {
        for name in entry_points() {
            let module = spirv(name).expect(name);
            // Opcode OpEntryPoint, execution model GLCompute, id of the function, name.
            let entry_points: Vec<_> = module
                .windows(8)
                .enumerate()
                .filter(|(_, w)| w[0] == 15 && w[1] == 0 && w[4..] == [5, 0, 0, 0])
                .collect();
            assert!(
                entry_points.iter().any(|&(at, _)| module[at + 12..].starts_with(name.as_bytes())),
                "{name}"
            );
            for fast in [false, true] {
                let ptx = ptx(name, fast).expect(name);
                assert!(ptx.contains(&format!(".visible .entry {name}(")), "{name}");
                assert_eq!(ptx.matches(".entry").count(), 1, "{name}");
            }
        }
    }
}
