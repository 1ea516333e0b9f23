//! Part of one rank in a render over all ranks: it renders work items, passes image parts on, and
//! answers messages. On the root it also hands out work and puts the image together.

use super::ClusterError;
use super::heartbeat::Heartbeat;
use super::image_part::{ImagePart, WireFormat};
use super::network::{Message, Network, Tag};
use super::plan::{self, Balance, DistributionMode};
use super::reduce::Reduce;
use super::render_thread::RenderThread;
use super::root::{ResumableFilm, Root};
use super::route::{Route, deliver};
use super::work::{Failure, Finished, Work};
use super::work_item::{Source, WorkItem, WorkerState, assign, render};
use crate::Error;
use std::ops::Range;
use std::time::{Duration, Instant};
use trisect::device::{DeviceInfo, DeviceKind};
use trisect::film::SampleBlock;
use trisect::render::{PartSizer, RenderObserver, Renderer, Settings};
use trisect::stats::{ClusterReport, RankReport};

/// Maximum time that an interrupted rank waits for the root to end the job.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(60);

/// Result of one turn of the loop.
pub(super) enum Turn {
    /// The image is not complete.
    Goes,
    /// The image is complete; on the root with the result.
    Done(Option<Box<Finished>>),
}

/// State of a rank during a render.
pub(super) struct RankRender<'a> {
    work: &'a Work,
    rank: u32,
    averages: bool,
    route: Route,
    source: Source,
    /// State of the root; `None` on the other ranks.
    root: Option<Root<'a>>,
    thread: RenderThread<WorkerState, WorkItem, ImagePart>,
    start: Instant,
    /// Bytes that the network had sent at the start.
    sent_before: u64,
    own: RankReport,
    last_piece: Instant,
    reported: bool,
    /// Time at which this rank was asked to end.
    told: Option<Instant>,
}

/// Returns the samples of a rank.
fn samples(work: &Work, rank: u32, averaging: u32) -> Range<u32> {
    match work.plan.mode {
        DistributionMode::Rows => 0..work.settings.samples,
        DistributionMode::Average if rank < averaging => {
            plan::samples_of(work.settings.samples, rank, averaging)
        }
        DistributionMode::Average => 0..0,
    }
}

/// Returns the source of a rank's work items.
fn source(work: &Work, device: &DeviceInfo, rank: u32, ranks: u32, samples: Range<u32>) -> Source {
    let Work { settings, plan, .. } = work;
    let averages = plan.mode == DistributionMode::Average;
    if !averages && plan.balance == Balance::Dynamic {
        let speed = PartSizer::unknown(device.kind, settings.pixels());
        return Source::Root { asked: false, over: false, ready: None, speed };
    }
    let rows = plan.rows(settings.height, rank, ranks);
    let strip = if averages { plan::strip_rows(settings.height) } else { u32::MAX };
    // Only whole images keep a GPU busy; on a CPU, a strip is sent while the next one is rendered.
    let whole = match device.kind {
        DeviceKind::Cpu if averages => strip,
        _ if averages => settings.height,
        _ => 1u32 << plan.block_shift.min(16),
    };
    // The speed follows from the first image part; a GPU needs many samples to be busy.
    let per_row = (u64::from(settings.width) * samples.len() as u64).max(1);
    let first = if device.kind == DeviceKind::Gpu { 1u64 << 28 } else { 1 << 20 };
    let at_once = u32::try_from(first / per_row).unwrap_or(u32::MAX / 2);
    let at_once = if averages { whole } else { (at_once / whole * whole).max(whole) };
    Source::Static { rows, next: 0, at_once, whole, samples, strip }
}

impl<'a> RankRender<'a> {
    /// Checks the work and starts the thread that renders.
    ///
    /// # Errors
    ///
    /// For settings out of range, a film that does not fit, or a thread that cannot be started.
    pub fn start<N: Network>(
        link: &Heartbeat<N>,
        renderer: Renderer,
        work: &'a Work,
        kept: Option<ResumableFilm<'a>>,
    ) -> Result<Self, Error> {
        let Work { settings, plan, wire_format, .. } = work;
        settings.check()?;
        let (rank, ranks) = (link.rank(), link.ranks());
        let device = renderer.device().info().clone();
        let averages = plan.mode == DistributionMode::Average;
        let averaging = plan::averaging(settings.samples, ranks);
        let tree = averages && matches!(wire_format, WireFormat::Chunk | WireFormat::Mean);
        let route = match tree && rank < averaging {
            true => Route::Tree(Reduce::new(settings, rank, averaging)),
            false => Route::Direct,
        };
        let source = source(work, &device, rank, ranks, samples(work, rank, averaging));
        let root = if rank == 0 { Some(Root::new(work, ranks, kept)?) } else { None };
        let phases = if tree { plan::phases(settings.samples, averaging) } else { 1 };
        let state = WorkerState { renderer, settings: settings.clone(), wire_format: *wire_format, phases };
        let thread = RenderThread::new(state, render)?;
        let (start, name) = (Instant::now(), format!("{}: {}", device.backend, device.name));
        let own = RankReport { rank, host: link.host_of(rank), device: name, ..RankReport::default() };
        Ok(Self {
            work,
            rank,
            averages,
            route,
            source,
            root,
            thread,
            start,
            sent_before: link.sent,
            own,
            last_piece: start,
            reported: false,
            told: None,
        })
    }

    /// Orders work, passes on what was rendered, answers messages and reports.
    ///
    /// # Errors
    ///
    /// An error of this rank or another, a rank that was silent for too long, or a request to end.
    pub fn turn<N: Network>(
        &mut self,
        link: &mut Heartbeat<N>,
        observer: &mut dyn RenderObserver,
        ended: &dyn Fn() -> bool,
    ) -> Result<Turn, Error> {
        self.order_work(link)?;
        self.pass_on_products(link)?;
        while let Some(message) = link.receive()? {
            if message.tag == Tag::Done && self.reported {
                return Ok(Turn::Done(None));
            }
            self.answer(link, message)?;
        }
        self.check_end(ended)?;
        if let Some(root) = &mut self.root {
            if observer.progress(root.assembler.done, root.assembler.total).is_break() {
                return Err(trisect::Error::Cancelled.into());
            }
            root.look();
        }
        self.report(link)?;
        self.finish(link)
    }

    /// Keeps two work items with the thread: one is rendered while the next one waits.
    fn order_work<N: Network>(&mut self, link: &mut Heartbeat<N>) -> Result<(), Error> {
        while self.thread.open() < 2 && !self.source.is_over() {
            if let Source::Root { asked, over, ready: None, speed } = &mut self.source
                && !*asked
                && !*over
            {
                match self.root.as_mut().and_then(|root| root.hand_out(speed.samples)) {
                    Some(part) => {
                        *over = part.is_none();
                        assign(&mut self.source, part);
                    }
                    None => {
                        *asked = true;
                        link.send(0, Tag::WorkRequest, speed.samples.to_le_bytes().to_vec())?;
                    }
                }
            }
            match self.source.take() {
                Some(order) => self.thread.submit(order),
                None => break,
            }
        }
        Ok(())
    }

    /// Passes on the image parts that the thread has rendered; waits a little for the first one.
    fn pass_on_products<N: Network>(&mut self, link: &mut Heartbeat<N>) -> Result<(), Error> {
        let mut within = link.nap();
        while let Some(product) = self.thread.next_product(within) {
            within = Duration::ZERO;
            let piece = match product {
                Ok(piece) => piece,
                Err(error) if self.rank == 0 => return Err(error),
                Err(error) => {
                    // The root reports the error and ends the job.
                    link.send(0, Tag::Report, encode(&Err((error.exit_code(), error.to_string()))))?;
                    link.flush()?;
                    link.expect(Tag::Done)?;
                    return Err(error);
                }
            };
            self.last_piece = Instant::now();
            self.own.render_seconds += piece.render_seconds;
            self.own.device_seconds += piece.device_seconds;
            self.own.pieces += 1;
            self.own.samples += piece.counts.samples + piece.counts.rejected;
            if !self.averages {
                self.source.learn(&piece);
            }
            self.deliver(link, self.rank, piece)?;
        }
        Ok(())
    }

    fn deliver<N: Network>(
        &mut self,
        link: &mut Heartbeat<N>,
        from: u32,
        piece: ImagePart,
    ) -> Result<(), Error> {
        deliver(link, &mut self.route, self.root.as_mut(), from, piece, self.work)
    }

    /// Answers a message of another rank.
    fn answer<N: Network>(&mut self, link: &mut Heartbeat<N>, message: Message) -> Result<(), Error> {
        let Message { from, tag, bytes } = message;
        let settings = &self.work.settings;
        match tag {
            Tag::ImagePart => {
                let piece = ImagePart::read(from, bytes, settings.width, settings.height)?;
                self.deliver(link, from, piece)?;
            }
            Tag::WorkRequest => {
                let most = <[u8; 8]>::try_from(bytes.as_slice()).map_or(u64::MAX, u64::from_le_bytes);
                let part = self.root.as_mut().and_then(|root| root.hand_out(most)).flatten();
                link.send(from, Tag::Work, words(part.as_ref()))?;
            }
            Tag::Work => {
                let part = part(&bytes, settings);
                if let Source::Root { asked, over, .. } = &mut self.source {
                    (*asked, *over) = (false, part.is_none());
                }
                assign(&mut self.source, part);
            }
            Tag::Report => match decode(&bytes) {
                Ok(Ok(report)) => {
                    let reports = self.root.as_mut().map(|root| &mut root.reports);
                    if let Some(place) = reports.and_then(|reports| reports.get_mut(from as usize)) {
                        *place = Some(report);
                    }
                }
                Ok(Err((code, message))) => {
                    let host = link.host_of(from);
                    return Err(ClusterError::Rank { rank: from, host, message, code }.into());
                }
                Err(message) => return Err(ClusterError::Protocol { rank: from, message }.into()),
            },
            other => {
                let message = format!("{other:?} while an image is rendered");
                return Err(ClusterError::Protocol { rank: from, message }.into());
            }
        }
        Ok(())
    }

    /// Ends the render if this process was asked to end. Only the root reports that. Other ranks
    /// stay alive until it has written the partial image, because a rank that ends would end the
    /// root, too.
    fn check_end(&mut self, ended: &dyn Fn() -> bool) -> Result<(), Error> {
        let is_late =
            |told: &mut Option<Instant>| told.get_or_insert_with(Instant::now).elapsed() > SHUTDOWN_TIMEOUT;
        if ended() && (self.rank == 0 || is_late(&mut self.told)) {
            let (done, total) = self.root.as_ref().map_or((0, 0), |root| root.assembler.pixels());
            return Err(ClusterError::Ended { done, total }.into());
        }
        Ok(())
    }

    /// Reports the times of this rank, once all that it rendered was sent.
    fn report<N: Network>(&mut self, link: &mut Heartbeat<N>) -> Result<(), Error> {
        let passed_on = match &self.route {
            Route::Direct => true,
            Route::Tree(reduce) => reduce.is_over(),
        };
        let rendered = self.source.is_over() && self.thread.open() == 0 && passed_on;
        if !rendered || self.reported || link.network().unsent() > 0 {
            return Ok(());
        }
        let Some(now) = self.root.as_ref().map_or_else(|| Some(Instant::now()), |root| root.last_arrival)
        else {
            return Ok(());
        };
        self.reported = true;
        let own = &mut self.own;
        own.seconds = now.duration_since(self.start).as_secs_f64();
        own.sync_seconds = now.saturating_duration_since(self.last_piece).as_secs_f64();
        let until = self.last_piece.duration_since(self.start).as_secs_f64();
        own.wait_seconds = (until - own.render_seconds).max(0.0);
        own.bytes = link.sent - self.sent_before;
        match &mut self.root {
            Some(root) => root.reports[0] = Some(own.clone()),
            None => link.send(0, Tag::Report, encode(&Ok(own.clone())))?,
        }
        Ok(())
    }

    /// Ends the render on the root, once all ranks have reported.
    fn finish<N: Network>(&mut self, link: &mut Heartbeat<N>) -> Result<Turn, Error> {
        if !self.root.as_ref().is_some_and(|root| root.reports.iter().all(Option::is_some)) {
            return Ok(Turn::Goes);
        }
        link.send_all(Tag::Done, &[])?;
        link.flush()?;
        let Some(root) = self.root.take() else { return Ok(Turn::Goes) };
        let seconds = root.last_arrival.unwrap_or(self.start).duration_since(self.start).as_secs_f64();
        let reports = root.reports.iter().flatten().cloned().collect();
        let report = ClusterReport::new(self.work.plan, self.work.choice.clone(), seconds, reports);
        let (counts, before, submissions) = (root.counts(), root.before, root.submissions);
        let finished = Finished { picture: root.picture(), report, counts, before, submissions };
        Ok(Turn::Done(Some(Box::new(finished))))
    }

    /// Ends the thread and returns the renderer.
    pub fn into_renderer(self) -> Renderer {
        self.thread.end().renderer
    }

    /// Returns the error, on the root with the partial image.
    pub fn failed(self, error: Error) -> Failure {
        match self.root {
            Some(root) => root.failed(error),
            None => error.into(),
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
