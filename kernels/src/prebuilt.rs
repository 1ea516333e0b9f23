//! Compiled kernels, as `cargo kernels` wrote them to `prebuilt/`. The host's backends load them.

use trisect_shared::features::{
    ALL, AOVS, Features, LINEAR, MICROFACETS, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL, STRATEGY,
    TEXTURES,
};

/// PTX with the CPU's bits: no contraction, correctly rounded division and square root.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/trisect.precise.ptx");

/// PTX with fused multiply-add and approximate division and square root.
pub const PTX_FAST: &str = include_str!("../prebuilt/trisect.fast.ptx");

/// Hashes of the kernels' sources and artifacts, as JSON.
pub const MANIFEST: &str = include_str!("../prebuilt/manifest.json");

/// Threads of a work group, across and down, of all entry points but [levels](is_level) of the
/// denoiser.
pub const WORKGROUP: (u32, u32) = (8, 8);

/// Name of the entry point that makes an image for a screen.
pub const DISPLAY: &str = "display";

/// Name of the entry point that writes first hits.
pub const FIRST_HIT: &str = "first_hit";

/// Render entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name of the entry point.
    pub name: &'static str,
    /// Features that the entry point is compiled for.
    pub features: Features,
}

impl Variant {
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

/// Names of entry points, and their SPIR-V modules.
type Modules = &'static [(&'static str, &'static [u8])];

macro_rules! modules {
    ($($name:ident $text:tt: $what:expr,)*) => {
        &[$(($text, include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*]
    };
}

const RENDER: Modules = for_each_variant!(modules);
const PASSES: Modules = for_each_pass!(modules);
const LEVELS: Modules = for_each_level!(modules);
const TEMPORAL: Modules = for_each_temporal!(modules);
const DISPLAYS: Modules = for_each_display!(modules);
const FIRST_HITS: Modules = &[(FIRST_HIT, include_bytes!("../prebuilt/spirv/first_hit.spv"))];

/// Returns whether an entry point is a level of the denoiser's filters, of which a thread computes
/// [`PIXELS_PER_THREAD`](trisect_shared::denoise::PIXELS_PER_THREAD) pixels.
pub fn is_level(entry_point: &str) -> bool {
    LEVELS.iter().any(|(name, _)| *name == entry_point)
}

/// Returns the threads of a work group of an entry point, across and down.
pub fn workgroup(entry_point: &str) -> (u32, u32) {
    if is_level(entry_point) { (64, 1) } else { WORKGROUP }
}

/// Returns the SPIR-V module, for Vulkan 1.2, that has only this entry point; `None` if there is no
/// such entry point.
pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
    let all = [RENDER, FIRST_HITS, PASSES, LEVELS, TEMPORAL, DISPLAYS].into_iter().flatten();
    all.copied().find(|(name, _)| *name == entry_point).map(|(_, module)| module)
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

    #[test]
    fn each_variant_is_in_each_artifact() {
        for (name, _) in [RENDER, FIRST_HITS, PASSES, LEVELS, TEMPORAL, DISPLAYS].into_iter().flatten() {
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
            for ptx in [PTX_PRECISE, PTX_FAST] {
                assert!(ptx.contains(&format!(".visible .entry {name}(")), "{name}");
            }
        }
    }
}
