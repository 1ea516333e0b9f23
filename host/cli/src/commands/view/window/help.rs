//! Help on keys and mouse, over the image.

use egui::{Align2, Context, Grid, Window};

/// Inputs and their effects.
const KEYS: [(&str, &str); 18] = [
    ("drag", "orbit; in fly mode: turn the view"),
    ("right drag, or Shift and drag", "shift the camera"),
    ("wheel", "closer, away"),
    ("click", "what is there: name, material, depth"),
    ("W, S", "closer, away; forwards, backwards"),
    ("A, D, Q, E", "left, right, down, up"),
    ("arrows", "orbit, or turn the view"),
    ("Shift", "four times as fast"),
    ("M", "orbit or fly"),
    ("R", "first camera"),
    ("B", "compare raw and denoised"),
    ("L", "next layer: normal, albedo, depth …"),
    ("H", "hide or show the controls"),
    ("I", "save the image"),
    ("X", "save its radiance (.exr)"),
    ("C", "save the scene with this camera"),
    ("?", "this help"),
    ("Escape", "close what is open, or the window"),
];

/// Shows the help while `open` is true; its own button closes it.
pub fn show(context: &Context, open: &mut bool) {
    let window = Window::new("Keys").open(open).resizable(false).collapsible(false).vscroll(true);
    window.anchor(Align2::LEFT_TOP, [12.0, 12.0]).show(context, |ui| {
        Grid::new("keys").num_columns(2).spacing([16.0, 4.0]).show(ui, |ui| {
            for (input, effect) in KEYS {
                ui.strong(input);
                ui.label(effect);
                ui.end_row();
            }
        });
        ui.label("Drop a scene or a model on the window to show it.");
    });
}
