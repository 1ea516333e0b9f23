//! Compiles tests in the copy of the workspace.

use crate::mutant::Test;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Package and target of a test, as [`Test`] names them.
pub type Target = (String, String);

/// A compiled test target.
#[derive(Clone, Debug)]
pub struct Executable {
    /// Path of the executable.
    pub path: PathBuf,
    /// Folder in which Cargo would run it: the package's.
    pub folder: PathBuf,
}

/// Calls Cargo.
pub struct Builder {
    /// Folder of the workspace.
    pub folder: PathBuf,
    /// Folder for artifacts.
    pub target_dir: PathBuf,
    /// File with settings for `--config`.
    pub config: Option<PathBuf>,
}

/// The used fields of Cargo's messages (`--message-format=json`).
#[derive(Deserialize)]
struct Message {
    package_id: Option<String>,
    manifest_path: Option<PathBuf>,
    target: Option<MessageTarget>,
    executable: Option<PathBuf>,
}

#[derive(Deserialize)]
struct MessageTarget {
    name: String,
    kind: Vec<String>,
}

impl Builder {
    /// Compiles the targets of `tests`.
    ///
    /// # Errors
    ///
    /// Cargo's messages if a target does not compile.
    pub fn build<'a>(
        &self,
        tests: impl IntoIterator<Item = &'a Test>,
    ) -> Result<BTreeMap<Target, Executable>, String> {
        let targets: BTreeSet<Target> =
            tests.into_iter().map(|test| (test.package.clone(), test.target.clone())).collect();
        // `--workspace` gives other crates the features, and so the artifacts, that they have when
        // all tests of the workspace run. With `--lib` it would compile the unit tests of each
        // member.
        let mut commands: Vec<Vec<&str>> = Vec::new();
        let mut integration = vec!["--workspace"];
        for (package, target) in &targets {
            if target == "lib" {
                commands.push(vec!["--package", package, "--lib"]);
            } else {
                integration.extend(["--test", target]);
            }
        }
        if integration.len() > 1 {
            commands.push(integration);
        }
        let mut found = BTreeMap::new();
        for command in commands {
            self.cargo(&command, &mut found)?;
        }
        found.retain(|target, _| targets.contains(target));
        match targets.into_iter().find(|target| !found.contains_key(target)) {
            Some((package, target)) => Err(format!("Cargo made no test target {target} of {package}")),
            None => Ok(found),
        }
    }

    fn cargo(&self, selection: &[&str], found: &mut BTreeMap<Target, Executable>) -> Result<(), String> {
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["test", "--no-run", "--locked", "--release", "--message-format=json-render-diagnostics"]);
        cargo.args(selection).arg("--target-dir").arg(&self.target_dir);
        if let Some(config) = &self.config {
            cargo.arg("--config").arg(config);
        }
        // A mutant changes few functions, so compiling incrementally is fast.
        cargo.env("CARGO_INCREMENTAL", "1").current_dir(&self.folder).stdin(Stdio::null());
        let output = cargo.output().map_err(|error| format!("cargo: {error}"))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let Ok(message) = serde_json::from_str::<Message>(line) else { continue };
            if let Some((target, executable)) = executable(message) {
                found.insert(target, executable);
            }
        }
        Ok(())
    }
}

fn executable(message: Message) -> Option<(Target, Executable)> {
    let Message {
        package_id: Some(id),
        manifest_path: Some(manifest),
        target: Some(target),
        executable: Some(path),
    } = message
    else {
        return None;
    };
    let name = if target.kind.iter().any(|kind| kind == "test") { target.name } else { "lib".to_owned() };
    let folder = manifest.parent().map(Path::to_owned)?;
    Some(((package(&id)?.to_owned(), name), Executable { path, folder }))
}

/// Returns the name in a package id: `path+file:///somewhere/folder#name@1.0.0`, or
/// `path+file:///somewhere/name#1.0.0` if the folder has the name.
fn package(id: &str) -> Option<&str> {
    let (place, version) = id.rsplit_once('#')?;
    match version.split_once('@') {
        Some((name, _)) => Some(name),
        None => place.rsplit('/').next(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn package_ids() {
        assert_eq!(package("path+file:///a/shared#trisect-shared@0.1.0"), Some("trisect-shared"));
        assert_eq!(package("path+file:///a/trisect#0.1.0"), Some("trisect"));
        assert_eq!(package("nonsense"), None);
    }
}
