//! Controls of the window.

use super::graph::Graph;
use egui::{ComboBox, Label, RichText, Slider, SliderClamping, Ui};
use trisect::denoise::{DenoiseSettings, Filter, LEVELS, TemporalSettings};
use trisect::device;
use trisect::render::DisplayOptions;
use trisect::view::{FrameTiming, Layer, MIN_SCALE, NavigationMode, Navigator, ViewOptions};

/// Maximum samples per pixel of a frame on the slider; below those of a chunk, which is the limit.
const MAX_SAMPLES: u32 = 64;

/// Device to choose: its label, backend and index.
pub type DeviceChoice = (String, device::Choice, Option<usize>);

/// Buttons that were pressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pressed {
    /// Write the image to a file.
    pub save_image: bool,
    /// Write its radiance to a file.
    pub save_radiance: bool,
    /// Show the help on keys, or hide it.
    pub help: bool,
    /// Write the camera into a scene file.
    pub save_camera: bool,
}

/// State that the panel shows and changes.
pub struct State<'a> {
    pub look: &'a mut ViewOptions,
    /// Frames a second to keep while the camera moves.
    pub moving_fps: &'a mut f64,
    pub navigator: &'a mut Navigator,
    /// Backend, device index, and the number of requests for it: a new number opens it again.
    pub backend: &'a mut (device::Choice, Option<usize>, u32),
    pub choices: &'a [DeviceChoice],
    pub scene: &'a str,
    pub device: &'a str,
    pub timing: Option<&'a FrameTiming>,
    /// Layer that is shown in place of the image, and its range.
    pub layer: &'a mut Option<Layer>,
    pub range: Option<[f64; 2]>,
    pub graph: &'a Graph,
    pub message: &'a str,
    pub error: &'a str,
}

/// Lays out the controls and returns which buttons were pressed.
pub fn show(ui: &mut Ui, state: &mut State) -> Pressed {
    let mut pressed = Pressed::default();
    ui.spacing_mut().slider_width = 110.0;
    ui.add(Label::new(RichText::new(state.scene).strong()).truncate());
    device(ui, state);
    ui.separator();
    frames(ui, state);
    ui.separator();
    let ViewOptions { settings, scale, denoise, history, max_samples: enough, screen } = &mut *state.look;
    ui.add(Slider::new(&mut settings.samples, 1..=MAX_SAMPLES).logarithmic(true).text("samples a frame"));
    ui.add(Slider::new(&mut settings.depth, 1..=50).text("depth"));
    ui.add(Slider::new(scale, MIN_SCALE..=1.0).text("resolution"));
    ui.add(Slider::new(state.moving_fps, 0.0..=60.0).text("frames/s, moving"));
    ui.add(Slider::new(enough, 1..=65_536).logarithmic(true).text("samples at rest"));
    ui.separator();
    filter(ui, denoise);
    ui.add(
        Slider::new(&mut history.frames, 0..=256)
            .logarithmic(true)
            .smallest_positive(1.0)
            .text("history, frames"),
    );
    unbounded(ui, &mut history.clamp, 0.1..=10.0, TemporalSettings::DEFAULT.clamp, "history, clamp");
    ui.separator();
    layer(ui, state.layer, state.range);
    shown(ui, screen);
    camera(ui, state.navigator);
    ui.horizontal(|ui| {
        pressed.save_image = ui.button("Save image").clicked();
        pressed.save_radiance = ui.button("Save .exr").clicked();
        pressed.save_camera = ui.button("Save camera").clicked();
        pressed.help = ui.button("?").on_hover_text("keys").clicked();
    });
    if !state.message.is_empty() {
        ui.label(state.message);
    }
    if !state.error.is_empty() {
        ui.colored_label(ui.visuals().error_fg_color, state.error);
        if ui.button("Try again").clicked() {
            state.backend.2 += 1;
        }
    }
    pressed
}

fn device(ui: &mut Ui, state: &mut State) {
    let mut wanted = None;
    let list = ComboBox::from_id_salt("device").width(ui.available_width()).truncate();
    list.selected_text(state.device).show_ui(ui, |ui| {
        for (label, backend, index) in state.choices {
            let is = (state.backend.0, state.backend.1) == (*backend, *index);
            if ui.selectable_label(is, label).clicked() {
                wanted = Some((*backend, *index));
            }
        }
    });
    if let Some((backend, index)) = wanted {
        *state.backend = (backend, index, state.backend.2 + 1);
    }
}

fn frames(ui: &mut Ui, state: &State) {
    if let Some(shot) = state.timing {
        let rate = 1.0 / shot.whole.as_secs_f64().max(1e-9);
        let text = format!("{}x{}, {} spp, {rate:.1} frames/s", shot.size.0, shot.size.1, shot.live.samples);
        ui.add(Label::new(text).truncate());
        ui.add(Label::new(RichText::new(format!("since {}", shot.live.since)).small()).truncate());
        ui.add(Label::new(RichText::new(shot.live.kernel).small()).truncate());
    }
    state.graph.show(ui);
}

fn filter(ui: &mut Ui, denoise: &mut Option<DenoiseSettings>) {
    let choices = [("off", None), ("atrous", Some(Filter::Atrous)), ("svgf", Some(Filter::Svgf))];
    ui.horizontal(|ui| {
        ui.label("denoise");
        for (name, filter) in choices {
            let is = denoise.map(|denoise| denoise.filter) == filter;
            if ui.selectable_label(is, name).clicked() && !is {
                *denoise = filter.map(DenoiseSettings::new);
            }
        }
    });
    let Some(denoise) = denoise else { return };
    let default = DenoiseSettings::new(denoise.filter);
    ui.add(Slider::new(&mut denoise.levels, LEVELS).text("levels"));
    unbounded(ui, &mut denoise.color, 0.05..=50.0, default.color, "colour");
    unbounded(ui, &mut denoise.normal, 1.0..=90.0, default.normal, "normal, degrees");
    unbounded(ui, &mut denoise.depth, 1e-4..=1.0, default.depth, "depth");
}

/// Shows a slider for a number that may also be infinite, with a checkbox for that.
fn unbounded(ui: &mut Ui, value: &mut f32, range: std::ops::RangeInclusive<f32>, default: f32, name: &str) {
    ui.horizontal(|ui| {
        let mut on = value.is_finite();
        if ui.checkbox(&mut on, "").changed() {
            *value = if on { default } else { f32::INFINITY };
        }
        if on {
            ui.add(Slider::new(value, range).logarithmic(true).text(name));
        } else {
            ui.label(format!("{name}: no stop"));
        }
    });
}

/// Name of the image among the layers.
const IMAGE: &str = "image";

fn layer(ui: &mut Ui, layer: &mut Option<Layer>, range: Option<[f64; 2]>) {
    ui.horizontal(|ui| {
        let name = |of: Option<Layer>| Layer::ALL.iter().find(|(_, all)| Some(*all) == of);
        let selected = name(*layer).map_or(IMAGE, |(name, _)| name);
        ComboBox::from_label("shown").selected_text(selected).show_ui(ui, |ui| {
            ui.selectable_value(layer, None, IMAGE);
            for (name, of) in Layer::ALL {
                ui.selectable_value(layer, Some(of), name);
            }
        });
        if let (Some(of), Some([low, high])) = (*layer, range) {
            let number = |value: f64| match of {
                Layer::Noise => format!("{:.1} %", 100.0 * value),
                Layer::Rays | Layer::Nodes => format!("{value:.1}"),
                _ => format!("{value:.3e}"),
            };
            ui.label(RichText::new(format!("{} to {}", number(low), number(high))).small());
        }
    });
}

fn shown(ui: &mut Ui, screen: &mut DisplayOptions) {
    ui.add(Slider::new(&mut screen.split, 0.0..=1.0).text("raw | denoised"));
    // An exposure outside the slider's range, as for a model in lux, stays until the slider is
    // moved.
    let stops = Slider::new(&mut screen.stops, -20.0..=20.0).clamping(SliderClamping::Edits);
    ui.add(stops.text("exposure, stops"));
}

fn camera(ui: &mut Ui, navigator: &mut Navigator) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut navigator.mode, NavigationMode::Orbit, "orbit");
        ui.selectable_value(&mut navigator.mode, NavigationMode::Fly, "fly");
        if ui.button("reset").clicked() {
            navigator.reset();
        }
    });
}
