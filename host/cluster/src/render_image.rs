//! One image over all ranks.
//!
//! Each rank has two threads: one renders, the other sends finished image parts and receives
//! messages. An image part is sent while the next one is rendered.

use super::ClusterError;
use super::heartbeat::Heartbeat;
use super::image_part::{ImagePart, WireFormat};
use super::network::{Message, Network, Tag};
use super::plan::{self, Balance, DistributionMode};
use super::reduce::Reduce;
use super::render_thread::RenderThread;
use super::root::{ResumableFilm, Root};
use super::work::{Failure, Finished, Work};
use super::work_item::{Source, WorkerState, assign, render};
use crate::Error;
use std::time::{Duration, Instant};
use trisect::device::DeviceKind;
use trisect::film::SampleBlock;
use trisect::render::{PartSizer, RenderObserver, Renderer, Settings};
use trisect::stats::{ClusterReport, RankReport};

/// Destination of image parts.
enum Route {
    /// The root.
    Direct,
    /// The parent in the tree of ranks.
    Tree(Reduce),
}

/// Maximum time that an interrupted rank waits for the root to end the job.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(60);

/// Renders an image over all ranks; each rank calls this with the same work. Returns the image on
/// the root, `None` on the others, and the renderer for the next image. `ended` returns whether the
/// process was asked to end.
///
/// # Errors
///
/// [`Failure`] with the partial image: an error of this rank or another, a rank that was silent for
/// too long, or a request to end. The caller must then end the job, because the other ranks wait.
pub fn render_image<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    work: &Work,
    observer: &mut dyn RenderObserver,
    ended: &dyn Fn() -> bool,
) -> Result<(Option<Finished>, Renderer), Failure> {
    render_into_film(link, renderer, work, None, observer, ended)
}

/// Renders the samples that the root's film `kept` lacks, chunk by chunk, until it is complete or
/// its observer ends the render. The work is that of [`Work::for_film`]; other ranks pass no film.
/// The complete film has the bits of one that one process rendered. Without a film on the root, the
/// work is an image as in [`render_image`].
///
/// # Errors
///
/// Errors of [`render_image`], and of a film that does not fit the work. [`Failure::partial`]
/// returns the film, unless it did not fit.
pub fn render_into_film<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    work: &Work,
    kept: Option<ResumableFilm<'_>>,
    observer: &mut dyn RenderObserver,
    ended: &dyn Fn() -> bool,
) -> Result<(Option<Finished>, Renderer), Failure> {
    let Work { settings, plan, wire_format: travels, .. } = work.clone();
    settings.check()?;
    let (rank, ranks) = (link.rank(), link.ranks());
    let device = renderer.backend().device().clone();
    let device_name = format!("{}: {}", device.backend, device.name);
    let averaging = plan::averaging(settings.samples, ranks);
    let averages = plan.mode == DistributionMode::Average;
    let samples = match averages {
        false => 0..settings.samples,
        true if rank < averaging => plan::samples_of(settings.samples, rank, averaging),
        true => 0..0,
    };
    let tree = averages && matches!(travels, WireFormat::Chunk | WireFormat::Mean);
    let mut route = if tree && rank < averaging {
        Route::Tree(Reduce::new(&settings, rank, averaging))
    } else {
        Route::Direct
    };
    let block = 1u32 << plan.block_shift.min(16);
    let mut source = if averages || plan.balance == Balance::Static {
        let rows = plan.rows(settings.height, rank, ranks);
        let strip = if averages { plan::strip_rows(settings.height) } else { u32::MAX };
        // Only whole images keep a GPU busy; on a CPU, a strip is sent while the next one is
        // rendered.
        let whole = match device.kind {
            DeviceKind::Cpu if averages => strip,
            _ if averages => settings.height,
            _ => block,
        };
        // The speed follows from the first image part; a GPU needs many samples to be busy.
        let per_row = (u64::from(settings.width) * samples.len() as u64).max(1);
        let first = if device.kind == DeviceKind::Gpu { 1u64 << 28 } else { 1 << 20 };
        let at_once = u32::try_from(first / per_row).unwrap_or(u32::MAX / 2);
        let at_once = if averages { whole } else { (at_once / whole * whole).max(whole) };
        Source::Static { rows, next: 0, at_once, whole, samples, strip }
    } else {
        let speed = PartSizer::unknown(device.kind, settings.pixels());
        Source::Root { asked: false, over: false, ready: None, speed }
    };
    let mut root = if rank == 0 { Some(Root::new(work, ranks, kept)?) } else { None };

    let phases = if tree { plan::phases(settings.samples, averaging) } else { 1 };
    let bench = WorkerState { renderer, settings: settings.clone(), wire_format: travels, phases };
    let mut workshop = RenderThread::new(bench, render).map_err(Error::from)?;
    let start = Instant::now();
    let sent_before = link.sent;
    let mut own = RankReport { rank, host: link.host_of(rank), device: device_name, ..RankReport::default() };
    let mut last_piece = start;
    let mut reported = false;
    let mut told = None;

    macro_rules! fail {
        ($error:expr) => {{
            let error: Error = $error.into();
            return Err(match root {
                Some(root) => root.failed(error),
                None => error.into(),
            });
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
        // One work item is rendered while the next one waits.
        while workshop.open() < 2 && !source.is_over() {
            if let Source::Root { asked, over, ready: None, speed } = &mut source
                && !*asked
                && !*over
            {
                match root.as_mut().and_then(|root| root.hand_out(speed.samples)) {
                    Some(part) => {
                        *over = part.is_none();
                        assign(&mut source, part);
                    }
                    None => {
                        *asked = true;
                        attempt!(link.send(0, Tag::WorkRequest, speed.samples.to_le_bytes().to_vec()));
                    }
                }
            }
            match source.take() {
                Some(order) => workshop.submit(order),
                None => break,
            }
        }
        let nap = link.nap();
        while let Some(product) = workshop.next_product(if busy { Duration::ZERO } else { nap }) {
            busy = true;
            let piece = match product {
                Ok(product) => product,
                Err(error) if rank == 0 => fail!(error),
                Err(error) => {
                    // The root reports the error and ends the job.
                    let told = (error.exit_code(), error.to_string());
                    attempt!(link.send(0, Tag::Report, encode(&Err(told))));
                    attempt!(link.flush());
                    attempt!(link.expect(Tag::Done));
                    fail!(error)
                }
            };
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
        while let Some(message) = attempt!(link.receive()) {
            let Message { from, tag, bytes } = message;
            match tag {
                Tag::ImagePart => {
                    let piece = attempt!(ImagePart::read(from, bytes, settings.width, settings.height));
                    attempt!(deliver(link, &mut route, root.as_mut(), from, piece, work));
                }
                Tag::WorkRequest => {
                    let most = <[u8; 8]>::try_from(bytes.as_slice()).map_or(u64::MAX, u64::from_le_bytes);
                    let part = root.as_mut().and_then(|root| root.hand_out(most)).flatten();
                    attempt!(link.send(from, Tag::Work, words(part.as_ref())));
                }
                Tag::Work => {
                    let part = part(&bytes, &settings);
                    if let Source::Root { asked, over, .. } = &mut source {
                        (*asked, *over) = (false, part.is_none());
                    }
                    assign(&mut source, part);
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
                        fail!(ClusterError::Rank { rank: from, host, message, code })
                    }
                    Err(message) => fail!(ClusterError::Protocol { rank: from, message }),
                },
                Tag::Done if reported => return Ok((None, workshop.end().renderer)),
                other => {
                    let message = format!("{other:?} while an image is rendered");
                    fail!(ClusterError::Protocol { rank: from, message })
                }
            }
        }
        // Only the root reports the interrupt. Other ranks stay alive until it has written the
        // partial image, because a rank that ends would end the root, too.
        if ended() && (rank == 0 || told.get_or_insert_with(Instant::now).elapsed() > SHUTDOWN_TIMEOUT) {
            let (done, total) = root.as_ref().map_or((0, 0), |root| root.assembler.pixels());
            fail!(ClusterError::Ended { done, total })
        }
        let passed_on = match &route {
            Route::Direct => true,
            Route::Tree(reduce) => reduce.is_over(),
        };
        let rendered = source.is_over() && workshop.open() == 0 && passed_on;
        if let Some(root) = &mut root {
            if observer.progress(root.assembler.done, root.assembler.total).is_break() {
                fail!(Error::Render(trisect::Error::Cancelled))
            }
            root.look();
        }
        if rendered && !reported && link.network().unsent() == 0 {
            let now = root.as_ref().map_or_else(|| Some(Instant::now()), |root| root.last_arrival);
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
            if let Err(error) = link.send_all(Tag::Done, &[]).and_then(|()| link.flush()) {
                return Err(root.failed(error.into()));
            }
            let seconds = root.last_arrival.unwrap_or(start).duration_since(start).as_secs_f64();
            let reports = root.reports.iter().flatten().cloned().collect();
            let report = ClusterReport::new(plan, work.choice.clone(), seconds, reports);
            let (counts, before, submissions) = (root.counts(), root.before, root.submissions);
            let picture = root.picture();
            let finished = Finished { picture, report, counts, before, submissions };
            return Ok((Some(finished), workshop.end().renderer));
        }
    }
}

/// Encodes a block as a message; a block without rows means that no work is left.
fn words(part: Option<&SampleBlock>) -> Vec<u8> {
    let words = part
        .map_or([0; 4], |SampleBlock { rows, samples }| [rows.start, rows.end, samples.start, samples.end]);
    bytemuck::cast_slice(&words).to_vec()
}

fn part(bytes: &[u8], settings: &Settings) -> Option<SampleBlock> {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes[..bytes.len() / 4 * 4]);
    let [first, end, from, to] = words[..] else { return None };
    let part = SampleBlock { rows: first..end, samples: from..to };
    (first < end && end <= settings.height && from < to && to <= settings.samples).then_some(part)
}

type RankOutcome = Result<RankReport, (u8, String)>;

fn encode(report: &RankOutcome) -> Vec<u8> {
    serde_json::to_vec(report).unwrap_or_default()
}

fn decode(bytes: &[u8]) -> Result<RankOutcome, String> {
    serde_json::from_slice(bytes).map_err(|error| format!("an invalid report: {error}"))
}

/// Passes an image part of this rank or another one to its destination.
fn deliver<N: Network>(
    link: &mut Heartbeat<N>,
    route: &mut Route,
    root: Option<&mut Root<'_>>,
    from: u32,
    piece: ImagePart,
    work: &Work,
) -> Result<(), Error> {
    let own = from == link.rank();
    let mut root = root;
    if let Some(root) = root.as_mut() {
        root.count(&piece);
    }
    match route {
        Route::Tree(reduce) => {
            let Settings { width, .. } = work.settings;
            match (reduce.parent, root) {
                (Some(parent), _) if reduce.children == 0 => {
                    // A leaf's sums are sent unchanged.
                    reduce.count(from, &piece)?;
                    link.send(parent, Tag::ImagePart, piece.into_bytes())?;
                }
                (Some(parent), _) => {
                    if let Some(strip) = reduce.add(from, piece)? {
                        link.send(parent, Tag::ImagePart, ImagePart::of_strip(&strip, width).into_bytes())?;
                    }
                }
                (None, Some(root)) => {
                    reduce.count(from, &piece)?;
                    root.assembler.add(from, &piece)?;
                }
                (None, None) => {}
            }
            Ok(())
        }
        Route::Direct => match root {
            Some(root) => root.take(from, &piece),
            None if own => Ok(link.send(0, Tag::ImagePart, piece.into_bytes())?),
            None => Err(ClusterError::Protocol {
                rank: from,
                message: "an image part to a rank that is not the root".to_owned(),
            }
            .into()),
        },
    }
}
