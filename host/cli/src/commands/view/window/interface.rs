//! The content of the window: controls, image and help, and what input does to them.

use super::layout::{Layout, controls};
use super::panel::{self, Pressed, State};
use super::worker::Task;
use super::{App, help, input, picked, save};
use egui::{Color32, ColorImage, Sense, TextureOptions};
use std::time::Instant;
use trisect::view::{FrameTiming, Layer};

/// Returns the layer after this one; `None` is the image.
fn next_layer(layer: Option<Layer>) -> Option<Layer> {
    let all = || Layer::ALL.into_iter().map(|(_, layer)| layer);
    match layer {
        None => all().next(),
        Some(_) => all().skip_while(|of| Some(*of) != layer).nth(1),
    }
}

impl App {
    /// Lays out controls and image, and handles input. Returns whether to quit.
    pub(super) fn lay_out(&mut self, ui: &mut egui::Ui) -> bool {
        let mut pressed = Pressed::default();
        let mut quit = false;
        // Escape takes the focus from a field before this frame begins.
        let is_typing = ui.ctx().egui_wants_keyboard_input();
        let was_typing = std::mem::replace(&mut self.was_typing, is_typing);
        self.held = false;
        if is_typing {
            self.last = Instant::now();
        } else {
            self.step(|held| ui.input(held));
            let keys = ui.input(|input| input::pressed(input, &mut self.navigator));
            // Escape leaves a field or closes a list, which egui does; only without both it quits.
            let closes = keys.quit && !was_typing && !egui::Popup::is_any_open(ui.ctx());
            quit = closes && !self.help;
            self.help = (self.help && !closes) ^ keys.help;
            self.panel ^= keys.panel;
            (pressed.save_image, pressed.save_camera) = (keys.save_image, keys.save_camera);
            pressed.save_radiance = keys.save_radiance;
            if keys.next_layer {
                self.layer = next_layer(self.layer);
            }
            if keys.compare {
                let screen = &mut self.look.screen;
                screen.split = if screen.split > 0.0 { 0.0 } else { 0.5 };
            }
        }
        let layout = Layout::new(ui.max_rect(), ui.ctx().pixels_per_point(), self.resolution, self.panel);
        if let Some(place) = layout.panel {
            let shot: Option<&FrameTiming> = self.frame.as_ref().map(|frame| &frame.timing);
            let mut state = State {
                look: &mut self.look,
                moving_fps: &mut self.moving_fps,
                navigator: &mut self.navigator,
                backend: &mut self.backend,
                choices: &self.choices,
                scene: &self.scene,
                device: &self.device,
                timing: shot,
                layer: &mut self.layer,
                range: self.frame.as_ref().and_then(|frame| frame.range),
                graph: &self.graph,
                message: &self.message,
                error: &self.error,
            };
            let buttons = controls(ui, place, |ui| panel::show(ui, &mut state));
            pressed.save_image |= buttons.save_image;
            pressed.save_camera |= buttons.save_camera;
            pressed.save_radiance |= buttons.save_radiance;
            self.help ^= buttons.help;
        }
        self.image(ui, &layout);
        help::show(ui.ctx(), &mut self.help);
        if pressed.save_radiance {
            self.worker.give(Task::SaveRadiance);
        }
        let path = self.job.scene.as_deref();
        if let (true, Some(frame)) = (pressed.save_image, &self.frame) {
            self.message = save::image(path, frame.timing.size, &frame.pixels);
        }
        if pressed.save_camera {
            let pose = self.space.camera_of(&self.navigator.pose());
            self.message = save::camera(&self.job, &pose);
        }
        quit
    }

    /// Shows the last frame, and moves the camera by the mouse over it.
    fn image(&mut self, ui: &mut egui::Ui, layout: &Layout) {
        let Layout { area, image: place, size, .. } = *layout;
        (self.look.settings.width, self.look.settings.height) = size;
        if let (None, Some(frame)) = (&self.texture, &self.frame) {
            let size = [frame.timing.size.0 as usize, frame.timing.size.1 as usize];
            let image = ColorImage::from_rgba_premultiplied(size, bytemuck::cast_slice(&frame.pixels));
            self.texture = Some(ui.ctx().load_texture("frame", image, TextureOptions::LINEAR));
        }
        if let Some(texture) = &self.texture {
            let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::Pos2::new(1.0, 1.0));
            ui.painter().image(texture.id(), place, whole, Color32::WHITE);
        }
        let response = ui.interact(area, ui.scope_id().with("image"), Sense::click_and_drag());
        let (scroll, shift) = ui.input(|input| (input.smooth_scroll_delta.y, input.modifiers.shift));
        self.dragged = response.dragged();
        if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
            let share = (at - place.min) / place.size();
            let is_inside = place.contains(at);
            self.picked = is_inside.then(|| (None, share, self.navigator.pose()));
            if is_inside {
                self.worker.give(Task::Pick(f64::from(share.x), f64::from(share.y)));
            }
        }
        match &self.picked {
            Some((Some(picked), share, pose)) if *pose == self.navigator.pose() => {
                picked::show(ui.ctx(), ui.painter(), place.min + *share * place.size(), picked);
            }
            _ => {}
        }
        input::mouse(&response, scroll, shift, &mut self.navigator);
    }
}
