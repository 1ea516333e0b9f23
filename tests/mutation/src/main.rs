//! `cargo mutation-gate`: see `tests/mutation/README.md`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use trisect_mutation::copy::git;
use trisect_mutation::error::Error;
use trisect_mutation::gate::{Gate, Verdict};
use trisect_mutation::mutant::{self, Mutant};
use trisect_mutation::options::{Options, USAGE};
use trisect_mutation::report;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    match Options::parse(arguments).and_then(|options| run(&options)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Runs the gate and returns whether each mutant that was run was caught.
fn run(options: &Options) -> Result<bool, Error> {
    let start = Instant::now();
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.join("../..");
    let root = root.canonicalize().map_err(Error::io(&root))?;
    let mutants = mutant::read(&here.join("mutants.toml"))?;
    let names: Vec<&str> = mutants.iter().map(|mutant| mutant.name.as_str()).collect();
    let chosen = options.choose(&names, seed(&root))?;
    let chosen: Vec<&Mutant> = chosen.into_iter().map(|i| &mutants[i]).collect();
    if options.list {
        chosen.iter().for_each(|mutant| print!("{}", report::describe(mutant)));
        return Ok(true);
    }
    let target = target_dir()?;
    let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
    let required = required.split(',').map(|name| name.trim().to_owned()).collect();
    println!("compiling the tests without a mutant");
    let config = here.join("profile.toml");
    let mut gate = Gate::new(&root, &target.join("mutation"), &target, Some(config), &chosen, required)?;
    println!("{:.1} s; running the mutants:\n", start.elapsed().as_secs_f64());
    // The time limit excludes this compilation, which could use all of it on a busy machine.
    let begin = Instant::now();

    let width = names.iter().map(|name| name.len()).max().unwrap_or_default();
    println!("{}", report::head(width));
    let (mut caught, mut failed, mut skipped, mut late) = (0, Vec::new(), Vec::new(), Vec::new());
    for mutant in &chosen {
        let name = mutant.name.as_str();
        if options.seconds.is_some_and(|seconds| begin.elapsed().as_secs() >= seconds) {
            late.push(name);
            continue;
        }
        let finding = gate.try_mutant(mutant)?;
        println!("{}", report::row(mutant, &finding, width));
        match &finding.verdict {
            Verdict::Skipped(_) => skipped.push(name),
            _ if !finding.is_good() => failed.push(name),
            _ => caught += usize::from(!mutant.control),
        }
    }
    let tried = caught + failed.len();
    println!("\n{caught} of {tried} mutants caught, in {:.0} s", start.elapsed().as_secs_f64());
    for (what, names) in [
        ("skipped, as their backend is missing", &skipped),
        ("not run before the time limit", &late),
        ("FAILED", &failed),
    ] {
        if !names.is_empty() {
            println!("{} {what}: {}", names.len(), names.join(", "));
        }
    }
    Ok(failed.is_empty())
}

/// Returns the target folder that this program was compiled in, which also has the artifacts of
/// other crates.
fn target_dir() -> Result<PathBuf, Error> {
    let program = std::env::current_exe().map_err(Error::io("this program"))?;
    match program.ancestors().nth(2) {
        Some(folder) => Ok(folder.to_owned()),
        None => Err(Error::Usage(format!("{} is not in a target folder of Cargo", program.display()))),
    }
}

/// Returns a number from the commit, so that time-limited runs of successive commits try different
/// mutants.
fn seed(root: &Path) -> usize {
    let commit = git(root, &["rev-parse", "--short=7", "HEAD"]).unwrap_or_default();
    usize::from_str_radix(commit.trim(), 16).unwrap_or_default()
}
