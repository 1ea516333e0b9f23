//! `trisect check`: prints the parts of a scene that are outside the supported range, and writes a
//! copy of the scene in its best space.

use crate::cli::CheckArgs;
use crate::terminal::escaped;
use std::fmt::Write;
use std::process::ExitCode;
use trisect::image::ImageError;
use trisect::output::Outputs;
use trisect::precision::{self, Change, Report};
use trisect::render::Settings;
use trisect::scene::{Rebase, SceneDocument};
use trisect_lab::Error;

/// Exit code if something in the scene is outside the supported range.
const OUTSIDE: u8 = 6;

/// Prints the findings, and writes a copy in the best space if `--write` is given.
pub fn run(arguments: &CheckArgs) -> Result<ExitCode, Error> {
    let json = arguments.json.json.as_deref();
    let outputs = Outputs::default().file("--json", json).file("--write", arguments.write.as_deref());
    outputs.check()?;
    Outputs::default().file("--json", json).check_inputs("the scene", [&arguments.scene])?;
    let mut scene = SceneDocument::load_with(&arguments.scene, &arguments.load.options())?;
    scene.choose_camera(&arguments.camera.choice())?;
    let report = precision::check(&scene, &scene.image);
    // Error with which a render would refuse the scene, such as a sky that is not a number.
    // Findings outside the range are printed first, because they may be its cause.
    let lowered = scene.clone().lower(Rebase::IDENTITY).map(drop).map_err(Error::from);
    let refused = lowered.and_then(|()| Ok(Settings::from(scene.image).check()?)).err();
    let outside = report.is_outside();
    let refused = match refused {
        Some(error) if !outside => return Err(error),
        refused => refused,
    };
    if let Some(path) = &arguments.write {
        let files = scene.description.files.iter().filter(|file| **file != arguments.scene);
        outputs.check_inputs("a file of the scene", files)?;
        let camera = scene.description.cameras.first().map(|(_, camera)| *camera);
        let change = match camera.filter(|_| arguments.camera.is_given()) {
            Some(camera) => Change::Camera(camera),
            None => Change::Space(report.best_space),
        };
        precision::write(&arguments.scene, &scene, change, path)?;
    }
    // Changes by the reader and losses by rounding are warnings in addition to the findings.
    let denied = super::warn(&scene.warnings(), &scene.name, arguments.deny_warnings);
    let json_text = || {
        let codec = |message| ImageError::Codec { path: arguments.scene.clone(), message };
        let json = serde_json::to_string_pretty(&report).map_err(|error| codec(error.to_string()))?;
        Ok(json + "\n")
    };
    super::data::print_result(json, json_text, || escaped(&text(&report)).into_owned())?;
    if let Some(path) = &arguments.write {
        super::eprint(&format!("wrote {}", path.display()));
    }
    match refused {
        Some(error) => Err(error),
        None => denied.map(|()| if outside { ExitCode::from(OUTSIDE) } else { ExitCode::SUCCESS }),
    }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    let extent = &report.extent;
    let _ = writeln!(text, "{}", report.scene);
    if let (Some(low), Some(high)) = (extent.low, extent.high) {
        let _ = writeln!(text, "all of it     {low} to {high}");
    }
    let _ = writeln!(text, "what matters  {} ± {}", extent.center, extent.radius);
    if let Some(eye) = extent.eye {
        let _ = writeln!(text, "eye           {eye}");
    }
    let _ = writeln!(text, "space         origin {}, scale {:?}", report.space.origin, report.space.scale);
    let best = report.best_space;
    let _ = match best == report.space {
        true => writeln!(text, "best space    this one"),
        false => writeln!(text, "best space    origin {}, scale {:?}", best.origin, best.scale),
    };
    let _ = writeln!(
        text,
        "accumulation  a pixel's mean is off by at most {:.1e} of itself",
        report.accumulation
    );
    for finding in &report.findings {
        let _ = write!(text, "\n{finding}");
    }
    for (limit, count) in &report.more {
        let _ = writeln!(text, "\n{}: {count} more", limit.title());
    }
    if report.findings.is_empty() {
        text += "nothing outside the supported range\n";
    } else if !report.is_outside() {
        text += "\nnothing outside the supported range but for notes\n";
    }
    text
}
