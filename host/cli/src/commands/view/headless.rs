//! `trisect view --headless`: renders frames along a camera path, writes them to files and prints
//! their times.

use super::super::{Session, data};
use crate::cli::ViewArgs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trisect::image::ImageError;
use trisect::output;
use trisect::output::Outputs;
use trisect::render::Renderer;
use trisect::scene::{CameraPose, SceneError};
use trisect::view::{CameraPath, FrameTiming, Pace, ViewOptions, Viewer};
use trisect_lab::Error;
use trisect_lab::bench::{BenchError, Row, ViewReport, rows_of_timings, table};

/// Number of frames without `--camera-path` and `--frames`.
const FRAMES: u32 = 10;

/// Checks before the first frame that all outputs can be written, and returns them.
pub fn check(arguments: &ViewArgs) -> Result<Outputs, Error> {
    let outputs = Outputs::default()
        .folder("-o", arguments.output.as_deref(), is_frame)
        .file("--json", arguments.json.as_deref());
    outputs.check()?;
    outputs.check_inputs("the camera path", &arguments.camera_path)?;
    if let Some(folder) = &arguments.output {
        let io = |source| ImageError::Io { path: folder.clone(), source };
        std::fs::create_dir_all(folder).map_err(io)?;
        output::check_writable(&file(folder, 0))?;
    }
    arguments.json.as_deref().map_or(Ok(()), data::probe)?;
    Ok(outputs)
}

/// Returns whether `name` is the file name of a frame.
fn is_frame(name: &Path) -> bool {
    let stem = name.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    stem.parse::<u32>().is_ok_and(|frame| file(Path::new(""), frame) == name)
}

/// Returns the path of a frame's file.
pub fn file(folder: &Path, frame: u32) -> PathBuf {
    folder.join(format!("{frame:04}.png"))
}

/// Returns the pose of the camera in each frame, in the renderer's space.
pub fn poses(arguments: &ViewArgs, session: &Session) -> Result<Vec<CameraPose>, Error> {
    let rest = || CameraPath::rest(session.space.camera_of(session.renderer.pose()));
    let path = arguments.camera_path.as_deref().map_or_else(|| Ok(rest()), CameraPath::load)?;
    let of_path = if arguments.camera_path.is_some() { path.last() + 1 } else { FRAMES };
    let frames = arguments.frames.unwrap_or(of_path);
    let poses = (0..frames).map(|frame| Ok(session.space.camera(&path.pose(frame)?)));
    Ok(poses.collect::<Result<_, SceneError>>()?)
}

/// Renders the frames of the camera path.
pub fn run(arguments: &ViewArgs, session: Session, look: &ViewOptions) -> Result<ExitCode, Error> {
    let poses = poses(arguments, &session)?;
    let mut viewer = Viewer::new(session.renderer);
    let mut shots: Vec<FrameTiming> = Vec::new();
    let mut pace = Pace::new(arguments.moving_fps.unwrap_or(0.0));
    let mut take = |viewer: &mut Viewer, pace: &mut Pace| {
        let Some((shot, pixels)) = viewer.take()? else { return Ok::<_, Error>(()) };
        pace.learn(shot.scale, shot.whole.as_secs_f64());
        if let Some(folder) = &arguments.output {
            write(&file(folder, shots.len() as u32), shot.size, pixels)?;
        }
        shots.push(shot);
        Ok(())
    };
    for pose in &poses {
        let look = ViewOptions { scale: pace.scale(look, pose), ..look.clone() };
        if let Err(error) = viewer.start(&look, pose) {
            while viewer.running() > 0 {
                take(&mut viewer, &mut pace)?;
            }
            return Err(error.into());
        }
        // One frame is copied and written while a device that can do so renders the next.
        while viewer.running() > 1 || viewer.has_ended() {
            take(&mut viewer, &mut pace)?;
        }
    }
    while viewer.running() > 0 {
        take(&mut viewer, &mut pace)?;
    }
    let Some(last) = shots.last() else { return Ok(ExitCode::SUCCESS) };
    // The first frame compiles kernels and allocates memory; it does not count.
    let counted = if shots.len() > 1 { &shots[1..] } else { &shots[..] };
    let rows = rows_of_timings(counted);
    let device = viewer.renderer().device().info();
    let (width, height) = last.size;
    let mut text = format!("scene     {}\n", session.name);
    text += &format!("device    {}: {} ({})\n", device.backend, device.name, device.details);
    text += &format!("frame     {width}x{height}, {} spp\n", look.settings.samples);
    text += &format!("kernel    {}\n\n", last.live.kernel);
    text += &table(&format!("{} frames after {}", counted.len(), shots.len() - counted.len()), &rows);
    let kernel = last.live.kernel;
    report(arguments, &session.name, viewer.renderer(), kernel, last.size, counted.len(), &rows)?;
    if !arguments.json.as_deref().is_some_and(data::is_stdout) {
        super::super::print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the measured rows as JSON if `--json` is given.
pub fn report(
    arguments: &ViewArgs,
    scene: &str,
    renderer: &Renderer,
    kernel: &str,
    (width, height): (u32, u32),
    frames: usize,
    rows: &[Row],
) -> Result<(), Error> {
    let Some(path) = &arguments.json else { return Ok(()) };
    let device = renderer.device().info();
    let report = ViewReport {
        format: ViewReport::FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: scene.to_owned(),
        backend: device.backend.to_owned(),
        device: device.name.clone(),
        kernel: kernel.to_owned(),
        width,
        height,
        frames,
        rows: rows.to_vec(),
    };
    let text = serde_json::to_string_pretty(&report)
        .map_err(|error| BenchError::Encode { path: path.clone(), message: error.to_string() })?;
    data::write(path, &text)
}

/// Writes a frame as a PNG. `pixels` are RGBA with 8 bits each, red in the lowest byte.
pub fn write(path: &Path, size: (u32, u32), pixels: &[u32]) -> Result<(), ImageError> {
    output::write_rgba(size.0, size.1, pixels, path)
}
