//! Builds the page: the module with its glue, the files of `page/`, and the scenes of the list.

use crate::files::{copy, list, root};
use crate::{PageError, at, scenes};
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use wasm_bindgen_cli_support::Bindgen;

/// Target of modules for browsers.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// Name of the module in a page.
const MODULE: &str = "trisect_web_bg.wasm";

/// Size of the page.
#[derive(Clone, Copy, Debug, Default)]
pub struct Size {
    /// Number of files.
    pub files: usize,
    /// Number of their bytes.
    pub bytes: u64,
    /// Number of bytes when a server compresses them.
    pub gzipped: u64,
}

/// Builds the page into a folder, which is replaced. Returns its size.
pub fn build(output: &Path) -> Result<Size, PageError> {
    check(output)?;
    let module = module()?;
    let parent = output.parent().filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(at(parent))?;
    // Beside the output, so that it is moved there at once.
    let beside = tempfile::tempdir_in(parent).map_err(at(parent))?;
    let fresh = beside.path().join("page");
    std::fs::create_dir(&fresh).map_err(at(&fresh))?;
    let mut bindgen = Bindgen::new();
    bindgen.input_path(&module).typescript(false).remove_name_section(true).remove_producers_section(true);
    let web = bindgen.web(true).map_err(|error| PageError::Glue(error.to_string()))?;
    web.generate(&fresh).map_err(|error| PageError::Glue(format!("{error:?}")))?;
    let own = root().join("host/web/page");
    for entry in std::fs::read_dir(&own).map_err(at(&own))? {
        let entry = entry.map_err(at(&own))?;
        copy(&entry.path(), &fresh.join(entry.file_name()))?;
    }
    scenes::copy_to(&fresh)?;
    let files = list(&fresh)?;
    let size = write_offline(&fresh, &files)?;
    if output.exists() {
        std::fs::remove_dir_all(output).map_err(at(output))?;
    }
    std::fs::rename(&fresh, output).map_err(at(output))?;
    Ok(size)
}

/// Checks that a folder is missing, empty, or that of a page.
fn check(output: &Path) -> Result<(), PageError> {
    let not_a_page = || PageError::NotAPage { path: output.to_owned() };
    if output.file_name().is_none() {
        return Err(not_a_page());
    }
    match std::fs::read_dir(output).map(|mut entries| entries.next().is_none()) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(at(output)(error)),
        Ok(is_empty) if is_empty || output.join(MODULE).is_file() => Ok(()),
        Ok(_) => Err(not_a_page()),
    }
}

/// Builds the module. Returns its path.
fn module() -> Result<PathBuf, PageError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(root()).args([
        "build",
        "--quiet",
        "--profile",
        "page",
        "--locked",
        "--package",
        "trisect-web",
    ]);
    // Flags for the machine's own processor are none for a browser's.
    command.args(["--lib", "--target", TARGET]).env_remove("RUSTFLAGS");
    match command.status() {
        Ok(status) if status.success() => {}
        _ => return Err(PageError::Module),
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    Ok(root().join(target).join(TARGET).join("page/trisect_web.wasm"))
}

/// Writes version and files into the service worker. Returns the size of the page.
fn write_offline(folder: &Path, files: &[PathBuf]) -> Result<Size, PageError> {
    let (mut size, mut hash) = (Size::default(), Sha256::new());
    for file in files {
        let content = std::fs::read(folder.join(file)).map_err(at(file))?;
        let mut gzipped = GzEncoder::new(Vec::new(), Compression::best());
        let gzipped = gzipped.write_all(&content).and_then(|()| gzipped.finish()).map_err(at(file))?;
        hash.update(file.as_os_str().as_encoded_bytes());
        hash.update(&content);
        size.files += 1;
        size.bytes += content.len() as u64;
        size.gzipped += gzipped.len() as u64;
    }
    let version: String = hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let is_cached = |file: &&PathBuf| file.as_path() != Path::new("offline.js");
    let names: Vec<String> =
        files.iter().filter(is_cached).map(|file| file.to_string_lossy().replace('\\', "/")).collect();
    let names: Vec<String> = ["./".to_owned()].into_iter().chain(names).collect();
    let worker = folder.join("offline.js");
    let text = std::fs::read_to_string(&worker).map_err(at(&worker))?;
    let list = serde_json::json!(names).to_string();
    let text = text.replace("@VERSION@", &version).replace("@FILES@", &list);
    std::fs::write(&worker, text).map_err(at(&worker))?;
    Ok(size)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn only_pages_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("others")).unwrap();
        std::fs::create_dir_all(at("empty")).unwrap();
        std::fs::create_dir_all(at("page")).unwrap();
        std::fs::write(at("others/letter.txt"), "kept").unwrap();
        std::fs::write(at("page").join(MODULE), "").unwrap();
        for good in ["missing", "empty", "page"] {
            check(&at(good)).unwrap();
        }
        for bad in [at("others"), at("others/letter.txt"), ".".into(), "..".into(), at("page/..")] {
            assert!(check(&bad).is_err(), "{}", bad.display());
        }
    }
}
