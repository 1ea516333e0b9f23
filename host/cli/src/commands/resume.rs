//! `trisect resume` continues a render from its checkpoint; `trisect merge` combines checkpoints.

use super::render::BEYOND_HALF;
use super::{Session, background, eprint, render};
use crate::cli::{
    Background, Cli, Command, MergeArgs, MetadataArg, PreviewArgs, RenderArgs, ResumeArgs, Samples,
};
use clap::Parser;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use trisect::checkpoint::{self, Checkpoint, CheckpointError, Header, Place};
use trisect::device::{Choice, MathMode};
use trisect::film::{Film, SampleBlock, Summation};
use trisect::image::ImageError;
use trisect::metadata;
use trisect::output::exposure::Exposure;
use trisect::output::{self, Format, Outputs, Window, exceeds_half};
use trisect::threads::start_shared;
use trisect_lab::Error;

/// Continues a render from its checkpoint.
pub fn run(arguments: &ResumeArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks(&arguments.cluster)?;
    let start = Instant::now();
    start_shared(arguments.threads.map(|threads| threads as usize))?;
    let place = Place::of(&arguments.file);
    let checkpoint = Checkpoint::read(&arguments.file)?;
    let command = command(arguments, &checkpoint.header)?;
    check_output(arguments, &command)?;
    render::check(&command)?;
    let denoise = render::checked_denoiser(&command)?;
    let mut session = Session::open_to_render(&render::job(&command), &command, &render::outputs(&command))?;
    session.settings.guides = !checkpoint.film.aovs.is_empty();
    session.settings.hidden_sky = command.background.hides_sky();
    // The scene may have another number of samples than the checkpoint, whose number counts.
    session.settings.samples = checkpoint.header.spp;
    if !command.log.quiet {
        render::announce(&session, &render::goal_text(&session, None));
        eprint(&describe_contents(&checkpoint));
        if arguments.output.is_none() && !output::is_stdout(&command.output) {
            eprint(&format!("  the image goes to {}, as the checkpoint says", command.output.display()));
        }
    }
    render::render_film(&command, session, denoise, Some((place, checkpoint)), start)
}

/// Returns a line of text with the share of its samples that a checkpoint has.
pub fn describe_contents(Checkpoint { header, film }: &Checkpoint) -> String {
    let of = &header.samples;
    format!("  {} of samples {} to {} are in the checkpoint", share(film, header), of.start, of.end)
}

/// Returns the percentage of the header's samples that the film has.
fn share(film: &Film, header: &Header) -> String {
    let missing: u64 = film.coverage.missing(&header.samples).iter().map(SampleBlock::size).sum();
    let all = SampleBlock { rows: 0..film.height, samples: header.samples.clone() }.size();
    format!("{:.1} %", 100.0 * (1.0 - missing as f64 / all.max(1) as f64))
}

/// Returns the command that started the render, with the options of `resume` in place of its own.
pub fn command(arguments: &ResumeArgs, header: &Header) -> Result<RenderArgs, Error> {
    let wrong = |message: String| CheckpointError::NotACheckpoint { path: arguments.file.clone(), message };
    if header.command.is_empty() {
        return Err(CheckpointError::NoCommand { path: arguments.file.clone() }.into());
    }
    let words = std::iter::once("trisect".to_owned()).chain(header.command.iter().cloned());
    let parsed = Cli::try_parse_from(words).map_err(|error| {
        wrong(format!("its command, {}, cannot be parsed: {error}", header.command.join(" ")))
    })?;
    let Command::Render(mut command) = parsed.command else {
        return Err(wrong(format!("its command, {}, is not a render", header.command.join(" "))).into());
    };
    let at = |path: PathBuf| header.folder.join(path);
    command.job.scene = arguments.scene.clone().or(command.job.scene.map(at));
    command.job.load.surroundings.in_folder(&header.folder);
    command.output = match &arguments.output {
        Some(output) => output.clone(),
        None if output::is_stdout(&command.output) => command.output,
        None => at(command.output),
    };
    command.file = arguments.image.or(&command.file, &command.output);
    // The path of statistics is that of the new command; the caller checks the image's path.
    command.log.stats = arguments.log.stats.clone();
    command.preview = PreviewArgs::default();
    command.job.load.includes.allow_outside |= arguments.includes.allow_outside;
    if let Some(backend) = arguments.backend {
        (command.job.backend, command.job.device) = (backend, arguments.device);
        // The image does not depend on these, and another backend may not have them.
        (command.job.features, command.job.schedule, command.job.traversal, command.job.tile) =
            (None, None, None, None);
        command.job.sums = Summation::Auto;
        if backend == Choice::Cpu {
            // The CPU has no other math. The checkpoint's identity is checked against it later.
            command.job.math = MathMode::Precise;
        }
    }
    command.job.threads = arguments.threads.or(command.job.threads);
    command.checkpointing.checkpoint = Some(arguments.file.clone());
    command.checkpointing.every = arguments.every.or(command.checkpointing.every);
    command.checkpointing.time_limit = arguments.time_limit;
    // Ranks have no fallback, even if the first command had one.
    let before = command.checkpointing.fallback.filter(|_| arguments.cluster.distribute.is_none());
    command.checkpointing.fallback = arguments.fallback.or(before);
    command.checkpointing.samples = Some(Samples(header.samples.clone()));
    command.cluster = arguments.cluster.clone();
    (command.log.quiet, command.log.verbose) = (arguments.log.quiet, arguments.log.verbose);
    Ok(*command)
}

/// Checks that the image is written to the user's path, or to one that a checkpoint may choose.
pub fn check_output(arguments: &ResumeArgs, command: &RenderArgs) -> Result<(), Error> {
    match &arguments.output {
        Some(_) => Ok(()),
        None if output::is_stdout(&command.output) => Ok(()),
        None => Ok(output::check_stored(&command.output, &arguments.file)?),
    }
}

/// Combines checkpoints of one image into a checkpoint or an image.
pub fn merge(arguments: &MergeArgs) -> Result<ExitCode, Error> {
    Outputs::default()
        .file("-o", Some(&arguments.output))
        .check_inputs("a checkpoint that is added", &arguments.files)?;
    let as_image = Format::of(&arguments.output).is_ok();
    if !as_image && is_other_image(&arguments.output) {
        return Err(ImageError::UnknownExtension { path: arguments.output.clone() }.into());
    }
    if as_image {
        arguments.image.check(&arguments.output)?;
        output::probe(&arguments.output)?;
    } else {
        checkpoint::probe(&arguments.output)?;
    }
    let (first, others) = arguments.files.split_first().map_or((None, &[][..]), |(a, b)| (Some(a), b));
    let Some(first) = first else { return Ok(ExitCode::SUCCESS) };
    start_shared(None)?;
    let mut sum = Checkpoint::read(first)?;
    for path in others {
        sum.merge(path, &Checkpoint::read(path)?)?;
    }
    if as_image {
        write_image(arguments, &sum)?;
    } else {
        sum.write(&arguments.output)?;
    }
    let count = match arguments.files.len() {
        1 => "1 checkpoint".to_owned(),
        count => format!("{count} checkpoints"),
    };
    eprint(&format!(
        "{count}: {} of {} samples a pixel",
        share(&sum.film, &sum.header),
        sum.header.samples.len()
    ));
    let missing = sum.film.coverage.missing(&(0..sum.header.spp));
    for part in &missing {
        let (rows, samples) = (&part.rows, &part.samples);
        eprint(&format!(
            "  without rows {} to {} of samples {} to {}",
            rows.start, rows.end, samples.start, samples.end
        ));
    }
    if !output::is_stdout(&arguments.output) {
        eprint(&format!("wrote {}", arguments.output.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the command that started the render, or `None` for a checkpoint that was written through
/// the library.
fn render_command(header: &Header) -> Option<RenderArgs> {
    let words = std::iter::once("trisect").chain(header.command.iter().map(String::as_str));
    match Cli::try_parse_from(words).map(|parsed| parsed.command) {
        Ok(Command::Render(command)) => Some(*command),
        _ => None,
    }
}

/// Writes the image of merged checkpoints as the command of the first one asks.
fn write_image(arguments: &MergeArgs, sum: &Checkpoint) -> Result<(), Error> {
    let (path, film) = (&arguments.output, &sum.film);
    let mut image = film.image();
    let command = render_command(&sum.header);
    let asks = |command: &RenderArgs| command.denoise.denoise.is_some() || !command.aov.is_empty();
    if command.as_ref().is_some_and(asks) {
        eprint(
            "warning: the image is not denoised and has no layers, although the render's command asks \
             for one of them; merge to a checkpoint and resume that",
        );
    }
    let file = match &command {
        Some(command) => arguments.image.or(&command.file, path),
        None => arguments.image.clone(),
    };
    let exposure = match (&command, file.exposure) {
        (_, Some(stops)) => Exposure::Stops(stops),
        (Some(command), None) => command.exposure(),
        (None, None) => Exposure::Stops(0.0),
    };
    let exposed = exposure.of(&image, path);
    exposed.apply(&mut image);
    let background = command.as_ref().map_or(Background::Sky, |command| command.background);
    file.tone_map().apply(&mut image, background::alpha_behind(background, film).as_deref());
    let mut encoding = file.encoding();
    encoding.window = sum.header.identity.crop().map(Window::from);
    if file.metadata() != MetadataArg::None {
        let math = command.as_ref().map_or(MathMode::Precise, |command| command.job.math);
        let fingerprint = sum.header.identity.fingerprint_with(math);
        let samples = film.counts().samples as f64 / film.pixels.len().max(1) as f64;
        let mut metadata = metadata::of_image(&sum.header.scene, samples, &fingerprint);
        metadata::add_display(&mut metadata, exposed.stops, file.tone_map());
        if file.metadata() == MetadataArg::All {
            eprint("warning: --metadata all: a merged image has no device, time and date of its own");
        }
        metadata.camera = sum.header.camera;
        encoding.metadata = metadata;
    }
    background::write(background, &image, film, Vec::new(), (path, &encoding))?;
    if matches!(Format::of(path), Ok(Format::Exr)) && !file.float && exceeds_half(&image.pixels) {
        eprint(BEYOND_HALF);
    }
    if let Some(automatic) = exposed.automatic {
        eprint(&automatic.to_string());
    }
    Ok(())
}

/// Returns whether the extension is that of an image format that cannot be written. A checkpoint of
/// such a name would hardly be what the user wants.
fn is_other_image(path: &Path) -> bool {
    const OTHERS: [&str; 4] = ["bmp", "gif", "webp", "tga"];
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| OTHERS.contains(&extension.as_str()))
}
