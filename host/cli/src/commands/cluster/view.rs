//! `trisect view --headless --distribute rows`: each rank renders a band of rows of every frame.

use super::super::data;
use super::super::view::headless;
use super::super::view::{look, metered};
use super::{ClusterSession, Session};
use crate::cli::{DistributeArg, ViewArgs};
use std::process::ExitCode;
use trisect::device::{DeviceInfo, DeviceKind};
use trisect::film::{RowSet, RowTarget};
use trisect::output::exposure::Exposure;
use trisect::render::Settings;
use trisect::view::{ViewOptions, Viewer};
use trisect_cluster::{ClusterError, FrameCost, FrameSeries, SeriesReport, Tag, plan, series};
use trisect_lab::Error;
use trisect_lab::bench::{Row, Summary, table};

/// Renders the frames of the camera path over all ranks.
pub fn run(arguments: &ViewArgs) -> Result<ExitCode, Error> {
    if !arguments.headless || arguments.cluster.distribute != Some(DistributeArg::Rows) {
        return Err(ClusterError::Unsupported {
            what: "over several ranks, view renders without a window, and each rank a band of rows"
                .to_owned(),
            remedy: "use --headless --distribute rows".to_owned(),
        }
        .into());
    }
    let cluster = &arguments.cluster;
    let mut crew = ClusterSession::start(&cluster.ranks, arguments.job.threads)?;
    let (own, checked) = (arguments.clone(), arguments.clone());
    let adjust = move |settings: &mut Settings, _: &DeviceInfo| {
        let look = look(&own, settings)?;
        *settings = look.settings.clone();
        Ok(vec![("what is shown".to_owned(), format!("{look:?}"))])
    };
    let check = move || headless::check(&checked);
    let session = match crew.assemble(&arguments.job, &cluster.ranks, check, adjust) {
        Ok(session) => session,
        Err(code) => return Ok(code),
    };
    let mut look = look(arguments, &session.settings)?;
    let session = match exposed(&mut crew, arguments, session, &mut look) {
        Ok(session) => session,
        Err(error) => return Ok(crew.give_up(&error)),
    };
    let poses = match headless::poses(arguments, &session) {
        Ok(poses) => poses,
        Err(error) => return Ok(crew.give_up(&error)),
    };
    let (rank, ranks) = (crew.link.rank(), crew.link.ranks());
    let size = look.scaled();
    let rows: Vec<RowSet> = (0..ranks).map(|rank| plan::band(size.height, rank, ranks).into()).collect();
    let own = plan::band(size.height, rank, ranks);
    let device = session.renderer.device().info().clone();
    let of = FrameSeries {
        width: size.width,
        height: size.height,
        rows,
        frames: poses.len() as u32,
        spins: device.kind == DeviceKind::Gpu,
    };
    let render = move |viewer: &mut Viewer, frame: u32, to: &mut RowTarget<'_>| {
        let Some(pose) = poses.get(frame as usize) else { return Ok(FrameCost::default()) };
        let shot = viewer.rows_to(&look, pose, &own, to)?;
        let device = shot.trace() + shot.denoise() + shot.display.as_secs_f64();
        Ok(FrameCost { render: shot.whole.as_secs_f64(), device })
    };
    let output = arguments.output.clone();
    let mut show = |frame: u32, pixels: &[u32]| -> Result<(), trisect_cluster::Error> {
        match &output {
            Some(folder) => {
                Ok(headless::write(&headless::file(folder, frame), (size.width, size.height), pixels)?)
            }
            None => Ok(()),
        }
    };
    let ended = crew.ended();
    let viewer = Viewer::new(session.renderer);
    match series(&mut crew.link, (viewer, None), &of, render, &mut show, &ended) {
        Ok((mut viewer, Some(times))) => {
            report(arguments, &session.name, &device, &size, ranks, &mut viewer, &times)?;
            Ok(ExitCode::SUCCESS)
        }
        Ok((_, None)) => Ok(ExitCode::SUCCESS),
        Err(error) => Ok(crew.give_up(&error.into())),
    }
}

/// Prints the times of the frames, and writes what `--json` asks for.
fn report(
    arguments: &ViewArgs,
    scene: &str,
    device: &DeviceInfo,
    size: &Settings,
    ranks: u32,
    viewer: &mut Viewer,
    times: &SeriesReport,
) -> Result<(), Error> {
    let rows = summary(times);
    let frames = times.whole.len();
    let title = format!("{} frames after {}", frames - FIRST.min(frames), FIRST);
    let text = format!(
        "scene     {scene}\ndevice    {}: {}, one of {ranks} ranks\nframe     {}x{}, {} spp\n\n{}",
        device.backend,
        device.name,
        size.width,
        size.height,
        size.samples,
        table(&title, &rows)
    );
    let shown = (size.width, size.height);
    headless::report(arguments, scene, viewer.renderer(), "", shown, frames, &rows)?;
    if !arguments.json.as_deref().is_some_and(data::is_stdout) {
        super::super::print(&text)?;
    }
    Ok(())
}

/// Determines an automatic exposure on the root and sends it to all ranks.
fn exposed(
    crew: &mut ClusterSession,
    arguments: &ViewArgs,
    mut session: Session,
    look: &mut ViewOptions,
) -> Result<Session, Error> {
    let Exposure::Automatic(level) = arguments.job.exposure(arguments.exposure) else {
        return Ok(session);
    };
    if crew.link.is_root() {
        let of = look.clone();
        let stops;
        (session, stops) = crew.link.run_while_polling(move || {
            let stops = metered(&mut session, &of, level);
            (session, stops)
        })?;
        look.screen.stops = stops?;
        crew.link.send_all(Tag::Exposure, &look.screen.stops.to_le_bytes())?;
    } else {
        let message = crew.link.expect(Tag::Exposure)?;
        let bytes = message
            .bytes
            .try_into()
            .map_err(|_| ClusterError::Protocol { rank: message.from, message: "no exposure".to_owned() })?;
        look.screen.stops = f32::from_le_bytes(bytes);
    }
    Ok(session)
}

/// Number of first frames whose times do not count: they compile kernels and fill the pipeline of
/// transfers.
const FIRST: usize = 3;

/// Returns the times of the frames in milliseconds, for each rank and from frame to frame.
fn summary(report: &SeriesReport) -> Vec<Row> {
    let row = |name: String, values: &[f64]| {
        Some(Row { name, unit: "ms".to_owned(), summary: Summary::of(values)? })
    };
    let mut rows = Vec::new();
    for (rank, costs) in report.costs.iter().enumerate() {
        let counted = costs.get(FIRST..).filter(|counted| !counted.is_empty()).unwrap_or(costs);
        let of =
            |value: fn(&FrameCost) -> f64| counted.iter().map(|cost| value(cost) * 1e3).collect::<Vec<_>>();
        rows.extend(row(format!("rank {rank}: device"), &of(|cost| cost.device)));
        rows.extend(row(format!("rank {rank}: its rows"), &of(|cost| cost.render)));
    }
    let whole = report.whole.get(FIRST.saturating_sub(1)..).unwrap_or(&report.whole);
    let periods: Vec<f64> = whole.windows(2).map(|pair| (pair[1] - pair[0]) * 1e3).collect();
    rows.extend(row("from frame to frame".to_owned(), &periods));
    rows
}
