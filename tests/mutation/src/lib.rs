//! The mutation gate: plants each mutant of a list in a copy of the workspace and compiles the
//! copy. Each test that the list names for the mutant must then fail, and must pass without the
//! mutant.

pub mod build;
pub mod copy;
pub mod error;
pub mod execute;
pub mod gate;
pub mod mutant;
pub mod options;
pub mod report;
