//! Renders that were interrupted, killed or split have the bits of one that was not.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;
use std::time::{Duration, SystemTime};
use trisect::checkpoint::Checkpoint;
use trisect::film::Film;
use trisect_tests::program::{Temporary, check_failure, trisect, wait_for};
use trisect_tests::running::{Running, program};
use trisect_tests::{binary, root};

const IMAGE: &[&str] = &["--backend", "cpu", "--resolution", "96x54", "--spp", "1024", "--depth", "8"];

static BOOK: LazyLock<String> =
    LazyLock::new(|| root().join("scenes/rtiow_final.ron").to_str().unwrap().to_owned());

/// Arguments for more samples than anyone would wait for.
const LONG: &[&str] =
    &["--backend", "cpu", "--resolution", "96x54", "--spp", "10000000", "--depth", "8", "--every", "1ms"];

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the film of an uninterrupted render.
fn uninterrupted(folder: &Temporary) -> Film {
    let file = folder.file("whole.ckpt");
    let image = folder.file("whole.pfm");
    let output = trisect(&[&["render", &BOOK, "-o", &image, "--checkpoint", &file], IMAGE].concat());
    assert!(output.status.success(), "{}", text(&output));
    Checkpoint::read(file.as_ref()).unwrap().film
}

/// Resumes a render and interrupts it twice. Returns whether it ended without writing.
fn ends_at_once(signal: &str, file: &str) -> bool {
    let start = SystemTime::now();
    let mut running = Running::start(&mut program(&["resume", file, "--every", "1h"]));
    running.until("are in the checkpoint");
    std::thread::sleep(Duration::from_secs(3));
    let before = fs::read(file).unwrap();
    running.signal(signal);
    std::thread::sleep(Duration::from_millis(100));
    running.signal(signal);
    let output = running.end();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output));
    let wrote = text(&output).contains("wrote");
    let is_new = fs::metadata(file).unwrap().modified().unwrap() > start;
    assert!(if wrote { is_new } else { fs::read(file).unwrap() == before }, "{}", text(&output));
    !wrote
}

/// After the first SIGINT, or the SIGTERM that a batch queue sends at its time limit, the exit code
/// is 130, and image and checkpoint are written.
#[test]
fn interrupts() {
    let folder = Temporary::new("checkpoint", "interrupts");
    let whole = uninterrupted(&folder);
    for name in ["INT", "TERM"] {
        let (file, out) = (folder.file(&format!("{name}.ckpt")), folder.file(&format!("{name}.pfm")));
        let start = SystemTime::now();
        let begin = [&["render", &BOOK, "-o", &out, "--checkpoint", &file], LONG].concat();
        let running = Running::start(&mut program(&begin));
        wait_for(&file, start);
        running.signal(name);
        let output = running.end();
        assert_eq!(output.status.code(), Some(130), "{}", text(&output));
        assert!(text(&output).contains("interrupted"), "{}", text(&output));
        let found = Checkpoint::read(file.as_ref()).unwrap();
        assert!(!found.film.coverage.parts().is_empty() && fs::exists(&out).unwrap());
        // A second interrupt ends the program within a part, which takes two seconds, and the last
        // checkpoint stays as it was. Now and then the part has just ended; not five times.
        assert!((0..5).any(|_| ends_at_once(name, &file)));
    }
    // If nothing was rendered, an existing image stays.
    let (none, earlier) = (folder.file("none.ckpt"), folder.file("INT.pfm"));
    let before = fs::read(&earlier).unwrap();
    let begin = ["render", &BOOK, "-o", &earlier, "--checkpoint", &none, "--time-limit", "0.001ms"];
    let output = trisect(&[&begin[..], IMAGE].concat());
    assert!(
        output.status.code() == Some(7) && text(&output).contains("nothing was rendered"),
        "{}",
        text(&output)
    );
    assert!(fs::read(&earlier).unwrap() == before);
    // --time-limit gives exit code 7; the checkpoint is resumed until the image is complete.
    let (file, out) = (folder.file("late.ckpt"), folder.file("late.pfm"));
    let begin = ["render", &BOOK, "-o", &out, "--checkpoint", &file, "--time-limit", "1ms"];
    let output = trisect(&[&begin[..], IMAGE].concat());
    assert_eq!(output.status.code(), Some(7), "{}", text(&output));
    let output = trisect(&["resume", &file]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert_eq!(Checkpoint::read(file.as_ref()).unwrap().film, whole);
}

/// An interrupt or time limit before a goal is reached leaves the image so far.
#[test]
fn goals_end() {
    let folder = Temporary::new("checkpoint", "goals");
    let (out, stats) = (folder.file("a.pfm"), folder.file("a.json"));
    let place = ["render", &BOOK, "--backend", "cpu", "--resolution", "96x54", "-o", &out, "--stats", &stats];
    let check = |output: &Output, code: i32| {
        assert_eq!(output.status.code(), Some(code), "{}", text(output));
        assert!(!text(output).contains("--max-spp"), "{}", text(output));
        let image = trisect::image::Image::read(out.as_ref()).unwrap();
        assert!(image.pixels.iter().flatten().all(|value| value.is_finite()));
        let stats: serde_json::Value = serde_json::from_str(&fs::read_to_string(&stats).unwrap()).unwrap();
        assert_eq!((&stats["sampling"]["ended"], &stats["sampling"]["met"]), (&true.into(), &false.into()));
        fs::remove_file(&out).unwrap();
    };
    for adaptive in ["off", "on"] {
        let far = ["--target-error", "0.001%", "--max-spp", "100000000", "--adaptive", adaptive];
        check(&trisect(&[&place[..], &far, &["--time-limit", "1s"]].concat()), 7);
        for goal in [&far[..], &["--budget", "1h", "--adaptive", adaptive]] {
            let running = Running::start(&mut program(&[&place[..], goal].concat()));
            std::thread::sleep(Duration::from_secs(3));
            running.signal("INT");
            check(&running.end(), 130);
        }
    }
    // A goal that is reached in time gives exit code 0.
    let near = [&place[..], &["--target-error", "20%", "--time-limit", "1h"]].concat();
    assert_eq!(trisect(&near).status.code(), Some(0));
}

/// Four ranges of samples that are rendered separately merge to one render. Overlapping films and
/// films of another image are refused.
#[test]
fn rendered_apart() {
    let folder = Temporary::new("checkpoint", "apart");
    let whole = uninterrupted(&folder);
    let render = |name: &str, samples: &str, more: &[&str]| {
        let (file, out) = (folder.file(name), folder.file("part.pfm"));
        let fixed = ["render", &BOOK, "-o", &out, "--checkpoint", &file, "--sample-range", samples];
        let output = trisect(&[&fixed[..], IMAGE, more].concat());
        assert!(output.status.success(), "{}", text(&output));
        file
    };
    let files = ["0..256", "768..1024", "256..512", "512..768"].map(|part| render(part, part, &[]));
    let of = files.each_ref().map(String::as_str);
    let sum = folder.file("sum.ckpt");
    assert!(trisect(&[&["merge"], &of[..], &["-o", &sum]].concat()).status.success());
    assert_eq!(Checkpoint::read(sum.as_ref()).unwrap().film, whole);
    let image = folder.file("sum.pfm");
    assert!(trisect(&[&["merge"], &of[..], &["-o", &image]].concat()).status.success());
    assert_eq!(fs::read(&image).unwrap(), fs::read(folder.file("whole.pfm")).unwrap());
    // After merging two, `resume` renders the rest.
    let part = folder.file("two.ckpt");
    let two = trisect(&["merge", of[0], of[1], "-o", &part]);
    assert!(two.status.success() && text(&two).contains("samples 256 to 768"), "{}", text(&two));
    assert!(trisect(&["resume", &part, "-o", &image]).status.success());
    assert_eq!(Checkpoint::read(part.as_ref()).unwrap().film, whole);

    let refused = |files: [&str; 2], words: &[&str]| {
        let arguments = ["merge", files[0], files[1], "-o", &sum];
        check_failure(&trisect(&arguments), &arguments, 1, words);
    };
    refused([of[0], of[0]], &["samples 0 to 256 of row 0", "both"]);
    let double = render("double", "256..1024", &[]);
    refused([of[3], &double], &["samples 512 to 768"]);
    let other = render("other", "256..512", &["--seed", "6"]);
    refused([of[0], &other], &["seed is 6 in this file"]);
    // The refusals did not change the sum.
    assert_eq!(Checkpoint::read(sum.as_ref()).unwrap().film, whole);
}

/// Mistakes with checkpoints are refused: another scene, an existing file, and a goal whose samples
/// depend on each other.
#[test]
fn mistakes_are_named() {
    let folder = Temporary::new("checkpoint", "mistakes");
    let (file, out, copy) = (folder.file("a.ckpt"), folder.file("a.png"), folder.file("scene.ron"));
    fs::copy(root().join("scenes/three_spheres.ron"), &copy).unwrap();
    let small = ["--backend", "cpu", "--resolution", "16x9", "--spp", "256"];
    let begin = [&["render", &copy, "-o", &out, "--checkpoint", &file], &small[..]].concat();
    assert!(trisect(&begin).status.success());
    check_failure(&trisect(&begin), &begin, 2, &["a.ckpt", "already exists", "trisect resume"]);
    let fails = |arguments: &[&str], code: i32, words: &[&str]| {
        check_failure(&trisect(arguments), arguments, code, words);
    };
    // A checkpoint that a caller of the library began has no command to resume, and can be merged.
    let (library, sum) = (folder.file("library.ckpt"), folder.file("sum.pfm"));
    let mut checkpoint = Checkpoint::read(file.as_ref()).unwrap();
    checkpoint.header.command.clear();
    checkpoint.write(library.as_ref()).unwrap();
    fails(&["resume", &library], 1, &["library.ckpt", "no command to resume", "`trisect merge`"]);
    assert!(trisect(&["merge", &library, "-o", &sum]).status.success());
    let text = fs::read_to_string(&copy).unwrap();
    fs::write(&copy, text.replacen("0.5", "0.25", 1)).unwrap();
    fails(&["resume", &file], 1, &["a.ckpt", "scene is"]);
    fs::remove_file(&copy).unwrap();
    fails(&["resume", &file], 4, &["scene.ron"]);
    fails(&["resume", &copy], 1, &["scene.ron"]);
    fails(&["resume", &out], 1, &["a.png", "not a checkpoint"]);
    fails(&["render", "--checkpoint", &out, "-o", &out], 2, &["a.png", "name two"]);
    let new = folder.file("b.ckpt");
    fails(&["render", "--checkpoint", &new, "--budget", "1s"], 2, &["--checkpoint", "--budget"]);
    fails(&["render", "--checkpoint", &new, "--every", "often"], 2, &["--every"]);
    fails(&["render", "--sample-range", "0..256"], 2, &["--checkpoint"]);
    let split = ["render", "--checkpoint", &new, "--spp", "512", "--sample-range", "0..100", "-o", &out];
    fails(&split, 2, &["split a chunk"]);
    assert!(!fs::exists(&new).unwrap(), "what failed at once leaves nothing behind");
    fails(&["merge", &file, "-o", &folder.file("sum.gif")], 2, &["sum.gif"]);
    fails(&["render", "--checkpoint", "/nowhere/a.ckpt"], 1, &["/nowhere/a.ckpt"]);
    fails(&["render", "--checkpoint", "/dev/null"], 1, &["/dev/null", "not a regular file"]);
    fails(&["merge", &file, "-o", &file], 2, &["a.ckpt", "-o would overwrite"]);
}

/// A checkpoint from another folder does not overwrite files unless asked: neither the image that
/// it names nor the statistics.
#[test]
fn nothing_is_written_on_a_checkpoints_word() {
    let folder = Temporary::new("checkpoint", "word");
    ["own", "other"].iter().for_each(|name| fs::create_dir_all(folder.path(name)).unwrap());
    let (file, copy) = (folder.file("own/a.ckpt"), folder.file("other/a.ckpt"));
    let (out, stats) = (folder.file("other/a.png"), folder.file("other/a.json"));
    let begin = ["render", "-o", &out, "--checkpoint", &file, "--stats", &stats, "--backend", "cpu"];
    let output = trisect(&[&begin[..], &["--resolution", "16x9", "--spp", "4"]].concat());
    assert!(output.status.success(), "{}", text(&output));
    [&out, &stats].iter().for_each(|path| fs::write(path, b"mine").unwrap());
    let resume = ["resume", &file];
    check_failure(&trisect(&resume), &resume, 2, &["other/a.png", "name the image file with -o"]);
    let asked = folder.file("own/b.png");
    assert!(trisect(&["resume", &file, "-o", &asked]).status.success());
    let mine = |path: &str| fs::read(path).unwrap() == b"mine";
    assert!(mine(&out) && mine(&stats));
    // Beside its image, the checkpoint is resumed as before, with a message that names the image.
    fs::copy(&file, &copy).unwrap();
    let output = trisect(&["resume", &copy]);
    assert!(output.status.success() && text(&output).contains("the image goes to"), "{}", text(&output));
    assert!(fs::read(&out).unwrap() == fs::read(&asked).unwrap() && mine(&stats));
    // The checkpoint itself cannot be a file to write.
    let over = ["resume", &copy, "-o", &out, "--stats", &copy];
    check_failure(&trisect(&over), &over, 2, &["--checkpoint", "--stats", "name two"]);
}

/// Returns the file, in a new folder of `safe`, that the program reports to have written, and whose
/// name ends with `end`. The reported line keeps its start and its end; names as long as these are
/// cut in between.
fn elsewhere(said: &str, safe: &Path, end: &str) -> PathBuf {
    let mut lines = said.lines().filter(|line| line.starts_with("wrote ") && line.contains(end));
    let line = lines.next().unwrap_or_else(|| panic!("no {end}: {said}"));
    let folders = fs::read_dir(safe).unwrap().map(|entry| entry.unwrap().path());
    let named = folders.filter(|folder| line.contains(folder.to_str().unwrap()));
    let mut files = named.flat_map(|folder| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
    files.find(|file| file.to_str().unwrap().ends_with(end)).unwrap_or_else(|| panic!("no {end} in {line}"))
}

/// If the target folder disappears during a render, image and checkpoint are where the program
/// reports, and contain the rendered samples.
#[test]
fn a_target_that_goes() {
    let folder = Temporary::new("checkpoint", "goes");
    let (there, safe) = (folder.path("there"), folder.path("safe"));
    [&there, &safe].into_iter().for_each(|path| fs::create_dir_all(path).unwrap());
    // Names of the maximum length.
    let (file, out) = (there.join("b".repeat(249) + "a.ckpt"), there.join("b".repeat(250) + "a.pfm"));
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let begin = [&["render", &BOOK, "-o", out, "--checkpoint", file], LONG].concat();
    let start = SystemTime::now();
    let running = Running::start(program(&begin).env("TMPDIR", &safe));
    wait_for(file, start);
    fs::rename(&there, folder.path("gone")).unwrap();
    // Long enough for another part, whose checkpoint fails. A part takes about two seconds.
    std::thread::sleep(Duration::from_secs(8));
    running.signal("INT");
    let output = running.end();
    let said = text(&output);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("a.ckpt") && said.contains("a.pfm") && said.contains("tries again"), "{said}");
    let found = Checkpoint::read(&elsewhere(&said, &safe, "a.ckpt")).unwrap();
    assert!(found.film.coverage.parts()[0].samples.len() >= 256);
    assert_eq!(trisect::image::Image::read(&elsewhere(&said, &safe, "a.pfm")).unwrap().width, 96);
    // The exit code is 1, not 7, so that a script does not queue the rest: the checkpoint is
    // elsewhere.
    fs::create_dir_all(&there).unwrap();
    let limited = [&begin[..], &["--time-limit", "6s"]].concat();
    let start = SystemTime::now();
    let running = Running::start(program(&limited).env("TMPDIR", &safe));
    wait_for(file, start);
    fs::rename(&there, folder.path("gone too")).unwrap();
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
    assert!(Checkpoint::read(&elsewhere(&text(&output), &safe, "a.ckpt")).is_ok());
}

/// Two renders with one checkpoint, or two that resume one: the first to write has the file. The
/// other writes its film elsewhere and has exit code 1.
#[test]
fn two_at_once() {
    let folder = Temporary::new("checkpoint", "two");
    let (file, safe) = (folder.file("a.ckpt"), folder.path("safe"));
    fs::create_dir_all(&safe).unwrap();
    let first_loses = |first: &[&str], second: &[&str], words: &str| {
        let mut running = Running::start(program(first).env("TMPDIR", &safe));
        running.until(words);
        running.signal("STOP");
        let output = trisect(second);
        assert!(output.status.success(), "{}", text(&output));
        let before = fs::read(&file).unwrap();
        running.signal("CONT");
        let output = running.end();
        let said = text(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("another process wrote this file") && said.contains("--checkpoint"), "{said}");
        assert!(fs::read(&file).unwrap() == before, "{said}");
        let film = Checkpoint::read(&elsewhere(&said, &safe, "a.ckpt")).unwrap().film;
        assert_eq!(film, Checkpoint::read(file.as_ref()).unwrap().film);
    };
    let images = ["one.pfm", "other.pfm"].map(|name| folder.file(name));
    let render = |image| [&["render", &BOOK, "-o", image, "--checkpoint", &file], IMAGE].concat();
    first_loses(&render(&images[0]), &render(&images[1]), "96x54");
    // A checkpoint that can be resumed.
    fs::remove_file(&file).unwrap();
    let output = trisect(&[&render(&images[0])[..], &["--time-limit", "1ms"]].concat());
    assert_eq!(output.status.code(), Some(7), "{}", text(&output));
    fs::remove_dir_all(&safe).unwrap();
    fs::create_dir_all(&safe).unwrap();
    let resume = |image| ["resume", &file, "-o", image];
    first_loses(&resume(&images[0]), &resume(&images[1]), "are in the checkpoint");
}

/// On a full disk, the checkpoint is written elsewhere, and the exit code is not 0.
#[test]
fn a_full_disk() {
    let folder = Temporary::new("checkpoint", "full");
    let (small, safe) = (folder.file("small"), folder.path("safe"));
    [small.as_ref(), safe.as_path()].into_iter().for_each(|path| fs::create_dir_all(path).unwrap());
    // The checkpoint has 663 kB, the image 62 kB.
    let script = format!(
        "mount -t tmpfs -o size=200k none {small} && exec {} render {} -o {small}/a.pfm --checkpoint {small}/a.ckpt \
         --every 1ms {}",
        binary().display(),
        *BOOK,
        IMAGE.join(" ")
    );
    let mut command = Command::new("unshare");
    command.args(["-r", "-m", "sh", "-c", &script]).env("TMPDIR", &safe);
    let output = match command.output() {
        Ok(output) if !text(&output).contains("unshare") && !text(&output).contains("mount:") => output,
        other => return eprintln!("SKIPPED: no file system of its own: {other:?}"),
    };
    let said = text(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("No space left on device"), "{said}");
    let found = Checkpoint::read(&elsewhere(&said, &safe, "a.ckpt")).unwrap();
    assert_eq!(found.film, uninterrupted(&folder));
}
