//! Search of the binary BVH in turns: lanes of a warp whose rays are done shade and take their next
//! rays, while the searches of other lanes wait. [`crate::path::render_persistent`] calls it.

use super::initial_hit;
use crate::buffer::{load, load_local, store_local};
use crate::bvh::{BvhNode, Child, Hit, NO_INSTANCE, NO_PRIMITIVE, RayQuery, STACK_SIZE};
use crate::features::{FeatureSet, Features, INSTANCES, PADDED_BOXES};
use crate::instance;
use crate::params::RenderParams;
use crate::primitive::{distance, is_closer};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::slabs::{BoxHits, RayReciprocals, intersect_boxes};
use crate::triangle::Shear;
use crate::warp;
use core::mem::MaybeUninit;

/// Minimum number of searching lanes for which a warp continues a turn
/// (docs/notebook/triangles-and-trees.md).
const MIN_SEARCHING_LANES: u32 = 16;

/// Maximum number of steps of a turn where lanes cannot vote.
const MAX_STEPS: u32 = 6;

/// Stack of a search: one entry more than levels, of which the lowest is [`Child::EMPTY`], which
/// ends the search.
pub type Stack = MaybeUninit<[u32; STACK_SIZE + 1]>;

/// Search that a lane keeps between turns. Its stack is apart: SPIR-V has no pointers in records.
#[derive(Clone, Copy)]
pub struct Search {
    /// Next child to visit.
    child: Child,
    /// Number of entries of the stack.
    depth: u32,
    /// Instance in which the search is.
    instance: u32,
    /// Closest hit so far.
    pub hit: Hit,
}

impl Search {
    /// A search that has ended.
    pub const ENDED: Self =
        Self { child: Child::EMPTY, depth: 0, instance: NO_INSTANCE, hit: Hit::in_world(0.0, NO_PRIMITIVE) };

    /// Returns whether the search has ended.
    #[inline(always)]
    pub fn has_ended(&self) -> bool {
        self.child == Child::EMPTY
    }

    /// Begins the search that [`closest_hit_below`](super::closest_hit_below) does.
    ///
    /// # Safety
    ///
    /// As [`closest_hit_below`](super::closest_hit_below).
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn new<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        ray: Ray,
        query: RayQuery,
        root: Child,
        stack: &mut Stack,
    ) -> Self {
        let shear = Shear::new(ray.direction);
        // SAFETY: the caller's promise; the stack has a first entry.
        let hit = unsafe {
            store_local(stack, 0, Child::EMPTY.0);
            initial_hit(features, params, scene, ray, &shear, query)
        };
        Self { child: root, depth: 1, instance: NO_INSTANCE, hit }
    }

    /// Continues the search for a turn: until few lanes of the warp search, or for some steps
    /// where lanes cannot vote.
    ///
    /// # Safety
    ///
    /// As [`closest_hit_below`](super::closest_hit_below), for the ray and the query with which the
    /// search began; `stack` is that of the search. Lanes of a warp call this together, those
    /// without a search, too.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn advance<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        ray: Ray,
        query: RayQuery,
        stack: &mut Stack,
    ) {
        // Made anew for each turn, because they would take registers while the lane shades.
        let Self { mut child, mut depth, mut instance, mut hit } = *self;
        let mut local = ray;
        if features.has::<INSTANCES>() && instance != NO_INSTANCE {
            // SAFETY: the search has passed into this instance.
            local = unsafe { instance::entry(params, scene, instance) }.enter(ray, instance);
        }
        let mut shear = Shear::new(local.direction);
        let mut reciprocals = RayReciprocals::new(local.origin, local.direction);
        macro_rules! visit {
            () => {
                visit_node!(features, scene, local, reciprocals, hit, child, depth, &mut *stack);
            };
        }
        let mut steps = 0;
        let mut searches = warp::any(child != Child::EMPTY);
        while searches {
            // Two nodes before a leaf, as without turns.
            visit!();
            visit!();
            if features.has::<INSTANCES>()
                && child.is_leaf()
                && child != Child::EMPTY
                && child.index() >= params.first_instance
            {
                cross_instance!(
                    params,
                    scene,
                    ray,
                    child,
                    depth,
                    &mut *stack,
                    local,
                    instance,
                    shear,
                    reciprocals,
                    {
                        depth -= 1;
                        // SAFETY: `depth` entries were stored.
                        child = Child(unsafe { load_local(stack, depth) });
                    }
                );
            } else if child.is_leaf() && child != Child::EMPTY {
                let primitive = child.index();
                depth -= 1;
                // SAFETY: `depth` entries were stored.
                child = Child(unsafe { load_local(stack, depth) });
                // SAFETY: the caller's promise.
                let t = unsafe { distance(features, params, scene, local, &shear, primitive) };
                if is_closer(t, primitive, hit.distance, hit.primitive)
                    || hit.is_after(features, t, primitive, instance)
                {
                    hit = Hit { distance: t, primitive, instance };
                    if query.any_hit && primitive != query.light_primitive {
                        child = Child::EMPTY;
                    }
                }
            }
            steps += 1;
            searches = if warp::HAS_WARP_VOTES {
                warp::count(child != Child::EMPTY) >= MIN_SEARCHING_LANES
            } else {
                child != Child::EMPTY && steps < MAX_STEPS
            };
        }
        *self = Self { child, depth, instance, hit };
    }
}
