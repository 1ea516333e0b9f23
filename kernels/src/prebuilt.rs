//! Compiled kernels, as `cargo kernels` wrote them to `prebuilt/`. The host's backends load them.

use trisect_shared::denoise::DenoiseParams;
use trisect_shared::display::DisplayParams;
use trisect_shared::features::{
    ALL, AOVS, Features, LINEAR, MICROFACETS, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL, STRATEGY,
    TEXTURES, WIDE,
};
use trisect_shared::params::RenderParams;

/// Hashes of the kernels' sources and artifacts, as JSON.
pub const MANIFEST: &str = include_str!("../prebuilt/manifest.json");

/// Threads of a work group, across and down, of all entry points but [levels](is_level) of the
/// denoiser.
pub const WORKGROUP: (u32, u32) = (8, 8);

/// Name of the entry point that makes an image for a screen.
pub const DISPLAY: &str = "display";

/// Name of the entry point that writes first hits.
pub const FIRST_HIT: &str = "first_hit";

/// Entry point: what a device must know to launch it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EntryPoint {
    /// Name of the entry point.
    pub name: &'static str,
    /// Bytes of its launch parameters.
    pub params: usize,
    /// Number of arrays that it only reads, which are bound first.
    pub reads: usize,
    /// Number of arrays that it writes, too.
    pub writes: usize,
    /// Number of arrays of the wide BVH, which only the CPU binds, after all others; 0 for a kernel
    /// that does not trace it.
    pub extra: usize,
}

impl EntryPoint {
    /// Returns the number of arrays.
    pub fn arrays(self) -> usize {
        self.reads + self.writes + self.extra
    }

    /// Returns the threads of a work group, across and down.
    pub fn workgroup(self) -> (u32, u32) {
        workgroup(self.name)
    }
}

/// Bindings of the entry points of one list.
const fn bindings(params: usize, reads: usize, writes: usize) -> EntryPoint {
    EntryPoint { name: "", params, reads, writes, extra: 0 }
}

const RENDER_BINDINGS: EntryPoint = bindings(size_of::<RenderParams>(), 10, 4);
const PASS_BINDINGS: EntryPoint = bindings(size_of::<DenoiseParams>(), 3, 2);
const TEMPORAL_BINDINGS: EntryPoint = bindings(size_of::<DenoiseParams>(), 5, 4);
const DISPLAY_BINDINGS: EntryPoint = bindings(size_of::<DisplayParams>(), 2, 1);

/// Arrays of the wide BVH: root, nodes, packets of spheres and of triangles.
const WIDE_ARRAYS: usize = 4;

/// Returns the entry point with this name, if there is one.
pub fn entry_point(name: &str) -> Option<EntryPoint> {
    let lists = [
        (RENDER, RENDER_BINDINGS),
        (FIRST_HITS, RENDER_BINDINGS),
        (PASSES, PASS_BINDINGS),
        (LEVELS, PASS_BINDINGS),
        (TEMPORAL, TEMPORAL_BINDINGS),
        (DISPLAYS, DISPLAY_BINDINGS),
    ];
    lists.into_iter().find_map(|(list, bindings)| {
        let modules = list.iter().find(|modules| modules.name == name)?;
        Some(EntryPoint { name: modules.name, ..bindings })
    })
}

/// Render entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name of the entry point.
    pub name: &'static str,
    /// Features that the entry point is compiled for.
    pub features: Features,
}

impl Variant {
    /// Returns the entry point. A variant with [`WIDE`], which only the CPU has, reads the arrays
    /// of the wide BVH after all others.
    pub fn entry_point(self) -> EntryPoint {
        let wide = self.features & WIDE != 0;
        EntryPoint { name: self.name, extra: if wide { WIDE_ARRAYS } else { 0 }, ..RENDER_BINDINGS }
    }

    /// Returns whether the variant renders correctly what needs `features`, by any traversal and
    /// schedule.
    pub fn supports(self, features: Features) -> bool {
        // Without microfacets a variant has one Fresnel formula, not the choice of both.
        let fresnel = self.features & (SCHLICK | MICROFACETS) != SCHLICK || features & SCHLICK != 0;
        // The sampler is compiled in: a launch cannot choose it.
        let sampler = (self.features ^ features) & SOBOL == 0;
        features & !STRATEGY & !self.features == 0 && fresnel && sampler
    }
}

macro_rules! variants {
    ($($name:ident $text:tt: $features:expr,)*) => {
        &[$(Variant { name: $text, features: $features },)*]
    };
}

/// All render entry points.
pub const VARIANTS: &[Variant] = for_each_variant!(variants);

/// Compiled modules of an entry point.
struct Modules {
    name: &'static str,
    spirv: &'static [u8],
    precise_ptx: &'static str,
    fast_ptx: &'static str,
}

macro_rules! modules {
    ($($name:ident $text:tt: $what:expr,)*) => {
        &[$(Modules {
            name: $text,
            spirv: include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv")),
            precise_ptx: include_str!(concat!("../prebuilt/ptx/precise/", $text, ".ptx")),
            fast_ptx: include_str!(concat!("../prebuilt/ptx/fast/", $text, ".ptx")),
        },)*]
    };
}

const RENDER: &[Modules] = for_each_variant!(modules);
const PASSES: &[Modules] = for_each_pass!(modules);
const LEVELS: &[Modules] = for_each_level!(modules);
const TEMPORAL: &[Modules] = for_each_temporal!(modules);
const DISPLAYS: &[Modules] = for_each_display!(modules);
const FIRST_HITS: &[Modules] = modules!(first_hit "first_hit": (),);

/// Returns the compiled modules of an entry point.
fn modules_of(entry_point: &str) -> Option<&'static Modules> {
    let all = [RENDER, FIRST_HITS, PASSES, LEVELS, TEMPORAL, DISPLAYS].into_iter().flatten();
    all.into_iter().find(|modules| modules.name == entry_point)
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

/// Returns the SPIR-V module, for Vulkan 1.2, that has only this entry point; `None` if there is no
/// such entry point.
pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
    modules_of(entry_point).map(|modules| modules.spirv)
}

/// Returns the PTX module that has only this entry point, with the CPU's bits (no contraction,
/// correctly rounded division and square root), or with fused multiply-add and approximate division
/// and square root; `None` if there is no such entry point.
pub fn ptx(entry_point: &str, fast: bool) -> Option<&'static str> {
    modules_of(entry_point).map(|modules| if fast { modules.fast_ptx } else { modules.precise_ptx })
}

/// Returns the names of all entry points.
pub fn entry_points() -> impl Iterator<Item = &'static str> {
    let all = [RENDER, FIRST_HITS, PASSES, LEVELS, TEMPORAL, DISPLAYS];
    all.into_iter().flatten().map(|modules| modules.name)
}

/// Returns the first, and so the cheapest, variant that has all of `features`, with exactly their
/// traversal and schedule, or `None` without one.
pub fn variant(features: Features) -> Option<Variant> {
    let same_strategy = |variant: &Variant| variant.features & STRATEGY == features & STRATEGY;
    VARIANTS.iter().copied().find(|variant| variant.supports(features) && same_strategy(variant))
}

/// Returns the variant with this name, if there is one.
pub fn variant_by_name(name: &str) -> Option<Variant> {
    VARIANTS.iter().copied().find(|variant| variant.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The host's kernels are those of devices.
    #[test]
    fn each_entry_point_is_native() {
        for name in entry_points() {
            let native = crate::native::native(name).expect(name);
            assert_eq!(entry_point(name).map(|entry_point| entry_point.name), Some(native.name));
        }
        assert!(crate::native::native("none").is_none() && entry_point("none").is_none());
    }

    #[test]
    fn each_variant_is_in_each_artifact() {
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
