//! Participating media of pbrt.

use super::parameters::Parameters;
use super::tokens::At;
use super::{Reader, SceneError, shown};
use crate::description::Medium;
use crate::medium::MAX_MEDIA;
use glam::DVec3;

impl Reader<'_> {
    /// Reads the names of the media inside and outside of surfaces.
    pub fn medium_interface(&mut self) -> Result<(), SceneError> {
        let inside = self.text("MediumInterface")?;
        // One name stands for both sides.
        let outside = match self.tokens.take()? {
            Some(super::Token::Text(text)) => text,
            Some(other) => {
                self.tokens.put_back(other);
                inside.clone()
            }
            None => inside.clone(),
        };
        (self.state.inside, self.state.outside) = (inside, outside);
        Ok(())
    }

    /// Returns the index of a medium; `None` for none, and for one that is not supported.
    pub fn medium(&mut self, name: &str, at: At) -> Result<Option<usize>, SceneError> {
        match self.media.get(name) {
            _ if name.is_empty() => Ok(None),
            Some(&medium) => Ok(medium),
            None => {
                let message = format!("unknown medium \"{}\"; MakeNamedMedium must define it", shown(name));
                self.error(at, message)
            }
        }
    }

    /// Defines a medium.
    pub fn make_named_medium(
        &mut self,
        name: String,
        parameters: &Parameters,
        at: At,
    ) -> Result<(), SceneError> {
        let kind = parameters.text(&self.tokens, "type")?.unwrap_or_default().to_owned();
        if kind != "homogeneous" || parameters.get("preset").is_some() {
            let feature = match kind.as_str() {
                "homogeneous" => "a medium by its preset".to_owned(),
                _ => format!("the medium \"{}\"", shown(&kind)),
            };
            self.unsupported(at, &feature, "left out");
            self.media.insert(name, None);
            return Ok(());
        }
        let mut share = |name: &str, default: [f64; 3]| match self.spectrum(parameters, name)? {
            None => Ok(DVec3::from(default)),
            Some(spectrum) => spectrum
                .share()
                .ok_or_else(|| self.tokens.error(at, format!("{name} has an unknown spectrum"))),
        };
        let [absorbed, scattered, glow] = [
            share("sigma_a", [0.0011, 0.0024, 0.014])?,
            share("sigma_s", [2.55, 3.21, 3.77])?,
            share("Le", [0.0; 3])?,
        ];
        let scale = parameters.number(&self.tokens, "scale", 1.0)?;
        let (absorbed, scattered) = (absorbed * scale, scattered * scale);
        let glow = glow * parameters.number(&self.tokens, "Lescale", 1.0)?;
        let anisotropy = parameters.number(&self.tokens, "g", 0.0)?.clamp(-0.99, 0.99);
        let extinction = absorbed + scattered;
        let albedo = DVec3::select(extinction.cmpgt(DVec3::ZERO), scattered / extinction, DVec3::ZERO);
        let medium =
            Medium { name: shown(&name), anisotropy, emission: glow, ..Medium::new(extinction, albedo) };
        medium.check().map_err(|fault| self.tokens.error(at, fault))?;
        if self.assembly.scene.media.len() >= MAX_MEDIA {
            return self.error(at, format!("too many media; at most {MAX_MEDIA}"));
        }
        self.assembly.scene.media.push(medium);
        self.media.insert(name, Some(self.assembly.scene.media.len() - 1));
        self.report_unused(parameters, "MakeNamedMedium \"homogeneous\"");
        Ok(())
    }
}
