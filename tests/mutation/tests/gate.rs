//! The gate's own negative controls, on a workspace of one small crate: a mutant that no test
//! notices must not pass.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use trisect_mutation::error::Error;
use trisect_mutation::execute::Outcome;
use trisect_mutation::gate::{Finding, Gate, Verdict};
use trisect_mutation::mutant::{self, Mutant};
use trisect_mutation::report;

const LIBRARY: &str = "//! A crate to plant mutants in.
pub fn sum(a: i32, b: i32) -> i32 {
    a + b
}
#[cfg(test)]
mod tests {
    #[test]
    fn adds() {
        assert_eq!(super::sum(2, 3), 5);
    }
    #[test]
    fn notices_nothing() {
        super::sum(2, 3);
    }
    #[test]
    fn crashes() {
        if super::sum(2, 3) != 5 {
            std::process::abort();
        }
    }
    #[test]
    fn always_fails() {
        panic!();
    }
    mod absent {
        #[test]
        fn wgpu() {
            eprintln!(\"SKIPPED for Wgpu: no adapter\");
        }
    }
}
";

const INTEGRATION: &str = "#[test]
fn adds() {
    assert_eq!(victim::sum(1, 1), 2);
}
";

/// Creates a Git workspace of one crate in the test's own folder.
fn workspace(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("gate-{name}"));
    let _ = fs::remove_dir_all(&root);
    for (file, text) in [
        ("Cargo.toml", "[workspace]\n[package]\nname = \"victim\"\nedition = \"2024\"\n"),
        ("Cargo.lock", "version = 4\n[[package]]\nname = \"victim\"\nversion = \"0.0.0\"\n"),
        (".gitignore", "/target/\n"),
        ("src/lib.rs", LIBRARY),
        ("tests/outside.rs", INTEGRATION),
    ] {
        let path = root.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    assert!(Command::new("git").args(["init", "--quiet"]).arg(&root).status().unwrap().success());
    root
}

/// Returns a mutant of `a + b` that `tests` should catch.
fn mutant(replace: &str, tests: &[&str]) -> Mutant {
    Mutant {
        name: "some".into(),
        what: "Some.".into(),
        file: "src/lib.rs".into(),
        find: "a + b".into(),
        replace: replace.into(),
        hex: false,
        control: false,
        caught_by: tests.iter().map(|test| format!("victim {test}").try_into().unwrap()).collect(),
    }
}

fn gate(root: &Path, mutants: &[&Mutant], required: &[&str]) -> Result<Gate, Error> {
    let target = root.join("target");
    let required = required.iter().map(|&name| name.to_owned()).collect();
    Gate::new(root, &target.join("mutation"), &target, None, mutants, required)
}

fn missed(finding: &Finding) -> Vec<&Outcome> {
    match &finding.verdict {
        Verdict::Missed(others) => others.iter().map(|(_, outcome)| outcome).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_noticed_passes_and_nothing_else() {
    let root = workspace("verdicts");
    let tests = ["lib tests::adds", "outside adds"];
    let noticed = mutant("a - b", &tests);
    let comment = mutant("a + b // the same", &tests);
    let control = Mutant { control: true, ..comment.clone() };
    let no_control = Mutant { control: true, ..noticed.clone() };
    let half = mutant("a - b", &["lib tests::adds", "lib tests::notices_nothing"]);
    let broken = mutant("a + \"b\"", &tests);
    let crash = mutant("a - b", &["lib tests::crashes"]);
    let all = [&noticed, &comment, &control, &no_control, &half, &broken, &crash];
    let mut gate = gate(&root, &all, &[]).unwrap();
    let mut find = |mutant: &Mutant| gate.try_mutant(mutant).unwrap();

    let finding = find(&noticed);
    assert_eq!((&finding.verdict, finding.by.len()), (&Verdict::Caught, 2));
    assert!(finding.is_good());
    // Negative control: a comment is no mutant.
    let finding = find(&comment);
    assert_eq!(missed(&finding), [&Outcome::Passed, &Outcome::Passed]);
    assert!(!finding.is_good() && report::row(&comment, &finding, 4).starts_with("FAILED"));
    assert_eq!(find(&control).verdict, Verdict::Caught);
    assert_eq!(missed(&find(&no_control)), [&Outcome::Failed, &Outcome::Failed]);
    // Each named test must fail.
    let finding = find(&half);
    assert_eq!((missed(&finding), finding.by.len()), (vec![&Outcome::Passed], 1));
    // Neither a compiler's error nor a crash counts as a test's failure.
    let finding = find(&broken);
    assert!(
        matches!(&finding.verdict, Verdict::DoesNotCompile(text) if text.contains("mismatched types")
        || text.contains("cannot add")),
        "{finding:?}"
    );
    assert!(!finding.is_good());
    let finding = find(&crash);
    assert!(matches!(missed(&finding).as_slice(), [Outcome::Crashed(_)]), "{finding:?}");
    // The mutant is removed from the copy, and was never in the workspace.
    for folder in [root.clone(), root.join("target/mutation/work")] {
        assert_eq!(fs::read_to_string(folder.join("src/lib.rs")).unwrap(), LIBRARY);
    }
    assert_eq!(find(&noticed).verdict, Verdict::Caught);
}

#[test]
fn what_cannot_be_judged_is_an_error() {
    let root = workspace("errors");
    // The text does not occur, or occurs more than once.
    for (find, want) in [("a * b", 0), ("super::sum(2, 3)", 3)] {
        let mutant = Mutant { find: find.into(), ..mutant("a - b", &["lib tests::adds"]) };
        let error = gate(&root, &[&mutant], &[]).err().expect("a mutant that does not apply");
        assert!(matches!(error, Error::Text { count, .. } if count == want), "{error}");
    }
    // Tests that do not exist, or fail without the mutant.
    let nonsense = mutant("a - b", &["lib tests::adds", "lib tests::nonsense", "outside tests::adds"]);
    let error = gate(&root, &[&nonsense], &[]).err().expect("tests that are not there");
    assert!(matches!(&error, Error::NoSuchTests { tests } if tests.len() == 2), "{error}");
    let failing = mutant("a - b", &["lib tests::always_fails"]);
    let error = gate(&root, &[&failing], &[]).unwrap().try_mutant(&failing).unwrap_err();
    assert!(matches!(error, Error::Baseline { .. }) && error.to_string().contains("fails"), "{error}");
    let no_target = mutant("a - b", &["nonsense adds"]);
    assert!(matches!(gate(&root, &[&no_target], &[]), Err(Error::Tool { .. })));
    // Only one gate runs at a time.
    let mutant = mutant("a - b", &["lib tests::adds"]);
    let _first = gate(&root, &[&mutant], &[]).unwrap();
    assert!(matches!(gate(&root, &[&mutant], &[]), Err(Error::Busy { .. })));
}

#[test]
fn a_missing_backend_is_said() {
    let root = workspace("backends");
    let only = mutant("a - b", &["lib tests::absent::wgpu"]);
    let both = mutant("a - b", &["lib tests::absent::wgpu", "lib tests::adds"]);
    let mut tolerant = gate(&root, &[&only, &both], &["cpu"]).unwrap();
    let finding = tolerant.try_mutant(&only).unwrap();
    assert_eq!(finding.verdict, Verdict::Skipped("SKIPPED for Wgpu: no adapter".into()));
    let finding = tolerant.try_mutant(&both).unwrap();
    assert_eq!((&finding.verdict, finding.by.len(), finding.skipped.len()), (&Verdict::Caught, 1, 1));
    drop(tolerant);
    let mut strict = gate(&root, &[&only], &["cpu", "wgpu"]).unwrap();
    let error = strict.try_mutant(&only).unwrap_err();
    assert!(matches!(error, Error::Backend { backend: "wgpu", .. }), "{error}");
}

/// Each mutant of the project's list applies to the sources as they are. A mutant of the shared
/// crate is also caught without a GPU, because a GPU with kernels built from the faulty source
/// would agree with the CPU.
#[test]
fn the_projects_faults_apply() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mutants = mutant::read(&here.join("mutants.toml")).unwrap();
    assert!(mutants.iter().filter(|mutant| !mutant.control).count() >= 20);
    assert!(mutants.iter().any(|mutant| mutant.control), "no control");
    for mutant in &mutants {
        let source = fs::read(here.join("../..").join(&mutant.file)).unwrap();
        mutant.apply(&source).unwrap_or_else(|error| panic!("{error}"));
        let alone = mutant.caught_by.iter().any(|test| test.backend().is_none());
        assert!(alone || !mutant.file.starts_with("shared"), "{}: only a comparison catches it", mutant.name);
    }
}

/// `profile.toml` names each member of the workspace. A member that it does not name could
/// overwrite the artifact that Cargo makes without it.
#[test]
fn the_profile_names_each_member() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(here)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let profile = fs::read_to_string(here.join("profile.toml")).unwrap();
    let profile: toml::Table = toml::from_str(&profile).unwrap();
    let named = &profile["profile"]["release"]["package"];
    for package in metadata["packages"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        assert!(named.get(name).is_some(), "tests/mutation/profile.toml does not name {name}");
    }
}
