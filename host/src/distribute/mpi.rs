//! Ranks that MPI started.
//!
//! rsmpi starts and ends MPI; messages go by MPI's own calls (MPI 4.0, sections 3.7 and 3.8), since their buffers live as long as the transfer
//! and not as long as a scope.
#![allow(unsafe_code, reason = "calls MPI; each block names why it is sound")]

use super::network::{Message, Network, Tag};
use super::{DistributeError, Shared};
use ::mpi::collective::SystemOperation;
use ::mpi::environment::Universe;
use ::mpi::ffi::{self, MPI_Request, MPI_Status};
use ::mpi::topology::{Color, Communicator, SimpleCommunicator};
use ::mpi::traits::{AsRaw, CommunicatorCollectives, Root};
use std::collections::VecDeque;
use std::mem::MaybeUninit;

/// A transfer, and the memory that MPI reads or writes until it ends.
struct Transfer {
    request: MPI_Request,
    /// The message; of one that is sent, its content only.
    message: Message,
    /// Or this.
    words: Vec<u32>,
    done: bool,
}

/// All processes that `mpirun` started.
pub struct Mpi {
    world: SimpleCommunicator,
    group: Option<SimpleCommunicator>,
    /// What ranks of this host share.
    window: Option<ffi::MPI_Win>,
    local: u32,
    host: String,
    sends: Vec<Transfer>,
    receives: VecDeque<Transfer>,
    /// Words that were sent.
    spent: Vec<Vec<u32>>,
    // Last: MPI ends with it.
    _universe: Universe,
}

/// Buffers that are kept for later, at most.
const SPENT: usize = 4;

fn check(action: &'static str, code: i32) -> Result<(), DistributeError> {
    if code == ffi::MPI_SUCCESS as i32 { Ok(()) } else { Err(DistributeError::Mpi { action, code }) }
}

impl Mpi {
    /// Starts MPI, once in a process. Only the thread that did calls it.
    ///
    /// # Errors
    ///
    /// [`DistributeError::Mpi`].
    pub fn start() -> Result<Self, DistributeError> {
        let failed = DistributeError::Mpi { action: "starting", code: -1 };
        let started = ::mpi::initialize_with_threading(::mpi::Threading::Funneled);
        let (universe, threading) = started.ok_or(failed.clone())?;
        if threading < ::mpi::Threading::Funneled {
            return Err(failed);
        }
        let world = universe.world();
        let host = ::mpi::environment::processor_name().unwrap_or_else(|_| "an unnamed host".to_owned());
        let local = world.split_shared(world.rank()).rank().unsigned_abs();
        Ok(Self {
            world,
            group: None,
            window: None,
            local,
            host,
            sends: Vec::new(),
            receives: VecDeque::new(),
            spent: Vec::new(),
            _universe: universe,
        })
    }

    /// Whether a transfer ended.
    fn test(transfer: &mut Transfer) -> Result<bool, DistributeError> {
        if !transfer.done {
            let mut flag = 0;
            let mut status = MaybeUninit::<MPI_Status>::uninit();
            // SAFETY: the request is one that MPI gave and that no test has ended; flag and status are written.
            let code = unsafe { ffi::MPI_Test(&mut transfer.request, &mut flag, status.as_mut_ptr()) };
            check("waiting for a message", code)?;
            transfer.done = flag != 0;
        }
        Ok(transfer.done)
    }

    /// Begins to send bytes, or words.
    fn begin(&mut self, to: u32, tag: Tag, bytes: Vec<u8>, words: Vec<u32>) -> Result<(), DistributeError> {
        let content: &[u8] = if words.is_empty() { &bytes } else { bytemuck::cast_slice(&words) };
        let count = i32::try_from(content.len()).map_err(|_| DistributeError::Unsupported {
            what: format!("a message of {} bytes; MPI's have at most 2^31 - 1", content.len()),
            remedy: "use more ranks, or a smaller --block".to_owned(),
        })?;
        let mut request = MaybeUninit::uninit();
        // SAFETY: the content lies on the heap and stays there, unchanged, in `sends` until a test has ended the request.
        let code = unsafe {
            ffi::MPI_Isend(
                content.as_ptr().cast(),
                count,
                ffi::RSMPI_UINT8_T,
                to as i32,
                tag as i32,
                self.world.as_raw(),
                request.as_mut_ptr(),
            )
        };
        check("sending", code)?;
        // SAFETY: the call succeeded and wrote it.
        let request = unsafe { request.assume_init() };
        let message = Message { from: self.rank(), tag, bytes };
        self.sends.push(Transfer { request, message, words, done: false });
        Ok(())
    }

    /// Begins to receive what has arrived.
    fn accept(&mut self) -> Result<bool, DistributeError> {
        let mut flag = 0;
        let mut handle = MaybeUninit::uninit();
        let mut status = MaybeUninit::<MPI_Status>::uninit();
        let world = self.world.as_raw();
        // SAFETY: flag, handle and status are written where a message is there.
        let code = unsafe {
            ffi::MPI_Improbe(
                ffi::RSMPI_ANY_SOURCE,
                ffi::RSMPI_ANY_TAG,
                world,
                &mut flag,
                handle.as_mut_ptr(),
                status.as_mut_ptr(),
            )
        };
        check("looking for a message", code)?;
        if flag == 0 {
            return Ok(false);
        }
        // SAFETY: a message is there, so both were written.
        let (mut handle, status) = unsafe { (handle.assume_init(), status.assume_init()) };
        let mut count = 0;
        // SAFETY: the status is that of the message.
        let code = unsafe { ffi::MPI_Get_count(&status, ffi::RSMPI_UINT8_T, &mut count) };
        check("asking for a message's length", code)?;
        let from = status.MPI_SOURCE.unsigned_abs();
        let Some(tag) = Tag::of(status.MPI_TAG) else {
            let message = format!("a message of kind {}", status.MPI_TAG);
            return Err(DistributeError::Protocol { rank: from, message });
        };
        let mut bytes = vec![0u8; count.max(0) as usize];
        let mut request = MaybeUninit::uninit();
        // SAFETY: the buffer has `count` bytes on the heap, and stays there, untouched, in `receives` until a test has ended the request.
        let code = unsafe {
            ffi::MPI_Imrecv(
                bytes.as_mut_ptr().cast(),
                count,
                ffi::RSMPI_UINT8_T,
                &mut handle,
                request.as_mut_ptr(),
            )
        };
        check("receiving", code)?;
        // SAFETY: the call succeeded and wrote it.
        let request = unsafe { request.assume_init() };
        self.receives.push_back(Transfer {
            request,
            message: Message { from, tag, bytes },
            words: Vec::new(),
            done: false,
        });
        Ok(true)
    }
}

impl Network for Mpi {
    fn rank(&self) -> u32 {
        self.world.rank().unsigned_abs()
    }

    fn ranks(&self) -> u32 {
        self.world.size().unsigned_abs()
    }

    fn host(&self) -> String {
        self.host.clone()
    }

    fn local(&self) -> u32 {
        self.local
    }

    fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), DistributeError> {
        self.begin(to, tag, bytes, Vec::new())
    }

    fn send_words(&mut self, to: u32, tag: Tag, words: Vec<u32>) -> Result<(), DistributeError> {
        self.begin(to, tag, Vec::new(), words)
    }

    fn reclaim(&mut self) -> Option<Vec<u32>> {
        self.spent.pop()
    }

    fn receive(&mut self) -> Result<Option<Message>, DistributeError> {
        while self.accept()? {}
        self.unsent();
        let mut waits = Vec::new();
        let mut ready = None;
        for (index, transfer) in self.receives.iter_mut().enumerate() {
            let from = transfer.message.from;
            let in_turn = transfer.message.tag == Tag::Pulse || !waits.contains(&from);
            if Self::test(transfer)? && in_turn {
                ready = Some(index);
                break;
            }
            waits.push(from);
        }
        Ok(ready.and_then(|index| self.receives.remove(index)).map(|transfer| transfer.message))
    }

    fn unsent(&mut self) -> usize {
        // One that fails stays, and so shows.
        let spent = &mut self.spent;
        self.sends.retain_mut(|transfer| {
            let done = Self::test(transfer).unwrap_or(false);
            if done && !transfer.words.is_empty() && spent.len() < SPENT {
                spent.push(std::mem::take(&mut transfer.words));
            }
            !done
        });
        self.sends.len()
    }

    fn share(&mut self, words: usize) -> Result<Option<Shared>, DistributeError> {
        let group = self.group.as_ref().unwrap_or(&self.world);
        let host = group.split_shared(group.rank());
        // Ranks keep their order: if the root is here, it is the first.
        let mut first = group.rank();
        host.process_at_rank(0).broadcast_into(&mut first);
        if first != 0 {
            return Ok(None);
        }
        let own = if host.rank() == 0 { words * size_of::<u32>() } else { 0 };
        let mut pointer: *mut std::ffi::c_void = std::ptr::null_mut();
        let mut window = MaybeUninit::uninit();
        // SAFETY: all of the host's ranks call this; pointer and window are written.
        let code = unsafe {
            ffi::MPI_Win_allocate_shared(
                own as ffi::MPI_Aint,
                size_of::<u32>() as i32,
                ffi::RSMPI_INFO_NULL,
                host.as_raw(),
                (&raw mut pointer).cast(),
                window.as_mut_ptr(),
            )
        };
        check("sharing memory", code)?;
        // SAFETY: the call succeeded and wrote it.
        let window = unsafe { window.assume_init() };
        self.window = Some(window);
        let (mut size, mut unit) = (0, 0);
        // SAFETY: the window is there; size, unit and pointer are written.
        let code =
            unsafe { ffi::MPI_Win_shared_query(window, 0, &mut size, &mut unit, (&raw mut pointer).cast()) };
        check("sharing memory", code)?;
        // SAFETY: the root's part of the window has so many words, until `unshare`, which all call when they are done.
        Ok(Some(unsafe { Shared::new(pointer.cast(), words) }))
    }

    fn unshare(&mut self) -> Result<(), DistributeError> {
        match self.window.take() {
            // SAFETY: all of the host's ranks call this, and use the memory no more.
            Some(mut window) => check("sharing memory", unsafe { ffi::MPI_Win_free(&mut window) }),
            None => Ok(()),
        }
    }

    fn is_busy(&mut self) -> bool {
        self.unsent() > 0 || !self.receives.is_empty()
    }

    fn group(&mut self, ranks: u32) -> Result<(), DistributeError> {
        let inside = self.rank() < ranks;
        let color = if inside { Color::with_value(0) } else { Color::undefined() };
        self.group = self.world.split_by_color(color);
        Ok(())
    }

    fn all_reduce(&mut self, values: &mut [f32]) -> Result<(), DistributeError> {
        let own = values.to_vec();
        self.group.as_ref().unwrap_or(&self.world).all_reduce_into(&own[..], values, SystemOperation::sum());
        Ok(())
    }

    fn abort(&mut self, code: u8) -> ! {
        self.world.abort(i32::from(code))
    }
}

impl Drop for Mpi {
    /// MPI may still read what was sent: that goes on while it ends, and so is not freed.
    fn drop(&mut self) {
        for transfer in self.sends.drain(..).chain(self.receives.drain(..)) {
            if !transfer.done {
                std::mem::forget((transfer.message.bytes, transfer.words));
            }
        }
    }
}
