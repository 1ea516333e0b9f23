//! Manifest of the prebuilt kernels: hashes of their sources and of their files, settings, and
//! versions of packages and tools. `main` writes it, and compares it with the sources.

use crate::compile::{Artifact, entry_point_folders};
use crate::error::Error;
use crate::toolchain::Toolchain;
use crate::{ptx, spirv};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Path of the manifest, from the workspace.
pub const FILE: &str = "kernels/prebuilt/manifest.json";

/// Packages of the lock file that are compiled into kernels.
const PACKAGES: [&str; 8] = [
    "bytemuck",
    "bytemuck_derive",
    "glam",
    "libm",
    "num-traits",
    "spirv-std",
    "spirv-std-macros",
    "spirv-std-types",
];

/// Everything that decides the artifacts' bytes, and the hashes of those bytes.
#[derive(Debug, Serialize, Deserialize, PartialEq, Eq)]
pub struct Manifest {
    /// SHA-256 of each source file, by its path from the workspace.
    pub sources: BTreeMap<String, String>,
    /// Locked versions of the packages that are compiled into kernels.
    pub packages: BTreeMap<String, String>,
    /// Targets, options, and the build profiles of the workspace.
    pub settings: BTreeMap<String, String>,
    /// SHA-256 of each artifact, by its path from the workspace.
    pub artifacts: BTreeMap<String, String>,
    /// Versions of the compilers.
    pub tools: BTreeMap<String, String>,
}

/// Returns the manifest of freshly compiled artifacts.
pub fn stamp(root: &Path, toolchain: &Toolchain, artifacts: &[Artifact]) -> Result<Manifest, Error> {
    Ok(Manifest {
        sources: sources(root)?,
        packages: packages(root)?,
        settings: settings(root)?,
        artifacts: artifacts.iter().map(|a| (a.name.clone(), hash(&a.bytes))).collect(),
        tools: BTreeMap::from([
            ("rustc".to_owned(), toolchain.rustc_version.clone()),
            ("rustc_codegen_spirv".to_owned(), "0.10.0-alpha.1".to_owned()),
            ("spirv-opt".to_owned(), toolchain.spirv_opt_version.clone()),
        ]),
    })
}

/// Reads the committed manifest.
pub fn read(root: &Path) -> Result<Manifest, Error> {
    let path = root.join(FILE);
    let text = load(&path)?;
    serde_json::from_slice(&text).map_err(|e| Error::Manifest { path, message: e.to_string() })
}

/// Writes the artifacts and their manifest, and removes modules of entry points that no longer
/// exist.
pub fn write(root: &Path, artifacts: &[Artifact], manifest: &Manifest) -> Result<(), Error> {
    for stray in stray_modules(root, artifacts)? {
        fs::remove_file(&stray).map_err(|source| Error::Io { path: stray.clone(), source })?;
    }
    for artifact in artifacts {
        save(&root.join(&artifact.name), &artifact.bytes)?;
    }
    let path = root.join(FILE);
    let mut text = serde_json::to_string_pretty(manifest)
        .map_err(|e| Error::Manifest { path: path.clone(), message: e.to_string() })?;
    text.push('\n');
    save(&path, text.as_bytes())
}

/// Compares fresh artifacts and their manifest with the committed ones.
pub fn compare(root: &Path, artifacts: &[Artifact], fresh: &Manifest) -> Result<(), Error> {
    let committed = read(root)?;
    let mut differences = changes(&committed, fresh);
    for artifact in artifacts {
        let path = root.join(&artifact.name);
        if load(&path)? != artifact.bytes {
            differences.push(format!("  {}: other bytes than the build gives", artifact.name));
        }
    }
    differences.extend(
        stray_modules(root, artifacts)?.iter().map(|stray| format!("  {}: no entry point", stray.display())),
    );
    if differences.is_empty() { Ok(()) } else { Err(Error::Stale { differences }) }
}

/// Returns the modules of entry points that no longer exist.
fn stray_modules(root: &Path, artifacts: &[Artifact]) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for folder in entry_point_folders() {
        let folder = root.join(folder);
        let error = |source| Error::Io { path: folder.clone(), source };
        fs::create_dir_all(&folder).map_err(error)?;
        for entry in fs::read_dir(&folder).map_err(error)? {
            let path = entry.map_err(error)?.path();
            if !artifacts.iter().any(|artifact| root.join(&artifact.name) == path) {
                found.push(path);
            }
        }
    }
    Ok(found)
}

/// Compares sources, settings and prebuilt files with the manifest. Builds nothing.
pub fn check_sources(root: &Path, manifest: &Manifest) -> Result<(), Error> {
    let mut artifacts = BTreeMap::new();
    for name in manifest.artifacts.keys() {
        artifacts.insert(name.clone(), hash(&load(&root.join(name))?));
    }
    let now = Manifest {
        sources: sources(root)?,
        packages: packages(root)?,
        settings: settings(root)?,
        artifacts,
        tools: manifest.tools.clone(),
    };
    let differences = changes(manifest, &now);
    if differences.is_empty() { Ok(()) } else { Err(Error::Stale { differences }) }
}

fn changes(old: &Manifest, new: &Manifest) -> Vec<String> {
    let parts = [
        ("source", &old.sources, &new.sources),
        ("package", &old.packages, &new.packages),
        ("setting", &old.settings, &new.settings),
        ("artifact", &old.artifacts, &new.artifacts),
        ("tool", &old.tools, &new.tools),
    ];
    let mut found = Vec::new();
    for (part, old, new) in parts {
        for key in old.keys().chain(new.keys().filter(|key| !old.contains_key(*key))) {
            if old.get(key) != new.get(key) {
                found.push(format!("  {part} {key}: {:?}, was {:?}", new.get(key), old.get(key)));
            }
        }
    }
    found
}

fn sources(root: &Path) -> Result<BTreeMap<String, String>, Error> {
    let mut files = vec![
        root.join("shared/Cargo.toml"),
        root.join("kernels/Cargo.toml"),
        root.join("tests/probes/Cargo.toml"),
        // Modules of this crate that hold options of the compilers.
        root.join("kernels/build/src/compile.rs"),
        root.join("kernels/build/src/contraction.rs"),
        root.join("kernels/build/src/entries.rs"),
        root.join("kernels/build/src/ptx.rs"),
        root.join("kernels/build/src/spirv.rs"),
    ];
    for folder in ["shared/src", "kernels/src", "tests/probes/src"] {
        collect(&root.join(folder), &mut files)?;
    }
    let mut hashes = BTreeMap::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap_or(&file).to_string_lossy().replace('\\', "/");
        hashes.insert(name, hash(&load(&file)?));
    }
    Ok(hashes)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Error> {
    let error = |source| Error::Io { path: folder.to_owned(), source };
    for entry in fs::read_dir(folder).map_err(error)? {
        let path = entry.map_err(error)?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

fn packages(root: &Path) -> Result<BTreeMap<String, String>, Error> {
    let lock = toml_file(&root.join("Cargo.lock"))?;
    let all = lock.get("package").and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let text = |package: &toml::Value, key: &str| {
        package.get(key).and_then(toml::Value::as_str).unwrap_or_default().to_owned()
    };
    Ok(all
        .iter()
        .map(|package| (text(package, "name"), text(package, "version")))
        .filter(|(name, _)| PACKAGES.contains(&name.as_str()))
        .collect())
}

fn settings(root: &Path) -> Result<BTreeMap<String, String>, Error> {
    let workspace = toml_file(&root.join("Cargo.toml"))?;
    let profiles = workspace.get("profile").map(ToString::to_string).unwrap_or_default();
    Ok(BTreeMap::from([
        ("profiles".to_owned(), profiles),
        ("ptx".to_owned(), format!("{} {}", ptx::ARCHITECTURE, ptx::VERSION)),
        ("spirv".to_owned(), spirv::TARGET.to_owned()),
    ]))
}

fn toml_file(path: &Path) -> Result<toml::Value, Error> {
    let text = String::from_utf8_lossy(&load(path)?).into_owned();
    toml::from_str(&text)
        .map_err(|e| Error::Manifest { path: path.to_owned(), message: e.message().to_owned() })
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn load(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}

fn save(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    fs::write(path, bytes).map_err(|source| Error::Io { path: path.to_owned(), source })
}
