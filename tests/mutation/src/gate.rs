//! Plants each mutant in turn and runs the tests that must notice.

use crate::build::{Builder, Executable, Target};
use crate::copy::Copy;
use crate::error::Error;
use crate::execute::{Outcome, Run, list, run};
use crate::mutant::{Mutant, Test};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What came of one mutant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Each test that could run failed (or, for a control, passed).
    Caught,
    /// Some test did not do what it must.
    Missed(Vec<(Test, Outcome)>),
    /// With the mutant, it does not compile: that says nothing about the tests.
    DoesNotCompile(String),
    /// All its tests need a backend that is missing.
    Skipped(String),
}

/// A mutant's verdict, and what it rests on.
#[derive(Clone, Debug)]
pub struct Finding {
    /// What came of it.
    pub verdict: Verdict,
    /// The tests that did what they must.
    pub by: Vec<Test>,
    /// Tests that did not run, each with what it said.
    pub skipped: Vec<(Test, String)>,
    /// For compiling.
    pub build: Duration,
    /// For running tests.
    pub tests: Duration,
}

impl Finding {
    /// Whether the gate may open.
    pub fn is_good(&self) -> bool {
        matches!(self.verdict, Verdict::Caught | Verdict::Skipped(_))
    }
}

/// A copy of the workspace, its tests compiled without a mutant, and what is known about them.
pub struct Gate {
    copy: Copy,
    builder: Builder,
    /// Of `REQUIRE_BACKENDS`.
    required: Vec<String>,
    /// For compiled tests without a mutant, and output.
    folder: PathBuf,
    clean: BTreeMap<Target, Executable>,
    baselines: HashMap<Test, Run>,
}

/// Longer than any test takes; a mutant may make loops endless.
const MIN_LIMIT: Duration = Duration::from_secs(30);

impl Gate {
    /// Copies the workspace at `root` to a folder in `folder` and compiles the tests of `mutants` there, with artifacts in
    /// `target_dir` and Cargo's settings in `config`.
    ///
    /// # Errors
    ///
    /// If a mutant cannot be planted, or the tests do not compile without one, or are not there.
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
        // Kept aside: Cargo overwrites them with each mutant.
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

    /// Plants `mutant`, runs its tests and takes it out again.
    ///
    /// # Errors
    ///
    /// If a test does not pass without the mutant, a required backend is missing, or a file cannot be written.
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

    /// Runs tests, each with its time limit, with the mutant planted.
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

    /// How the test ends without a mutant.
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
