//! Scenes of the page's list, with the files that they name.

use crate::files::{copy, root};
use crate::{PageError, at};
use serde_json::json;
use std::path::Path;
use trisect_scene::SceneDocument;

/// Scenes in the order of the list: name and path. `mesh.ron` is left out: its mesh has 30 MB.
const SCENES: [(&str, &str); 18] = [
    ("Ray Tracing in One Weekend", "scenes/rtiow_final.ron"),
    ("Cornell box", "scenes/cornell_box.ron"),
    ("Three spheres", "scenes/three_spheres.ron"),
    ("Materials", "scenes/materials.ron"),
    ("Layers", "scenes/layers.ron"),
    ("Features of glTF", "scenes/gltf/features.glb"),
    ("Room", "scenes/room.ron"),
    ("Sun and sky", "scenes/sun_sky.ron"),
    ("Multiple importance sampling", "scenes/veach_mis.ron"),
    ("The Next Week", "scenes/next_week.ron"),
    ("Cornell box with smoke", "scenes/cornell_smoke.ron"),
    ("Fog and lamps", "scenes/fog_lamps.ron"),
    ("Many lights", "scenes/many_lights.ron"),
    ("A door ajar", "scenes/door_slit.ron"),
    ("Gallery: interior", "scenes/gallery/interior.ron"),
    ("Gallery: still life", "scenes/gallery/still_life.ron"),
    ("Gallery: product", "scenes/gallery/product.ron"),
    ("Gallery: ten thousand", "scenes/gallery/ten_thousand.ron"),
];

/// Copies the scenes with their files to a folder, and writes their list there.
pub fn copy_to(folder: &Path) -> Result<(), PageError> {
    let mut list = Vec::new();
    for (name, path) in SCENES {
        let document = SceneDocument::load(&root().join(path))?;
        let mut files = vec![path.to_owned()];
        for file in &document.description.files {
            let relative =
                file.strip_prefix(root()).map_err(|_| PageError::Outside { path: file.clone() })?;
            let relative = relative.to_string_lossy().replace('\\', "/");
            if !files.contains(&relative) {
                files.push(relative);
            }
        }
        for file in &files {
            copy(&root().join(file), &folder.join(file))?;
        }
        list.push(json!({ "name": name, "path": path, "files": files }));
    }
    let to = folder.join("scenes.json");
    std::fs::write(&to, serde_json::Value::from(list).to_string()).map_err(at(&to))
}
