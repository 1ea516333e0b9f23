//! The program in a shell: completions, manual pages, `doctor`, JSON, colours and broken streams.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use std::process::{Command, Output};
use trisect_tests::program::{Temporary, trisect};
use trisect_tests::{binary, root};

fn printed(arguments: &[&str]) -> String {
    let output = trisect(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&printed(arguments)).unwrap()
}

/// Returns the names of all commands, as the help lists them.
fn commands() -> Vec<String> {
    let help = printed(&["help"]);
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("    "));
    names.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

#[test]
fn completions_know_each_command() {
    let all = commands();
    assert!(all.len() > 10 && all.contains(&"resume".to_owned()), "{all:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = printed(&["completions", shell]);
        for name in &all {
            assert!(script.contains(name.as_str()), "{shell}: no {name}");
        }
    }
    // Asks bash what it would offer.
    let folder = Temporary::new("shell", "completions");
    let script = folder.file("trisect.bash");
    fs::write(&script, printed(&["completions", "bash"])).unwrap();
    let ask = format!(
        "source {script}; COMP_WORDS=(trisect render --backe); COMP_CWORD=2; _trisect trisect --backe render; echo \"${{COMPREPLY[@]}}\""
    );
    let output = Command::new("bash").args(["-c", &ask]).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "--backend", "{output:?}");
}

#[test]
fn a_manual_page_each() {
    let folder = Temporary::new("shell", "man");
    let out = folder.file("man1");
    assert!(trisect(&["man", "-o", &out]).status.success());
    for name in commands().iter().filter(|name| *name != "help") {
        let page = fs::read_to_string(format!("{out}/trisect-{name}.1")).unwrap();
        assert!(page.contains(".TH") && page.contains(".SH SYNOPSIS"), "{name}");
    }
    assert!(fs::read_to_string(format!("{out}/trisect.1")).unwrap().contains("Exit codes"));
    assert!(printed(&["man"]).contains(".SH NAME"));
    assert_eq!(trisect(&["man", "-o", "/proc/nowhere"]).status.code(), Some(1));
}

#[test]
fn the_doctor_tries_what_is_here() {
    let text = printed(&["doctor"]);
    assert!(text.contains("the image is the processor's, bit for bit"), "{text}");
    let found = json(&["doctor", "--json"]);
    let found = found.as_array().unwrap();
    let state = |part: &str| {
        let of = |one: &&Value| one["part"] == part;
        found.iter().find(of).map_or("", |one| one["state"].as_str().unwrap())
    };
    assert_eq!((state("cpu 0"), state("temporary files")), ("works", "works"));
    // Each part that does not work has a remedy.
    assert!(
        found
            .iter()
            .all(|one| one["state"] == "works" || one["mend"].as_str().is_some_and(|mend| !mend.is_empty()))
    );
    let broken = Command::new(binary()).arg("doctor").env("TMPDIR", "/proc").output().unwrap();
    let text = String::from_utf8_lossy(&broken.stdout);
    assert!(
        broken.status.code() == Some(1) && text.contains("BROKEN") && text.contains("set TMPDIR"),
        "{text}"
    );
}

#[test]
fn reports_are_json_where_asked() {
    let info = json(&["info", "--json"]);
    let names: Vec<&str> =
        info["backends"].as_array().unwrap().iter().filter_map(|one| one["backend"].as_str()).collect();
    assert_eq!(names, ["cuda", "wgpu", "cpu"]);
    for backend in info["backends"].as_array().unwrap() {
        assert!(!backend["devices"].as_array().unwrap().is_empty() || backend["missing"].is_string());
    }
    let help = |name: &str| printed(&["help", name]);
    for name in ["info", "doctor", "check", "compare", "converge", "tradeoff", "bench", "view"] {
        assert!(help(name).contains("--json"), "{name}");
    }
    assert!(help("render").contains("--stats"));
}

/// Colours are printed to a terminal unless NO_COLOR is set, and never elsewhere.
#[test]
fn colours_are_for_terminals() {
    let escapes = |of: &[u8]| of.contains(&0x1b);
    assert!(!escapes(&trisect(&["render", "--nothing"]).stderr));
    let on_a_terminal = |no_color: &str| {
        let line = format!("{} render --nothing", binary().display());
        let mut command = Command::new("script");
        command.args(["-qec", &line, "/dev/null"]).env("TERM", "xterm").env_remove("NO_COLOR");
        if !no_color.is_empty() {
            command.env("NO_COLOR", no_color);
        }
        command.output()
    };
    match (on_a_terminal(""), on_a_terminal("1")) {
        (Ok(with), Ok(without)) => assert!(escapes(&with.stdout) && !escapes(&without.stdout), "{without:?}"),
        _ => eprintln!("SKIPPED: no script(1), which makes a terminal"),
    }
}

/// Runs a line of bash in which `"$0" "$@"` is the program with these arguments.
fn in_bash(line: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new("bash");
    command.args(["-c", line]).arg(binary()).args(arguments).env("NO_COLOR", "1").output().unwrap()
}

/// An image is written even if standard error or standard output refuses all data, is closed, or
/// has lost its reader.
#[test]
fn an_image_is_written_whoever_listens() {
    let folder = Temporary::new("shell", "listeners");
    let image = folder.file("image.png");
    let render =
        ["render", "--backend", "cpu", "--resolution", "8x6", "--spp", "1", "--verbose", "-o", &image];
    for line in [
        r#""$0" "$@" 2>/dev/full"#,
        r#""$0" "$@" >/dev/full 2>/dev/full"#,
        r#""$0" "$@" 2>&-"#,
        r#""$0" "$@" <&- >&- 2>&-"#,
        r#""$0" "$@" 2>&1 | true; exit ${PIPESTATUS[0]}"#,
    ] {
        let _ = fs::remove_file(&image);
        let output = in_bash(line, &render);
        assert_eq!(output.status.code(), Some(0), "{line}: {output:?}");
        assert!(fs::metadata(&image).is_ok_and(|facts| facts.len() > 0), "{line}");
    }
    // The exit code stays even if the message cannot be printed.
    let full = r#""$0" "$@" 2>/dev/full"#;
    assert_eq!(in_bash(full, &["render", "--nothing"]).status.code(), Some(2));
    assert_eq!(in_bash(full, &["render", "/nowhere.ron"]).status.code(), Some(4));
}

/// A result that cannot be printed is an error that loses no file. A reader that stops reading is
/// no error.
#[test]
fn results_that_nobody_reads() {
    let folder = Temporary::new("shell", "readers");
    let (json, out, cache) = (folder.file("bench.json"), folder.file("out"), folder.file("cache"));
    let small = ["--backend", "cpu", "--resolution", "16x9"];
    let bench = [&["bench", "--spp", "1", "--frames", "1", "--json", &json][..], &small].concat();
    let scene = root().join("scenes/cornell_box.ron");
    let lab =
        ["tradeoff", scene.to_str().unwrap(), "--knobs", "roulette", "--levels", "1", "--reference-spp"];
    let lab = [&lab[..], &["16", "--seeds", "4", "--cache", &cache, "-o", &out], &small].concat();
    let full = |arguments: &[&str]| {
        let output = in_bash(r#""$0" "$@" >/dev/full"#, arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && !text.contains("panicked"), "{arguments:?}: {text}");
        assert!(text.contains("standard output"), "{arguments:?}: {text}");
    };
    for arguments in [&bench[..], &["--help"], &["info"], &["completions", "bash"]] {
        full(arguments);
    }
    assert!(serde_json::from_str::<Value>(&fs::read_to_string(&json).unwrap()).is_ok());
    for enough in ["head -1", "true"] {
        let line = format!(r#""$0" "$@" 2>&1 | {enough}; exit ${{PIPESTATUS[0]}}"#);
        for arguments in [&lab[..], &bench, &["--help"], &["info"]] {
            let output = in_bash(&line, arguments);
            assert_eq!(output.status.code(), Some(0), "{arguments:?} | {enough}: {output:?}");
        }
    }
    assert!(fs::read_to_string(format!("{out}/report.html")).unwrap().ends_with("</html>\n"));
}

/// Mesa's layer that asks a display server for its device is disabled where there is no display.
#[test]
fn no_display_is_no_error() {
    let of = |set: &[(&str, &str)]| {
        let mut command = Command::new(binary());
        let told = ["MESA_VK_DEVICE_SELECT", "DRI_PRIME", "NODEVICE_SELECT"];
        for name in ["DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"].into_iter().chain(told) {
            command.env_remove(name);
        }
        let output = command.arg("info").envs(set.iter().copied()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    assert_eq!((of(&[]).as_str(), of(&[("XDG_RUNTIME_DIR", "")]).as_str()), ("", ""));
    // Negative control: with a display the layer stays, and prints a message where it is installed.
    if !of(&[("DISPLAY", ":987")]).contains("XDG_RUNTIME_DIR") {
        eprintln!("SKIPPED: this machine has no layer that complains");
    }
}
