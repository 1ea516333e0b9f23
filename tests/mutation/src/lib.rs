//! The mutation gate: a test suite is worth what it catches. Each fault of a list is planted in a copy of the workspace, which is
//! compiled; each test that the list names for it must then fail, and must pass without the fault.

pub mod build;
pub mod copy;
pub mod error;
pub mod execute;
pub mod fault;
pub mod gate;
pub mod options;
pub mod report;
