//! Vertex of a path: the point of a surface that a ray hits, and how rays leave it.

use crate::bsdf::{
    Bsdf, BsdfNormals, LAMBERTIAN, Slots, TexturePoint, TexturedMaterial, is_layered, load_material, opacity,
    straight_transmittance,
};
use crate::bvh::Hit;
use crate::features::{FeatureSet, Features, NORMAL_MAPS, PLANAR, SMOOTH, TRIANGLES};
use crate::layers::MaterialLayers;
use crate::material::Material;
use crate::math::max;
use crate::params::RenderParams;
use crate::ray::{OriginPrimitive, Ray};
use crate::scene::Scene;
use crate::smooth_surface::lift;
use crate::surface::{self, Surface, bend_shading_normal, mapped_normal};
use crate::texture::NO_TEXTURE;
use glam::Vec3;

/// Point of a surface that a path's ray hits, and what is there.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// Ray that hits the surface.
    pub(super) ray: Ray,
    pub(super) hit: Hit,
    pub(super) surface: Surface,
    pub(super) material: Material,
    /// Layers of a layered material; the coat's normal is on the side of the surface's.
    pub(super) layers: MaterialLayers,
    /// Unit normal on the side of the surface's normal, by the normal map if there is one.
    pub(super) mapped_normal: Vec3,
    /// True if there is one.
    pub(super) is_mapped: bool,
}

impl Vertex {
    /// Loads what is at `hit`, with the textures of the material's slots `wanted`.
    ///
    /// # Safety
    ///
    /// As [`render_pixel`](super::render_pixel); `hit` is that of a primitive, from `ray`'s
    /// traversal.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn at<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        ray: Ray,
        hit: Hit,
        wanted: Slots,
    ) -> Self {
        // SAFETY: a primitive that traversal returned; the caller's promise for materials.
        let (surface, textured) = unsafe {
            let surface = surface::at(features, params, scene, ray, hit);
            let place = TexturePoint { u: surface.u, v: surface.v, attributes: surface.attributes };
            (surface, load_material(features, scene, surface.material, wanted, place))
        };
        let (mut normal, mut is_mapped) = (surface.shading_normal, false);
        if features.has::<NORMAL_MAPS>() && textured.material.normal_texture != NO_TEXTURE {
            (normal, is_mapped) = (mapped_normal(&surface, textured.normal), true);
        }
        let TexturedMaterial { material, mut layers, .. } = textured;
        if features.has::<NORMAL_MAPS>()
            && is_layered(features, material.kind)
            && layers.coat_normal != Vec3::ZERO
        {
            layers.coat_normal = mapped_normal(&surface, layers.coat_normal);
        }
        Self { ray, hit, surface, material, layers, mapped_normal: normal, is_mapped }
    }

    /// Returns whether the ray comes from the outside.
    #[inline(always)]
    pub(super) fn is_front(&self) -> bool {
        self.ray.direction.dot(self.surface.normal) < 0.0
    }

    /// Returns the surface's opacity.
    #[inline(always)]
    pub(super) fn opacity<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> f32 {
        opacity(features, &self.material)
    }

    /// Returns the part of the light by channel that passes straight through a pane.
    #[inline(always)]
    pub(super) fn straight_transmittance<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
    ) -> Vec3 {
        let normals = self.facing_normals(features, params, self.is_front());
        let cos = max(-self.ray.direction.dot(normals.of_bsdf.shading), 1e-6);
        straight_transmittance(features, &self.material, cos)
    }

    /// Returns the continuation of the ray beyond the surface.
    #[inline(always)]
    pub(super) fn pass(&self) -> Ray {
        let Surface { point, normal, error_bound, .. } = self.surface;
        let inside = self.is_front();
        Ray {
            origin: surface::offset_ray_origin(point, normal, error_bound, !inside),
            direction: self.ray.direction,
            origin_primitive: OriginPrimitive::new(self.hit.primitive, inside),
            origin_instance: self.hit.instance,
        }
    }

    /// Returns the ray that leaves the surface in `direction`, to its inside or its outside; light
    /// that is reflected near the horizon leaves the [smooth surface](crate::smooth_surface).
    #[inline(always)]
    pub(super) fn leave<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        direction: Vec3,
        inside: bool,
    ) -> Ray {
        let Surface { point, normal, error_bound, smooth_height, .. } = self.surface;
        let mut origin_primitive = OriginPrimitive::new(self.hit.primitive, inside);
        let mut height = error_bound;
        // Light that is reflected, near the horizon of a triangle that stands for a smooth surface.
        if features.has::<SMOOTH>() && smooth_height > 0.0 && inside != self.is_front() {
            let cos = direction.dot(if inside { -normal } else { normal });
            height += lift(smooth_height, cos);
            // Below the horizon the ray may meet its own triangle, from above.
            if cos < 0.0 {
                origin_primitive = OriginPrimitive::NONE;
            }
        }
        let origin = if features.has::<{ PLANAR | TRIANGLES }>() {
            surface::offset_ray_origin(point, normal, height, !inside)
        } else {
            point
        };
        Ray { origin, direction, origin_primitive, origin_instance: self.hit.instance }
    }

    /// Returns whether light from this direction is reflected and meets the smooth surface above
    /// the triangle.
    #[inline(always)]
    pub(super) fn is_lifted(&self, bsdf: &Bsdf, direction: Vec3) -> bool {
        bsdf.cosine(direction) > 0.0 && self.surface.smooth_height > 0.0
    }

    /// Returns whether the surface may scatter light from this direction: light between the
    /// horizons of the surface and of its shading normal would leak, unless the smooth surface lies
    /// above.
    #[inline(always)]
    pub(super) fn scatters(&self, bsdf: &Bsdf, direction: Vec3, front: bool) -> bool {
        let outside = direction.dot(self.surface.normal) > 0.0;
        (bsdf.cosine(direction) > 0.0) == (outside == front) || self.is_lifted(bsdf, direction)
    }

    /// Returns the normals on the side that the ray comes from, as `front` says.
    #[inline(always)]
    pub(super) fn facing_normals<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        front: bool,
    ) -> FacingNormals {
        let Surface { normal, shading_normal, .. } = self.surface;
        let geometric = if front { normal } else { -normal };
        let (mut shading, mut mapped, mut smooth) = (geometric, geometric, geometric);
        // Only a triangle has a shading normal of its own: others keep their bits in every kernel.
        let differ = features.has::<TRIANGLES>() && self.hit.primitive >= params.first_triangle;
        if differ {
            shading = if front { self.mapped_normal } else { -self.mapped_normal };
            (mapped, smooth) = (shading, if front { shading_normal } else { -shading_normal });
            // A diffuse surface keeps its normal: its shading must not depend on the viewer.
            if self.material.kind != LAMBERTIAN {
                shading = bend_shading_normal(shading, geometric, -self.ray.direction);
            }
        }
        let is_mapped = features.has::<NORMAL_MAPS>() && self.is_mapped && differ;
        FacingNormals { geometric, differ, of_bsdf: BsdfNormals { shading, is_mapped, mapped, smooth } }
    }
}

/// Unit normals of a vertex, on the side that its ray comes from.
#[derive(Clone, Copy)]
pub(super) struct FacingNormals {
    pub(super) geometric: Vec3,
    /// True if the primitive has a shading normal of its own.
    pub(super) differ: bool,
    pub(super) of_bsdf: BsdfNormals,
}

impl FacingNormals {
    /// Returns the unit normal of a coat whose normal map says `mapped`, on the viewer's side, or
    /// zero for no map; zero stands for the shading normal. It is bent as shading normals are.
    #[inline(always)]
    pub(super) fn of_coat<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        mapped: Vec3,
        viewer: Vec3,
    ) -> Vec3 {
        let mut normal = Vec3::ZERO;
        if features.has::<NORMAL_MAPS>() {
            if mapped != Vec3::ZERO {
                normal = bend_shading_normal(mapped, self.geometric, viewer);
            } else if self.of_bsdf.is_mapped {
                normal = bend_shading_normal(self.of_bsdf.smooth, self.geometric, viewer);
            }
        }
        normal
    }
}
