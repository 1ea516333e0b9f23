//! Label of the surface that a click on the image picked, beside its place.

use super::worker::Picked;
use egui::{Area, Color32, Context, Frame, Id, Label, Painter, Pos2, TextWrapMode, vec2};

/// Radius in points of the circle around the place.
const RADIUS: f32 = 5.0;

/// Draws a circle at the place, and beside it a label with names, depth, position and normal.
pub fn show(context: &Context, painter: &Painter, at: Pos2, picked: &Picked) {
    painter.circle_stroke(at, RADIUS, (3.0, Color32::BLACK));
    painter.circle_stroke(at, RADIUS, (1.5, Color32::WHITE));
    let label = Area::new(Id::unique("picked")).fixed_pos(at + vec2(2.0 * RADIUS, RADIUS));
    label.constrain(true).interactable(false).show(context, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
            for line in lines(picked) {
                ui.add(Label::new(line).selectable(false));
            }
        });
    });
}

fn lines(picked: &Picked) -> Vec<String> {
    let Some((pick, name)) = picked else { return vec!["nothing".to_owned()] };
    let numbers = |of: [f64; 3], digits: usize| of.map(|c| format!("{c:.digits$}")).join(", ");
    vec![
        format!("{}, of {}", name.object, name.material),
        format!("depth {:.4}", pick.depth),
        format!("at ({})", numbers(pick.position.to_array(), 4)),
        format!("normal ({})", numbers(pick.normal.to_array(), 2)),
    ]
}
