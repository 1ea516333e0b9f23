//! Graph of the times of the last frames.

use egui::{Color32, Label, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2};
use std::collections::VecDeque;

/// Number of frames that the graph shows.
const FRAMES: usize = 200;

/// Height of the graph in points.
const HEIGHT: f32 = 70.0;

/// Names and colours of the parts of a frame, from the bottom of a bar upwards.
pub const PARTS: [(&str, Color32); 3] = [
    ("trace", Color32::from_rgb(86, 156, 214)),
    ("denoise", Color32::from_rgb(206, 145, 76)),
    ("present", Color32::from_rgb(120, 190, 110)),
];

/// Milliseconds of each part of the last frames.
#[derive(Default)]
pub struct Graph {
    frames: VecDeque<[f32; 3]>,
}

impl Graph {
    /// Adds a frame.
    pub fn push(&mut self, milliseconds: [f32; 3]) {
        self.frames.push_back(milliseconds);
        if self.frames.len() > FRAMES {
            self.frames.pop_front();
        }
    }

    /// Returns the times of the last frame, zeros before the first.
    pub fn last(&self) -> [f32; 3] {
        self.frames.back().copied().unwrap_or_default()
    }

    /// Draws a bar for each frame, its parts stacked, with names and last times below.
    pub fn show(&self, ui: &mut Ui) {
        let (response, painter) =
            ui.allocate_painter(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
        let area = response.rect;
        painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
        let sum = |frame: &[f32; 3]| frame.iter().sum::<f32>();
        let most = self.frames.iter().map(sum).fold(1e-3, f32::max);
        let width = area.width() / FRAMES as f32;
        let skipped = FRAMES - self.frames.len();
        for (index, frame) in self.frames.iter().enumerate() {
            let left = area.left() + (skipped + index) as f32 * width;
            let mut bottom = area.bottom();
            for (value, (_, color)) in frame.iter().zip(PARTS) {
                let top = bottom - value / most * (area.height() - 2.0);
                let bar = Rect::from_min_max(Pos2::new(left, top), Pos2::new(left + width, bottom));
                painter.rect_filled(bar, 0.0, color);
                bottom = top;
            }
        }
        painter.rect_stroke(
            area,
            2.0,
            Stroke::new(1.0, ui.visuals().weak_text_color()),
            egui::StrokeKind::Inside,
        );
        ui.columns(PARTS.len(), |columns| {
            for ((column, (name, color)), value) in columns.iter_mut().zip(PARTS).zip(self.last()) {
                let text = RichText::new(format!("{name} {value:.2} ms")).small().color(color);
                column.add(Label::new(text).truncate());
            }
        });
    }
}
