//! Every command block of the tutorial and of the how-to pages runs, in order, in a folder of the
//! page's own.
//!
//! A `sh` fence is run by `bash -e` and must end with exit code 0, or with that of `exit=CODE`. A
//! fence with `file=NAME` is written to that file instead. A fence with `needs=WORD` is skipped,
//! with a message, where the machine lacks the backend or command WORD; `needs=window` opens a
//! window on a virtual screen. Fences of other languages are not run.

use super::fences::{Fence, fences};
use super::{files, name, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use trisect_tests::program::{Temporary, trisect};
use trisect_tests::{binary, root};

/// Languages of fences that readers see and no test runs: output, other systems, other files.
const SHOWN: &[&str] = &["text", "console", "powershell", "ron", "json", "python", "toml", "rust"];

/// Returns a shell in `folder` with the program on its path and `mpirun` as tests need it.
fn shell(folder: &Path) -> Command {
    let program = binary();
    let mut path = program.parent().unwrap().as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let mut command = Command::new("bash");
    command.args(["-e", "-o", "pipefail"]).current_dir(folder).env("PATH", path).env("NO_COLOR", "1");
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    command.env("OMPI_MCA_rmaps_base_oversubscribe", "1").env("OMPI_MCA_hwloc_base_binding_policy", "none");
    command
}

/// Returns whether the machine has what a fence needs.
fn has(need: &str) -> bool {
    let backend = |name: &str| {
        let info = String::from_utf8_lossy(&trisect(&["info", "--json"]).stdout).into_owned();
        info.contains(&format!("\"{name}\""))
            && trisect(&["render", "--backend", name, "--resolution", "8x8", "--spp", "1", "-o", "/dev/null"])
                .status
                .success()
    };
    match need {
        "cuda" => backend("cuda"),
        "oidn" => trisect_tests::oidn::available(),
        "gpu" => backend("cuda") || backend("wgpu"),
        tool => {
            Command::new("sh").args(["-c", &format!("command -v {tool}")]).output().unwrap().status.success()
        }
    }
}

/// Runs one fence.
fn run(fence: &Fence, folder: &Path) -> Output {
    shell(folder).args(["-c", &fence.text]).output().unwrap()
}

/// Runs a fence on a virtual screen until its window is visible, and then ends it.
#[cfg(target_os = "linux")]
fn show(fence: &Fence, folder: &Path) -> Result<(), String> {
    use std::os::unix::process::CommandExt;
    use std::time::Duration;
    use trisect_tests::desktop::Desktop;

    let desktop = Desktop::start(1280, 1024).map_err(|error| format!("Xvfb: {error}"))?;
    let log = fs::File::create(folder.join("window.txt")).map_err(|error| error.to_string())?;
    let mut child = shell(folder)
        .args(["-c", &format!("exec {}", fence.text.trim())])
        .env("DISPLAY", &desktop.name)
        .env("XDG_RUNTIME_DIR", folder)
        .env_remove("WAYLAND_DISPLAY")
        .stderr(log)
        .process_group(0)
        .spawn()
        .map_err(|error| error.to_string())?;
    let shown = desktop.window("Trisect", Duration::from_secs(60)).map_err(|error| error.to_string());
    let _ = child.kill();
    let _ = child.wait();
    shown.map(|_| ()).map_err(|error| {
        format!("{error}: {}", fs::read_to_string(folder.join("window.txt")).unwrap_or_default())
    })
}

/// Runs the blocks of a page; returns how many ran.
fn page(path: &str) -> usize {
    let folder = Temporary::new("docs", &path.replace('/', "-"));
    #[cfg(unix)]
    for shared in ["scenes", "docs"] {
        let whole = root().join(shared).canonicalize().unwrap();
        std::os::unix::fs::symlink(whole, folder.path(shared)).unwrap();
    }
    let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
    let mut count = 0;
    for fence in fences(&text(&root().join(path))) {
        let place = format!("{path}:{}", fence.line);
        if let Some(file) = fence.option("file") {
            fs::write(folder.path(file), &fence.text).unwrap();
            continue;
        }
        if fence.language() != "sh" {
            assert!(SHOWN.contains(&fence.language()), "{place}: a fence without a known language");
            continue;
        }
        if fence.text.contains("mpirun") && !trisect_tests::mpi::available() {
            continue;
        }
        match fence.option("needs") {
            #[cfg(target_os = "linux")]
            Some("window") => match show(&fence, &folder.path("")) {
                Ok(()) => count += 1,
                Err(error) if required.contains("wgpu") => panic!("{place}: {error}"),
                Err(error) => eprintln!("SKIPPED {place}: {error}"),
            },
            Some(need) if !has(need) => {
                let is_required = required.split(',').any(|name| name.trim() == need);
                assert!(!is_required, "{place}: REQUIRE_BACKENDS names {need}, which is missing");
                eprintln!("SKIPPED {place}: needs {need}");
            }
            _ => {
                let output = run(&fence, &folder.path(""));
                let said = String::from_utf8_lossy(&output.stderr);
                let wanted = fence.option("exit").map_or(0, |code| code.parse().unwrap());
                assert_eq!(output.status.code(), Some(wanted), "{place}:\n{}\n{said}", fence.text);
                assert!(!said.contains("panicked"), "{place}: {said}");
                count += 1;
            }
        }
    }
    count
}

/// Makes a test of each page, named as its file, and the list of them.
macro_rules! pages {
    ($($name:ident: $path:literal),* $(,)?) => {
        $(#[test]
        fn $name() { assert!(page($path) > 0, "no command of {} ran", $path); })*
        const PAGES: &[&str] = &[$($path),*];
    };
}

pages! {
    tutorial_first_image: "docs/tutorial/first-image.md",
    tutorial_first_scene: "docs/tutorial/first-scene.md",
    tutorial_own_model: "docs/tutorial/own-model.md",
    tutorial_first_window: "docs/tutorial/first-window.md",
    how_to_animations: "docs/how-to/animations.md",
    how_to_exposure: "docs/how-to/exposure.md",
    how_to_preview: "docs/how-to/preview.md",
    how_to_vary_a_scene: "docs/how-to/vary-a-scene.md",
    how_to_image_files: "docs/how-to/image-files.md",
    how_to_denoise: "docs/how-to/denoise.md",
    how_to_evaluate: "docs/how-to/evaluate-other-renderers.md",
    how_to_samples_and_budgets: "docs/how-to/samples-and-budgets.md",
    how_to_interrupt_and_resume: "docs/how-to/interrupt-and-resume.md",
    how_to_cluster: "docs/how-to/cluster.md",
    how_to_far_away_scenes: "docs/how-to/far-away-scenes.md",
    how_to_camera_paths: "docs/how-to/camera-paths.md",
    how_to_aovs: "docs/how-to/aovs.md",
    how_to_in_a_browser: "docs/how-to/in-a-browser.md",
    how_to_platforms: "docs/how-to/platforms.md",
}

#[test]
fn every_page_is_run() {
    // The tests of the Python module execute the notebooks and compare their pages.
    let is_notebook = |path: &String| path.starts_with("docs/tutorial/notebooks/");
    for path in files(&[".md"]).iter().map(|path| name(path)).filter(|path| !is_notebook(path)) {
        if path.starts_with("docs/tutorial/") || path.starts_with("docs/how-to/") {
            assert!(PAGES.contains(&path.as_str()), "{path} is in no test");
        }
    }
}

/// The negative control: a command that fails, and one that names an unknown option, are noticed.
#[test]
fn a_failing_command_is_noticed() {
    let folder = Temporary::new("docs", "control");
    for command in ["false\ntrue\n", "trisect render --no-such-option\n", "trisect --version | false\n"] {
        let fence = Fence { info: "sh".to_owned(), text: command.to_owned(), line: 1 };
        assert!(!run(&fence, &folder.path("")).status.success(), "{command}");
    }
}
