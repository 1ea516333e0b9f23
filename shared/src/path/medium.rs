//! Media along a path: flights between surfaces, and vertices in a medium, which are connected to a
//! light and scatter.

use super::nee::Connection;
use super::vertex::Vertex;
use super::{Path, blocks};
use crate::aovs::{self, AovSums, SurfaceAovs};
use crate::bsdf::BsdfEval;
use crate::buffer::SharedSlice;
use crate::bvh::NO_PRIMITIVE;
use crate::features::{AOVS, FeatureSet, Features, LIGHT_TREE, MEDIA, NEE, PORTALS};
use crate::light::{self, ReferencePoint};
use crate::math::{max, max_component, min};
use crate::medium::{COLLIDES, Medium, MediumStack, fly, load_medium, phase_function, sample_phase_function};
use crate::params::RenderParams;
use crate::ray::{OriginPrimitive, Ray};
use crate::sampler::words;
use crate::scene::Scene;
use glam::Vec3;

/// Distance of a vertex in a medium from the ends of its ray, relative to the coordinates: rounding
/// must not put it on the other side of a boundary, where its rays would not leave the medium.
const MARGIN: f32 = 8.0 * f32::EPSILON;

impl Path {
    /// Carries the light of the path's ray, or of its shadow ray, through the medium in which the
    /// ray is, up to a surface at `distance` or a collision before it. Returns whether it collided:
    /// then the ray ends at a vertex in the medium, and the path [continues](Self::shade_medium)
    /// there.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn fly<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        distance: f32,
    ) -> MediumVertex {
        let mut vertex = MediumVertex { collided: false, distance, albedo: Vec3::ONE, anisotropy: 0.0 };
        let id = self.media.innermost();
        if id != 0 {
            let shadow = features.has::<NEE>() && self.shadow;
            // SAFETY: the host numbers media from 1 on; the caller's promise.
            let medium: Medium =
                unsafe { load_medium(scene.materials, params.camera.first_medium + (id - 1)) };
            let (mut carries, mut block) = (self.throughput, blocks::flight(self.segment, self.passes));
            if shadow {
                (carries, block) = (self.pending_light, blocks::shadow_flight(self.segment, self.passes));
            }
            let random = words(features, self.key, block);
            let only_transmits = shadow || medium.flags & COLLIDES == 0;
            // SAFETY: the caller's promise.
            let flight = unsafe { fly(scene, &medium, self.ray, distance, carries, only_transmits, random) };
            if shadow {
                self.pending_light *= flight.weight;
            } else {
                self.throughput *= flight.weight;
            }
            if flight.collided {
                self.radiance += self.throughput * medium.emission;
                self.throughput *= medium.albedo;
                let Ray { origin, direction, .. } = self.ray;
                let reach = origin.abs() + direction.abs() * flight.distance;
                let margin = min(MARGIN * max_component(reach), 0.5 * distance);
                vertex = MediumVertex {
                    collided: true,
                    distance: max(min(flight.distance, distance - margin), margin),
                    albedo: medium.albedo,
                    anisotropy: medium.anisotropy,
                };
            }
        }
        vertex
    }

    /// Returns the transmittance by channel of the medium that a ray of a connection is in, for a
    /// distance; `block` is that of its random words.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(clippy::too_many_arguments, unsafe_code, reason = "one flight; see buffer")]
    pub(super) unsafe fn transmittance<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        media: MediumStack,
        ray: Ray,
        distance: f32,
        block: u32,
    ) -> Vec3 {
        let id = media.innermost();
        let mut passed = Vec3::ONE;
        if id != 0 {
            let random = words(features, self.key, block);
            // SAFETY: the host numbers media from 1 on; the caller's promise.
            passed = unsafe {
                let medium: Medium = load_medium(scene.materials, params.camera.first_medium + (id - 1));
                fly(scene, &medium, ray, distance, Vec3::ONE, true, random).weight
            };
        }
        passed
    }

    /// Connects the vertex in a medium at which the path's ray ends to a light, and scatters.
    /// Returns whether the path ended.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn shade_medium<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        vertex: MediumVertex,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        self.segment += 1;
        let incoming = self.ray.direction;
        let point = self.ray.origin + incoming * vertex.distance;
        if features.has::<AOVS>() && self.segment == 1 {
            let aov_sample = SurfaceAovs { albedo: vertex.albedo, diffuse: 1.0 };
            let add_hit = |g: &mut AovSums| g.add_hit(NO_PRIMITIVE, -incoming, aov_sample, point, Vec3::ZERO);
            // SAFETY: the caller's promise.
            unsafe { aovs::update_pixel(aovs, self.pixel, add_hit) };
        }
        let mut ended = true;
        if self.segment < params.max_depth {
            // SAFETY: the caller's promise.
            let connection = unsafe { self.connect_medium(features, params, scene, point) };
            let cos = connection.light.direction.dot(incoming);
            let pdf = phase_function(vertex.anisotropy, cos);
            let eval = BsdfEval { value: Vec3::splat(pdf), pdf };
            if features.has::<NEE>() {
                self.begin_connection(&connection, eval);
            }
            let random = words(features, self.key, blocks::scattering(self.segment));
            let direction = sample_phase_function(vertex.anisotropy, incoming, random.x, random.y);
            self.pdf = phase_function(vertex.anisotropy, direction.dot(incoming));
            self.vertex_primitive = NO_PRIMITIVE;
            self.skipped_distance = 0.0;
            if features.has::<{ LIGHT_TREE | PORTALS }>() {
                self.vertex_normal = Vec3::ZERO;
            }
            self.continues = max_component(self.throughput) > 0.0;
            self.play_roulette(features, params, random.w);
            self.continuation = Ray::in_world(point, direction, OriginPrimitive::NONE);
            self.continuation_media = self.media;
            ended = !self.continues && !self.shadow;
            self.ray = if features.has::<NEE>() && self.shadow {
                Ray::in_world(point, connection.light.direction, OriginPrimitive::NONE)
            } else {
                self.continuation
            };
        }
        ended
    }

    /// Samples the direct light at a point in a medium, if there is a light.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn connect_medium<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        point: Vec3,
    ) -> Connection {
        let mut connection = Connection::NONE;
        if features.has::<NEE>() && (params.light_count > 0 || params.environment_probability > 0.0) {
            let random = words(features, self.key, blocks::light(self.segment));
            let choice = self.choice_of_sky(features, params);
            let from = ReferencePoint { point, primitive: NO_PRIMITIVE, normal: Vec3::ZERO };
            // SAFETY: the caller's promise.
            let light = unsafe { light::sample(features, params, scene, from, random, choice) };
            connection = Connection { light, is_possible: true, inside: false };
        }
        connection
    }

    /// Continues the ray beyond the surface at `vertex`, in the medium there.
    #[inline(always)]
    pub(super) fn pass<const POSSIBLE: Features>(&mut self, features: FeatureSet<POSSIBLE>, vertex: &Vertex) {
        self.ray = vertex.pass();
        if features.has::<MEDIA>() {
            self.media = self.media.cross(vertex.material.medium, vertex.is_front());
        }
    }

    /// Enters or leaves the medium that the surface at `vertex` bounds: for the path's ray that
    /// leaves it to its inside or its outside, and for the shadow ray if there is one. `front` is
    /// true if the path came from outside.
    #[inline(always)]
    pub(super) fn leave_surface<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        vertex: &Vertex,
        front: bool,
        inside: bool,
        shadow_inside: bool,
    ) {
        if features.has::<MEDIA>() {
            self.continuation_media = self.media_behind(vertex, front, inside);
            let connects = features.has::<NEE>() && self.shadow;
            self.media = self.media_behind(vertex, front, if connects { shadow_inside } else { inside });
        }
    }

    /// Returns the media of a ray that leaves the surface at `vertex`, to its inside or its
    /// outside. `front` is true if the path's ray came from outside.
    #[inline(always)]
    pub(super) fn media_behind(&self, vertex: &Vertex, front: bool, inside: bool) -> MediumStack {
        let id = if front == inside { vertex.material.medium } else { 0 };
        self.media.cross(id, inside)
    }
}

/// Vertex of a path in a medium.
#[derive(Clone, Copy)]
pub(super) struct MediumVertex {
    /// False if there is none, because light reached the surface.
    pub(super) collided: bool,
    distance: f32,
    albedo: Vec3,
    anisotropy: f32,
}
