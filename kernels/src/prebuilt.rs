//! The compiled kernels, as `cargo kernels` left them in `prebuilt/`.

use trisect_shared::features::{
    ALL, Features, GUIDES, LINEAR, METHOD, MICROFACETS, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL,
    TEXTURES,
};

/// PTX that gives the CPU's bits: no contraction, correctly rounded division and square root.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/trisect.precise.ptx");

/// PTX with fused multiply-add and approximate division and square root.
pub const PTX_FAST: &str = include_str!("../prebuilt/trisect.fast.ptx");

/// Threads of a work group, across and down, but of the [`LEVELS`] of the denoiser.
pub const WORKGROUP: (u32, u32) = (8, 8);

/// The entry point that writes first hits.
pub const FIRST_HIT: &str = "first_hit";

/// One render entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Of the entry point.
    pub name: &'static str,
    /// What it can do.
    pub features: Features,
}

impl Variant {
    /// Whether it renders what needs these features right, by whatever method.
    pub fn serves(self, features: Features) -> bool {
        // Without microfacets a variant has one Fresnel, not the choice of both.
        let fresnel = self.features & (SCHLICK | MICROFACETS) != SCHLICK || features & SCHLICK != 0;
        features & !METHOD & !self.features == 0 && fresnel
    }
}

macro_rules! table {
    ($($name:ident $text:tt: $features:expr,)*) => {
        /// All render entry points.
        pub const VARIANTS: &[Variant] = &[$(Variant { name: $text, features: $features },)*];

        fn spirv_of_variant(entry_point: &str) -> Option<&'static [u8]> {
            match entry_point {
                $($text => Some(include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*
                FIRST_HIT => Some(include_bytes!("../prebuilt/spirv/first_hit.spv")),
                _ => None,
            }
        }
    };
}

for_each_variant!(table);

macro_rules! passes {
    ($($name:ident $text:tt: |$($argument:ident),*| $body:block,)*) => {
        /// The passes of the denoiser that a thread a pixel makes.
        pub const PASSES: &[&str] = &[$($text,)*];

        fn spirv_of_pass(entry_point: &str) -> Option<&'static [u8]> {
            match entry_point {
                $($text => Some(include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*
                _ => None,
            }
        }
    };
}

for_each_pass!(passes);

macro_rules! levels {
    ($($name:ident $text:tt: |$($argument:ident),*| $body:block,)*) => {
        /// The levels of its filters, of which a thread makes [`PIXELS`](trisect_shared::denoise::PIXELS) pixels.
        pub const LEVELS: &[&str] = &[$($text,)*];

        fn spirv_of_level(entry_point: &str) -> Option<&'static [u8]> {
            match entry_point {
                $($text => Some(include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*
                _ => None,
            }
        }
    };
}

for_each_level!(levels);

/// Threads of a work group of an entry point, across and down.
pub fn workgroup(entry_point: &str) -> (u32, u32) {
    if LEVELS.contains(&entry_point) { (64, 1) } else { WORKGROUP }
}

/// SPIR-V for Vulkan 1.2: the module of an entry point, which it has alone. `None` where there is no such entry point.
pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
    let pass = || spirv_of_pass(entry_point).or_else(|| spirv_of_level(entry_point));
    spirv_of_variant(entry_point).or_else(pass)
}

/// The first, that is the cheapest, variant that can do all of `features`, by just their method.
pub fn variant(features: Features) -> Option<Variant> {
    let same_method = |variant: &Variant| variant.features & METHOD == features & METHOD;
    VARIANTS.iter().copied().find(|variant| variant.serves(features) && same_method(variant))
}

/// The variant with this name.
pub fn variant_by_name(name: &str) -> Option<Variant> {
    VARIANTS.iter().copied().find(|variant| variant.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_variant_is_in_each_artifact() {
        for name in VARIANTS.iter().map(|v| v.name).chain([FIRST_HIT]).chain([PASSES, LEVELS].concat()) {
            let module = spirv(name).expect(name);
            // OpEntryPoint, GLCompute, its function's id, its name.
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
