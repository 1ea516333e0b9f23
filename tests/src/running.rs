//! The program as a running process, which tests interrupt or kill.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use std::io::Read;
use std::process::{Child, Command, Output, Stdio};

/// Returns a command that runs the program with these arguments.
pub fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(crate::binary());
    command.args(arguments);
    command
}

/// A running process; it is killed on drop.
pub struct Running(Option<Child>);

impl Running {
    /// Starts the process; its standard error can be read later.
    ///
    /// # Panics
    ///
    /// If it cannot be started.
    pub fn start(command: &mut Command) -> Self {
        Self(Some(command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()))
    }

    /// Reads standard error until `words` occur.
    ///
    /// # Panics
    ///
    /// If standard error ends without them.
    pub fn until(&mut self, words: &str) {
        let mut said = String::new();
        let out = self.0.as_mut().unwrap().stderr.as_mut().unwrap();
        while !said.contains(words) {
            let mut byte = [0];
            assert!(out.read(&mut byte).unwrap() > 0, "ended without {words:?}: {said}");
            said.push(byte[0] as char);
        }
    }

    /// Sends a signal, such as `TERM`.
    ///
    /// # Panics
    ///
    /// If the signal cannot be sent.
    pub fn signal(&self, name: &str) {
        let id = self.0.as_ref().unwrap().id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    /// Kills the process as `kill -9` does, and returns whether it was still running.
    ///
    /// # Panics
    ///
    /// If the system does not report the state of the process.
    pub fn kill(mut self) -> bool {
        let mut child = self.0.take().unwrap();
        let going = child.try_wait().unwrap().is_none();
        let _ = child.kill();
        child.wait().unwrap();
        going
    }

    /// Waits for the end of the process, and returns its output.
    ///
    /// # Panics
    ///
    /// If the output cannot be read.
    pub fn end(mut self) -> Output {
        self.0.take().unwrap().wait_with_output().unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
