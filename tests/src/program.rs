//! The program as people run it, and what it must say when it fails.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

/// A folder of a test's own.
///
/// # Panics
///
/// If it cannot be made.
pub fn folder(file: &str, name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("trisect-{file}-{}-{name}", std::process::id()));
    match fs::create_dir_all(&path) {
        Ok(()) => path,
        Err(error) => panic!("{}: {error}", path.display()),
    }
}

/// Runs the program.
///
/// # Panics
///
/// If it cannot be run.
pub fn trisect(arguments: &[&str]) -> Output {
    run(Command::new(crate::binary()).args(arguments))
}

/// Runs the program within `memory` bytes of address space, where there is bash to limit it. What it does before it opens a backend
/// takes one thread, and so no more than it needs.
///
/// # Panics
///
/// If it cannot be run.
pub fn within(memory: u64, arguments: &[&str]) -> Output {
    if !cfg!(target_os = "linux") {
        return trisect(arguments);
    }
    let script = format!("ulimit -v {} && exec \"$0\" \"$@\"", memory / 1024);
    run(Command::new("bash").args(["-c", &script]).arg(crate::binary()).args(arguments))
}

fn run(command: &mut Command) -> Output {
    match command.env("NO_COLOR", "1").output() {
        Ok(output) => output,
        Err(error) => panic!("the program does not run: {error}"),
    }
}

/// Checks that the program ended with `code` and said each of `words`, without a panic.
///
/// # Panics
///
/// If it did not.
pub fn check_failure(output: &Output, arguments: &[&str], code: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?}: no {word:?} in: {text}");
    }
}

/// Runs the program, which must end with `code` and say each of `words`, without a panic.
///
/// # Panics
///
/// If it does not.
pub fn fails(arguments: &[&str], code: i32, words: &[&str]) {
    check_failure(&trisect(arguments), arguments, code, words);
}

/// A folder of a test's own, which goes with it.
pub struct Temporary(PathBuf);

impl Temporary {
    /// Makes it.
    ///
    /// # Panics
    ///
    /// If it cannot be made.
    pub fn new(file: &str, name: &str) -> Self {
        Self(folder(file, name))
    }

    /// A file in it, as text.
    ///
    /// # Panics
    ///
    /// If the system's folder for temporary files has a name that is no text.
    pub fn file(&self, name: &str) -> String {
        match self.path(name).to_str() {
            Some(path) => path.to_owned(),
            None => panic!("{}: no text", self.0.display()),
        }
    }

    /// The same as a path.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Waits for a file that was written after `after`.
///
/// # Panics
///
/// If none is within two minutes.
pub fn wait_for(file: &str, after: SystemTime) {
    let start = Instant::now();
    while !fs::metadata(file).and_then(|facts| facts.modified()).is_ok_and(|time| time >= after) {
        assert!(start.elapsed() < Duration::from_secs(120), "no {file}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
