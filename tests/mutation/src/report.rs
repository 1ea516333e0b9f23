//! The gate's printed report.

use crate::gate::{Finding, Verdict};
use crate::mutant::{Mutant, Test};

/// Returns a row of the table: verdict, mutant, seconds for compiling and for tests, and the tests
/// that caught it. Further lines state skipped tests and failures.
pub fn row(mutant: &Mutant, finding: &Finding, width: usize) -> String {
    let word = match &finding.verdict {
        Verdict::Caught if mutant.control => "passes",
        Verdict::Caught => "caught",
        Verdict::Missed(_) | Verdict::DoesNotCompile(_) => "FAILED",
        Verdict::Skipped(_) => "SKIPPED",
    };
    let mut by = finding.by.iter().map(short).collect::<Vec<_>>().join(", ");
    if by.is_empty() {
        by = "-".to_owned();
    }
    let (build, tests) = (finding.build.as_secs_f64(), finding.tests.as_secs_f64());
    let mut text = format!("{word:7}  {:width$}  {build:5.1}  {tests:5.1}  {by}", mutant.name);
    for (test, message) in &finding.skipped {
        text += &format!("\n         skipped: {test}: {message}");
    }
    match &finding.verdict {
        Verdict::Missed(others) => {
            for (test, outcome) in others {
                text += &format!("\n         {test} {outcome}; {}", mutant.what);
            }
        }
        Verdict::DoesNotCompile(output) => {
            text += &format!("\n         does not compile with the mutant:\n{output}");
        }
        Verdict::Caught | Verdict::Skipped(_) => {}
    }
    text
}

/// Returns the head of the table.
pub fn head(width: usize) -> String {
    format!("{:7}  {:width$}  {:>5}  {:>5}  by", "", "mutant", "build", "tests")
}

/// Returns a test's target and name; the package instead of the target for unit tests.
fn short(test: &Test) -> String {
    let target = if test.target == "lib" { &test.package } else { &test.target };
    format!("{target} {}", test.name)
}

/// Returns the description of a mutant for `--list`.
pub fn describe(mutant: &Mutant) -> String {
    let mut text = format!("{}: {}\n    {}\n", mutant.name, mutant.what, mutant.file.display());
    for test in &mutant.caught_by {
        text += &format!("    {} {test}\n", if mutant.control { "leaves" } else { "caught by" });
    }
    text
}
