//! Probes as native code, on all threads.

use super::{Device, ProbeScene};
use rayon::prelude::*;
use trisect::device::BackendError;
use trisect_probes::record::{Input, Output, ProbeParams};
use trisect_shared::scene::Scene;

/// The processor of this machine.
pub struct Native {
    scene: ProbeScene,
    name: String,
}

impl Native {
    pub fn new(scene: ProbeScene) -> Self {
        Self { scene, name: trisect::device::cpu::describe(1).name }
    }
}

type Probe = unsafe fn(&ProbeParams, Scene, Input) -> Output;

fn function(name: &str) -> Option<Probe> {
    macro_rules! table {
        ($($module:ident $text:tt,)*) => {
            [$(($text, trisect_probes::$module::$module as Probe),)*]
        };
    }
    trisect_probes::for_each_probe!(table).into_iter().find(|(text, _)| *text == name).map(|(_, probe)| probe)
}

impl Device for Native {
    fn name(&self) -> &str {
        &self.name
    }

    #[allow(unsafe_code, reason = "some probes read the scene without bounds checks")]
    fn run(
        &mut self,
        probe: &'static str,
        params: &ProbeParams,
        inputs: &[Input],
    ) -> Result<Vec<Output>, BackendError> {
        let probe = function(probe).ok_or_else(|| BackendError::Device {
            backend: "cpu",
            action: "probing",
            message: format!("no {probe}"),
        })?;
        let scene = self.scene.records();
        // SAFETY: the scene comes from the host's own readers and builders; tests keep its indices
        // in range.
        Ok(inputs.par_iter().map(|&input| unsafe { probe(params, scene, input) }).collect())
    }
}
