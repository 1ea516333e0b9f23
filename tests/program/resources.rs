//! A system that refuses memory, threads, stack or long files causes an error that names the cause,
//! never a panic (101) or a signal (134, 139, 153). The program also runs without `/proc`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use trisect_tests::binary;
use trisect_tests::program::{Temporary, check_failure, within};

/// Runs the program by a line of bash, in which `"$0" "$@"` is the program with its arguments.
fn in_bash(line: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new("bash");
    command.args(["-c", line]).arg(binary()).args(arguments).env("NO_COLOR", "1");
    command.env_remove("RAYON_NUM_THREADS").output().unwrap()
}

fn render<'a>(image: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", "--backend", "cpu", "--spp", "1", "--quiet", "-o", image][..], more].concat()
}

const SMALL: [&str; 2] = ["--resolution", "64x36"];

#[test]
fn a_count_of_threads_is_one() {
    let folder = Temporary::new("resources", "count");
    let image = folder.file("a.png");
    let render = render(&image, &SMALL);
    for (value, code) in [("1000000", 2), ("-1", 2), ("many", 2), ("2", 0), ("0", 0)] {
        let line = format!(r#"RAYON_NUM_THREADS={value} exec "$0" "$@""#);
        let output = in_bash(&line, &render);
        let words: &[&str] = if code == 0 { &[] } else { &["RAYON_NUM_THREADS", "1 to 1024"] };
        check_failure(&output, &render, code, words);
    }
}

/// No thread pool has threads for all cores where one thread was asked for.
#[test]
fn one_thread_is_one_thread() {
    let folder = Temporary::new("resources", "one");
    let image = folder.file("a.png");
    // Three threads show that the count works; otherwise the first case would prove nothing.
    for threads in [1, 3] {
        let count = threads.to_string();
        let arguments =
            ["render", "--backend", "cpu", "--threads", &count, "--spp", "1000000", "--quiet", "-o", &image];
        let mut child = Command::new(binary()).args(arguments).spawn().unwrap();
        let tasks = format!("/proc/{}/task", child.id());
        let names = || {
            let folders = fs::read_dir(&tasks).into_iter().flatten().flatten();
            folders.filter_map(|task| fs::read_to_string(task.path().join("comm")).ok()).collect::<Vec<_>>()
        };
        let of = |name: &str| names().iter().filter(|task| task.starts_with(name)).count();
        let start = Instant::now();
        while of("trisect-cpu") < threads && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(50));
        let found = (of("trisect-cpu"), of("trisect-pool"), names());
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!((found.0, found.1), (threads, threads), "{:?}", found.2);
        // Beside the pools there is the main thread, and at most one that writes.
        assert!(found.2.len() <= 2 * threads + 2, "{:?}", found.2);
    }
}

#[test]
fn threads_that_are_refused() {
    let folder = Temporary::new("resources", "threads");
    let image = folder.file("a.png");
    // A copy that another user, to whom the limit applies, may read.
    let program = folder.file("trisect");
    fs::copy(binary(), &program).unwrap();
    fs::set_permissions(folder.path(""), fs::Permissions::from_mode(0o777)).unwrap();
    let line =
        r#"setpriv --reuid=65534 --regid=65534 --clear-groups bash -c 'ulimit -u 1; exec "$0" "$@"' "$@""#;
    let run = |arguments: &[&str]| in_bash(line, &[&[program.as_str()], arguments].concat());
    if run(&["--version"]).status.code() != Some(0) {
        eprintln!("SKIPPED: setpriv cannot change the user here");
        return;
    }
    let render = render(&image, &SMALL);
    let pixel = folder.file("pixel.pfm");
    fs::write(&pixel, b"Pf\n1 1\n-1.0\n\0\0\0\0").unwrap();
    for arguments in [&render[..], &["compare", &pixel, &pixel], &["doctor"]] {
        check_failure(&run(arguments), arguments, 1, &["cannot be started", "--threads", "ulimit -u"]);
    }
}

#[test]
fn a_stack_that_is_too_small_is_refused() {
    let folder = Temporary::new("resources", "stack");
    let image = folder.file("a.png");
    let render = render(&image, &SMALL);
    for limit in [64, 256, 1000] {
        let output = in_bash(&format!(r#"ulimit -s {limit}; exec "$0" "$@""#), &render);
        check_failure(&output, &render, 1, &["stack", "1 MiB", "ulimit -s"]);
    }
    let output = in_bash(r#"ulimit -s 1024; exec "$0" "$@""#, &render);
    check_failure(&output, &render, 0, &[]);
}

/// The existing image stays, and nothing of the new one is left.
#[test]
fn files_that_are_too_long_are_errors() {
    let folder = Temporary::new("resources", "length");
    let (image, checkpoint) = (folder.file("a.png"), folder.file("a.film"));
    fs::write(&image, "an earlier image").unwrap();
    let line = r#"ulimit -f 4; exec "$0" "$@""#;
    let large = ["--resolution", "320x180", "--checkpoint", &checkpoint];
    for more in [&large[..2], &large] {
        let render = render(&image, more);
        check_failure(&in_bash(line, &render), &render, 1, &["a.png", "File too large"]);
        assert_eq!(fs::read(&image).unwrap(), b"an earlier image");
        let left: Vec<_> = fs::read_dir(folder.path("")).unwrap().map(|file| file.unwrap().path()).collect();
        assert_eq!(left, [folder.path("a.png")]);
    }
    let render = render(&image, &SMALL[..0]);
    let output = in_bash(r#"exec "$0" "$@""#, &render);
    check_failure(&output, &render, 0, &[]);
}

/// Statistics are written to their path if they fit there, even if the image fits nowhere.
#[test]
fn statistics_outlive_the_image() {
    let folder = Temporary::new("resources", "statistics");
    let (image, stats) = (folder.file("a.exr"), folder.file("a.json"));
    let render = render(&image, &["--resolution", "64x36", "--stats", &stats]);
    let words = ["a.exr", "File too large", "wrote", "a.json"];
    check_failure(&in_bash(r#"ulimit -f 8; exec "$0" "$@""#, &render), &render, 1, &words);
    assert!(fs::read_to_string(&stats).unwrap().contains("\"phases\""));
    assert!(!fs::exists(&image).unwrap());
}

#[test]
fn memory_that_is_not_there_is_an_error() {
    let folder = Temporary::new("resources", "memory");
    let image = folder.file("a.png");
    let large = render(&image, &["--resolution", "1920x1080"]);
    check_failure(&within(150 << 20, &large), &large, 2, &["1920x1080", "MiB"]);
    // Whichever allocation is refused first.
    for megabytes in (60..600).step_by(90) {
        for arguments in [&large[..], &["bench", "--backend", "cpu", "--spp", "1", "--frames", "1"]] {
            let output = within(megabytes << 20, arguments);
            let code = output.status.code();
            assert!(matches!(code, Some(0..=2)), "{megabytes} MiB: {arguments:?}: {output:?}");
        }
    }
}

#[test]
fn images_of_a_few_bytes_take_no_memory() {
    let folder = Temporary::new("resources", "images");
    let (hdr, png, pfm) = (folder.file("a.hdr"), folder.file("a.png"), folder.file("a.pfm"));
    fs::write(&hdr, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 20000\n").unwrap();
    let header = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x08\x02\0\0\0\0\0\0\0";
    fs::write(&png, header).unwrap();
    // Longer than the memory, without any bytes on the disk.
    fs::File::create(&pfm).unwrap().set_len(1 << 40).unwrap();
    for (file, words) in [
        (&hdr, ["a.hdr", "20000 x 16000", "cut off"]),
        (&png, ["a.png", "65535 x 65535", "cut off"]),
        (&pfm, ["a.pfm", "4096.0 GiB", "available"]),
    ] {
        let compare = ["compare", file, file];
        check_failure(&within(1 << 30, &compare), &compare, 1, &words);
    }
    let scene = folder.file("a.ron");
    fs::write(&scene, r#"Scene(version: 1, image: (width: 8, height: 4, samples: 1), camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40), sky: Image(file: "a.hdr", scale: 1), materials: {}, objects: [])"#).unwrap();
    let image = folder.file("out.png");
    let render = render(&image, &[&scene]);
    check_failure(&within(1 << 30, &render), &render, 4, &["a.hdr", "20000 x 16000", "cut off"]);
}

#[test]
fn nothing_needs_proc() {
    let folder = Temporary::new("resources", "proc");
    let image = folder.file("a.png");
    let hidden = r#"exec unshare -m bash -c 'mount -t tmpfs none /proc && exec "$0" "$@"' "$0" "$@""#;
    if in_bash(hidden, &["--version"]).status.code() != Some(0) {
        eprintln!("SKIPPED: unshare cannot hide /proc here");
        return;
    }
    let render = render(&image, &SMALL);
    for arguments in [&render[..], &["info"], &["compare", &image, &image]] {
        check_failure(&in_bash(hidden, arguments), arguments, 0, &[]);
    }
}
