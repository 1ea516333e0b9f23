//! What a torture test found, in lines that `docs/accuracy.md` is made of.

use crate::Subject;

/// How a backend stands to a torture test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It meets the test as stated.
    Passed,
    /// It meets a weaker, measured bound; the figure says which and by what rule.
    Bounded,
}

/// Prints the line of test `number` (of the list in `docs/accuracy.md`): number, backend, device, outcome, figure.
pub fn report(number: u32, subject: Subject, outcome: Outcome, figure: impl AsRef<str>) {
    let outcome = match outcome {
        Outcome::Passed => "passed",
        Outcome::Bounded => "bounded",
    };
    println!("TORTURE {number:02} | {subject:?} | {} | {outcome} | {}", subject.device(), figure.as_ref());
}
