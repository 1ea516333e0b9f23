//! Layout of the window: rectangles of the image and of the controls.

use egui::{Frame, Rect, ScrollArea, Ui, UiBuilder, pos2, vec2};

/// Width of the controls, in points.
pub const PANEL: f32 = 340.0;

/// Assumed size of the screen in pixels if the system does not report it.
const UNKNOWN_SCREEN: (u32, u32) = (1920, 1080);

/// Maximum width and height in pixels of a rendered image that follows the window.
const MAX_SIDE: u32 = 16_384;

/// Returns the inner size in pixels of a window that shows an image of `resolution` beside the
/// controls; it is at most the size of the screen.
pub fn window_size(resolution: (u32, u32), screen: Option<(u32, u32)>, scale_factor: f64) -> (u32, u32) {
    let screen = screen.filter(|&(width, height)| width > 0 && height > 0).unwrap_or(UNKNOWN_SCREEN);
    let panel = (f64::from(PANEL) * scale_factor).round() as u32;
    (resolution.0.saturating_add(panel).min(screen.0), resolution.1.min(screen.1))
}

/// Rectangles of image and controls, in points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Rectangle of the controls if they are shown; it does not depend on their content.
    pub panel: Option<Rect>,
    /// Rest of the window.
    pub area: Rect,
    /// Rectangle of the image in the area.
    pub image: Rect,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
}

impl Layout {
    /// Divides a window. An image of a fixed resolution is scaled to fit beside the controls;
    /// without one, the image fills the rest of the window.
    pub fn new(window: Rect, pixels_per_point: f32, resolution: Option<(u32, u32)>, has_panel: bool) -> Self {
        let width = if has_panel { PANEL.min(window.width()) } else { 0.0 };
        let (left, right) = window.split_left_right_at_x(window.right() - width);
        let area = left;
        let pixels = |points: f32| (points * pixels_per_point).round();
        let fit = vec2(pixels(area.width()), pixels(area.height()));
        let side = |pixels: f32| (pixels as u32).clamp(1, MAX_SIDE);
        let size = resolution.unwrap_or((side(fit.x), side(fit.y)));
        let whole = vec2(size.0 as f32, size.1 as f32);
        let scale = (fit.x / whole.x).min(fit.y / whole.y).max(0.0);
        let shown = whole * scale;
        // On whole pixels, so that an unscaled image is not blurred.
        let corner = ((fit - shown) * 0.5).floor().max(egui::Vec2::ZERO) / pixels_per_point;
        let image = match resolution {
            Some(_) => Rect::from_min_size(area.min + corner, shown / pixels_per_point),
            None => area,
        };
        Self { panel: has_panel.then_some(right), area, image, size }
    }
}

/// Shows the controls in `place`. Content that is too wide is clipped, content that is too high
/// scrolls.
pub fn controls<R>(ui: &mut Ui, place: Rect, add: impl FnOnce(&mut Ui) -> R) -> R {
    let frame = Frame::side_top_panel(ui.style());
    let mut panel = ui.new_child(UiBuilder::new().id_salt("controls").max_rect(place));
    panel.set_clip_rect(place);
    panel.painter().rect_filled(place, 0.0, frame.fill);
    let margin = frame.inner_margin;
    let inner = Rect::from_min_max(
        pos2(place.left() + margin.leftf(), place.top() + margin.topf()),
        pos2(place.right() - margin.rightf(), place.bottom() - margin.bottomf()),
    );
    let mut content = panel.new_child(UiBuilder::new().id_salt("content").max_rect(inner));
    ScrollArea::vertical().auto_shrink(false).show(&mut content, add).inner
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{CentralPanel, Context, Panel, RawInput, TextWrapMode};

    fn window(width: f32, height: f32) -> Rect {
        Rect::from_min_size(pos2(0.0, 0.0), vec2(width, height))
    }

    #[test]
    fn the_window_is_the_image_and_the_panel() {
        let screen = Some((2560, 1440));
        assert_eq!(window_size((480, 300), screen, 1.0), (820, 300));
        assert_eq!(window_size((480, 300), screen, 2.0), (1160, 300));
        assert_eq!(window_size((1280, 720), screen, 1.0), (1620, 720));
        // The window is no wider than the screen.
        assert_eq!(window_size((1280, 720), Some((1280, 800)), 1.0), (1280, 720));
        assert_eq!(window_size((u32::MAX, u32::MAX), None, 1.0), UNKNOWN_SCREEN);
        assert_eq!(window_size((10, 10), Some((0, 0)), 1.0), (350, 10));
    }

    #[test]
    fn a_fixed_resolution_stays() {
        let at = |width, height, scale| Layout::new(window(width, height), scale, Some((480, 300)), true);
        let exact = at(820.0, 300.0, 1.0);
        assert_eq!((exact.size, exact.image), ((480, 300), window(480.0, 300.0)));
        assert_eq!(exact.panel, Some(Rect::from_min_max(pos2(480.0, 0.0), pos2(820.0, 300.0))));
        // Points of two pixels each: the same image takes half as many of them.
        let dense = at(580.0, 150.0, 2.0);
        assert_eq!((dense.size, dense.image), ((480, 300), window(240.0, 150.0)));
        // Larger and smaller windows scale the image, and keep its aspect ratio and the panel.
        for (width, height) in [(2000.0, 900.0), (600.0, 620.0), (341.0, 20.0)] {
            let layout = at(width, height, 1.0);
            assert_eq!(layout.size, (480, 300));
            assert_eq!(layout.panel.map(|panel| panel.width()), Some(PANEL));
            assert!((layout.image.width() / layout.image.height() - 1.6).abs() < 1e-3, "{layout:?}");
            assert!(layout.area.contains_rect(layout.image.shrink(1e-3)), "{layout:?}");
        }
        let screen = Layout::new(window(1280.0, 720.0), 1.0, Some((1280, 720)), true);
        assert_eq!((screen.size, screen.image.width()), ((1280, 720), 940.0));
        assert!(screen.panel.is_some());
    }

    #[test]
    fn an_image_without_a_resolution_follows_the_window() {
        let at = |width, height, panel| Layout::new(window(width, height), 1.0, None, panel);
        assert_eq!(at(1140.0, 500.0, true).size, (800, 500));
        assert_eq!(at(1140.0, 500.0, false).size, (1140, 500));
        assert_eq!(at(100.0, 1.0, true).size, (1, 1));
        assert_eq!(at(100.0, 1.0, true).panel.map(|panel| panel.width()), Some(100.0));
        assert_eq!(at(1e6, 1e6, false).size, (MAX_SIDE, MAX_SIDE));
    }

    /// Checks that labels wider than the panel do not move the image. The negative control: egui's
    /// own panel on the right moves by the overflow although it has an exact size.
    #[test]
    fn a_wide_label_does_not_move_the_image() {
        let left = |own: bool, label: &str| {
            let context = Context::default();
            let input = || RawInput { screen_rect: Some(window(1280.0, 720.0)), ..RawInput::default() };
            let mut width = 0.0;
            // egui lays out by the sizes of the frame before.
            for _ in 0..3 {
                let _ = context.run_ui(input(), |ui| {
                    let layout = Layout::new(ui.max_rect(), 1.0, None, true);
                    let add = |ui: &mut Ui| {
                        ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
                        ui.label(label);
                    };
                    match own {
                        true => {
                            if let Some(place) = layout.panel {
                                controls(ui, place, add);
                            }
                            width = layout.image.width();
                        }
                        false => {
                            Panel::right("controls").resizable(false).exact_size(PANEL).show(ui, add);
                            width = CentralPanel::default()
                                .frame(Frame::NONE)
                                .show(ui, |ui| ui.available_rect_before_wrap().width())
                                .inner;
                        }
                    }
                });
            }
            width
        };
        let wide = "a kernel with a long name ".repeat(20);
        assert_eq!(left(true, "short"), 940.0);
        assert_eq!(left(true, &wide), 940.0);
        assert_ne!(left(false, &wide), 940.0, "the negative control passes: the test cannot fail");
    }
}
