//! Connection of a path's vertex to a light: its shadow ray, from its start, through what it
//! passes, to its end.

use super::nee::{Connection, sample_direct_light};
use super::vertex::Vertex;
use super::{MAX_PASSES, Path};
use crate::bsdf::{Bsdf, BsdfEval, is_layered, is_pane};
use crate::features::{FeatureSet, Features, NEE};
use crate::layers::SOLID;
use crate::math::{max_component, min};
use crate::medium::transmittance;
use crate::params::RenderParams;
use crate::scene::Scene;
use glam::Vec3;

impl Path {
    /// Samples the direct light at `vertex`, if there is a light and the surface is not a mirror.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn connect<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        vertex: &Vertex,
        bsdf: &Bsdf,
        front: bool,
    ) -> Connection {
        if features.has::<NEE>()
            && (params.light_count > 0 || params.environment_probability > 0.0)
            && bsdf.has_non_delta_lobe(features)
        {
            // SAFETY: the caller's promise.
            return unsafe { sample_direct_light(features, params, scene, self, vertex, bsdf, front) };
        }
        Connection::NONE
    }

    /// Makes the connection's shadow ray the next ray, if it may add light; `eval` is that of the
    /// BSDF in its direction.
    #[inline(always)]
    pub(super) fn begin_connection(&mut self, connection: &Connection, eval: BsdfEval) {
        self.pending_light = self.throughput * connection.contribution(eval);
        self.shadow = max_component(self.pending_light) > 0.0;
        (self.shadow_t_max, self.light_primitive) = (connection.light.t_max, connection.light.primitive);
        self.panes = 0;
    }

    /// Weakens the light of a connection by the absorption of the solid through which it comes.
    #[inline(always)]
    pub(super) fn absorb_connection<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        vertex: &Vertex,
        connection: &Connection,
        front: bool,
    ) {
        let is_solid = is_layered(features, vertex.material.kind) && vertex.layers.flags & SOLID != 0;
        let sigma = if connection.inside != front || !is_solid {
            self.absorption
        } else if front {
            vertex.layers.absorption
        } else {
            Vec3::ZERO
        };
        if sigma.dot(sigma) > 0.0 {
            self.pending_light *= transmittance(sigma, min(connection.light.t_max, 1e30));
        }
    }

    /// Weakens the light of the shadow ray by the surface at `vertex`, which it passes unless no
    /// light is left. A pane counts as a segment, as it does for a path that passes it. Returns
    /// whether the path ended.
    #[inline(always)]
    pub(super) fn attenuate<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        vertex: &Vertex,
    ) -> bool {
        let opacity = vertex.opacity(features);
        let mut passed = Vec3::splat(1.0 - opacity);
        if is_pane(features, &vertex.material) {
            self.panes += 1;
            if self.segment + self.panes < params.max_depth {
                passed += vertex.straight_transmittance(features, params) * opacity;
            }
        }
        self.pending_light *= passed;
        self.passes += 1;
        self.shadow_t_max -= vertex.hit.distance;
        if max_component(self.pending_light) > 0.0 && self.passes <= MAX_PASSES {
            self.pass(features, vertex);
            false
        } else {
            self.end_connection()
        }
    }

    /// Continues the path after its shadow ray. Returns whether the path ended.
    #[inline(always)]
    pub(super) fn end_connection(&mut self) -> bool {
        self.shadow = false;
        self.ray = self.continuation;
        self.media = self.continuation_media;
        !self.continues
    }
}
