//! Camera, film, sampler and integrator of Mitsuba.

use super::super::assembly::{Projection, View, reflection};
use super::document::Element;
use super::{Reader, SceneError};
use glam::DVec3;
use std::rc::Rc;

/// Maximum number of integrators within each other.
const MAX_NESTING: usize = 8;

impl Reader<'_, '_> {
    /// Reads the camera with its film and its sampler.
    pub fn sensor(&mut self, element: &Rc<Element>, notes: &mut Vec<String>) -> Result<(), SceneError> {
        let document = self.document;
        for child in &element.children {
            match child.tag.as_str() {
                "film" => self.film(child)?,
                "sampler" => {
                    let samples = &mut self.assembly.settings.samples;
                    *samples = document.count(child, "sample_count", 1, *samples)?;
                    let _ = child.property("seed");
                }
                "medium" | "ref" => {
                    self.assembly.scene.atmosphere = self.medium(child)?;
                }
                _ => continue,
            }
            child.mark();
        }
        for name in ["near_clip", "far_clip", "shutter_open", "shutter_close"] {
            let _ = element.property(name);
        }
        let kind = element.kind();
        if !matches!(kind, "perspective" | "thinlens" | "orthographic") {
            self.unsupported(element, &element.label(), "taken as a perspective");
        }
        let projection = match kind {
            "orthographic" => Projection::Parallel { half_height: 1.0 / self.aspect() },
            _ => Projection::Perspective { half_height: self.half_height(element)? },
        };
        let mut lens = (0.0, 1.0);
        if kind == "thinlens" {
            lens = (
                document.number(element, "aperture_radius", 0.0)?,
                document.number(element, "focus_distance", 1.0)?,
            );
            if !(lens.0 >= 0.0 && lens.1 > 0.0) {
                return Err(
                    document.error(element, "aperture_radius must be 0 or more, focus_distance above 0")
                );
            }
        } else {
            let _ = element.property("focus_distance");
        }
        for name in ["principal_point_offset_x", "principal_point_offset_y"] {
            if document.number(element, name, 0.0)? != 0.0 {
                self.unsupported(element, &format!("{name} of {}", element.label()), "ignored");
            }
        }
        let to_world = document.transform(element, "to_world")?;
        let view =
            View { to_world, right: DVec3::NEG_X, projection, lens_radius: lens.0, focus_distance: lens.1 };
        if view.is_mirrored() {
            self.assembly.world = reflection();
            notes.push("the camera shows a mirrored view: the world is reflected in x".to_owned());
        }
        let pose = view.pose(&self.assembly.world).map_err(|fault| document.error(element, fault))?;
        self.assembly.scene.cameras.push(("sensor".to_owned(), pose));
        self.report_unused(element);
        Ok(())
    }

    fn aspect(&self) -> f64 {
        f64::from(self.assembly.settings.width) / f64::from(self.assembly.settings.height)
    }

    /// Returns the tangent of half the vertical angle.
    fn half_height(&self, element: &Rc<Element>) -> Result<f64, SceneError> {
        let document = self.document;
        let aspect = self.aspect();
        let diagonal = |half: f64| half / aspect.hypot(1.0);
        if element.property("fov").is_none() {
            let word = document.word(element, "focal_length")?.unwrap_or("50mm");
            let length = document.parse_number(element, word.trim_end_matches("mm"))?;
            // A film of 36 x 24 mm has the same diagonal angle.
            let half = 0.5 * 36f64.hypot(24.0) / length;
            return if half > 0.0 {
                Ok(diagonal(half))
            } else {
                Err(document.error(element, "focal_length must be above 0"))
            };
        }
        let fov = document.number(element, "fov", 45.0)?;
        if !(fov > 0.0 && fov < 180.0) {
            return Err(
                document.error(element, format!("fov is {fov}; it must be above 0 and below 180 degrees"))
            );
        }
        let half = (0.5 * fov.to_radians()).tan();
        let axis = document.word(element, "fov_axis")?.unwrap_or("x");
        let is_wide = aspect >= 1.0;
        match axis {
            "x" => Ok(half / aspect),
            "y" => Ok(half),
            "diagonal" => Ok(diagonal(half)),
            "smaller" => Ok(if is_wide { half } else { half / aspect }),
            "larger" => Ok(if is_wide { half / aspect } else { half }),
            _ => Err(document.error(element, "fov_axis must be x, y, diagonal, smaller or larger")),
        }
    }

    fn film(&mut self, element: &Rc<Element>) -> Result<(), SceneError> {
        let document = self.document;
        let settings = &mut self.assembly.settings;
        settings.width = document.count(element, "width", 1, settings.width)?;
        settings.height = document.count(element, "height", 1, settings.height)?;
        for name in
            ["pixel_format", "component_format", "file_format", "sample_border", "compensate", "banner"]
        {
            let _ = element.property(name);
        }
        for child in element.children.iter().filter(|child| child.tag == "rfilter") {
            child.mark();
            if child.kind() != "box" {
                self.unsupported(child, &child.label(), "the filter is a box of one pixel");
            }
        }
        self.report_unused(element);
        Ok(())
    }

    /// Reads the depth of paths from an integrator.
    pub fn integrator(&mut self, element: &Rc<Element>, depth: usize) -> Result<(), SceneError> {
        let document = self.document;
        let kind = element.kind();
        match kind {
            "path" | "volpath" | "volpathmis" | "prb" | "prbvolpath" => {
                let most = document.number(element, "max_depth", -1.0)?;
                if most >= 0.0 {
                    self.assembly.settings.depth = most.clamp(1.0, 65535.0) as u32;
                }
            }
            "direct" => self.assembly.settings.depth = 2,
            _ => {
                let nested = element.children.iter().find(|child| child.tag == "integrator").cloned();
                match nested.filter(|_| depth < MAX_NESTING) {
                    Some(nested) => {
                        nested.mark();
                        self.integrator(&nested, depth + 1)?;
                    }
                    None => self.unsupported(element, &element.label(), "paths are traced"),
                }
                return Ok(());
            }
        }
        for name in ["rr_depth", "hide_emitters"] {
            let _ = element.property(name);
        }
        if document.flag(element, "hide_emitters", false)? {
            self.unsupported(element, "hide_emitters", "lights are seen");
        }
        self.report_unused(element);
        Ok(())
    }
}
