//! Runs each option of each command in the forms that it takes, and in forms that it refuses.
//!
//! `table` has the forms. The help of each command has its options: one without a row is a failure.
//! The exit codes are those of docs/reference/command-line.md.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod help;
mod rows;
mod table;

use help::{Listed, Options, Value};
use rows::Row;
use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use table::{BASES, COMMANDS, TABLE};
use trisect_tests::models::sliding_square;
use trisect_tests::program::{Temporary, trisect};

/// Exit code of usage errors.
const USAGE: i32 = 2;

/// Number of commands that run at a time.
const WORKERS: usize = 2;

/// Commands whose runs take longer, so that a run has as many options as it can.
const LONG: [&str; 3] = ["report", "cluster", "tradeoff"];

/// Options that exclude each other.
const EXCLUSIVE: [(&str, &str); 5] = [
    ("--resolution", "--width"),
    ("--resolution", "--height"),
    // The images to measure against have the scene's size.
    ("--against", "--width"),
    ("--against", "--height"),
    ("--against", "--resolution"),
];

/// Image, camera and sky of the scenes.
const VIEW: &str = "version: 1, image: (width: 16, height: 9, samples: 1, depth: 3), \
    camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Uniform(radiance: (1, 1, 1))";

/// Command line, and the result that it must have.
#[derive(Debug)]
struct Run {
    /// Arguments; `{n}` stands for a number that no other run has.
    arguments: Vec<String>,
    /// Exit codes, one of which is the result.
    codes: Vec<i32>,
    /// Text that standard error must have.
    word: String,
}

impl Run {
    /// Runs the program in the folder, and returns what is wrong with the result.
    fn fault(&self, folder: &Temporary, number: usize) -> Option<String> {
        let arguments: Vec<String> =
            self.arguments.iter().map(|argument| argument.replace("{n}", &number.to_string())).collect();
        let output = program(folder, &arguments);
        let told = String::from_utf8_lossy(&output.stderr);
        let is_code = output.status.code().is_some_and(|code| self.codes.contains(&code));
        let is_right = is_code && told.contains(&self.word) && !told.contains("panicked");
        let (codes, word) = (&self.codes, &self.word);
        (!is_right)
            .then(|| format!("trisect {arguments:?}: {}, not {codes:?} with {word:?}: {told}", output.status))
    }
}

fn program(folder: &Temporary, arguments: &[String]) -> Output {
    let mut command = Command::new(trisect_tests::binary());
    command.args(arguments).current_dir(folder.path("")).env("NO_COLOR", "1").stdin(Stdio::null());
    command.output().unwrap()
}

/// Returns a folder with the files that the table names.
fn folder(name: &str) -> Temporary {
    let folder = Temporary::new("option-forms", name);
    let write = |name: &str, text: &str| fs::write(folder.path(name), text).unwrap();
    let scene = format!(
        "Scene({VIEW}, materials: {{ \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }}, \
         objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"a\")])"
    );
    write("a.ron", &scene);
    write("parts.ron", &scene.replace("samples: 1", "samples: 300"));
    write("model.ron", &format!("Scene({VIEW}, materials: {{}}, objects: [Mesh(file: \"square.gltf\")])"));
    let variants = "\"extensions\":{\"KHR_materials_variants\":{\"variants\":[{\"name\":\"day\"}]}},\
        \"extensionsUsed\":[\"KHR_materials_variants\",";
    let square = sliding_square([1.0, -0.5, 0.0]);
    write("square.gltf", &square.replace("\"extensionsUsed\":[", variants));
    let pose = "(look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30)";
    write("path.ron", &format!("CameraPath(version: 1, keys: [(frame: 0, camera: {pose})])"));
    for name in ["seeds", "others"] {
        fs::create_dir(folder.path(name)).unwrap();
    }
    for files in [
        "--output=sky.pfm",
        "--output=seeds/1.pfm --seed=1",
        "--output=seeds/2.pfm --seed=2",
        "--output=others/1.pfm --seed=3",
        "--output=others/2.pfm --seed=4",
        "--output=a.png --checkpoint=done.ckpt",
    ] {
        let words = format!("render a.ron --backend=cpu {files}");
        let output = program(&folder, &split(&words));
        assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
    }
    folder
}

fn split(words: &str) -> Vec<String> {
    words.split_whitespace().map(str::to_owned).collect()
}

/// Runs the commands, and returns what is wrong with their results. `name` is that of the test.
fn faults(name: &str, runs: &[Run]) -> Vec<String> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let (next, found) = (&next, &found);
            scope.spawn(move || {
                let folder = folder(&format!("{name}-{worker}"));
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(run) = runs.get(number) else { break };
                    let fault = run.fault(&folder, number);
                    found.lock().unwrap().extend(fault);
                }
            });
        }
    });
    found.into_inner().unwrap()
}

/// Returns the options of each command of the program, by its name in `BASES`.
fn helps() -> BTreeMap<&'static str, Options> {
    let mut helps = BTreeMap::new();
    let mut left = vec![String::new()];
    while let Some(command) = left.pop() {
        let words: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        let text = String::from_utf8(trisect(&words).stdout).unwrap();
        left.extend(help::commands(&text).iter().map(|name| format!("{command} {name}").trim().to_owned()));
        let base = BASES.iter().find(|base| base.1 == command);
        let (name, ..) = base.unwrap_or_else(|| panic!("{command}: not in BASES"));
        helps.insert(*name, help::options(&text));
    }
    helps
}

/// Returns the options of a command that have no row, and the possible values that have no form.
fn gaps(command: &str, options: &Options, rows: &[Row]) -> Vec<String> {
    let mut gaps = Vec::new();
    for (option, listed) in options {
        let covering: Vec<&Row> = rows.iter().filter(|row| row.covers(command, option)).collect();
        if covering.is_empty() {
            gaps.push(format!("{command} {option}: no row"));
            continue;
        }
        let is_missing = |value: &&String| !covering.iter().any(|row| row.has(value));
        let missing = listed.possible.iter().filter(is_missing);
        gaps.extend(missing.map(|value| format!("{command} {option} {value}: no form")));
    }
    gaps
}

fn excludes(a: &str, b: &str) -> bool {
    a == b || EXCLUSIVE.contains(&(a, b)) || EXCLUSIVE.contains(&(b, a))
}

/// Returns the arguments of a command: those of its base that the context and the form permit, the
/// context and the form, which has the options named in `options`.
fn arguments(command: &str, context: &[&str], options: &[&str], form: &[String]) -> Vec<String> {
    let base = BASES.iter().find(|base| base.0 == command);
    let (_, words, defaults) = base.unwrap_or_else(|| panic!("{command}: not in BASES"));
    let name = |word: &str| word.split('=').next().unwrap_or_default().to_owned();
    let is_free = |word: &&str| {
        let default = name(word);
        !word.starts_with("--")
            || !options.iter().any(|option| excludes(option, &default))
                && !context.iter().any(|other| name(other) == default)
    };
    let mut all = split(words);
    all.extend(defaults.split_whitespace().filter(is_free).map(str::to_owned));
    for word in context {
        match all.iter_mut().find(|argument| *argument == "a.ron") {
            Some(scene) if !word.starts_with('-') => *scene = (*word).to_owned(),
            _ => all.push((*word).to_owned()),
        }
    }
    all.extend_from_slice(form);
    all
}

/// Returns the ways to write the form of this index. The forms of a row take turns between
/// `--name VALUE` and `--name=VALUE`, a single one has both, and the first one has the short name.
/// A form that shares runs has fewer ways, because each takes a run.
fn spellings(row: &Row, index: usize, listed: &Listed, shares: bool) -> Vec<Vec<String>> {
    let option = row.option;
    let short = listed.short.as_deref();
    let Some(value) = &row.accepted[index].value else {
        return [Some(option), short].into_iter().flatten().map(split).collect();
    };
    let apart = vec![option.to_owned(), value.clone()];
    let joined = vec![format!("{option}={value}")];
    let mut ways = match (listed.value, row.accepted.len()) {
        (Value::Required, 1) if !shares => vec![apart, joined],
        (Value::Required, _) if index.is_multiple_of(2) => vec![apart],
        _ => vec![joined],
    };
    if let (0, Some(short)) = (index, short) {
        ways.push(vec![short.to_owned(), value.clone()]);
        let more = [format!("{short}{value}"), format!("{short}={value}")];
        ways.extend(more.into_iter().filter(|_| !shares).map(|word| vec![word]));
    }
    ways
}

/// Returns the runs in which a command must refuse a form, beside those of a missing, empty or
/// surplus value. One command of a row has its first form as two words, too.
fn refusals(row: &Row, command: &str, listed: &Listed) -> Vec<Run> {
    let mut runs = Vec::new();
    for (index, form) in row.refused.iter().enumerate() {
        // These are refused after the start of MPI, which takes 0.4 s.
        let late = form.word.is_some() || form.codes != [USAGE];
        if command == "cluster" && row.commands.len() > 1 && late {
            continue;
        }
        let value = form.value.as_deref().unwrap_or_default();
        let mut refuse = |words: &[String], word: &str| {
            let arguments = arguments(command, &row.context, &[row.option], words);
            runs.push(Run { arguments, codes: form.codes.clone(), word: word.to_owned() });
        };
        let word = form.word.unwrap_or(row.option);
        refuse(&[format!("{}={value}", row.option)], word);
        if index == 0 && command == row.commands[0] && listed.value == Value::Required {
            // As a word of its own, -1 counts as an option, which the message names instead.
            let word = if value.starts_with('-') { "" } else { word };
            refuse(&[row.option.to_owned(), value.to_owned()], word);
        }
    }
    runs
}

/// Returns the runs in which a command must refuse an option because its value is missing, empty or
/// surplus. The empty value is left out if a row has it.
fn without_value(row: &Row, command: &str, listed: &Listed, rows: &[Row]) -> Vec<Run> {
    let is_known = rows.iter().any(|other| other.covers(command, row.option) && other.has(""));
    let empty = (!is_known).then(|| format!("{}=", row.option));
    let words: Vec<String> = match listed.value {
        Value::Absent => vec![format!("{}=1", row.option)],
        Value::Optional => empty.into_iter().collect(),
        Value::Required => [row.option.to_owned()].into_iter().chain(empty).collect(),
    };
    let run = |word: String| {
        let arguments = arguments(command, &row.context, &[row.option], &[word]);
        Run { arguments, codes: vec![USAGE], word: row.option.to_owned() }
    };
    words.into_iter().map(run).collect()
}

/// Forms that share a run.
struct Joined<'a> {
    command: &'static str,
    context: &'a [&'static str],
    options: Vec<&'static str>,
    words: Vec<String>,
}

/// Adds a form to the first run of the same command and context that has room for its option.
fn join<'a>(all: &mut Vec<Joined<'a>>, row: &'a Row, command: &'static str, words: Vec<String>) {
    let fits = |run: &&mut Joined| {
        let is_free = !run.options.iter().any(|option| excludes(option, row.option));
        run.command == command && run.context == row.context && is_free
    };
    match all.iter_mut().find(fits) {
        Some(run) => {
            run.options.push(row.option);
            run.words.extend(words);
        }
        None => all.push(Joined { command, context: &row.context, options: vec![row.option], words }),
    }
}

/// Returns the runs of all rows. Rows of options that a build without MPI lacks are named.
fn runs(rows: &[Row], helps: &BTreeMap<&str, Options>) -> Vec<Run> {
    let (mut runs, mut joined) = (Vec::new(), Vec::new());
    for (row, &command) in rows.iter().flat_map(|row| row.commands.iter().map(move |name| (row, name))) {
        let Some(listed) = helps.get(command).and_then(|options| options.get(row.option)) else {
            assert!(row.of_ranks || command == "cluster", "{command} does not list {}", row.option);
            println!("SKIPPED: {command} {}: this build does not list it", row.option);
            continue;
        };
        for (index, form) in row.accepted.iter().enumerate() {
            if form.value.as_deref() == Some("never") {
                println!("NOT RUN: {command} {}", row.option);
                continue;
            }
            let is_long = LONG.contains(&command) || row.of_ranks;
            let shares = is_long && form.codes == [0] && row.option != "--help";
            for words in spellings(row, index, listed, shares) {
                if shares {
                    join(&mut joined, row, command, words);
                    continue;
                }
                let arguments = arguments(command, &row.context, &[row.option], &words);
                runs.push(Run { arguments, codes: form.codes.clone(), word: String::new() });
            }
        }
        runs.extend(refusals(row, command, listed));
        if command == row.commands[0] {
            runs.extend(without_value(row, command, listed, rows));
        }
    }
    runs.extend(joined.iter().map(|run| {
        let arguments = arguments(run.command, run.context, &run.options, &run.words);
        Run { arguments, codes: vec![0], word: String::new() }
    }));
    runs
}

/// Each option of each command has a row, and each form of it the result that the table states.
#[test]
fn each_form_of_each_option() {
    let (rows, helps) = (rows::rows(TABLE), helps());
    let missing = |(name, options): (&&str, &Options)| gaps(name, options, &rows);
    let mut found: Vec<String> = helps.iter().flat_map(missing).collect();
    let mut runs = runs(&rows, &helps);
    runs.extend(COMMANDS.iter().map(|&(words, code, word)| Run {
        arguments: split(words),
        codes: vec![code],
        word: word.to_owned(),
    }));
    found.extend(faults("all", &runs));
    assert!(found.is_empty(), "{} of {} runs:\n{}", found.len(), runs.len(), found.join("\n"));
}

/// Negative control: an option and a value that no row has are found, and so are a form that is
/// taken but must be refused, one that is refused but must be taken, and a message without a word.
#[test]
fn faults_are_found() {
    let text = "Options:\n      --made-up <N>\n          Number\n\n  -o, --output <FILE>\n\n      \
        --sampler <SAMPLER>\n          Source\n\n          Possible values:\n          - sobol: One\n\
        \x20         - halton: Two\n";
    let options = help::options(text);
    assert_eq!(options["--output"].short.as_deref(), Some("-o"));
    let found = gaps("render", &options, &rows::rows(TABLE));
    assert_eq!(found, ["render --made-up: no row", "render --sampler halton: no form"]);
    let run = |form: &str, code: i32, word: &str| Run {
        arguments: arguments("render", &[], &["--spp"], &split(form)),
        codes: vec![code],
        word: word.to_owned(),
    };
    let wrong = [run("--spp=1", USAGE, ""), run("--spp 0", 0, ""), run("--spp=0", USAGE, "--depth")];
    assert_eq!(faults("wrong", &wrong).len(), wrong.len());
    let right = [run("--spp=1", 0, ""), run("--spp 0", USAGE, "--spp")];
    assert!(faults("right", &right).is_empty());
}
