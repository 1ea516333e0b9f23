//! Surface of the window, and the wgpu device that draws egui's output on it.

use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use wgpu::{
    Backends, Color, CurrentSurfaceTexture, Device, DeviceDescriptor, Instance, InstanceDescriptor, LoadOp,
    Operations, Queue, RenderPassColorAttachment, RenderPassDescriptor, RequestAdapterOptions, StoreOp,
    Surface, SurfaceConfiguration, TextureFormat,
};
use winit::window::Window;

/// Surface, device and renderer of a window. If the device is lost, all of it is created anew.
pub struct Output {
    window: Arc<Window>,
    instance: Instance,
    surface: Surface<'static>,
    device: Device,
    queue: Queue,
    config: SurfaceConfiguration,
    renderer: Renderer,
    lost: Arc<AtomicBool>,
}

impl Output {
    /// Opens the adapter that can show the window, and configures its surface.
    pub fn new(window: Arc<Window>) -> Result<Self, String> {
        let mut descriptor = InstanceDescriptor::new_without_display_handle();
        descriptor.backends = Backends::VULKAN | Backends::METAL | Backends::DX12;
        let instance = Instance::new(descriptor);
        let surface = instance.create_surface(window.clone()).map_err(|error| error.to_string())?;
        let adapter = pollster::block_on(instance.request_adapter(&RequestAdapterOptions {
            compatible_surface: Some(&surface),
            ..Default::default()
        }))
        .map_err(|error| {
            format!("{error}; install a graphics driver with Vulkan, or Mesa's software adapter")
        })?;
        let (device, queue) = pollster::block_on(adapter.request_device(&DeviceDescriptor {
            label: Some("trisect view"),
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|error| error.to_string())?;
        let lost = Arc::new(AtomicBool::new(false));
        let (of_device, of_error) = (lost.clone(), lost.clone());
        device.set_device_lost_callback(move |_, _| of_device.store(true, Ordering::Relaxed));
        device.on_uncaptured_error(Arc::new(move |error| {
            crate::terminal::eprint(&format!("warning: the window: {error}"));
            of_error.store(true, Ordering::Relaxed);
        }));
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or("the adapter cannot draw on this window")?;
        // egui blends encoded sRGB values, so the surface must not convert them.
        let formats = surface.get_capabilities(&adapter).formats;
        let plain = [TextureFormat::Bgra8Unorm, TextureFormat::Rgba8Unorm];
        if let Some(format) = plain.into_iter().find(|format| formats.contains(format)) {
            config.format = format;
        }
        surface.configure(&device, &config);
        let renderer =
            Renderer::new(&device, config.format, RendererOptions { dithering: false, ..Default::default() });
        Ok(Self { window, instance, surface, device, queue, config, renderer, lost })
    }

    /// Returns whether the device or surface is lost, so that all must be created anew.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Returns the maximum width and height of a texture in pixels.
    pub fn greatest_side(&self) -> usize {
        self.device.limits().max_texture_dimension_2d as usize
    }

    /// Adapts the surface to the window's size. Returns false for a minimised window, which has
    /// none.
    fn fit(&mut self) -> bool {
        let size = self.window.inner_size();
        let limit = self.device.limits().max_texture_dimension_2d;
        let (width, height) = (size.width.min(limit), size.height.min(limit));
        if width == 0 || height == 0 {
            return false;
        }
        if (width, height) != (self.config.width, self.config.height) {
            (self.config.width, self.config.height) = (width, height);
            self.surface.configure(&self.device, &self.config);
        }
        true
    }

    /// Draws egui's output. If the surface is not ready, nothing is drawn, and the next call tries
    /// again.
    pub fn draw(&mut self, context: &egui::Context, output: egui::FullOutput) {
        for (id, deltas) in &output.textures_delta.set {
            for delta in deltas {
                self.renderer.update_texture(&self.device, &self.queue, *id, delta);
            }
        }
        if self.fit() {
            self.draw_frame(context, output.shapes, output.pixels_per_point);
        }
        for id in &output.textures_delta.free {
            self.renderer.free_texture(id);
        }
    }

    fn draw_frame(
        &mut self,
        context: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        pixels_per_point: f32,
    ) {
        let texture = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture) => texture,
            CurrentSurfaceTexture::Outdated => {
                self.surface.configure(&self.device, &self.config);
                self.window.request_redraw();
                return;
            }
            CurrentSurfaceTexture::Lost => {
                match self.instance.create_surface(self.window.clone()) {
                    Ok(surface) => {
                        self.surface = surface;
                        self.surface.configure(&self.device, &self.config);
                    }
                    Err(_) => self.lost.store(true, Ordering::Relaxed),
                }
                self.window.request_redraw();
                return;
            }
            _ => return, // occluded or timed out
        };
        let screen =
            ScreenDescriptor { size_in_pixels: [self.config.width, self.config.height], pixels_per_point };
        let jobs = context.tessellate(shapes, pixels_per_point);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut commands =
            self.renderer.update_buffers(&self.device, &self.queue, &mut encoder, &jobs, &screen);
        let view = texture.texture.create_view(&Default::default());
        let pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: LoadOp::Clear(Color::BLACK), store: StoreOp::Store },
            })],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        commands.push(encoder.finish());
        self.queue.submit(commands);
        self.window.pre_present_notify();
        self.queue.present(texture);
    }
}
