//! The mutation gate: a test suite is worth what it catches. Each mutant of a list is planted in a copy of the workspace, which is
//! compiled; each test that the list names for it must then fail, and must pass without the mutant.

pub mod build;
pub mod copy;
pub mod error;
pub mod execute;
pub mod gate;
pub mod mutant;
pub mod options;
pub mod report;
