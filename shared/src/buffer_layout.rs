//! Layout of records in buffers: the record itself, except in SPIR-V.
//!
//! A device can read 16 bytes with one instruction. LLVM finds such reads in a record. Vulkan's
//! compilers do not: they would load three coordinates, the number beside them and each child
//! separately, with a bounds check each. In SPIR-V a buffer therefore holds rows of four words,
//! which become a record once they are loaded; words, so that no bit pattern changes on the way.
//! [`crate::buffer`] converts on each access (docs/notebook/vulkan.md).

/// Element type of a buffer of `T`.
pub type Packed<T> = <T as Packable>::Rows;

/// Record that a buffer can hold.
pub trait Packable: Copy {
    /// Form of the record in a buffer.
    type Rows: Copy;
    /// Returns the record that `rows` hold.
    fn unpack(rows: Self::Rows) -> Self;
}

/// Record that kernels also write.
pub trait PackableMut: Packable {
    /// Returns the rows that hold this record.
    fn pack(self) -> Self::Rows;
}

#[cfg(not(target_arch = "spirv"))]
impl<T: Copy> Packable for T {
    type Rows = T;
    #[inline(always)]
    fn unpack(rows: T) -> T {
        rows
    }
}

#[cfg(not(target_arch = "spirv"))]
impl<T: Copy> PackableMut for T {
    #[inline(always)]
    fn pack(self) -> T {
        self
    }
}

#[cfg(target_arch = "spirv")]
pub use spirv::ReadRows;

#[cfg(target_arch = "spirv")]
#[allow(unsafe_code, reason = "see buffer")]
mod spirv {
    use super::{Packable, PackableMut};
    use crate::bvh::BvhNode;
    use crate::film::{Compensation, PixelSums};
    use crate::planar::Planar;
    use crate::records::aovs::AovSums;
    use crate::records::attributes::{MeshVertex, VertexAttributes};
    use crate::records::denoise::{FilteredPixel, GBufferTexel, HistoryPixel};
    use crate::records::environment::EnvironmentTexel;
    use crate::records::first_hit::FirstHit;
    use crate::records::instance::{InstanceEntry, InstancePlacement};
    use crate::records::layers::{LayerTextures, MaterialLayers};
    use crate::records::light::Light;
    use crate::records::material::Material;
    use crate::records::medium::Medium;
    use crate::records::texture::{Texel, Texture};
    use crate::sphere::Sphere;
    use crate::triangle::Triangle;
    use glam::{UVec2, UVec4, Vec3, Vec4};

    /// Rows that a buffer of single rows holds, too.
    pub trait ReadRows: Copy {
        /// Number of rows.
        const COUNT: u32;
        /// Returns the rows from `first` on.
        ///
        /// # Safety
        ///
        /// The buffer has these rows.
        unsafe fn read(rows: &[UVec4], first: u32) -> Self;
    }

    macro_rules! rows {
        ($($name:ident $bytes:literal: $($row:ident)*,)*) => {$(
            #[doc = concat!("A record of ", $bytes, " bytes.")]
            #[repr(C)]
            #[derive(Clone, Copy)]
            pub struct $name {
                $(#[doc = "Its next row."] pub $row: UVec4,)*
            }

            impl ReadRows for $name {
                const COUNT: u32 = $bytes / 16;
                #[inline(always)]
                unsafe fn read(rows: &[UVec4], first: u32) -> Self {
                    let mut next = first as usize;
                    $(
                        // SAFETY: the caller's promise.
                        let $row = unsafe { *rows.get_unchecked(next) };
                        next += 1;
                    )*
                    let _ = next;
                    Self { $($row,)* }
                }
            }
        )*};
    }

    rows! {
        Rows1 16: a,
        Rows2 32: a b,
        Rows3 48: a b c,
        Rows4 64: a b c d,
        Rows6 96: a b c d e f,
        Rows8 128: a b c d e f g h,
    }

    #[inline(always)]
    fn f(bits: u32) -> f32 {
        f32::from_bits(bits)
    }

    #[inline(always)]
    fn xyz(row: UVec4) -> Vec3 {
        Vec3::new(f(row.x), f(row.y), f(row.z))
    }

    #[inline(always)]
    fn xyzw(row: UVec4) -> Vec4 {
        Vec4::new(f(row.x), f(row.y), f(row.z), f(row.w))
    }

    #[inline(always)]
    fn row(v: Vec3, w: u32) -> UVec4 {
        UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w)
    }

    impl Packable for u32 {
        type Rows = u32;
        #[inline(always)]
        fn unpack(word: u32) -> u32 {
            word
        }
    }

    impl PackableMut for u32 {
        #[inline(always)]
        fn pack(self) -> u32 {
            self
        }
    }

    /// Implements [`Packable`], and [`PackableMut`] for records that kernels write, by conversions
    /// from and to rows.
    macro_rules! record {
        ($record:ident, $rows:ident, |$from:ident| $read:expr) => {
            impl Packable for $record {
                type Rows = $rows;
                #[inline(always)]
                fn unpack($from: $rows) -> Self {
                    $read
                }
            }
            const _: () = assert!(size_of::<$record>() == size_of::<$rows>());
        };
        ($record:ident, $rows:ident, |$from:ident| $read:expr, |$value:ident| $write:expr) => {
            record!($record, $rows, |$from| $read);
            impl PackableMut for $record {
                #[inline(always)]
                fn pack(self) -> $rows {
                    let $value = self;
                    $write
                }
            }
        };
    }

    record!(Sphere, Rows2, |r| Sphere { center: xyz(r.a), radius: f(r.a.w), material: r.b.x, pad: [0; 3] });
    record!(BvhNode, Rows4, |r| BvhNode {
        x: xyzw(r.a),
        y: xyzw(r.b),
        z: xyzw(r.c),
        first: r.d.x,
        second: r.d.y,
        tile_entry: r.d.z,
        pad: 0
    });
    record!(InstanceEntry, Rows4, |r| InstanceEntry {
        x: xyzw(r.a),
        y: xyzw(r.b),
        z: xyzw(r.c),
        root: r.d.x,
        first_triangle: r.d.y,
        triangle_count: r.d.z,
        pad: 0
    });
    record!(InstancePlacement, Rows4, |r| InstancePlacement {
        x: xyzw(r.a),
        y: xyzw(r.b),
        z: xyzw(r.c),
        handedness: f(r.d.x),
        pad: [0; 3]
    });
    record!(Planar, Rows6, |r| Planar {
        origin: xyz(r.a),
        material: r.a.w,
        normal: xyz(r.b),
        kind: r.b.w,
        dual_u: xyz(r.c),
        pad0: 0,
        dual_v: xyz(r.d),
        pad1: 0,
        edge_u: xyz(r.e),
        area: f(r.e.w),
        edge_v: xyz(r.f),
        pad2: 0
    });
    record!(Triangle, Rows3, |r| Triangle {
        a: xyz(r.a),
        vertex_a: r.a.w,
        b: xyz(r.b),
        vertex_b: r.b.w,
        c: xyz(r.c),
        vertex_c: r.c.w
    });
    record!(MeshVertex, Rows2, |r| MeshVertex {
        normal: xyz(r.a),
        material: r.a.w,
        u: f(r.b.x),
        v: f(r.b.y),
        attributes: r.b.z,
        instance: r.b.w
    });
    record!(VertexAttributes, Rows2, |r| VertexAttributes {
        color: Texel { red_green: r.a.x, blue_alpha: r.a.y },
        u: f(r.a.z),
        v: f(r.a.w),
        tangent: r.b.x,
        pad: [0; 3]
    });
    record!(Material, Rows8, |r| Material {
        albedo: xyz(r.a),
        kind: r.a.w,
        fuzz: f(r.b.x),
        ior: f(r.b.y),
        roughness: f(r.b.z),
        metallic: f(r.b.w),
        emission: xyz(r.c),
        light_pdf: f(r.c.w),
        eta: xyz(r.d),
        transmission: f(r.d.w),
        k: xyz(r.e),
        flags: r.e.w,
        albedo_texture: r.f.x,
        metallic_roughness_texture: r.f.y,
        emission_texture: r.f.z,
        transmission_texture: r.f.w,
        opacity: f(r.g.x),
        alpha_cutoff: f(r.g.y),
        normal_texture: r.g.z,
        normal_scale: f(r.g.w),
        layers: r.h.x,
        medium: r.h.y,
        pad: [0; 2]
    });
    record!(Medium, Rows8, |r| Medium {
        extinction: xyz(r.a),
        anisotropy: f(r.a.w),
        albedo: xyz(r.b),
        flags: r.b.w,
        emission: xyz(r.c),
        first_density: r.c.w,
        x: xyzw(r.d),
        y: xyzw(r.e),
        z: xyzw(r.f),
        width: r.g.x,
        height: r.g.y,
        depth: r.g.z,
        first_majorant: r.g.w,
        pad: [0; 4]
    });
    record!(MaterialLayers, Rows8, |r| MaterialLayers {
        specular_color: xyz(r.a),
        specular: f(r.a.w),
        sheen_color: xyz(r.b),
        sheen_roughness: f(r.b.w),
        absorption: xyz(r.c),
        dispersion: f(r.c.w),
        diffuse_transmission_color: xyz(r.d),
        diffuse_transmission: f(r.d.w),
        coat: f(r.e.x),
        coat_roughness: f(r.e.y),
        anisotropy: f(r.e.z),
        flags: r.e.w,
        anisotropy_cos: f(r.f.x),
        anisotropy_sin: f(r.f.y),
        film: f(r.f.z),
        film_ior: f(r.f.w),
        film_min: f(r.g.x),
        film_thickness: f(r.g.y),
        pad: [0; 2],
        coat_normal: xyz(r.h),
        padding: 0
    });
    record!(LayerTextures, Rows8, |r| LayerTextures {
        coat: r.a.x,
        coat_roughness: r.a.y,
        specular: r.a.z,
        specular_color: r.a.w,
        sheen_color: r.b.x,
        sheen_roughness: r.b.y,
        anisotropy: r.b.z,
        film: r.b.w,
        film_thickness: r.c.x,
        diffuse_transmission: r.c.y,
        diffuse_transmission_color: r.c.z,
        coat_normal: r.c.w,
        pad: [0; 20]
    });
    record!(Light, Rows4, |r| Light {
        kind: r.a.x,
        primitive: r.a.y,
        threshold: r.a.z,
        alias: r.a.w,
        position: xyz(r.b),
        probability: f(r.b.w),
        intensity: xyz(r.c),
        cone_scale: f(r.c.w),
        axis: xyz(r.d),
        cone_offset: f(r.d.w)
    });
    record!(Texture, Rows3, |r| Texture {
        first: r.a.x,
        width: r.a.y,
        height: r.a.z,
        flags: r.a.w,
        uu: f(r.b.x),
        uv: f(r.b.y),
        vu: f(r.b.z),
        vv: f(r.b.w),
        u0: f(r.c.x),
        v0: f(r.c.y),
        pad: [0; 2]
    });
    record!(EnvironmentTexel, Rows2, |r| EnvironmentTexel {
        radiance: xyz(r.a),
        pdf: f(r.a.w),
        threshold: r.b.x,
        alias: r.b.y,
        pad: [0; 2]
    });
    record!(Texel, UVec2, |r| Texel { red_green: r.x, blue_alpha: r.y }, |texel| UVec2::new(
        texel.red_green,
        texel.blue_alpha
    ));
    record!(
        PixelSums,
        Rows2,
        |r| PixelSums { radiance: xyz(r.a), samples: r.a.w, squares: xyz(r.b), segments: r.b.w },
        |s| Rows2 { a: row(s.radiance, s.samples), b: row(s.squares, s.segments) }
    );
    record!(
        AovSums,
        Rows4,
        |r| AovSums {
            normal: xyz(r.a),
            hits: r.a.w,
            albedo: xyz(r.b),
            primitive: r.b.w,
            position: xyz(r.c),
            misses: r.c.w,
            emission: xyz(r.d),
            diffuse: f(r.d.w)
        },
        |g| Rows4 {
            a: row(g.normal, g.hits),
            b: row(g.albedo, g.primitive),
            c: row(g.position, g.misses),
            d: row(g.emission, g.diffuse.to_bits())
        }
    );
    record!(FilteredPixel, Rows1, |r| FilteredPixel { color: xyz(r.a), variance: f(r.a.w) }, |l| Rows1 {
        a: row(l.color, l.variance.to_bits())
    });
    record!(GBufferTexel, Rows1, |r| GBufferTexel { normal: xyz(r.a), inverse_depth: f(r.a.w) }, |e| Rows1 {
        a: row(e.normal, e.inverse_depth.to_bits())
    });
    record!(
        HistoryPixel,
        Rows3,
        |r| HistoryPixel {
            filtered: FilteredPixel { color: xyz(r.a), variance: f(r.a.w) },
            gbuffer: GBufferTexel { normal: xyz(r.b), inverse_depth: f(r.b.w) },
            samples: f(r.c.x),
            pad0: 0,
            pad1: 0,
            pad2: 0
        },
        |p| Rows3 {
            a: row(p.filtered.color, p.filtered.variance.to_bits()),
            b: row(p.gbuffer.normal, p.gbuffer.inverse_depth.to_bits()),
            c: UVec4::new(p.samples.to_bits(), 0, 0, 0)
        }
    );
    record!(Compensation, Rows1, |r| Compensation { radiance: xyz(r.a), pad: 0 }, |c| Rows1 {
        a: row(c.radiance, 0)
    });
    record!(
        FirstHit,
        Rows2,
        |r| FirstHit { normal: xyz(r.a), primitive: r.a.w, distance: f(r.b.x), pad: [0; 3] },
        |h| Rows2 { a: row(h.normal, h.primitive), b: UVec4::new(h.distance.to_bits(), 0, 0, 0) }
    );
}
