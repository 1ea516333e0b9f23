//! One image over all ranks.
//!
//! Each rank has two threads: one renders, the other sends what is ready and receives. A piece of the image travels while the next one is
//! rendered.

use super::DistributeError;
use super::canvas::{Canvas, Picture};
use super::link::Link;
use super::network::{Message, Network, Tag};
use super::order::{Bench, Source, give, render};
use super::piece::{Piece, Travels};
use super::plan::{self, Balance, Dispenser, Mode, Plan};
use super::reduce::Reduce;
use super::report::{ClusterReport, RankReport};
use super::workshop::Workshop;
use crate::Error;
use crate::backend::{Device, DeviceKind};
use crate::film::FilmCounts;
use crate::render::{Observer, Renderer, Settings};
use crate::stats::{Phases, RenderStats};
use std::time::{Duration, Instant};
use trisect_kernels::{VARIANTS, variant_by_name};

/// What all ranks render together.
#[derive(Clone, Debug)]
pub struct Work {
    /// The image.
    pub settings: Settings,
    /// Who renders what.
    pub plan: Plan,
    /// What travels of it.
    pub travels: Travels,
    /// Why that plan, where the program chose.
    pub choice: String,
}

/// An image that came.
#[derive(Clone, Debug)]
pub struct Finished {
    /// It.
    pub picture: Picture,
    /// What it took.
    pub report: ClusterReport,
    /// Over all pixels.
    pub counts: FilmCounts,
    /// Of all ranks.
    pub submissions: u64,
    /// The root's kernel.
    pub kernel: &'static str,
}

impl Finished {
    /// The same as of a render by one process: on the root's device, with the device's seconds of all.
    pub fn stats(&self, device: &Device, settings: &Settings) -> RenderStats {
        let variant = variant_by_name(self.kernel).unwrap_or(VARIANTS[0]);
        let mut stats = RenderStats::new(device, settings, variant, Phases::default());
        stats.submissions = self.submissions;
        stats.device_seconds = self.report.ranks.iter().map(|rank| rank.device_seconds).sum();
        let seconds = Duration::from_secs_f64(self.report.seconds);
        stats.finish(self.counts, seconds, Duration::ZERO, Duration::ZERO);
        stats.cluster = Some(self.report.clone());
        stats
    }
}

/// Why an image did not come, and what there is of it.
#[derive(Debug)]
pub struct Failure {
    /// Why.
    pub error: Error,
    /// On the root, if any piece came.
    pub partial: Option<Box<Picture>>,
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { error: error.into(), partial: None }
    }
}

/// What a rank does with pieces.
enum Route {
    /// To the root.
    Direct,
    /// Up the tree.
    Tree(Reduce),
}

/// The root's side.
struct Root {
    canvas: Canvas,
    dispenser: Option<Dispenser>,
    reports: Vec<Option<RankReport>>,
    submissions: u64,
    came: Option<Instant>,
}

/// Renders an image over all ranks, each of which calls this with the same work. On the root the image comes back, on others none; and the renderer,
/// for the next. `ended` says whether the process was asked to end.
///
/// # Errors
///
/// [`Failure`] with what came: an error of this rank or of another, one that was silent for too long, or an end that was asked for. The job
/// must be ended then: others wait.
pub fn still<N: Network>(
    link: &mut Link<N>,
    renderer: Renderer,
    work: &Work,
    observer: &mut dyn Observer,
    ended: &dyn Fn() -> bool,
) -> Result<(Option<Finished>, Renderer), Failure> {
    let Work { settings, plan, travels, .. } = work.clone();
    settings.check()?;
    let (rank, ranks) = (link.rank(), link.ranks());
    let device = renderer.backend().device().clone();
    let device_name = format!("{}: {}", device.backend, device.name);
    let averaging = plan::averaging(settings.samples, ranks);
    let averages = plan.mode == Mode::Average;
    let samples = match averages {
        false => 0..settings.samples,
        true if rank < averaging => plan::samples_of(settings.samples, rank, averaging),
        true => 0..0,
    };
    let tree = averages && matches!(travels, Travels::Chunk | Travels::Mean);
    let mut route = if tree && rank < averaging {
        Route::Tree(Reduce::new(&settings, rank, averaging))
    } else {
        Route::Direct
    };
    let block = 1u32 << plan.block_shift.min(16);
    let mut source = if averages || plan.balance == Balance::Static {
        let rows = plan.rows(settings.height, rank, ranks);
        let strip = if averages { plan::strip_rows(settings.height) } else { u32::MAX };
        // A GPU is busy with whole images only; a processor's strips are on their way while it renders the next.
        let whole = match device.kind {
            DeviceKind::Cpu if averages => strip,
            _ if averages => settings.height,
            _ => block,
        };
        // The first piece tells the speed; a GPU needs much to be busy.
        let per_row = (u64::from(settings.width) * samples.len() as u64).max(1);
        let first = if device.kind == DeviceKind::Gpu { 1u64 << 28 } else { 1 << 20 };
        let at_once = u32::try_from(first / per_row).unwrap_or(u32::MAX / 2);
        let at_once = if averages { whole } else { (at_once / whole * whole).max(whole) };
        Source::Own { rows, next: 0, at_once, whole, samples, strip }
    } else {
        Source::Root { asked: false, over: false, ready: None }
    };
    let mut root = (rank == 0).then(|| Root {
        canvas: Canvas::new(settings.width, settings.height, settings.samples, travels),
        dispenser: (!averages && plan.balance == Balance::Dynamic)
            .then(|| Dispenser::new(settings.height, block, ranks)),
        reports: vec![None; ranks as usize],
        submissions: 0,
        came: None,
    });

    let phases = if tree { plan::phases(settings.samples, averaging) } else { 1 };
    let bench = Bench { renderer, settings: settings.clone(), travels, phases };
    let mut workshop = Workshop::new(bench, render);
    let start = Instant::now();
    let sent_before = link.sent;
    let mut own = RankReport { rank, host: link.host_of(rank), device: device_name, ..RankReport::default() };
    let mut last_piece = start;
    let mut reported = false;
    let mut kernel = "";

    macro_rules! fail {
        ($error:expr) => {{
            let error: Error = $error.into();
            let partial =
                root.filter(|root| root.canvas.done > 0).map(|root| Box::new(root.canvas.picture()));
            return Err(Failure { error, partial });
        }};
    }
    macro_rules! attempt {
        ($result:expr) => {
            match $result {
                Ok(value) => value,
                Err(error) => fail!(error),
            }
        };
    }

    loop {
        let mut busy = false;
        // One order is rendered, the next one waits.
        while workshop.open() < 2 && !source.is_over() {
            if let Source::Root { asked, over, ready: None } = &mut source
                && !*asked
                && !*over
            {
                match root.as_mut().and_then(|root| root.dispenser.as_mut()) {
                    Some(dispenser) => {
                        let rows = dispenser.take();
                        *over = rows.is_none();
                        give(&mut source, rows, settings.samples);
                    }
                    None => {
                        *asked = true;
                        attempt!(link.send(0, Tag::Want, Vec::new()));
                    }
                }
            }
            match source.take() {
                Some(order) => workshop.order(order),
                None => break,
            }
        }
        let nap = link.nap();
        while let Some(product) = workshop.product(if busy { Duration::ZERO } else { nap }) {
            busy = true;
            let (piece, by) = match product {
                Ok(product) => product,
                Err(error) if rank == 0 => fail!(error),
                Err(error) => {
                    // The root says it, and ends the job.
                    let told = (error.exit_code(), error.to_string());
                    attempt!(link.send(0, Tag::Report, encode(&Err(told))));
                    attempt!(link.flush());
                    attempt!(link.expect(Tag::Done));
                    fail!(error)
                }
            };
            kernel = by;
            last_piece = Instant::now();
            own.render_seconds += piece.render_seconds;
            own.device_seconds += piece.device_seconds;
            own.pieces += 1;
            own.samples += piece.counts.samples + piece.counts.rejected;
            if !averages {
                source.learn(&piece);
            }
            attempt!(deliver(link, &mut route, root.as_mut(), rank, piece, work));
        }
        while let Some(message) = attempt!(link.turn()) {
            let Message { from, tag, bytes } = message;
            match tag {
                Tag::Part => {
                    let piece = attempt!(Piece::read(from, bytes, settings.width, settings.height));
                    attempt!(deliver(link, &mut route, root.as_mut(), from, piece, work));
                }
                Tag::Want => {
                    let dispenser = root.as_mut().and_then(|root| root.dispenser.as_mut());
                    let rows = dispenser.and_then(Dispenser::take).unwrap_or(0..0);
                    attempt!(link.send(
                        from,
                        Tag::Work,
                        bytemuck::cast_slice(&[rows.start, rows.end]).to_vec()
                    ));
                }
                Tag::Work => {
                    let rows: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes[..bytes.len() / 4 * 4]);
                    let rows = match rows[..] {
                        [start, end] if start < end && end <= settings.height => Some(start..end),
                        _ => None,
                    };
                    if let Source::Root { asked, over, .. } = &mut source {
                        (*asked, *over) = (false, rows.is_none());
                    }
                    give(&mut source, rows, settings.samples);
                }
                Tag::Report => match decode(&bytes) {
                    Ok(Ok(report)) => {
                        if let Some(place) =
                            root.as_mut().and_then(|root| root.reports.get_mut(from as usize))
                        {
                            *place = Some(report);
                        }
                    }
                    Ok(Err((code, message))) => {
                        let host = link.host_of(from);
                        fail!(DistributeError::Rank { rank: from, host, message, code })
                    }
                    Err(message) => fail!(DistributeError::Protocol { rank: from, message }),
                },
                Tag::Done if reported => return Ok((None, workshop.end().renderer)),
                other => {
                    let message = format!("{other:?} while an image was rendered");
                    fail!(DistributeError::Protocol { rank: from, message })
                }
            }
        }
        if ended() {
            let (done, total) = root.as_ref().map_or((0, 0), |root| root.canvas.pixels());
            fail!(DistributeError::Ended { done, total })
        }
        let passed_on = match &route {
            Route::Direct => true,
            Route::Tree(reduce) => reduce.is_over(),
        };
        let rendered = source.is_over() && workshop.open() == 0 && passed_on;
        if let Some(root) = &mut root {
            if observer.progress(root.canvas.done, root.canvas.total).is_break() {
                fail!(Error::Cancelled)
            }
            if root.canvas.is_complete() {
                root.came.get_or_insert_with(Instant::now);
            }
        }
        if rendered && !reported && link.network().unsent() == 0 {
            let now = root.as_ref().map_or_else(|| Some(Instant::now()), |root| root.came);
            if let Some(now) = now {
                reported = true;
                own.seconds = now.duration_since(start).as_secs_f64();
                own.sync_seconds = now.saturating_duration_since(last_piece).as_secs_f64();
                let until = last_piece.duration_since(start).as_secs_f64();
                own.wait_seconds = (until - own.render_seconds).max(0.0);
                own.bytes = link.sent - sent_before;
                match &mut root {
                    Some(root) => root.reports[0] = Some(own.clone()),
                    None => attempt!(link.send(0, Tag::Report, encode(&Ok(own.clone())))),
                }
            }
        }
        if root.as_ref().is_some_and(|root| root.reports.iter().all(Option::is_some))
            && let Some(root) = root.take()
        {
            link.send_all(Tag::Done, &[])?;
            link.flush()?;
            let seconds = root.came.unwrap_or(start).duration_since(start).as_secs_f64();
            let reports = root.reports.into_iter().flatten().collect();
            let report = ClusterReport::new(plan, work.choice.clone(), seconds, reports);
            let (counts, submissions) = (root.canvas.counts, root.submissions);
            let finished = Finished { picture: root.canvas.picture(), report, counts, submissions, kernel };
            return Ok((Some(finished), workshop.end().renderer));
        }
    }
}

type Told = Result<RankReport, (u8, String)>;

fn encode(report: &Told) -> Vec<u8> {
    serde_json::to_vec(report).unwrap_or_default()
}

fn decode(bytes: &[u8]) -> Result<Told, String> {
    serde_json::from_slice(bytes).map_err(|error| format!("no report: {error}"))
}

/// Takes a piece of this rank's or another's where it belongs.
fn deliver<N: Network>(
    link: &mut Link<N>,
    route: &mut Route,
    root: Option<&mut Root>,
    from: u32,
    piece: Piece,
    work: &Work,
) -> Result<(), Error> {
    let own = from == link.rank();
    let mut root = root;
    if let Some(root) = root.as_mut() {
        root.canvas.counts = root.canvas.counts + piece.counts;
        root.submissions += u64::from(piece.submissions);
    }
    match route {
        Route::Tree(reduce) => {
            let Settings { width, .. } = work.settings;
            match (reduce.parent, root) {
                (Some(parent), _) if reduce.children == 0 => {
                    // A leaf's sums go as they are.
                    reduce.count(from, &piece)?;
                    link.send(parent, Tag::Part, piece.into_bytes())?;
                }
                (Some(parent), _) => {
                    if let Some(strip) = reduce.add(from, piece)? {
                        link.send(parent, Tag::Part, Piece::of_strip(&strip, width).into_bytes())?;
                    }
                }
                (None, Some(root)) => {
                    reduce.count(from, &piece)?;
                    root.canvas.add(from, &piece)?;
                }
                (None, None) => {}
            }
            Ok(())
        }
        Route::Direct => match root {
            Some(root) => root.canvas.take(from, &piece),
            None if own => Ok(link.send(0, Tag::Part, piece.into_bytes())?),
            None => {
                Err(DistributeError::Protocol { rank: from, message: "a piece for the root".to_owned() }
                    .into())
            }
        },
    }
}
