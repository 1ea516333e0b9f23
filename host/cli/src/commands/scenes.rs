//! `trisect render` of one scene or several: one after another, each to files of its own.

use super::signals::INTERRUPTED;
use super::{dispatch, eprint};
use crate::cli::{DEFAULT_OUTPUT, JobArgs, RenderArgs};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trisect::error::MotionError;
use trisect::output::{ConflictError, Outputs, is_stdout};
use trisect::scene::SceneDocument;
use trisect_lab::Error;

/// Part of a file's name in whose place the scene's name stands.
const SCENE: &str = "{scene}";

/// Renders all scenes of a command. One that fails does not keep the others from being rendered;
/// the exit code is that of the first failure.
pub fn render(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    let has_name = |path: &Path| path.to_str().is_some_and(|text| text.contains(SCENE));
    let is_named = has_name(&arguments.output) || arguments.log.stats.as_deref().is_some_and(has_name);
    if arguments.more.is_empty() && !(is_named && arguments.job.scene.is_some()) {
        return dispatch::render(arguments);
    }
    let commands = commands(arguments)?;
    check_inputs(&commands)?;
    let mut first_failure = ExitCode::SUCCESS;
    for command in &commands {
        let code = match dispatch::render(command) {
            Ok(code) => code,
            Err(error) => {
                eprint(&format!("error: {error}"));
                ExitCode::from(error.exit_code())
            }
        };
        if first_failure == ExitCode::SUCCESS {
            first_failure = code;
        }
        if code == ExitCode::from(INTERRUPTED as u8) {
            break;
        }
    }
    Ok(first_failure)
}

/// Returns the command of each scene.
fn commands(arguments: &RenderArgs) -> Result<Vec<RenderArgs>, Error> {
    let checkpointing = &arguments.checkpointing;
    let one = [
        ("--distribute", arguments.cluster.distribute.is_some()),
        ("--checkpoint", checkpointing.checkpoint.is_some()),
        ("standard output", is_stdout(&arguments.output)),
    ];
    let several = !arguments.more.is_empty();
    if let Some((what, _)) = one.into_iter().find(|(_, given)| *given && several) {
        let remedy = "start a command for each scene";
        return Err(MotionError::Beside { what, with: "several scenes", remedy }.into());
    }
    let is_json = |scene: &&PathBuf| scene.extension().is_some_and(|of| of == "json");
    if let Some(scene) = arguments.more.iter().find(is_json) {
        return Err(ConflictError::NoScene { path: scene.clone() }.into());
    }
    let output = match arguments.output == Path::new(DEFAULT_OUTPUT) {
        true => PathBuf::from(format!("{SCENE}.png")),
        false => arguments.output.clone(),
    };
    let scenes = arguments.job.scene.iter().chain(&arguments.more);
    let mut commands: Vec<RenderArgs> = Vec::new();
    for scene in scenes {
        let stats = arguments
            .log
            .stats
            .as_deref()
            .map(|path| named(path, scene, arguments.log.stats_option))
            .transpose()?;
        let mut command = RenderArgs {
            job: JobArgs { scene: Some(scene.clone()), ..arguments.job.clone() },
            more: Vec::new(),
            output: named(&output, scene, "-o")?,
            ..arguments.clone()
        };
        command.log.stats = stats;
        for other in &commands {
            // Of several scenes, each prints its own object.
            let stats = command.log.stats.as_ref().filter(|path| !is_stdout(path));
            let same_stats = stats.is_some() && other.log.stats.as_ref() == stats;
            let same = [
                (other.output == command.output, "-o", &command.output),
                (same_stats, command.log.stats_option, stats.unwrap_or(&command.output)),
            ];
            if let Some((_, option, path)) = same.into_iter().find(|(same, ..)| *same) {
                return Err(ConflictError::SameName { path: path.clone(), option }.into());
            }
        }
        commands.push(command);
    }
    Ok(commands)
}

/// Checks that no scene's output is a file that any of the scenes needs. A scene that cannot be
/// read is reported when it is rendered.
fn check_inputs(commands: &[RenderArgs]) -> Result<(), ConflictError> {
    let outputs = commands.iter().fold(Outputs::default(), |outputs, command| {
        outputs.file("-o", Some(&command.output)).file(command.log.stats_option, command.log.stats.as_deref())
    });
    for job in commands.iter().map(|command| &command.job) {
        outputs.check_inputs("a scene", &job.scene)?;
        let Some(scene) = &job.scene else { continue };
        if let Ok(document) = SceneDocument::load_with(scene, &job.load.options()) {
            outputs.check_inputs("a file of a scene", &document.description.files)?;
        }
    }
    Ok(())
}

/// Returns a path in which the name of a scene's file stands for `{scene}`.
fn named(path: &Path, scene: &Path, option: &'static str) -> Result<PathBuf, ConflictError> {
    if is_stdout(path) {
        return Ok(path.to_owned());
    }
    let several = || ConflictError::Several { path: path.to_owned(), option };
    let text = path.to_str().filter(|text| text.contains(SCENE)).ok_or_else(several)?;
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    Ok(PathBuf::from(text.replace(SCENE, &name)))
}
