//! Compiles the crates with entry points for both targets, with `ptx` and `spirv`; called by
//! `main`.

use crate::entries::split;
use crate::error::Error;
use crate::package::Package;
use crate::toolchain::Toolchain;
use crate::{ptx, spirv};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// Kind of an artifact, which decides what it must not contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// SPIR-V words, little endian.
    Spirv,
    /// PTX text with the CPU's rounding.
    Ptx,
}

/// Compiled module of one entry point; of the probes' PTX, of all entry points.
#[derive(Debug)]
pub struct Artifact {
    /// Path of the file, from the workspace.
    pub name: String,
    /// Kind of the file's content.
    pub kind: Kind,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

const KERNELS: Package = Package { name: "trisect-kernels", folder: "kernels" };
const PROBES: Package = Package { name: "trisect-probes", folder: "tests/probes" };

/// Returns the folders, from the workspace, with a file for each entry point, and nothing else.
pub fn entry_point_folders() -> [String; 3] {
    let [kernels, probes] = [KERNELS, PROBES].map(|package| package.spirv_folder());
    [kernels, probes, KERNELS.ptx_folder()]
}

/// Compiles SPIR-V and PTX. rust-gpu and spirv-opt are single-threaded: SPIR-V is compiled in
/// parallel with PTX, and optimised kernel by kernel.
pub fn all(root: &Path, toolchain: &Toolchain) -> Result<Vec<Artifact>, Error> {
    // spirv-builder runs the first `cargo` and `rustc` of the path.
    let mut path = toolchain.directory.join("bin").into_os_string();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    // SAFETY: this program has only one thread so far.
    #[allow(unsafe_code, reason = "spirv-builder takes its tools from the environment only")]
    unsafe {
        std::env::set_var("PATH", path);
        std::env::set_var("RUSTC_BOOTSTRAP", "1");
        std::env::set_var("CARGO_PROFILE_RELEASE_LTO", "off");
        std::env::remove_var("RUSTUP_TOOLCHAIN");
    }
    let to_ptx = |package: &Package| {
        timed(&format!("{} to PTX", package.name), || ptx::module(root, toolchain, package))
    };
    let artifact = |name, bytes| Artifact { name, kind: Kind::Ptx, bytes };
    let (spirv, ptx) = thread::scope(|scope| {
        let ptx = scope.spawn(|| {
            let module = to_ptx(&KERNELS)?;
            let folder = KERNELS.ptx_folder();
            // A module for each entry point, because the driver compiles all of a module at once.
            let modules = split(&String::from_utf8_lossy(&module)).into_iter().map(|(name, text)| {
                artifact(format!("{folder}/{name}.ptx"), ptx::compact(&text).into_bytes())
            });
            let mut all: Vec<Artifact> = modules.collect();
            // Tests load all probes at once.
            all.push(artifact("tests/probes/prebuilt/probes.precise.ptx".to_owned(), to_ptx(&PROBES)?));
            Ok::<_, Error>(all)
        });
        let spirv = [KERNELS, PROBES].map(|package| {
            let modules =
                timed(&format!("{} to SPIR-V", package.name), || spirv::modules(root, toolchain, &package))?;
            let file =
                |(entry_point, module)| (format!("{}/{entry_point}.spv", package.spirv_folder()), module);
            Ok::<_, Error>(modules.into_iter().map(file).collect::<Vec<_>>())
        });
        let ptx = ptx.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (spirv, ptx)
    });
    let ([kernels, probes], ptx) = (spirv, ptx?);
    let mut modules = [kernels?, probes?].concat();
    modules.sort();
    let mut artifacts = timed("SPIR-V, optimised,", || optimise(&modules))?;
    artifacts.extend(ptx);
    Ok(artifacts)
}

/// Optimises modules, as many at once as there are cores.
fn optimise(modules: &[(String, PathBuf)]) -> Result<Vec<Artifact>, Error> {
    let next = AtomicUsize::new(0);
    let work = || -> Result<Vec<(usize, Artifact)>, Error> {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some((name, path)) = modules.get(index) else { return Ok(done) };
            let bytes = spirv::optimised(path)?;
            done.push((index, Artifact { name: name.clone(), kind: Kind::Spirv, bytes }));
        }
    };
    let mut artifacts = thread::scope(|scope| {
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let mut all = Vec::new();
        for worker in workers {
            all.extend(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        Ok::<_, Error>(all)
    })?;
    artifacts.sort_by_key(|(index, _)| *index);
    Ok(artifacts.into_iter().map(|(_, artifact)| artifact).collect())
}

/// Runs `compile` and prints its time to standard error.
fn timed<T>(what: &str, compile: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let start = Instant::now();
    let result = compile()?;
    eprintln!("compiled {what} in {:.0} s", start.elapsed().as_secs_f64());
    Ok(result)
}
