//! Runs the program under mpirun.

use crate::program::Temporary;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Returns whether mpirun is available and the program was built with MPI; prints on standard error
/// why not.
///
/// # Panics
///
/// If `REQUIRE_BACKENDS` names `mpi` and one of them is missing.
pub fn available() -> bool {
    let info = crate::program::trisect(&["info"]);
    let built = String::from_utf8_lossy(&info.stdout).contains("mpi   built in");
    let reason = match (built, Command::new("mpirun").arg("--version").output()) {
        (false, _) => "the program was built without --features mpi",
        (true, Err(_)) => "mpirun was not found",
        (true, Ok(_)) => return true,
    };
    let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
    assert!(
        !required.split(',').any(|name| name.trim() == "mpi"),
        "REQUIRE_BACKENDS names mpi, but {reason}"
    );
    eprintln!("SKIPPED: {reason}");
    false
}

/// Returns an mpirun command that starts any number of ranks on any machine, also as root. Each of
/// `contexts` is a number of ranks and the program's arguments.
pub fn command(options: &[&str], contexts: &[(u32, &[&str])]) -> Command {
    let mut command = Command::new("mpirun");
    command.args(["--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]).args(options);
    // Otherwise mpirun prints its help once for each rank.
    command.env("NO_COLOR", "1").env("OMPI_MCA_orte_base_help_aggregate", "1");
    for (index, (ranks, arguments)) in contexts.iter().enumerate() {
        if index > 0 {
            command.arg(":");
        }
        command.arg("-n").arg(ranks.to_string()).arg(crate::binary()).args(*arguments);
    }
    command
}

/// Runs `ranks` ranks with the same arguments.
///
/// # Panics
///
/// If mpirun cannot be run.
pub fn run(ranks: u32, arguments: &[&str]) -> Output {
    run_each(&[(ranks, arguments)])
}

/// Runs groups of ranks, each with its own arguments.
///
/// # Panics
///
/// If mpirun cannot be run.
pub fn run_each(contexts: &[(u32, &[&str])]) -> Output {
    match command(&[], contexts).output() {
        Ok(output) => output,
        Err(error) => panic!("mpirun does not run: {error}"),
    }
}

/// A job of two ranks, the second of which can be sent signals.
pub struct Job {
    /// The mpirun process.
    child: Child,
    /// Process id of the second rank.
    pub victim: u32,
}

impl Job {
    /// Starts the job, and waits until the second rank's process exists.
    ///
    /// # Panics
    ///
    /// If it does not start.
    pub fn start(folder: &Temporary, arguments: &[&str]) -> Self {
        let note = folder.path("victim");
        let _ = std::fs::remove_file(&note);
        let mut command = command(&[], &[(1, arguments)]);
        // A shell writes its process id and is replaced by the program.
        let script = format!("echo $$ > {}.new && mv {0}.new {0} && exec \"$0\" \"$@\"", note.display());
        command.args([":", "-n", "1", "bash", "-c", &script]).arg(crate::binary()).args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = match command.spawn() {
            Ok(child) => child,
            Err(error) => panic!("mpirun does not run: {error}"),
        };
        let start = Instant::now();
        loop {
            if let Some(victim) = read_number(&note) {
                return Self { child, victim };
            }
            assert!(start.elapsed() < Duration::from_secs(20), "no second rank");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Sends the second rank a signal.
    ///
    /// # Panics
    ///
    /// If its process has ended.
    pub fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.victim.to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "rank 1 had ended before it got {name}");
    }

    /// Sends mpirun a signal.
    ///
    /// # Panics
    ///
    /// If the signal cannot be sent.
    pub fn end_by(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "mpirun had ended before it got {name}");
    }

    /// Waits for the end of the job, and returns its output and how long that took.
    ///
    /// # Panics
    ///
    /// If it does not end within a minute.
    pub fn end(mut self) -> (Output, Duration) {
        let start = Instant::now();
        while self.child.try_wait().is_ok_and(|ended| ended.is_none()) {
            if start.elapsed() > Duration::from_secs(60) {
                let _ = self.child.kill();
                panic!("the job does not end");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let took = start.elapsed();
        match self.child.wait_with_output() {
            Ok(output) => (output, took),
            Err(error) => panic!("mpirun: {error}"),
        }
    }
}

fn read_number(path: &Path) -> Option<u32> {
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}
