//! The program under mpirun.

use crate::program::Temporary;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Whether mpirun is there and the program was built with MPI; says on standard error why not.
///
/// # Panics
///
/// If `REQUIRE_BACKENDS` names `mpi` and one of both is missing.
pub fn available() -> bool {
    let info = crate::program::trisect(&["info"]);
    let built = String::from_utf8_lossy(&info.stdout).contains("mpi   built in");
    let reason = match (built, Command::new("mpirun").arg("--version").output()) {
        (false, _) => "the program was built without --features mpi",
        (true, Err(_)) => "there is no mpirun",
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

/// mpirun with what tests need: any number of ranks on any machine, as root, too. Each of `contexts` is so many ranks and the program's arguments.
pub fn command(options: &[&str], contexts: &[(u32, &[&str])]) -> Command {
    let mut command = Command::new("mpirun");
    command.args(["--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]).args(options);
    // Its own help goes unasked otherwise, once for each rank.
    command.env("NO_COLOR", "1").env("OMPI_MCA_orte_base_help_aggregate", "1");
    for (index, (ranks, arguments)) in contexts.iter().enumerate() {
        if index > 0 {
            command.arg(":");
        }
        command.arg("-n").arg(ranks.to_string()).arg(crate::binary()).args(*arguments);
    }
    command
}

/// Runs so many ranks with the same arguments.
///
/// # Panics
///
/// If mpirun cannot be run.
pub fn run(ranks: u32, arguments: &[&str]) -> Output {
    run_each(&[(ranks, arguments)])
}

/// Runs ranks with arguments of their own.
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

/// A job of two ranks of which the second one's process is known.
pub struct Job {
    /// mpirun.
    child: Child,
    /// The second rank's process.
    pub victim: u32,
}

impl Job {
    /// Starts it, and waits until the second rank's process is there.
    ///
    /// # Panics
    ///
    /// If it does not start.
    pub fn start(folder: &Temporary, arguments: &[&str]) -> Self {
        let note = folder.path("victim");
        let _ = std::fs::remove_file(&note);
        let mut command = command(&[], &[(1, arguments)]);
        // A shell notes its number and becomes the program.
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
    /// If it is not there any more.
    pub fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.victim.to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "rank 1 had ended before it got {name}");
    }

    /// Sends mpirun a signal.
    ///
    /// # Panics
    ///
    /// If it is not there any more.
    pub fn end_by(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "mpirun had ended before it got {name}");
    }

    /// Waits for the job's end, and says how long that took.
    ///
    /// # Panics
    ///
    /// If it does not end within a minute.
    pub fn end(mut self) -> (Output, Duration) {
        let start = Instant::now();
        while self.child.try_wait().is_ok_and(|ended| ended.is_none()) {
            if start.elapsed() > Duration::from_secs(60) {
                let _ = self.child.kill();
                panic!("the job goes on");
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
