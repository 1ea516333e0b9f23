//! Participating media of Mitsuba.

use super::document::Element;
use super::texture::Quantity;
use super::{Reader, SceneError, address};
use crate::description::Medium;
use crate::medium::MAX_MEDIA;
use glam::DVec3;
use std::rc::Rc;

impl Reader<'_, '_> {
    /// Returns the index of a medium; `None` for one that is not supported.
    pub fn medium(&mut self, element: &Rc<Element>) -> Result<Option<usize>, SceneError> {
        let document = self.document;
        let element = self.resolved(element)?;
        element.mark();
        let key = address(element);
        if let Some(&known) = self.media.get(&key) {
            return Ok(known);
        }
        if element.tag != "medium" {
            return Err(document.error(element, format!("{} is no <medium>", element.label())));
        }
        if element.kind() != "homogeneous" {
            self.unsupported(element, &element.label(), "left out");
            self.media.insert(key, None);
            return Ok(None);
        }
        let scale = document.number(element, "scale", 1.0)?;
        let extinction = self.color(element, "sigma_t", Quantity::Share)?.unwrap_or(DVec3::ONE) * scale;
        let albedo = self.color(element, "albedo", Quantity::Share)?.unwrap_or(DVec3::splat(0.75));
        let anisotropy = self.phase(element)?;
        self.report_unused(element);
        let name = super::shown(element.attribute("id").unwrap_or("medium"));
        let albedo = albedo.clamp(DVec3::ZERO, DVec3::ONE);
        let medium = Medium { name, anisotropy, ..Medium::new(extinction, albedo) };
        medium.check().map_err(|fault| document.error(element, fault))?;
        if self.assembly.scene.media.len() >= MAX_MEDIA {
            return Err(document.error(element, format!("too many media; at most {MAX_MEDIA}")));
        }
        self.assembly.budget.take(size_of::<Medium>() as u64, &document.site(element))?;
        let index = self.assembly.scene.media.len();
        self.assembly.scene.media.push(medium);
        self.media.insert(key, Some(index));
        Ok(Some(index))
    }

    /// Returns the mean cosine of a medium's phase function.
    fn phase(&mut self, medium: &Rc<Element>) -> Result<f64, SceneError> {
        let document = self.document;
        let mut found = 0.0;
        for child in &medium.children {
            let phase = self.resolved(child)?;
            if phase.tag != "phase" {
                continue;
            }
            child.mark();
            match phase.kind() {
                "isotropic" => {}
                "hg" => found = document.number(phase, "g", 0.8)?.clamp(-0.99, 0.99),
                _ => self.unsupported(phase, &phase.label(), "taken as isotropic"),
            }
        }
        Ok(found)
    }
}
