//! Textures and factors of materials.

use super::super::images::Curve;
use super::super::source_location::SourceLocation;
use super::super::warnings::Warnings;
use super::json::{NormalTexture, TextureInfo};
use super::texture;
use super::{Document, Output};
use crate::description::TextureUse;
use crate::error::SceneError;
use glam::DVec4;

/// Maximum scale of a normal map, as in a scene file.
const MAX_SCALE: f64 = 1e6;

/// Reader of a material's textures, which may use two sets of texture coordinates.
pub struct Slots<'a> {
    pub document: &'a Document<'a>,
    /// Place of the material.
    pub site: &'a SourceLocation<'a>,
    /// Sets in order of precedence.
    pub sets: [Option<u32>; 2],
    /// Number of textures of further sets.
    pub others: u64,
}

impl Slots<'_> {
    /// Reads the texture at `place` of the material; `None` without `info`.
    pub fn texture(
        &mut self,
        output: &mut Output,
        info: Option<&TextureInfo>,
        curve: Curve,
        place: &str,
    ) -> Result<Option<TextureUse>, SceneError> {
        let Some(info) = info else { return Ok(None) };
        let read = texture::read(self.document, output, info, curve, &self.site.member(place))?;
        Ok(read.map(|(mut texture, set)| {
            match self.sets {
                [None, _] => self.sets[0] = Some(set),
                [Some(first), _] if first == set => {}
                [_, None] => self.sets[1] = Some(set),
                [_, Some(second)] if second == set => {}
                _ => self.others += 1,
            }
            texture.second_uvs = self.sets[1] == Some(set);
            texture
        }))
    }

    /// Reads the normal map at `place` of the material, and the factor of its x and y; `None` and 1
    /// without `map`.
    pub fn normal_map(
        &mut self,
        output: &mut Output,
        map: Option<&NormalTexture>,
        place: &str,
    ) -> Result<(Option<TextureUse>, f64), SceneError> {
        let scale = map.map_or(1.0, |map| map.scale);
        if scale.abs() > MAX_SCALE {
            let site = self.site.member(place);
            return Err(site.malformed(format!("scale is {scale:e}"), "it must be at most 1e6"));
        }
        Ok((self.texture(output, map.map(|map| &map.info), Curve::Linear, place)?, scale))
    }
}

/// Clamps factors to 0 to 1, with a warning if one changes.
pub fn share(factors: DVec4, site: &SourceLocation, warnings: &mut Warnings) -> DVec4 {
    let clamped = factors.clamp(DVec4::ZERO, DVec4::ONE);
    let changed = u64::from(clamped != factors);
    warnings.tally("material factors outside 0 to 1, clamped", changed, &site.place);
    clamped
}
