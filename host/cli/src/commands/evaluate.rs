//! `trisect evaluate`: prints noise, bias and times of images of any renderer.

use super::data::{print_result, probe};
use crate::cli::EvaluateArgs;
use std::process::ExitCode;
use trisect::output::Outputs;
use trisect_lab::Error;
use trisect_lab::evaluate::ImageFolder;

/// Evaluates the images of a folder, and prints a table.
pub fn run(arguments: &EvaluateArgs) -> Result<ExitCode, Error> {
    let json = arguments.json.json.as_deref();
    let outputs = Outputs::default().file("--json", json);
    outputs.check()?;
    let images = ImageFolder::open(&arguments.folder, arguments.reference.as_deref())?;
    outputs.check_inputs("an image", images.files())?;
    json.map_or(Ok(()), probe)?;
    trisect::threads::start_shared(None)?;
    if arguments.frames {
        let found = images.evaluate_frames()?;
        print_result(json, || Ok(found.json()?), || found.table())?;
    } else {
        let found = images.evaluate()?;
        print_result(json, || Ok(found.json()?), || found.table())?;
    }
    Ok(ExitCode::SUCCESS)
}
