//! Runs single functions of the shared crate on a backend (see `trisect_probes`): a torture test
//! passes inputs, its questions, and gets an output, the answer, for each.

mod cpu;
mod cuda;
mod wgpu;

use crate::BackendUnderTest;
use bytemuck::Zeroable;
use trisect::bvh::Bvh;
use trisect::device::BackendError;
use trisect::device::wgpu::Route;
use trisect::lights::Lights;
use trisect::scene::{Scene, SharedVec};
use trisect_probes::record::{Input, Output, ProbeParams};
use trisect_shared::params::RenderParams;
use trisect_shared::planar::Planar;
use trisect_shared::triangle::Triangle;

/// Maximum number of questions per launch; they take 32 MiB.
const BATCH: usize = 1 << 18;

/// A device that answers questions.
trait Device {
    /// Returns the driver's name of the device.
    fn name(&self) -> &str;
    /// Answers at most [`BATCH`] questions.
    fn run(
        &mut self,
        probe: &'static str,
        params: &ProbeParams,
        inputs: &[Input],
    ) -> Result<Vec<Output>, BackendError>;
}

/// A scene in the form that kernels get, for probes that trace or scatter.
#[derive(Clone, Debug)]
pub struct ProbeScene {
    /// Spheres, planar shapes (in a scene without portals), textures and environment map. A test
    /// may change their values, for instance to impossible ones, but not their number. Changes of
    /// other records have no effect: triangles, materials and lights are those of
    /// [`ProbeScene::new`].
    pub scene: Scene,
    /// BVH of the scene. A negative control may break it.
    pub bvh: Bvh,
    planars: Vec<Planar>,
    triangles: SharedVec<Triangle>,
    lights: Lights,
}

impl ProbeScene {
    /// Builds the BVH and the light table.
    ///
    /// # Panics
    ///
    /// If the BVH cannot be built.
    pub fn new(scene: &Scene) -> Self {
        let bvh = match Bvh::build(scene, None) {
            Ok(bvh) => bvh,
            Err(error) => panic!("{error}"),
        };
        let (triangles, lights) = (scene.numbered_triangles(), Lights::new(scene));
        Self { scene: scene.clone(), bvh, planars: scene.flats_and_portals(), triangles, lights }
    }

    /// Returns the device arrays.
    pub fn records(&self) -> trisect_shared::scene::Scene<'_> {
        let Self { scene, bvh, planars, triangles, lights } = self;
        trisect_shared::scene::Scene {
            spheres: &scene.spheres,
            nodes: &bvh.nodes,
            materials: &lights.materials,
            planars: if scene.portals.is_empty() { &scene.flats } else { planars },
            triangles,
            vertices: &scene.vertices,
            lights: &lights.lights,
            textures: &scene.textures,
            texels: &scene.texels,
            environment: scene.environment.as_ref().map_or(&[], |environment| &environment.texels),
            wide: trisect_shared::wide::WideTree::NONE,
        }
    }

    /// Returns the scene's part of the launch parameters, without camera, sky and settings.
    pub fn params(&self) -> RenderParams {
        let size = self.scene.environment.as_ref().map_or((0, 0), |e| (e.width, e.height));
        RenderParams {
            root: self.bvh.root.0,
            first_planar: self.scene.spheres.len() as u32,
            first_triangle: (self.scene.spheres.len() + self.scene.flats.len()) as u32,
            primitive_count: self.scene.world_primitives() as u32,
            first_instance: self.bvh.first_leaf_of_instances(),
            instance_count: self.scene.shared.instances.len() as u32,
            first_instance_node: self.bvh.first_instance_node as u32,
            light_count: self.lights.count,
            area_light_count: self.lights.area_count,
            environment_probability: self.lights.environment_probability,
            environment_width: size.0,
            environment_height: size.1,
            environment_cos: 1.0,
            first_portal: self.scene.flats.len() as u32,
            portal_count: self.scene.portals.len() as u32,
            ..RenderParams::zeroed()
        }
    }
}

/// A backend that is ready to answer questions.
pub struct Prober {
    subject: BackendUnderTest,
    device: Box<dyn Device>,
    /// Parameters of each launch; a test may set the camera.
    pub render: RenderParams,
}

impl Prober {
    /// Opens the backend with an empty scene. `None`, with a message, where it is missing and not
    /// required.
    pub fn new(subject: BackendUnderTest) -> Option<Self> {
        let nothing = "Scene(version: 1, image: (width: 1, height: 1), materials: {}, objects: [],
            camera: (look_from: (0, 0, 0), look_at: (0, 0, -1), vertical_fov: 60))";
        match Scene::parse(nothing, "nothing") {
            Ok(scene) => Self::with_scene(subject, &ProbeScene::new(&scene)),
            Err(error) => panic!("{error}"),
        }
    }

    /// Opens the backend with a scene. `None`, with a message, where it is missing and not
    /// required.
    pub fn with_scene(subject: BackendUnderTest, scene: &ProbeScene) -> Option<Self> {
        let open = |route| wgpu::Wgpu::open(route, scene).map(|device| Box::new(device) as Box<dyn Device>);
        let device: Result<Box<dyn Device>, BackendError> = match subject {
            BackendUnderTest::Cpu => Ok(Box::new(cpu::Native::new(scene.clone()))),
            BackendUnderTest::Wgpu => open(Route::PassThrough),
            BackendUnderTest::WgpuNaga => open(Route::Naga),
            BackendUnderTest::WgpuWgsl => open(Route::Wgsl),
            BackendUnderTest::Cuda => cuda::Cuda::open(scene).map(|device| Box::new(device) as _),
        };
        let device = subject.available(device)?;
        Some(Self { subject, device, render: scene.params() })
    }

    /// Returns the backend.
    pub fn subject(&self) -> BackendUnderTest {
        self.subject
    }

    /// Returns the device's name.
    pub fn device(&self) -> &str {
        self.device.name()
    }

    /// Runs a probe on each question, and returns the answers in order. `probe` is the name of an
    /// entry point, `operation` one of its module's constants.
    ///
    /// # Panics
    ///
    /// If the device fails.
    pub fn ask(&mut self, probe: &'static str, operation: u32, inputs: &[Input]) -> Vec<Output> {
        let mut outputs = Vec::with_capacity(inputs.len());
        for batch in inputs.chunks(BATCH) {
            let count = batch.len() as u32;
            let params = ProbeParams { operation, count, pad0: 0, pad1: 0, render: self.render };
            match self.device.run(probe, &params, batch) {
                Ok(answers) => outputs.extend(answers),
                Err(error) => panic!("{:?}, {probe} {operation}: {error}", self.subject),
            }
        }
        outputs
    }
}
