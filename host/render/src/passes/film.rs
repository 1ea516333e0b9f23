//! The film on a device, and the launches that render into it.

use super::misuse;
use super::scene::SceneArrays;
use bytemuck::bytes_of;
use trisect_device::{
    BackendError, Buffer, Command, Device, DeviceKind, Dispatch, MathMode, RowSet, RowTarget, Started,
};
use trisect_kernels::{EntryPoint, FIRST_HIT, entry_point, render_kernel};
use trisect_shared::aovs::AovSums;
use trisect_shared::features::{AOVS, PADDED_BOXES, WIDE};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;

/// Description of a film: what stays the same over all submissions of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FilmDesc {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Kernel.
    pub kernel: EntryPoint,
    /// Math build of the kernels.
    pub math: MathMode,
}

/// Launch of a render kernel over a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Launch {
    /// Launch parameters.
    pub params: RenderParams,
    /// True if the BVH's boxes are padded for all ray origins of the launch.
    pub padded: bool,
}

impl Launch {
    /// Returns the form of the kernel for this launch: the camera may have left the space for which
    /// boxes are padded.
    fn kernel(&self, of: EntryPoint) -> EntryPoint {
        if self.padded { of } else { render_kernel(of.features & !PADDED_BOXES) }
    }
}

/// Film on a device, with a record for each pixel.
pub(super) struct DeviceFilm {
    /// Size, kernel and math build.
    pub of: FilmDesc,
    /// [`PixelSums`].
    pub sums: Buffer,
    /// [`Compensation`] of the pixel's unfinished chunk.
    compensations: Buffer,
    /// Counter of the queue from which persistent lanes take pixels.
    counter: Buffer,
    /// [`AovSums`], if the kernel writes them; else it may be too small.
    pub aovs: Buffer,
}

impl FilmDesc {
    /// Returns `width * height`.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    fn sums_bytes(&self) -> u64 {
        self.pixels() * size_of::<PixelSums>() as u64
    }

    fn aovs_bytes(&self) -> u64 {
        if self.has_aovs() { self.pixels() * size_of::<AovSums>() as u64 } else { 0 }
    }

    /// Returns whether the kernel writes AOV sums.
    pub fn has_aovs(&self) -> bool {
        self.kernel.has(AOVS)
    }
}

impl DeviceFilm {
    /// Allocates a film.
    fn new(device: &mut dyn Device, of: FilmDesc) -> Result<Self, BackendError> {
        let compensations = of.pixels() * size_of::<Compensation>() as u64;
        Ok(Self {
            of,
            sums: device.allocate(of.sums_bytes(), "the film")?,
            compensations: device.allocate(compensations, "the film")?,
            counter: device.allocate(size_of::<u32>() as u64, "the film")?,
            aovs: device.allocate(of.aovs_bytes(), "the film's AOV sums")?,
        })
    }

    /// Returns whether its buffers have room for another film.
    fn fits(&self, of: &FilmDesc) -> bool {
        self.sums.bytes() >= of.sums_bytes() && self.aovs.bytes() >= of.aovs_bytes()
    }

    /// Selects the kernel, and makes a film of [`PixelSums::UNWRITTEN`], with the memory of another
    /// film if that fits.
    pub fn begin(device: &mut dyn Device, of: FilmDesc, other: Option<Self>) -> Result<Self, BackendError> {
        device.compile(of.kernel, of.math)?;
        let film = match other.filter(|film| film.fits(&of)) {
            Some(film) => Self { of, ..film },
            None => Self::new(device, of)?,
        };
        let erase = |buffer, bytes| Command::Fill { buffer, first: 0, bytes, ones: true };
        let commands = vec![erase(&film.sums, of.sums_bytes()), erase(&film.aovs, of.aovs_bytes())];
        // SAFETY: no launch.
        unsafe { device.run(commands) }?;
        Ok(film)
    }

    /// Starts to render one submission into the film. The launch is one of the renderer that
    /// uploaded the scene.
    pub fn start_render(
        &self,
        device: &mut dyn Device,
        scene: &SceneArrays,
        launch: &Launch,
    ) -> Result<Started, BackendError> {
        let mut params = launch.params;
        let Self { of, sums, compensations, counter, aovs } = self;
        let last = params.rows.checked_sub(1).map_or(0, |last| params.row(last));
        if (params.width, params.height) != (of.width, of.height) || last >= of.height {
            return Err(misuse("the launch is for a film of another size"));
        }
        let kernel = launch.kernel(of.kernel);
        if kernel.queue && device.info().kind == DeviceKind::SoftwareGpu {
            // A software adapter runs lanes one after the other, and Mesa's lavapipe ends each loop
            // of a lane after 65,535 iterations.
            params.max_lane_pixels = 1;
        }
        let launch = Command::Dispatch(Dispatch {
            entry_point: kernel,
            math: of.math,
            params: bytes_of(&params),
            lengths: bytes_of(&scene.lengths),
            arrays: scene.of_launch([sums, compensations, counter, aovs], kernel.has(WIDE))?,
            threads: (params.width, params.rows),
        });
        let commands = if kernel.queue { vec![Command::clear(counter), launch] } else { vec![launch] };
        // SAFETY: the arrays are a valid scene's, and the renderer takes roots and counts from the
        // same scene. The film has a record for each pixel of the launch, whose size was compared,
        // and the kernels with AOVS got AOV sums.
        unsafe { device.start(commands) }
    }

    /// Copies these rows of the film, packed, to `sums`, and those of its AOV sums to `aovs`, which
    /// is empty if they are not wanted. Resets these rows at least to [`PixelSums::UNWRITTEN`] and
    /// [`AovSums::UNWRITTEN`].
    pub fn read(
        &self,
        device: &mut dyn Device,
        rows: &RowSet,
        sums: &mut [PixelSums],
        aovs: &mut [AovSums],
    ) -> Result<(), BackendError> {
        let wants_aovs = !aovs.is_empty();
        let mut commands = Vec::from(read_and_erase(&self.sums, RowTarget::records(sums, rows)));
        if wants_aovs {
            commands.extend(read_and_erase(&self.aovs, RowTarget::records(aovs, rows)));
        }
        // SAFETY: no launch.
        unsafe { device.run(commands) }.map(|_| ())
    }

    /// Copies these rows of sums and AOV sums, packed, which stay as they are: those of this film,
    /// or those `of` another place with as many pixels.
    pub fn copy(
        &self,
        device: &mut dyn Device,
        of: Option<[&Buffer; 2]>,
        rows: &RowSet,
        (sums, aovs): (&mut [PixelSums], &mut [AovSums]),
    ) -> Result<(), BackendError> {
        if !self.of.has_aovs() {
            return Err(misuse("the film has no AOV sums"));
        }
        let [from_sums, from_aovs] = of.unwrap_or([&self.sums, &self.aovs]);
        let commands = vec![
            Command::Read { from: from_sums, to: RowTarget::records(sums, rows) },
            Command::Read { from: from_aovs, to: RowTarget::records(aovs, rows) },
        ];
        // SAFETY: no launch.
        unsafe { device.run(commands) }.map(|_| ())
    }

    /// Writes the sums of all pixels to the film, and their AOV sums if the film's kernel writes
    /// AOV sums; otherwise `aovs` is empty.
    pub fn write(
        &self,
        device: &mut dyn Device,
        sums: &[PixelSums],
        aovs: &[AovSums],
    ) -> Result<(), BackendError> {
        let expected = if self.of.has_aovs() { sums.len() } else { 0 };
        if sums.len() as u64 != self.of.pixels() || aovs.len() != expected {
            return Err(misuse("the sums are for a film of another size"));
        }
        device.write(&self.sums, 0, bytemuck::cast_slice(sums))?;
        device.write(&self.aovs, 0, bytemuck::cast_slice(aovs))
    }

    /// Writes the first hit of each pixel's first sample of the launch to `hits`, which has a
    /// record for each pixel of the film.
    pub fn first_hits(
        &self,
        device: &mut dyn Device,
        scene: &SceneArrays,
        params: &RenderParams,
        hits: &mut [FirstHit],
    ) -> Result<(), BackendError> {
        let of = self.of;
        let entry_point = entry_point(FIRST_HIT).ok_or_else(|| misuse("there is no such kernel"))?;
        if (params.width, params.height) != (of.width, of.height) || hits.len() as u64 != of.pixels() {
            return Err(misuse("the launch is for a film of another size"));
        }
        device.compile(entry_point, of.math)?;
        let output = device.allocate(size_of_val(hits) as u64, "the first hits")?;
        // A browser refuses a launch that binds one buffer as several writable arrays.
        let mut unused = || device.allocate(0, "the first hits");
        let unused = [unused()?, unused()?, unused()?];
        let rows = RowSet::from(0..of.height);
        let launch = Dispatch {
            entry_point,
            math: of.math,
            params: bytes_of(params),
            lengths: bytes_of(&scene.lengths),
            arrays: scene.of_launch([&output, &unused[0], &unused[1], &unused[2]], false)?,
            threads: (of.width, of.height),
        };
        let read = Command::Read { from: &output, to: RowTarget::records(hits, &rows) };
        let commands = vec![Command::clear(&output), Command::Dispatch(launch), read];
        // SAFETY: as in `render`; the kernel writes only the output.
        unsafe { device.run(commands) }.map(|_| ())
    }
}

/// Returns commands that copy rows of a film to the host, and then erase all from the first of them
/// to the last.
fn read_and_erase<'a>(from: &'a Buffer, to: RowTarget<'a>) -> [Command<'a>; 2] {
    let start = to.rows().blocks().next().map_or(0, |block| block.start);
    let row = to.row_bytes() as u64;
    let (first, bytes) = (u64::from(start) * row, u64::from(to.rows().end().saturating_sub(start)) * row);
    [Command::Read { from, to }, Command::Fill { buffer: from, first, bytes, ones: true }]
}
