//! Totals of a film on the device: 7, 21 and 22 for its kernels, which get chunks with any values.
#![allow(unsafe_code, reason = "launches of kernels, with arrays of the sizes that they need")]

use bytemuck::{Zeroable, bytes_of, cast_slice};
use glam::Vec3;
use trisect::device::{BackendError, Buffer};
use trisect::device::{Command, Device, Dispatch, MathMode, RowSet, RowTarget};
use trisect::film::{Film, PixelTotals, SampleBlock};
use trisect::scene::Scene;
use trisect_kernels::{FILM_ADD, FILM_COUNT, FILM_READ, entry_point};
use trisect_shared::film::PixelSums;
use trisect_shared::rng::PathKey;
use trisect_shared::totals::{COUNT_WORDS, COUNTED_ROWS, READ_WORDS, SUMS, TOTAL_WORDS, TotalsParams};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Number of samples of a chunk here.
const SAMPLES: u32 = 256;

/// Number of words behind the output of a launch, which no kernel may write: enough for the threads
/// of a workgroup outside the launch.
const BEHIND: u32 = 16 * READ_WORDS;

/// Totals of some rows of pixels on a device.
struct Rows {
    device: Box<dyn Device>,
    width: u32,
    rows: u32,
    sums: Buffer,
    totals: Buffer,
    output: Buffer,
    unused: Buffer,
}

impl Rows {
    fn new(subject: BackendUnderTest, width: u32, rows: u32) -> Option<Self> {
        let mut device = subject.renderer(&Scene::hello_world().unwrap())?.into_device();
        for name in [FILM_ADD, FILM_READ, FILM_COUNT] {
            device.compile(entry_point(name).unwrap(), MathMode::Precise).unwrap();
        }
        let mut allocate =
            |words: u32| device.allocate(u64::from(words * width * rows * 4), "a test").unwrap();
        let (sums, totals) = (allocate(8), allocate(TOTAL_WORDS));
        let (output, unused) = (allocate(READ_WORDS + BEHIND), allocate(1));
        let mut made = Self { device, width, rows, sums, totals, output, unused };
        made.clear();
        Some(made)
    }

    fn run(&mut self, commands: Vec<Command<'_>>) -> Result<(), BackendError> {
        // SAFETY: the arrays have records and words for each pixel.
        unsafe { self.device.run(commands) }.map(|_| ())
    }

    fn clear(&mut self) {
        let totals = self.totals.clone();
        self.run(vec![Command::clear(&totals)]).unwrap();
    }

    fn params(&self) -> TotalsParams {
        let (width, rows, samples) = (self.width, self.rows, SAMPLES);
        TotalsParams { width, height: rows, rows, block_shift: 31, samples, sums: SUMS, ..Zeroable::zeroed() }
    }

    fn threads(&self, name: &str) -> (u32, u32) {
        (self.width, if name == FILM_COUNT { self.rows.div_ceil(COUNTED_ROWS) } else { self.rows })
    }

    fn launch(&mut self, name: &'static str) {
        let (params, threads) = (self.params(), self.threads(name));
        let arrays = [self.sums.clone(), self.unused.clone(), self.totals.clone(), self.output.clone()];
        let launch = Dispatch {
            entry_point: entry_point(name).unwrap(),
            math: MathMode::Precise,
            params: bytes_of(&params),
            lengths: &[],
            arrays: arrays.iter().collect(),
            threads,
        };
        self.run(vec![Command::Dispatch(launch)]).unwrap();
    }

    /// Adds a chunk, of a record for each pixel.
    fn add(&mut self, chunk: &[PixelSums]) {
        let sums = self.sums.clone();
        self.device.write(&sums, 0, cast_slice(chunk)).unwrap();
        self.launch(FILM_ADD);
    }

    fn read(&mut self) -> Vec<PixelTotals> {
        self.launch(FILM_READ);
        let mut totals = vec![PixelTotals::zeroed(); self.width as usize];
        let (output, rows) = (self.output.clone(), RowSet::from(0..1));
        let to = RowTarget::records(&mut totals, &rows);
        self.run(vec![Command::Read { from: &output, to }]).unwrap();
        totals
    }
}

/// Returns the host's totals of the same chunks.
fn on_host(chunks: &[Vec<PixelSums>]) -> Vec<PixelTotals> {
    let mut film = Film::new(chunks[0].len() as u32, 1);
    for (first, chunk) in (0..).step_by(SAMPLES as usize).zip(chunks) {
        film.merge(&SampleBlock { rows: 0..1, samples: first..first + SAMPLES }, chunk).unwrap();
    }
    film.pixels.exact().into_owned()
}

fn bits(totals: &[PixelTotals]) -> &[u32] {
    cast_slice(totals)
}

/// Returns a chunk whose radiance and squares have this value in each channel.
fn splat(value: f32) -> PixelSums {
    PixelSums { radiance: Vec3::splat(value), samples: SAMPLES, squares: Vec3::splat(value), segments: 3 }
}

/// Returns chunks of random sums of 40 binades, and of what no sum should be.
fn random(width: u32, count: u32) -> Vec<Vec<PixelSums>> {
    let record = |chunk: u32, pixel: u32| {
        let random = |i: u32| PathKey { seed: 7 + i, pixel, sample: chunk }.words(0);
        let number = |i: u32| {
            let w = random(i);
            f32::from_bits(w.y & 0x8000_0000 | (127 - 20 + w.x % 40) << 23 | w.z & 0x007f_ffff)
        };
        let w = random(9);
        let special = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -0.0, 1e9, 0.0];
        let vector = |i| Vec3::new(number(i), number(i + 1), number(i + 2));
        let sums = PixelSums {
            radiance: vector(0),
            samples: w.x % (SAMPLES + 1),
            squares: vector(3),
            segments: w.y | 0x8000_0000,
        };
        match pixel {
            // One pixel has each special value, in a channel of one chunk; others are not written.
            0..=5 if chunk == 3 => {
                PixelSums { squares: Vec3::new(1.0, special[pixel as usize], 2.0), ..sums }
            }
            6 if chunk == 0 => PixelSums::UNWRITTEN,
            7 if chunk == count - 1 => PixelSums::UNWRITTEN,
            _ => sums,
        }
    };
    (0..count).map(|chunk| (0..width).map(|pixel| record(chunk, pixel)).collect()).collect()
}

/// Random chunks add up to the host's bits, in each of several orders.
fn t07_totals_on_the_device(subject: BackendUnderTest) {
    let chunks = random(300, 24);
    let Some(mut row) = Rows::new(subject, 300, 1) else { return };
    let want = on_host(&chunks);
    for step in [1, 5, 7, 23] {
        row.clear();
        (0..24).for_each(|at| row.add(&chunks[at * step % 24]));
        let got = row.read();
        let first = bits(&got).iter().zip(bits(&want)).position(|(got, want)| got != want);
        assert_eq!(first, None, "order {step}: word of pixel {:?}", first.map(|at| at / READ_WORDS as usize));
    }
    let unwritten = &want[6];
    assert!(unwritten.unwritten == u64::from(SAMPLES) && unwritten.radiance[0].value().is_nan());
    // A chunk counts once: its records were reset, so that another launch finds nothing there.
    row.launch(FILM_ADD);
    assert!(row.read().iter().all(|totals| totals.unwritten >= u64::from(SAMPLES)));
    // Negative controls: a chunk too few, and one twice.
    for order in [(0..23).collect::<Vec<_>>(), (0..24).chain([4]).collect()] {
        row.clear();
        order.iter().for_each(|&at: &usize| row.add(&chunks[at]));
        assert_ne!(bits(&row.read()), bits(&want), "negative control not detected");
    }
    report(
        7,
        subject,
        Outcome::Passed,
        "24 random chunks in 4 orders, added up on the device: the host's bits",
    );
}

/// The mean of 2²¹ samples of 0.1 in chunks is off by at most 1e-6, and has the host's bits.
fn t21_totals_on_the_device(subject: BackendUnderTest) {
    const CHUNKS: usize = 1 << 13;
    let Some(mut row) = Rows::new(subject, 1, 1) else { return };
    let chunk = vec![splat(0.1 * SAMPLES as f32)];
    (0..CHUNKS).for_each(|_| row.add(&chunk));
    let got = row.read();
    assert_eq!(bits(&got), bits(&on_host(&vec![chunk.clone(); CHUNKS])));
    let off = (got[0].mean()[0] / 0.1 - 1.0).abs();
    assert!(off <= 1e-6, "{off}");
    // Negative control: sums in f32.
    let plain = (0..CHUNKS).fold(0.0f32, |sum, _| sum + chunk[0].radiance.x);
    let plain = (f64::from(plain) / (CHUNKS as f64 * f64::from(SAMPLES)) / 0.1 - 1.0).abs();
    assert!(plain > 1e-6, "negative control not detected: {plain}");
    report(
        21,
        subject,
        Outcome::Passed,
        format!("on the device: relative error {off:.1e}; in f32 {plain:.1e}"),
    );
}

/// Terms that cancel leave what is left, at any ratio: also where a pair of f64 would lose it.
fn t22_totals_on_the_device(subject: BackendUnderTest) {
    let Some(mut row) = Rows::new(subject, 1, 1) else { return };
    let (most, least) = (f32::MAX, f32::from_bits(1));
    for (terms, left) in [
        ([16_777_216.0, 1.0, -16_777_216.0, 0.0, 0.0], 1.0),
        ([most, 1.0, least, -most, -1.0], least),
        ([-most, -least, 1.0, most, -1.0], -least),
    ] {
        for turn in 0..5 {
            row.clear();
            (0..5).for_each(|at| row.add(&[splat(terms[(at + turn) % 5])]));
            let totals = row.read()[0];
            for sum in totals.radiance.iter().chain(&totals.squares) {
                assert_eq!(sum.parts(), (f64::from(left), 0.0), "{terms:?} from {turn}");
            }
        }
    }
    // Negative control: pairs of f64, as the host has them, lose the smallest of them.
    let host = on_host(&[most, 1.0, least, -most, -1.0].map(|term| vec![splat(term)]));
    assert_ne!(host[0].radiance[0].value(), f64::from(least), "negative control not detected");
    report(22, subject, Outcome::Passed, "on the device: exact over 277 bits, in each of 5 orders");
}

/// Threads of a workgroup outside the launch write nothing: words behind the output of its own
/// threads stay as they were.
fn nothing_is_written_outside(subject: BackendUnderTest) {
    for (width, rows) in [(1, 1), (7, 5), (17, 3), (9, COUNTED_ROWS + 1)] {
        let Some(mut of) = Rows::new(subject, width, rows) else { return };
        of.add(&vec![PixelSums { samples: SAMPLES, ..PixelSums::zeroed() }; (width * rows) as usize]);
        for (name, words) in [(FILM_COUNT, COUNT_WORDS), (FILM_READ, READ_WORDS), (FILM_ADD, 0)] {
            let output = of.output.clone();
            let all = Command::Fill { buffer: &output, first: 0, bytes: output.bytes(), ones: true };
            let threads = of.threads(name);
            let own = words * threads.0 * threads.1;
            // Counts add up from those of no chunk.
            let bytes = if name == FILM_COUNT { u64::from(4 * own) } else { 0 };
            let none = Command::Fill { buffer: &output, first: 0, bytes, ones: false };
            of.run(vec![all, none]).unwrap();
            of.launch(name);
            let mut found = vec![0u32; output.bytes() as usize / 4];
            let words_of = RowSet::from(0..found.len() as u32);
            let to = RowTarget::records(&mut found, &words_of);
            of.run(vec![Command::Read { from: &output, to }]).unwrap();
            let (own, behind) = found.split_at(own as usize);
            assert!(behind.iter().all(|&word| word == u32::MAX), "{name} of {width}x{rows} pixels");
            assert!(words == 0 || own.contains(&0), "{name}: negative control not detected");
        }
    }
}

for_each_route!(nothing_is_written_outside);
for_each_route!(t07_totals_on_the_device, t21_totals_on_the_device, t22_totals_on_the_device);
