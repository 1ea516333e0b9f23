//! Methods of rendering: math build, traversal and schedule.

use serde::Serialize;
use trisect_shared::features::{
    Features, HEAVY, INTERLEAVED, LINEAR, MICROFACETS, NEE, PERSISTENT, REGENERATE, ROULETTE, TEXTURES,
    TRIANGLES, WIDE, has_any, is_of_many_materials,
};

/// Math build of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum MathMode {
    /// Each operation is rounded separately; CUDA gives the bits of the CPU.
    ///
    /// Vulkan gives them too where the driver's division and square root are correctly rounded.
    Precise,
    /// Fused multiply-add, and on CUDA approximate division and square root; not on the CPU.
    Fast,
}

/// Method of finding the closest hit. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Traversal {
    /// Test of each primitive.
    Linear,
    /// Binary BVH, with a stack for each ray.
    Stack,
    /// Wide BVH, on the CPU only.
    Wide,
}

/// Number of primitives from which on a GPU interleaves the searches of triangles. With fewer,
/// lanes lose more by shading in small groups than by waiting for searches
/// (docs/notebook/triangles-and-trees.md).
const MIN_INTERLEAVED_PRIMITIVES: usize = 4096;

/// Number of primitives from which on a light kernel gains from a queue: with fewer, rays of a warp
/// visit the same few nodes anyway (docs/notebook/specialisation.md).
const MIN_QUEUE_PRIMITIVES: usize = 32;

/// Assignment of pixels and samples to the lanes of a device. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Schedule {
    /// One pixel per lane, one sample after the other; lanes of a warp wait for its longest path.
    Pixel,
    /// One pixel per lane; its next sample starts as soon as a path ends.
    Regenerate,
    /// All lanes that the device holds; each takes pixels from a queue.
    Persistent,
    /// Lanes as in `persistent`; those whose rays are done shade while the searches of others wait.
    Interleaved,
}

impl Traversal {
    /// Returns the traversal of a kernel with these features.
    pub fn of(features: Features) -> Self {
        match features & (LINEAR | WIDE) {
            LINEAR => Self::Linear,
            0 => Self::Stack,
            _ => Self::Wide,
        }
    }

    /// Returns the features of a kernel with this method.
    pub fn features(self) -> Features {
        match self {
            Self::Linear => LINEAR,
            Self::Stack => 0,
            Self::Wide => WIDE,
        }
    }
}

/// Returns whether a GPU gains by interleaving the searches of a kernel: searches are long among
/// many triangles, and with light sampling rays of a warp differ in length. Textures take so long
/// that shading by few lanes loses more.
fn has_long_searches(kernel: Features, primitives: usize) -> bool {
    has_any(kernel, TRIANGLES)
        && has_any(kernel, NEE)
        && !has_any(kernel, TEXTURES)
        && primitives >= MIN_INTERLEAVED_PRIMITIVES
}

impl Schedule {
    /// Returns the schedule that was fastest on CUDA for a kernel with these features, in a scene
    /// of so many primitives.
    pub(crate) fn best_on_cuda(kernel: Features, primitives: usize) -> Self {
        match () {
            () if has_long_searches(kernel, primitives) && !has_any(kernel, MICROFACETS) => Self::Interleaved,
            () if has_any(kernel, HEAVY) || primitives >= MIN_QUEUE_PRIMITIVES => Self::Persistent,
            () => Self::Regenerate,
        }
    }

    /// Returns the schedule that was fastest on Vulkan for a kernel with these features, in a scene
    /// of so many primitives. Its queue is dear, because lanes cannot vote in loops
    /// (docs/notebook/vulkan.md); without roulette, paths among plain spheres are long enough.
    pub(crate) fn best_on_vulkan(kernel: Features, primitives: usize) -> Self {
        let has_long_paths =
            !has_any(kernel, HEAVY | MICROFACETS | ROULETTE) && primitives >= MIN_QUEUE_PRIMITIVES;
        if has_long_searches(kernel, primitives) || is_of_many_materials(kernel) || has_long_paths {
            return Self::Interleaved;
        }
        Self::Regenerate
    }

    /// Returns the schedule of a kernel with these features.
    pub fn of(features: Features) -> Self {
        match features & (REGENERATE | PERSISTENT | INTERLEAVED) {
            0 => Self::Pixel,
            REGENERATE => Self::Regenerate,
            few if few & INTERLEAVED == 0 => Self::Persistent,
            _ => Self::Interleaved,
        }
    }

    /// Returns the features of a kernel with this method.
    pub fn features(self) -> Features {
        match self {
            Self::Pixel => 0,
            Self::Regenerate => REGENERATE,
            Self::Persistent => REGENERATE | PERSISTENT,
            Self::Interleaved => REGENERATE | PERSISTENT | INTERLEAVED,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::bsdf::{CONDUCTOR, LAMBERTIAN, METALLIC_ROUGHNESS};
    use trisect_shared::features::{EMITTERS, PLANAR, SPHERES, of_material};

    /// The defaults on scenes that were measured (docs/notebook/specialisation.md).
    #[test]
    fn schedules_are_those_that_were_fastest() {
        use Schedule::{Interleaved, Persistent, Regenerate};
        let grey = of_material(LAMBERTIAN);
        let lit = grey | EMITTERS | NEE;
        let rough = of_material(CONDUCTOR) | of_material(METALLIC_ROUGHNESS);
        for (scene, features, primitives, cuda, vulkan) in [
            ("three_spheres", SPHERES | grey, 4, Regenerate, Regenerate),
            ("rtiow_final", SPHERES | grey, 485, Persistent, Interleaved),
            ("rtiow_final by roulette", SPHERES | grey | ROULETTE, 485, Persistent, Regenerate),
            ("cornell_box", PLANAR | lit, 18, Persistent, Regenerate),
            ("materials", SPHERES | lit | rough, 40, Persistent, Interleaved),
            ("features.glb", TRIANGLES | TEXTURES | lit, 9_000, Persistent, Regenerate),
            ("room", TRIANGLES | PLANAR | lit, 499_287, Interleaved, Interleaved),
            ("room with rough metal", TRIANGLES | lit | rough, 499_287, Persistent, Interleaved),
            ("mesh under a uniform sky", TRIANGLES | grey, 499_280, Persistent, Regenerate),
            ("few triangles", TRIANGLES | lit, 4_095, Persistent, Regenerate),
        ] {
            assert_eq!(Schedule::best_on_cuda(features, primitives), cuda, "{scene} on CUDA");
            assert_eq!(Schedule::best_on_vulkan(features, primitives), vulkan, "{scene} on Vulkan");
        }
    }
}
