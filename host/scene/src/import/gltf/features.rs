//! Refuses a glTF file that requires an unsupported feature, and warns of unsupported features that
//! it uses.

use super::super::source_location::{SourceLocation, shown};
use super::super::warnings::Warnings;
use super::json::Root;
use crate::error::SceneError;

/// Supported extensions.
const SUPPORTED: [&str; 25] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Remedy for compressed geometry.
pub const DECOMPRESS: &str =
    "decompress it with `gltf-transform copy in.glb out.glb`, or export the file without it";

/// Returns the remedy for a required extension.
fn remedy(extension: &str) -> &'static str {
    match extension {
        "EXT_texture_avif" | "MSFT_texture_dds" => "export the file with PNG or JPEG textures",
        _ => "export the file without it",
    }
}

/// Refuses a file that requires an unsupported extension, and warns of all other unsupported
/// features.
pub fn check(root: &Root, name: &str, warnings: &mut Warnings) -> Result<(), SceneError> {
    let supported = |extension: &str| SUPPORTED.contains(&extension);
    if let Some(extension) = root.extensions_required.iter().find(|extension| !supported(extension)) {
        return Err(SourceLocation::new(name, "extensionsRequired")
            .unsupported(format!("the extension {}", shown(extension)), remedy(extension)));
    }
    for extension in root.extensions_used.iter().filter(|extension| !supported(extension)) {
        warnings.once(format!("the extension {} is not supported and ignored", shown(extension)));
    }
    let mut warn = |used: bool, text: &str| {
        if used {
            warnings.once(text);
        }
    };
    warn(
        root.materials.iter().any(|material| material.occlusion_texture.is_some()),
        "occlusion maps (occlusionTexture) are not supported and ignored: occlusion is computed",
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page on glTF has a row for each supported extension, and says of no other one that it
    /// is drawn.
    #[test]
    fn the_table_of_extensions_is_complete() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/scene-format/gltf.md");
        let text = std::fs::read_to_string(page).unwrap_or_else(|error| panic!("{page}: {error}"));
        let row = |line: &str| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let is_extension = cells[0].starts_with("KHR_") || cells[0].starts_with("EXT_");
            (is_extension && cells.len() == 3).then(|| (cells[0].to_owned(), cells[1].to_owned()))
        };
        let rows: Vec<(String, String)> = text.lines().filter_map(row).collect();
        let listed = |state: fn(&str) -> bool| {
            let mut all: Vec<String> = rows
                .iter()
                .filter(|(_, of)| state(of))
                .flat_map(|(names, _)| names.split(", ").map(str::to_owned))
                .collect();
            all.sort_unstable();
            all
        };
        assert_eq!(listed(|state| state == "drawn" || state == "approximated"), SUPPORTED);
        assert!(!listed(|state| state == "ignored").is_empty());
    }
}
