//! Images of MTL materials: their placement, and images that are computed from those of the files.

use super::super::budget::{Budget, fits};
use super::super::files::{Files, readable};
use super::super::images::{Curve, Images};
use super::super::source_location::{SourceLocation, shown};
use super::super::warnings::Warnings;
use super::lookup::Lookup;
use super::map::{Map, is_absolute};
use crate::description::{Description, Filter, Texels, TextureImage, TextureUse, Wrap};
use crate::error::SceneError;
use crate::missing_file::{has_suggestion, suggesting};
use glam::{DAffine2, DVec2, Vec3};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::ErrorKind;
use std::sync::Arc;

/// Height of a white texel over a black one with `-bm 1`, in widths of the image.
const HEIGHT: f32 = 0.01;
/// Minimum share of a normal map's texels that are unit vectors out of the surface.
const MIN_NORMALS: f64 = 0.9;

/// Destination of materials and images, and source of image files.
pub struct Used<'a> {
    pub description: &'a mut Description,
    pub images: &'a mut Images,
    pub files: &'a mut dyn Files,
    pub lookup: &'a mut Lookup,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
}

/// Images that were computed, by the files and the way.
#[derive(Debug, Default)]
pub struct Derived {
    index: HashMap<(String, String), usize>,
}

/// Returns the use of a map of colours, which the library `file` names.
pub fn colors(map: &Map, used: &mut Used, file: &str) -> Result<TextureUse, SceneError> {
    let image = decoded(map, Curve::Srgb, used, file)?;
    Ok(placed(map, image))
}

/// Returns the use of a normal map. Unless `is_normal_map`, the texels decide whether the map is
/// one, or a height map, from which one is computed.
pub fn normals(
    map: &Map,
    is_normal_map: bool,
    derived: &mut Derived,
    used: &mut Used,
    file: &str,
) -> Result<TextureUse, SceneError> {
    let image = decoded(map, Curve::Linear, used, file)?;
    let heights = &used.images.all[image];
    if is_normal_map || has_normals(texels(heights)) {
        return Ok(placed(map, image));
    }
    let key = (map.path.clone(), "normals".to_owned());
    let image = match derived.index.get(&key) {
        Some(&known) => known,
        None => {
            fits(size_of::<[f32; 4]>() as u64 * texels(heights).len() as u64, &map.site(file))?;
            let normals = normals_of(heights);
            used.images.all.push(normals.into());
            derived.index.insert(key, used.images.all.len() - 1);
            used.images.all.len() - 1
        }
    };
    Ok(placed(map, image))
}

/// Returns the use of one image whose green is the roughness of one map and whose blue is the
/// metalness of the other; 1 without the map.
pub fn roughness_and_metalness(
    (rough, metal): (Option<&Map>, Option<&Map>),
    derived: &mut Derived,
    used: &mut Used,
    file: &str,
) -> Result<Option<TextureUse>, SceneError> {
    let Some(first) = rough.or(metal) else { return Ok(None) };
    let path = |map: Option<&Map>| map.map_or_else(String::new, |map| map.path.clone());
    let key = (path(rough), path(metal));
    if let Some(&known) = derived.index.get(&key) {
        return Ok(Some(placed(first, known)));
    }
    let mut read = |map: Option<&Map>| map.map(|map| decoded(map, Curve::Linear, used, file)).transpose();
    let sources = [read(rough)?, read(metal)?];
    let sources = sources.map(|source| source.and_then(|index| used.images.all.get(index)).map(Arc::as_ref));
    let sides = |side: fn(&TextureImage) -> u32| sources.iter().flatten().map(|image| side(image)).max();
    let (width, height) = (sides(|image| image.width).unwrap_or(1), sides(|image| image.height).unwrap_or(1));
    fits(4 * u64::from(width) * u64::from(height), &first.site(file))?;
    let at = |source: Option<&TextureImage>, x: u32, y: u32| {
        let Some(image) = source else { return 255 };
        let scaled = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as usize;
        let (column, row) = (scaled(x, width, image.width), scaled(y, height, image.height));
        texels(image)[row * image.width as usize + column][0]
    };
    let [rough, metal] = sources;
    let all = (0..height).flat_map(|y| (0..width).map(move |x| [255, at(rough, x, y), at(metal, x, y), 255]));
    let image = TextureImage {
        name: format!("{} with {}", key.0, key.1),
        width,
        height,
        texels: Texels::Linear8(all.collect()),
    };
    used.images.all.push(image.into());
    derived.index.insert(key, used.images.all.len() - 1);
    Ok(Some(placed(first, used.images.all.len() - 1)))
}

/// Returns the index of the image of a map, which the library `file` names. An image that is
/// missing at its path is looked for by its name.
fn decoded(map: &Map, curve: Curve, used: &mut Used, file: &str) -> Result<usize, SceneError> {
    let site = map.site(file);
    let read = image(&map.path, map, curve, used, &site);
    let (fault, has_suggestion) = match &read {
        Err(SceneError::Resource { source, .. }) if source.kind() == ErrorKind::NotFound => {
            ("is missing", has_suggestion(source))
        }
        // The image may be where the library is now.
        Err(SceneError::Outside { .. }) if is_absolute(&map.written) => {
            ("lies outside the scene's folder", true)
        }
        _ => return read,
    };
    if let Some(found) = used.lookup.find(&map.written, &map.folder, used.files) {
        let (written, shown_found) = (shown(&map.written), shown(&found));
        let place = format!("{file}: {}", site.place);
        used.warnings.once(format!("{place}: \"{written}\" {fault}; \"{shown_found}\" is used in its place"));
        return image(&found, map, curve, used, &site);
    }
    match used.lookup.similar(&map.written, &map.folder, used.files) {
        Some(name) if !has_suggestion => Err(site.resource(&map.written, suggesting(&name))),
        _ => read,
    }
}

/// Returns the index of the image at a path, which `map` names.
fn image(
    path: &str,
    map: &Map,
    curve: Curve,
    used: &mut Used,
    site: &SourceLocation,
) -> Result<usize, SceneError> {
    used.images.get(path, curve, site, || {
        let bytes =
            used.files.read(path, readable()).map_err(|source| site.resource(&map.written, source))?;
        used.budget.extend(bytes.len());
        Ok(Cow::Owned(bytes))
    })
}

/// Returns the use of an image with the placement of a map.
fn placed(map: &Map, image: usize) -> TextureUse {
    // MTL scales and moves images with v upwards from the bottom.
    let offset = DVec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y);
    let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
    let transform = DAffine2::from_scale_angle_translation(map.scale, 0.0, offset);
    TextureUse { image, wrap: [wrap; 2], filter: Filter::Linear, transform, second_uvs: false }
}

/// Returns the texels of an image that was decoded from a file.
fn texels(image: &TextureImage) -> &[[u8; 4]] {
    match &image.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels,
        Texels::Float(_) => &[],
    }
}

/// Returns whether texels are the vectors of a normal map. Those of a height map are grey.
fn has_normals(texels: &[[u8; 4]]) -> bool {
    let is_normal = |&&[r, g, b, _]: &&[u8; 4]| {
        let vector = Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 127.5 - 1.0;
        let is_grey = r.abs_diff(g).max(g.abs_diff(b)) < 8;
        !is_grey && vector.z > 0.0 && (0.7..1.3).contains(&vector.length())
    };
    texels.iter().filter(is_normal).count() as f64 >= MIN_NORMALS * texels.len() as f64
}

/// Returns the normal map of a height map, by central differences across its borders.
fn normals_of(heights: &TextureImage) -> TextureImage {
    let (width, height) = (heights.width as usize, heights.height as usize);
    let texels = texels(heights);
    let scale = HEIGHT * width as f32 / 255.0 / 2.0;
    let normal = |x: usize, y: usize| {
        let at = |x: usize, y: usize| {
            let [r, g, b, _] = texels[y % height * width + x % width];
            (f32::from(r) + f32::from(g) + f32::from(b)) / 3.0
        };
        let across = at(x + 1, y) - at(x + width - 1, y);
        // The image's rows go down, and a normal map's y goes up.
        let down = at(x, y + 1) - at(x, y + height - 1);
        let normal = 0.5 + 0.5 * Vec3::new(-across * scale, down * scale, 1.0).normalize();
        [normal.x, normal.y, normal.z, 1.0]
    };
    let all = (0..height).flat_map(|y| (0..width).map(move |x| normal(x, y)));
    TextureImage {
        name: format!("normals of {}", heights.name),
        width: heights.width,
        height: heights.height,
        texels: Texels::Float(all.collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: u32, heights: &[u8]) -> TextureImage {
        let texels = heights.iter().map(|&h| [h, h, h, 255]).collect();
        let height = heights.len() as u32 / width;
        TextureImage { name: "h".to_owned(), width, height, texels: Texels::Linear8(texels) }
    }

    fn vectors(image: &TextureImage) -> Vec<Vec3> {
        let Texels::Float(texels) = &image.texels else { panic!() };
        texels.iter().map(|&[x, y, z, _]| 2.0 * Vec3::new(x, y, z) - 1.0).collect()
    }

    #[test]
    fn height_maps_are_told_from_normal_maps() {
        let waves: Vec<[u8; 4]> = (0..64).map(|i| [128 + i, 128 - i / 2, 250 - i / 2, 255]).collect();
        assert!(has_normals(&waves));
        assert!(!has_normals(texels(&grey(8, &[201; 64]))) && !has_normals(texels(&grey(8, &[0; 64]))));
        assert!(!has_normals(&[[200, 30, 30, 255]; 64]), "a photograph");
    }

    /// A slope that rises to the right leans to the left, and one that rises downward leans up.
    #[test]
    fn normals_lean_away_from_the_slope() {
        let right = vectors(&normals_of(&grey(4, &[0, 10, 20, 30, 0, 10, 20, 30])));
        let scale = HEIGHT * 4.0 / 255.0 / 2.0;
        assert!((right[1] - Vec3::new(-20.0 * scale, 0.0, 1.0).normalize()).length() < 1e-6, "{}", right[1]);
        let down = vectors(&normals_of(&grey(1, &[0, 10, 20, 30])));
        assert!(down[1].y > 0.0 && down[1].x == 0.0);
        // Negative control: a flat map has no slope.
        assert!(vectors(&normals_of(&grey(2, &[7; 4]))).iter().all(|normal| *normal == Vec3::Z));
    }
}
