//! Features of a render kernel: a mask of bits. A kernel does only what its mask has, so a scene
//! pays for nothing else.
//!
//! On GPUs the mask is a constant that the host writes into the compiled module before the driver
//! compiles it (`trisect_kernels`), so the driver removes what is missing. On the CPU a few sets of
//! [possible](FeatureSet) features are compiled ahead, and the mask decides among those at run
//! time.

/// Set of features. GPUs hold it as two [words](of_words): not all have integers of 64 bits.
pub type Features = u64;

/// Returns the set whose bits 0 to 31 are `low`, and whose bits 32 to 63 are `high`.
#[inline(always)]
pub const fn of_words(low: u32, high: u32) -> Features {
    (high as Features) << 32 | low as Features
}

/// Returns the [words](of_words) of a set, the low one first.
#[inline(always)]
pub const fn to_words(features: Features) -> [u32; 2] {
    [features as u32, (features >> 32) as u32]
}

/// Schlick's approximation for smooth glass, as "Ray Tracing in One Weekend" (the book) has it,
/// instead of Fresnel's equations.
pub const SCHLICK: Features = 1 << 0;
/// Owen-scrambled Sobol sequence instead of independent random numbers.
pub const SOBOL: Features = 1 << 1;
/// Writing of [`AovSums`](crate::aovs::AovSums) at the camera ray's first hit.
pub const AOVS: Features = 1 << 2;

/// Russian roulette: a path survives with 3 times the largest component of its throughput, at most
/// 1, as probability, from the segment on that the launch parameters name.
pub const ROULETTE: Features = 1 << 3;
/// Spheres.
pub const SPHERES: Features = 1 << 4;
/// Planar shapes: quads and discs.
pub const PLANAR: Features = 1 << 5;
/// Triangles.
pub const TRIANGLES: Features = 1 << 6;
/// Normals of mesh vertices.
pub const SMOOTH: Features = 1 << 7;
/// Instances of meshes: leaves of the BVH that are trees of their own.
pub const INSTANCES: Features = 1 << 8;

/// Surfaces that emit.
pub const EMITTERS: Features = 1 << 9;
/// Next-event estimation: connections of paths to lights and to the sky.
pub const NEE: Features = 1 << 10;
/// With [`NEE`]: connections to point, spot and directional lights.
pub const PUNCTUAL: Features = 1 << 11;
/// With [`NEE`]: a tree of lights, by which each connection chooses.
pub const LIGHT_TREE: Features = 1 << 12;
/// Environment map as the sky.
pub const ENVIRONMENT: Features = 1 << 13;

/// Image textures.
pub const TEXTURES: Features = 1 << 14;
/// Surfaces that are masked or blended.
pub const HOLES: Features = 1 << 15;
/// Normal maps of meshes.
pub const NORMAL_MAPS: Features = 1 << 16;
/// Colours of mesh vertices, and second sets of their texture coordinates.
pub const ATTRIBUTES: Features = 1 << 17;

/// Participating media: volumes that absorb, scatter and emit.
pub const MEDIA: Features = 1 << 18;
/// Thin walls of clear glass without roughness, which shadow rays pass.
pub const PANES: Features = 1 << 19;
/// With [`NEE`] and [`PUNCTUAL`]: connections to lights without extent through smooth glass.
pub const REFRACTED_LIGHT: Features = 1 << 20;
/// With [`NEE`]: connections to the sky through portals.
pub const PORTALS: Features = 1 << 21;

/// Place of the bit of material kind 0; the bits of the kinds end below 32.
const FIRST_MATERIAL: u32 = 22;

/// Boxes of the BVH that are [padded](crate::slabs) for all ray origins of the launch. Only GPUs
/// make use of it.
pub const PADDED_BOXES: Features = 1 << 32;
/// Traversal that tests each primitive, without a BVH; all other traversals must agree with it.
pub const LINEAR: Features = 1 << 33;
/// Traversal of the wide BVH, on the CPU only.
pub const WIDE: Features = 1 << 34;
/// Wide traversal by AVX2. The caller of a function with this feature promises that the CPU
/// supports it.
pub const AVX2: Features = 1 << 35;
/// Wide traversal by AVX-512; as [`AVX2`].
pub const AVX512: Features = 1 << 36;
/// Counting of the [`Visits`](crate::bvh::Visits) of a traversal. No render kernel has this: its
/// search drops what it counted.
pub const COUNTED: Features = 1 << 37;
/// Schedule: a lane starts its next sample as soon as its path ends, not when all paths of its warp
/// have ended.
pub const REGENERATE: Features = 1 << 38;
/// Schedule: the device is filled once, and each lane takes pixels from a queue.
pub const PERSISTENT: Features = 1 << 39;
/// Schedule, with [`PERSISTENT`]: lanes whose rays are done shade and take their next rays while
/// the searches of other lanes of the warp wait.
pub const INTERLEAVED: Features = 1 << 40;

/// Features that choose the image: a kernel must have those of the render and no others. All
/// features below are needed by a scene or its settings, and a kernel may have more.
pub const CHOICES: Features = SCHLICK | SOBOL | AOVS;

/// Kinds of primitives.
pub const SHAPES: Features = SPHERES | PLANAR | TRIANGLES;

/// Materials of the book: the kinds below [`MICROFACET_KINDS`](crate::bsdf::MICROFACET_KINDS).
pub const BOOK: Features = 0b111 << FIRST_MATERIAL;

/// Microfacet materials: the other kinds.
pub const MICROFACETS: Features = 0x1f << (FIRST_MATERIAL + 5);

/// Returns the features of microfacet materials of greater kinds.
#[inline(always)]
pub const fn of_greater_kinds(kind: u32) -> Features {
    let bit = of_material(kind);
    MICROFACETS & !(bit | (bit - 1))
}

/// Layered materials: a kind that makes a kernel more than twice as large.
pub const LAYERS: Features = 1 << (FIRST_MATERIAL + 8);

/// Returns the feature of materials of a kind of [`crate::bsdf`].
#[inline(always)]
pub const fn of_material(kind: u32) -> Features {
    1 << (FIRST_MATERIAL + kind)
}

/// All features that a scene or its settings can need.
pub const NEEDS: Features = ROULETTE
    | SHAPES
    | SMOOTH
    | INSTANCES
    | BOOK
    | MICROFACETS
    | EMITTERS
    | NEE
    | PUNCTUAL
    | LIGHT_TREE
    | REFRACTED_LIGHT
    | PANES
    | PORTALS
    | ENVIRONMENT
    | MEDIA
    | OF_SURFACES;

/// Features that decide what is read of a surface beyond its primitive and its material.
pub const OF_SURFACES: Features = TEXTURES | HOLES | NORMAL_MAPS | ATTRIBUTES;

/// Features that choose traversal and schedule. They do not change the image.
pub const STRATEGY: Features = PADDED_BOXES | LINEAR | WIDE | REGENERATE | PERSISTENT | INTERLEAVED;

/// Features that kernels for GPUs may have.
pub const OF_GPUS: Features = CHOICES | NEEDS | STRATEGY & !WIDE;

/// Features of scenes for which GPUs have kernels of their own, so that other scenes do not pay.
pub const RARE: Features = LAYERS | INSTANCES | REFRACTED_LIGHT | MEDIA;

/// Features that kernels for GPUs may have in scenes without the rare ones.
pub const OF_GPUS_WITHOUT_RARE: Features = OF_GPUS & !RARE;

/// Returns whether a kernel has several kinds of microfacet materials: it does not fit a GPU's
/// instruction cache, and its lanes diverge.
pub const fn is_of_many_materials(features: Features) -> bool {
    (features & MICROFACETS).count_ones() > 1
}

/// Features that CUDA's kernels for spheres with the book's materials may have.
pub const OF_BOOK: Features = CHOICES | ROULETTE | SPHERES | BOOK | PADDED_BOXES | REGENERATE | PERSISTENT;

/// Features that make a kernel large: it takes many registers, and its lanes diverge.
pub const HEAVY: Features = PLANAR | TRIANGLES | EMITTERS | NEE | ENVIRONMENT | MEDIA | OF_SURFACES;

/// Features with their names, as options and statistics have them; those of materials are in
/// [`bsdf::NAMES`](crate::bsdf::NAMES).
pub const NAMES: [(Features, &str); 28] = [
    (SCHLICK, "schlick"),
    (SOBOL, "sobol"),
    (AOVS, "aovs"),
    (ROULETTE, "roulette"),
    (SPHERES, "spheres"),
    (PLANAR, "planar"),
    (TRIANGLES, "triangles"),
    (SMOOTH, "smooth"),
    (INSTANCES, "instances"),
    (EMITTERS, "emitters"),
    (NEE, "nee"),
    (PUNCTUAL, "punctual"),
    (LIGHT_TREE, "light-tree"),
    (REFRACTED_LIGHT, "refracted-light"),
    (ENVIRONMENT, "environment"),
    (TEXTURES, "textures"),
    (HOLES, "holes"),
    (PANES, "panes"),
    (PORTALS, "portals"),
    (NORMAL_MAPS, "normal-maps"),
    (ATTRIBUTES, "attributes"),
    (MEDIA, "media"),
    (PADDED_BOXES, "padded-boxes"),
    (LINEAR, "linear"),
    (WIDE, "wide"),
    (REGENERATE, "regenerate"),
    (PERSISTENT, "persistent"),
    (INTERLEAVED, "interleaved"),
];

/// Features that a kernel asks for while it runs. Those outside of `POSSIBLE` are known to be
/// missing when the kernel is compiled; of the others a mask decides.
#[derive(Clone, Copy, Debug)]
pub struct FeatureSet<const POSSIBLE: Features> {
    /// [Words](of_words) of the mask.
    low: u32,
    high: u32,
}

impl<const POSSIBLE: Features> FeatureSet<POSSIBLE> {
    /// All features that are possible: each is known when the kernel is compiled.
    pub const ALL: Self = Self::new(POSSIBLE);

    /// Returns the features of `mask`.
    #[inline(always)]
    pub const fn new(mask: Features) -> Self {
        let [low, high] = to_words(mask);
        Self { low, high }
    }

    /// Returns the features of the mask with these [words](of_words).
    #[inline(always)]
    pub const fn of_words(low: u32, high: u32) -> Self {
        Self { low, high }
    }

    /// Returns whether the kernel has a bit of `SOME`.
    ///
    /// The argument is a constant of the type, so that kernels for GPUs compare words only.
    #[inline(always)]
    pub const fn has<const SOME: Features>(self) -> bool {
        let (low, high) = const { ((POSSIBLE & SOME) as u32, ((POSSIBLE & SOME) >> 32) as u32) };
        (self.low & low) | (self.high & high) != 0
    }

    /// Returns whether `kind`, which is at least the kind of material `of`, equals it. `OF` is the
    /// feature of that kind, and `GREATER` has those of greater kinds; a kernel without any
    /// compares nothing.
    #[inline(always)]
    pub const fn is_kind<const OF: Features, const GREATER: Features>(self, kind: u32, of: u32) -> bool {
        self.has::<OF>() && (kind == of || !self.has::<GREATER>())
    }
}

/// Returns whether `features` has any bit of `some`.
#[inline(always)]
pub const fn has_any(features: Features, some: Features) -> bool {
    features & some != 0
}
