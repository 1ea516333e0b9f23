//! Calls whose arguments a backend cannot check: the only unsafe code of the renderer.
#![allow(unsafe_code, reason = "each call states why the promise of the backend's trait holds")]

use crate::bvh::{Bvh, Wide};
use crate::film::RowTarget;
use crate::lights::Lights;
use std::time::Duration;
use trisect_device::{Backend, BackendError, DisplayLaunch, Launch, Pass, SceneRecords};
use trisect_scene::{Scene, SceneError};
use trisect_shared::params::RenderParams;
use trisect_shared::scene::Scene as Records;
use trisect_shared::wide::WideTree;

/// Scene that was validated, with the trees and the light table that were made for it.
pub(super) struct ValidScene<'a>(&'a Scene);

impl<'a> ValidScene<'a> {
    /// Validates the scene.
    pub fn new(scene: &'a Scene) -> Result<Self, SceneError> {
        scene.validate().map(|()| Self(scene))
    }

    /// Returns the scene's records, with those of the trees and the light table that were made for
    /// it.
    pub fn records<'b>(&self, bvh: &'b Bvh, wide: Option<&'b Wide>, lights: &'b Lights) -> SceneRecords<'b>
    where
        'a: 'b,
    {
        let scene = self.0;
        let records = Records {
            spheres: &scene.spheres,
            nodes: &bvh.nodes,
            materials: &lights.materials,
            planars: &scene.flats,
            triangles: &bvh.triangles,
            shading: &bvh.shading,
            lights: &lights.lights,
            textures: &scene.textures,
            texels: &scene.texels,
            environment: scene.environment.as_ref().map_or(&[], |environment| &environment.texels),
            wide: wide.map_or(WideTree::NONE, Wide::tree),
        };
        // SAFETY: the scene's indices were validated, and the builders of trees and light table
        // write indices of its own arrays only.
        unsafe { SceneRecords::new(records) }
    }
}

/// Returns a launch of a kernel, with parameters from `Renderer::launch`.
pub(super) fn launch(params: RenderParams) -> Launch {
    // SAFETY: `Renderer::launch` takes roots, counts and size from the uploaded scene and the film.
    unsafe { Launch::new(params) }
}

/// Runs the passes of the denoiser, which [`passes`](crate::denoise) made for the backend's film.
pub(super) fn denoise(backend: &mut dyn Backend, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
    // SAFETY: each pass reads the image that the one before wrote, and what a live frame reads of
    // earlier ones was written by the frame before: `TemporalState` forgets it otherwise.
    unsafe { backend.denoise(passes) }
}

/// Converts rows of the last frame for a display.
pub(super) fn display(
    backend: &mut dyn Backend,
    frame: &DisplayLaunch,
    to: &mut RowTarget<'_>,
) -> Result<Duration, BackendError> {
    // SAFETY: the launch is that of the frame that the backend rendered last, whose passes wrote
    // the image.
    unsafe { backend.display(frame, to) }
}
