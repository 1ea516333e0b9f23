//! Runs the program and checks its failures; temporary folders and files for such tests.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

/// Creates a temporary folder for a test.
///
/// # Panics
///
/// If it cannot be created.
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

/// Runs the program within `memory` bytes of address space on Linux, and without a limit elsewhere.
/// Until it opens a backend, the program has one thread, so no stacks of further threads count.
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

/// Checks that the program ended with `code`, that standard error has each of `words`, and that it
/// did not panic.
///
/// # Panics
///
/// If any of this is not so.
pub fn check_failure(output: &Output, arguments: &[&str], code: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?}: no {word:?} in: {text}");
    }
}

/// Runs the program, which must end with `code`, with each of `words` on standard error and without
/// a panic.
///
/// # Panics
///
/// If it does not.
pub fn fails(arguments: &[&str], code: i32, words: &[&str]) {
    check_failure(&trisect(arguments), arguments, code, words);
}

/// A test's temporary folder, which is removed on drop.
pub struct Temporary(PathBuf);

impl Temporary {
    /// Creates the folder.
    ///
    /// # Panics
    ///
    /// If it cannot be created.
    pub fn new(file: &str, name: &str) -> Self {
        Self(folder(file, name))
    }

    /// Returns the path of a file in the folder, as text.
    ///
    /// # Panics
    ///
    /// If the system's folder for temporary files has a name that is not UTF-8.
    pub fn file(&self, name: &str) -> String {
        match self.path(name).to_str() {
            Some(path) => path.to_owned(),
            None => panic!("{}: not UTF-8", self.0.display()),
        }
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Waits until a file has been written after `after`.
///
/// # Panics
///
/// If it has not been written within two minutes.
pub fn wait_for(file: &str, after: SystemTime) {
    let start = Instant::now();
    while !fs::metadata(file).and_then(|facts| facts.modified()).is_ok_and(|time| time >= after) {
        assert!(start.elapsed() < Duration::from_secs(120), "no {file}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
