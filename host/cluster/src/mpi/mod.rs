//! Network of the ranks that MPI started.
//!
//! rsmpi starts and ends MPI. Messages use MPI's own calls (MPI 4.0, sections 3.7 and 3.8), because
//! rsmpi ties a buffer to a scope, and here a buffer must live until its transfer ends.
#![allow(unsafe_code, reason = "calls MPI; each block says why it is sound")]

mod shared_memory;
mod transfer;
mod window;

use crate::ClusterError;
use crate::network::{Message, Network, Tag};
use ::mpi::collective::SystemOperation;
use ::mpi::environment::Universe;
use ::mpi::ffi::{self, MPI_Request, MPI_Status};
use ::mpi::topology::{Color, Communicator, SimpleCommunicator};
use ::mpi::traits::{AsRaw, CommunicatorCollectives, Root};
use shared_memory::{MessageSlot, SharedMemoryTransport};
use std::collections::VecDeque;
use std::mem::MaybeUninit;
use transfer::{Content, MessageKind, Received, Sent};
use trisect::film::{FrameMemory, HostMemory};
use window::Window;

/// Network of all processes that `mpirun` started.
pub struct Mpi {
    world: SimpleCommunicator,
    group: Option<SimpleCommunicator>,
    /// Frames that the ranks of this host share.
    window: Option<Window>,
    /// Transport of long messages to ranks of this host.
    shared_memory: Option<SharedMemoryTransport>,
    /// Messages that wait for free shared memory, and later ones that must not overtake them:
    /// receiver, tag, content.
    waiting: VecDeque<(u32, Tag, Content)>,
    local: u32,
    neighbours: u32,
    host: String,
    sends: Vec<Sent>,
    receives: VecDeque<Received>,
    /// Buffers of sent words, for reuse.
    spare_buffers: Vec<Vec<u32>>,
    // Last field: MPI ends when it is dropped.
    _universe: Universe,
}

/// Maximum number of buffers kept for reuse.
const MAX_SPARE_BUFFERS: usize = 4;

pub(super) fn check(action: &'static str, code: i32) -> Result<(), ClusterError> {
    if code == ffi::MPI_SUCCESS as i32 { Ok(()) } else { Err(ClusterError::Mpi { action, code }) }
}

impl Mpi {
    /// Starts MPI, at most once in a process. Only the calling thread may use MPI afterwards.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    pub fn start() -> Result<Self, ClusterError> {
        let failed = ClusterError::Mpi { action: "starting", code: -1 };
        let started = ::mpi::initialize_with_threading(::mpi::Threading::Funneled);
        let (universe, threading) = started.ok_or(failed.clone())?;
        if threading < ::mpi::Threading::Funneled {
            return Err(failed);
        }
        let world = universe.world();
        let host = ::mpi::environment::processor_name().unwrap_or_else(|_| "an unnamed host".to_owned());
        let on_host = world.split_shared(world.rank());
        let (local, neighbours) = (on_host.rank().unsigned_abs(), on_host.size().unsigned_abs());
        let mailbox = SharedMemoryTransport::open(&world)?;
        Ok(Self {
            world,
            group: None,
            window: None,
            shared_memory: mailbox,
            waiting: VecDeque::new(),
            local,
            neighbours,
            host,
            sends: Vec::new(),
            receives: VecDeque::new(),
            spare_buffers: Vec::new(),
            _universe: universe,
        })
    }

    /// Returns whether a transfer has ended. An earlier test must not have returned true for it.
    fn test(request: &mut MPI_Request) -> Result<bool, ClusterError> {
        let mut flag = 0;
        let mut status = MaybeUninit::<MPI_Status>::uninit();
        // SAFETY: MPI gave the request, and no test has ended it; flag and status are written.
        let code = unsafe { ffi::MPI_Test(request, &mut flag, status.as_mut_ptr()) };
        check("waiting for a message", code)?;
        Ok(flag != 0)
    }

    /// Sends a message: now, or after the messages that wait for shared memory.
    fn dispatch(&mut self, to: u32, tag: Tag, content: Content) -> Result<(), ClusterError> {
        if tag != Tag::Heartbeat && self.waiting.iter().any(|waiting| waiting.0 == to) {
            self.waiting.push_back((to, tag, content));
            return Ok(());
        }
        let long = self.shared_memory.as_mut().filter(|mailbox| mailbox.takes(to, content.bytes().len()));
        let Some(mailbox) = long else { return self.begin(to, MessageKind::Plain(tag), content) };
        match mailbox.put(content.bytes()) {
            Some(place) => {
                self.keep(content);
                self.begin(to, MessageKind::Placed(tag), Content::Bytes(place.encode()))
            }
            None => {
                self.waiting.push_back((to, tag, content));
                Ok(())
            }
        }
    }

    /// Sends the waiting messages for which enough shared memory is free.
    fn dispatch_waiting(&mut self) -> Result<(), ClusterError> {
        for (to, tag, content) in std::mem::take(&mut self.waiting) {
            self.dispatch(to, tag, content)?;
        }
        Ok(())
    }

    /// Keeps the buffer of sent words for reuse.
    fn keep(&mut self, content: Content) {
        if let Content::Words(words) = content
            && self.spare_buffers.len() < MAX_SPARE_BUFFERS
        {
            self.spare_buffers.push(words);
        }
    }

    /// Starts sending a message.
    fn begin(&mut self, to: u32, mark: MessageKind, content: Content) -> Result<(), ClusterError> {
        let bytes = content.bytes();
        let count = i32::try_from(bytes.len()).map_err(|_| ClusterError::Unsupported {
            what: format!("a message of {} bytes exceeds MPI's maximum of 2^31 - 1", bytes.len()),
            remedy: "use more ranks, or a smaller `block`".to_owned(),
        })?;
        let mut request = MaybeUninit::uninit();
        // SAFETY: the content lies on the heap and stays there, unchanged, in `sends` until a test
        // has ended the request.
        let code = unsafe {
            ffi::MPI_Isend(
                bytes.as_ptr().cast(),
                count,
                ffi::RSMPI_UINT8_T,
                to as i32,
                mark.number(),
                self.world.as_raw(),
                request.as_mut_ptr(),
            )
        };
        check("sending", code)?;
        // SAFETY: the call succeeded and wrote it.
        let request = unsafe { request.assume_init() };
        self.sends.push(Sent { request, content });
        Ok(())
    }

    /// Returns the number of ranks on this host, including this one.
    pub fn neighbours(&self) -> u32 {
        self.neighbours
    }

    /// Starts receiving the next message that has arrived; returns whether there was one.
    fn accept(&mut self) -> Result<bool, ClusterError> {
        let mut flag = 0;
        let mut handle = MaybeUninit::uninit();
        let mut status = MaybeUninit::<MPI_Status>::uninit();
        let world = self.world.as_raw();
        // SAFETY: flag, handle and status are written if a message has arrived.
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
        // SAFETY: a message has arrived, so both were written.
        let (mut handle, status) = unsafe { (handle.assume_init(), status.assume_init()) };
        let mut count = 0;
        // SAFETY: the status is that of the message.
        let code = unsafe { ffi::MPI_Get_count(&status, ffi::RSMPI_UINT8_T, &mut count) };
        check("asking for a message's length", code)?;
        let from = status.MPI_SOURCE.unsigned_abs();
        let Some(mark) = MessageKind::of(status.MPI_TAG) else {
            let message = format!("a message of kind {}", status.MPI_TAG);
            return Err(ClusterError::Protocol { rank: from, message });
        };
        let mut bytes = vec![0u8; count.max(0) as usize];
        let mut request = MaybeUninit::uninit();
        // SAFETY: the buffer has `count` bytes on the heap, and stays there, untouched, in
        // `receives` until a test has ended the request.
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
        self.receives.push_back(Received { request, from, mark, bytes, done: false });
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

    fn local_rank(&self) -> u32 {
        self.local
    }

    fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), ClusterError> {
        self.dispatch(to, tag, Content::Bytes(bytes))
    }

    fn send_words(&mut self, to: u32, tag: Tag, words: Vec<u32>) -> Result<(), ClusterError> {
        self.dispatch(to, tag, Content::Words(words))
    }

    fn reclaim(&mut self) -> Option<Vec<u32>> {
        self.spare_buffers.pop()
    }

    fn receive(&mut self) -> Result<Option<Message>, ClusterError> {
        while self.accept()? {}
        self.unsent();
        loop {
            let mut waits = Vec::new();
            let mut ready = None;
            for (index, transfer) in self.receives.iter_mut().enumerate() {
                let free = matches!(transfer.mark, MessageKind::Taken | MessageKind::Plain(Tag::Heartbeat));
                transfer.done = transfer.done || Self::test(&mut transfer.request)?;
                if transfer.done && (free || !waits.contains(&transfer.from)) {
                    ready = Some(index);
                    break;
                }
                waits.push(transfer.from);
            }
            let Some(Received { from, mark, bytes, .. }) =
                ready.and_then(|index| self.receives.remove(index))
            else {
                return Ok(None);
            };
            let wrong = || ClusterError::Protocol {
                rank: from,
                message: "an invalid slot of shared memory".to_owned(),
            };
            match (mark, &mut self.shared_memory) {
                (MessageKind::Plain(tag), _) => return Ok(Some(Message { from, tag, bytes })),
                (MessageKind::Placed(tag), Some(mailbox)) => {
                    let place = MessageSlot::decode(&bytes).ok_or_else(wrong)?;
                    let content = mailbox.take(from, place).ok_or_else(wrong)?;
                    self.begin(from, MessageKind::Taken, Content::Bytes(bytes))?;
                    return Ok(Some(Message { from, tag, bytes: content }));
                }
                (MessageKind::Taken, Some(mailbox)) => {
                    mailbox.taken(MessageSlot::decode(&bytes).ok_or_else(wrong)?);
                    self.dispatch_waiting()?;
                }
                (_, None) => return Err(wrong()),
            }
        }
    }

    fn unsent(&mut self) -> usize {
        let mut at = 0;
        while at < self.sends.len() {
            // A send that failed stays in the list, so it counts as unsent.
            if Self::test(&mut self.sends[at].request).unwrap_or(false) {
                let sent = self.sends.swap_remove(at);
                self.keep(sent.content);
            } else {
                at += 1;
            }
        }
        self.sends.len()
            + self.waiting.len()
            + self.shared_memory.as_ref().map_or(0, SharedMemoryTransport::waiting)
    }

    fn share(&mut self, width: u32, height: u32, frames: u32) -> Result<Option<FrameMemory>, ClusterError> {
        let words = FrameMemory::words(width, height, frames);
        let group = self.group.as_ref().unwrap_or(&self.world);
        let host = group.split_shared(group.rank());
        // Ranks keep their order: if the root is on this host, it is the first.
        let mut first = group.rank();
        host.process_at_rank(0).broadcast_into(&mut first);
        if first != 0 {
            return Ok(None);
        }
        let bytes = words * size_of::<u32>();
        let Some(window) = Window::allocate(&host, if host.rank() == 0 { bytes } else { 0 })? else {
            return Ok(None);
        };
        let (first, size) = window.part(0)?;
        self.window = Some(window);
        // SAFETY: the root's part of the window has these bytes until `unshare`, which all ranks
        // call when nothing uses it.
        let memory = unsafe { HostMemory::shared(first, size) };
        Ok(FrameMemory::of(memory, width, height, frames))
    }

    fn unshare(&mut self) -> Result<(), ClusterError> {
        self.window.take().map_or(Ok(()), Window::free)
    }

    fn is_busy(&mut self) -> bool {
        self.unsent() > 0 || !self.receives.is_empty()
    }

    fn group(&mut self, ranks: u32) -> Result<(), ClusterError> {
        let inside = self.rank() < ranks;
        let color = if inside { Color::with_value(0) } else { Color::undefined() };
        self.group = self.world.split_by_color(color);
        Ok(())
    }

    fn all_reduce(&mut self, values: &mut [f32]) -> Result<(), ClusterError> {
        let own = values.to_vec();
        self.group.as_ref().unwrap_or(&self.world).all_reduce_into(&own[..], values, SystemOperation::sum());
        Ok(())
    }

    fn abort(&mut self, code: u8) -> ! {
        self.world.abort(i32::from(code))
    }
}

impl Drop for Mpi {
    /// Leaks the buffers of unfinished transfers, because MPI may still use them while it ends.
    fn drop(&mut self) {
        self.sends.drain(..).for_each(|sent| std::mem::forget(sent.content));
        self.receives.drain(..).filter(|received| !received.done).for_each(|received| {
            std::mem::forget(received.bytes);
        });
    }
}
