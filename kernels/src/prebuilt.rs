//! The compiled kernels, as `cargo kernels` left them in `prebuilt/`.

use trisect_shared::features::{
    ALL, Features, LINEAR, METHOD, MICROFACETS, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL, TEXTURES,
};

/// SPIR-V for Vulkan 1.2 with all entry points.
pub const SPIRV: &[u8] = include_bytes!("../prebuilt/trisect.spv");

/// PTX that gives the CPU's bits: no contraction, correctly rounded division and square root.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/trisect.precise.ptx");

/// PTX with fused multiply-add and approximate division and square root.
pub const PTX_FAST: &str = include_str!("../prebuilt/trisect.fast.ptx");

/// Threads of a work group, across and down.
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
    };
}

for_each_variant!(table);

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
        let spirv = String::from_utf8_lossy(SPIRV);
        for name in VARIANTS.iter().map(|v| v.name).chain([FIRST_HIT]) {
            for ptx in [PTX_PRECISE, PTX_FAST] {
                assert!(ptx.contains(&format!(".visible .entry {name}(")), "{name}");
            }
            assert!(spirv.contains(name), "{name}");
        }
    }
}
