//! Plants each mutant in turn and runs the tests that must catch it.

use crate::build::{Builder, Executable, Target};
use crate::copy::Copy;
use crate::error::Error;
use crate::execute::{Outcome, Run, list, run};
use crate::mutant::{Mutant, Test};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Verdict on a mutant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Each test that could run failed (or passed, for the control).
    Caught,
    /// Some tests had another outcome.
    Missed(Vec<(Test, Outcome)>),
    /// The copy does not compile with the mutant, which proves nothing about the tests.
    DoesNotCompile(String),
    /// All its tests need a backend that is missing.
    Skipped(String),
}

/// Verdict on a mutant, with the details.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The verdict.
    pub verdict: Verdict,
    /// Tests with the wanted outcome.
    pub by: Vec<Test>,
    /// Tests that did not run, each with its message.
    pub skipped: Vec<(Test, String)>,
    /// Time for compiling.
    pub build: Duration,
    /// Time for running tests, including the first run of each without a mutant.
    pub tests: Duration,
}

impl Finding {
    /// Returns whether the gate accepts this: the mutant is caught, or skipped.
    pub fn is_good(&self) -> bool {
        matches!(self.verdict, Verdict::Caught | Verdict::Skipped(_))
    }
}

/// A copy of the workspace, its tests compiled without a mutant, and their outcomes without one.
pub struct Gate {
    copy: Copy,
    builder: Builder,
    /// Backends of `REQUIRE_BACKENDS`.
    required: Vec<String>,
    /// Folder for output and for tests compiled without a mutant.
    folder: PathBuf,
    clean: BTreeMap<Target, Executable>,
    baselines: HashMap<Test, Run>,
}

/// Minimum time limit of a test with a mutant, which may make loops endless. The limit is ten times
/// the test's time without a mutant if that is longer.
const MIN_LIMIT: Duration = Duration::from_secs(30);

impl Gate {
    /// Copies the workspace at `root` to a folder in `folder` and compiles the tests of `mutants`
    /// there, with artifacts in `target_dir` and Cargo's settings in `config`.
    ///
    /// # Errors
    ///
    /// If a mutant cannot be planted, or the tests do not exist or do not compile without a mutant.
    pub fn new(
        root: &Path,
        folder: &Path,
        target_dir: &Path,
        config: Option<PathBuf>,
        mutants: &[&Mutant],
        required: Vec<String>,
    ) -> Result<Self, Error> {
        let copy = Copy::new(root, &folder.join("work"))?;
        for mutant in mutants {
            mutant.apply(&copy.read(&mutant.file)?)?;
        }
        let builder = Builder { folder: copy.folder().to_owned(), target_dir: target_dir.to_owned(), config };
        let tests = mutants.iter().flat_map(|mutant| &mutant.caught_by);
        let built = builder.build(tests).map_err(|output| Error::Tool {
            action: "compiling the tests without a mutant".to_owned(),
            output,
        })?;
        // The executables are copied, because Cargo overwrites them with each mutant.
        let mut clean = BTreeMap::new();
        let mut missing: BTreeSet<&Test> = mutants.iter().flat_map(|mutant| &mutant.caught_by).collect();
        for (target, executable) in built {
            let there = list(&executable)?;
            missing.retain(|test| {
                (&test.package, &test.target) != (&target.0, &target.1) || !there.contains(&test.name)
            });
            let path = folder.join(format!("{}-{}", target.0, target.1));
            std::fs::copy(&executable.path, &path).map_err(Error::io(&path))?;
            clean.insert(target, Executable { path, ..executable });
        }
        if !missing.is_empty() {
            return Err(Error::NoSuchTests { tests: missing.into_iter().map(Test::to_string).collect() });
        }
        Ok(Self { copy, builder, required, folder: folder.to_owned(), clean, baselines: HashMap::new() })
    }

    /// Plants `mutant`, runs its tests and removes it.
    ///
    /// # Errors
    ///
    /// If a test does not pass without the mutant, a required backend is missing, or a file cannot
    /// be written.
    pub fn try_mutant(&mut self, mutant: &Mutant) -> Result<Finding, Error> {
        let start = Instant::now();
        let mut finding = Finding {
            verdict: Verdict::Caught,
            by: Vec::new(),
            skipped: Vec::new(),
            build: Duration::ZERO,
            tests: Duration::ZERO,
        };
        let mut runnable = Vec::new();
        for test in &mutant.caught_by {
            let Run { outcome, output, time } = self.baseline(test)?;
            match outcome {
                Outcome::Passed => runnable.push((test, MIN_LIMIT.max(time * 10))),
                Outcome::Skipped(message) => finding.skipped.push((test.clone(), message)),
                other => {
                    let (test, outcome) = (test.to_string(), other.to_string());
                    return Err(Error::Baseline { test, outcome, output });
                }
            }
        }
        if runnable.is_empty() {
            let messages: Vec<&str> = finding.skipped.iter().map(|(_, message)| message.as_str()).collect();
            finding.verdict = Verdict::Skipped(messages.join("; "));
            return Ok(finding);
        }
        let source = self.copy.read(&mutant.file)?;
        self.copy.write(&mutant.file, &mutant.apply(&source)?)?;
        finding.tests += start.elapsed();
        let start = Instant::now();
        let built = self.builder.build(runnable.iter().map(|(test, _)| *test));
        finding.build = start.elapsed();
        let start = Instant::now();
        let judged = match built {
            Ok(executables) => self.judge(mutant, &executables, runnable, &mut finding),
            Err(output) => {
                finding.verdict = Verdict::DoesNotCompile(output);
                Ok(())
            }
        };
        self.copy.write(&mutant.file, &source)?;
        judged?;
        finding.tests += start.elapsed();
        Ok(finding)
    }

    /// Runs tests, each with its time limit, with the mutant planted, and sets the verdict.
    fn judge(
        &self,
        mutant: &Mutant,
        executables: &BTreeMap<Target, Executable>,
        tests: Vec<(&Test, Duration)>,
        finding: &mut Finding,
    ) -> Result<(), Error> {
        let wanted = if mutant.control { Outcome::Passed } else { Outcome::Failed };
        let mut others = Vec::new();
        for (test, limit) in tests {
            let outcome = self.run(executables, test, limit)?.outcome;
            if outcome == wanted {
                finding.by.push(test.clone());
            } else {
                others.push((test.clone(), outcome));
            }
        }
        if !others.is_empty() {
            finding.verdict = Verdict::Missed(others);
        }
        Ok(())
    }

    /// Returns the outcome of a test without a mutant, which is determined once.
    fn baseline(&mut self, test: &Test) -> Result<Run, Error> {
        if let Some(known) = self.baselines.get(test) {
            return Ok(known.clone());
        }
        let limit = Duration::from_secs(600);
        let found = self.run(&self.clean, test, limit)?;
        if let (Outcome::Skipped(message), Some(backend)) = (&found.outcome, test.backend())
            && self.required.iter().any(|name| name == backend)
        {
            return Err(Error::Backend { backend, test: test.to_string(), message: message.clone() });
        }
        self.baselines.insert(test.clone(), found.clone());
        Ok(found)
    }

    fn run(
        &self,
        executables: &BTreeMap<Target, Executable>,
        test: &Test,
        limit: Duration,
    ) -> Result<Run, Error> {
        match executables.get(&(test.package.clone(), test.target.clone())) {
            Some(executable) => run(executable, &test.name, limit, &self.folder.join("output")),
            None => Ok(Run { outcome: Outcome::Missing, output: String::new(), time: Duration::ZERO }),
        }
    }
}
