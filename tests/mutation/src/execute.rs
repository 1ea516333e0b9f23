//! Runs single tests.

use crate::build::Executable;
use crate::error::Error;
use std::collections::HashSet;
use std::fmt;
use std::fs::{self, File};
use std::io;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Outcome of a test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The test passed.
    Passed,
    /// The test failed.
    Failed,
    /// The test did not run, because a backend is missing; with its message.
    Skipped(String),
    /// The process ended in another way than by passing or failing; with its exit status.
    Crashed(String),
    /// The test exceeded its time limit.
    TimedOut,
    /// The target has no test of this name.
    Missing,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Passed => write!(f, "passes"),
            Self::Failed => write!(f, "fails"),
            Self::Skipped(message) => write!(f, "is skipped ({message})"),
            Self::Crashed(how) => write!(f, "crashes ({how})"),
            Self::TimedOut => write!(f, "does not end"),
            Self::Missing => write!(f, "does not exist"),
        }
    }
}

/// Outcome of a test, and what it printed.
#[derive(Clone, Debug)]
pub struct Run {
    /// Outcome.
    pub outcome: Outcome,
    /// Standard output and standard error.
    pub output: String,
    /// Duration.
    pub time: Duration,
}

/// Longest wait for an executable that another process still has open for writing.
const BUSY_LIMIT: Duration = Duration::from_secs(10);

/// Calls `start` again as long as the executable is open for writing. A process that another thread
/// forked while the executable was copied holds it open until it becomes another program.
fn when_not_busy<T>(mut start: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    let first = Instant::now();
    loop {
        match start() {
            Err(error)
                if error.kind() == io::ErrorKind::ExecutableFileBusy && first.elapsed() < BUSY_LIMIT =>
            {
                std::thread::sleep(Duration::from_millis(5));
            }
            other => return other,
        }
    }
}

/// Returns the names of all tests of `executable`.
///
/// # Errors
///
/// If it cannot be run.
pub fn list(executable: &Executable) -> Result<HashSet<String>, Error> {
    let mut list = Command::new(&executable.path);
    list.arg("--list").current_dir(&executable.folder);
    let output = when_not_busy(|| list.output()).map_err(Error::io(&executable.path))?;
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.lines().filter_map(|line| Some(line.strip_suffix(": test")?.to_owned())).collect())
}

/// Runs test `name` of `executable`, for at most `limit`. `scratch` is a file for its output.
///
/// # Errors
///
/// If it cannot be started.
pub fn run(executable: &Executable, name: &str, limit: Duration, scratch: &Path) -> Result<Run, Error> {
    let output = File::create(scratch).map_err(Error::io(scratch))?;
    let same = output.try_clone().map_err(Error::io(scratch))?;
    let start = Instant::now();
    let mut command = Command::new(&executable.path);
    command
        .args(["--exact", name, "--nocapture", "--color", "never"])
        // A missing backend must be reported as skipped, and not fail like a caught mutant; and
        // tests must use the copy's scenes.
        .env_remove("REQUIRE_BACKENDS")
        .env_remove("TRISECT_ROOT")
        // Tests of the command line would run a program that was compiled without the mutant.
        .env("TRISECT_BIN", "the mutation gate compiles no program")
        .current_dir(&executable.folder)
        .stdin(Stdio::null())
        .stdout(output)
        .stderr(same);
    let mut child = when_not_busy(|| command.spawn()).map_err(Error::io(&executable.path))?;
    let status = loop {
        match child.try_wait().map_err(Error::io(&executable.path))? {
            Some(status) => break Some(status),
            None if start.elapsed() > limit => {
                // It may have ended in the meantime.
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let time = start.elapsed();
    let output = fs::read(scratch).map_err(Error::io(scratch))?;
    let output = String::from_utf8_lossy(&output).into_owned();
    Ok(Run { outcome: status.map_or(Outcome::TimedOut, |status| outcome(status, &output)), output, time })
}

/// Derives the outcome by libtest's rules: a failure has exit code 101 and a result line.
fn outcome(status: ExitStatus, output: &str) -> Outcome {
    let says = |text: &str| output.lines().any(|line| line.starts_with(text));
    match status.code() {
        Some(0) if !says("running 1 test") => Outcome::Missing,
        // On a machine of one core the message follows "test a ... " on the same line.
        Some(0) => match output.lines().find_map(|line| line.find("SKIPPED for ").map(|at| &line[at..])) {
            Some(message) => Outcome::Skipped(message.to_owned()),
            None => Outcome::Passed,
        },
        Some(101) if says("test result: FAILED. 0 passed; 1 failed") => Outcome::Failed,
        _ => Outcome::Crashed(status.to_string()),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;

    #[test]
    fn an_executable_that_is_open_for_writing_is_waited_for() {
        let path = std::env::temp_dir().join(format!("trisect-busy-{}", std::process::id()));
        fs::copy("/bin/true", &path).unwrap();
        let open = File::options().append(true).open(&path).unwrap();
        let start = || Command::new(&path).status();
        // Negative control: without waiting it does not start.
        assert_eq!(start().unwrap_err().kind(), io::ErrorKind::ExecutableFileBusy);
        let closed = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            drop(open);
        });
        assert!(when_not_busy(start).unwrap().success());
        closed.join().unwrap();
        fs::remove_file(&path).unwrap();
    }

    #[test]
    fn outcomes() {
        let ended = |code: i32, output: &str| outcome(ExitStatus::from_raw(code << 8), output);
        assert_eq!(ended(0, "\nrunning 1 test\ntest a ... ok\n"), Outcome::Passed);
        assert_eq!(ended(0, "\nrunning 0 tests\n"), Outcome::Missing);
        let skipped = "running 1 test\nSKIPPED for Wgpu: none\ntest a::wgpu ... ok\n";
        assert_eq!(ended(0, skipped), Outcome::Skipped("SKIPPED for Wgpu: none".into()));
        // A skipped scene is no missing backend.
        assert_eq!(ended(0, "running 1 test\nSKIPPED mesh.ron: not generated\n"), Outcome::Passed);
        assert_eq!(ended(101, "running 1 test\ntest result: FAILED. 0 passed; 1 failed;"), Outcome::Failed);
        assert!(matches!(ended(101, "thread main panicked"), Outcome::Crashed(_)));
        let killed = outcome(ExitStatus::from_raw(11), "running 1 test\n");
        assert!(matches!(killed, Outcome::Crashed(_)));
    }
}
