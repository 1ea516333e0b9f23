//! Messages between ranks: their tags, and the trait [`Network`] that carries them, which is
//! implemented by MPI (`mpi`) and by threads of one process (`local`).

use super::ClusterError;
use trisect::film::FrameMemory;

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Tag {
    /// Shows that the rank is alive.
    Heartbeat = 1,
    /// Host, device and fingerprint of a rank.
    Handshake = 2,
    /// Root's answer: all ranks may begin, or the reason against it; also its choice of a mode.
    Start = 3,
    /// Encoded scene.
    Scene = 4,
    /// Request for work; in a series of frames, the number of frames complete on the root.
    WorkRequest = 5,
    /// Block of samples to render; an empty one if none is left.
    Work = 6,
    /// Pixels.
    ImagePart = 7,
    /// Cost of a rank's work, or its error.
    Report = 8,
    /// The image or series is complete.
    Done = 9,
    /// Measurement of the network.
    Ping = 10,
    /// Header of the checkpoint from which the render continues.
    Resume = 11,
    /// Exposure in stops, the same for the rows of all ranks.
    Exposure = 12,
}

impl Tag {
    /// All tags.
    const ALL: [Self; 12] = [
        Self::Heartbeat,
        Self::Handshake,
        Self::Start,
        Self::Scene,
        Self::WorkRequest,
        Self::Work,
        Self::ImagePart,
        Self::Report,
        Self::Done,
        Self::Ping,
        Self::Resume,
        Self::Exposure,
    ];

    /// Returns the tag with this number.
    pub fn of(number: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|tag| *tag as i32 == number)
    }
}

/// Message from another rank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Rank that sent it.
    pub from: u32,
    /// Kind of the message.
    pub tag: Tag,
    /// Content of the message.
    pub bytes: Vec<u8>,
}

/// Processes that can send each other messages: through MPI, or as threads of one process. Messages
/// from one rank arrive in the order in which it sent them, except [`Tag::Heartbeat`].
pub trait Network {
    /// Returns this process's rank, from 0; rank 0 is the root.
    fn rank(&self) -> u32;

    /// Returns the number of ranks.
    fn ranks(&self) -> u32;

    /// Returns the name of this rank's host.
    fn host(&self) -> String;

    /// Returns this rank's number among those on the same host.
    fn local_rank(&self) -> u32;

    /// Starts sending a message; the transfer advances when [`receive`](Self::receive) is called.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), ClusterError>;

    /// Sends a message of 32-bit words, which need not be copied.
    ///
    /// # Errors
    ///
    /// Same as [`send`](Self::send).
    fn send_words(&mut self, to: u32, tag: Tag, words: Vec<u32>) -> Result<(), ClusterError> {
        self.send(to, tag, bytemuck::cast_slice(&words).to_vec())
    }

    /// Returns a buffer of sent words for reuse, if there is one: fresh memory costs as much as
    /// copying to it.
    fn reclaim(&mut self) -> Option<Vec<u32>> {
        None
    }

    /// Returns the next message, if one has arrived, and advances all transfers.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`], and [`ClusterError::Protocol`] for an invalid message.
    fn receive(&mut self) -> Result<Option<Message>, ClusterError>;

    /// Returns the number of messages that are still being sent. A short message may count as sent
    /// before its receiver takes it.
    fn unsent(&mut self) -> usize;

    /// Returns whether a transfer is in progress. A waiting rank must not sleep then, because
    /// transfers advance only when the network is called.
    fn is_busy(&mut self) -> bool;

    /// Allocates memory for frames that the ranks of the [group](Self::group) on the root's host
    /// share. Returns `None` on other hosts, and if there is no or too little shared memory. All
    /// ranks of the group call this, and [`unshare`](Self::unshare) when they no longer use it.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn share(
        &mut self,
        _width: u32,
        _height: u32,
        _frames: u32,
    ) -> Result<Option<FrameMemory>, ClusterError> {
        Ok(None)
    }

    /// Frees the memory of [`share`](Self::share), which nothing may use afterwards.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn unshare(&mut self) -> Result<(), ClusterError> {
        Ok(())
    }

    /// Makes the first `ranks` ranks the group of [`all_reduce`](Self::all_reduce) and
    /// [`share`](Self::share). All ranks call this.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn group(&mut self, ranks: u32) -> Result<(), ClusterError>;

    /// Sums values over the ranks of the group, in place: the report's method of merging images,
    /// for comparison. All ranks of the group call it with the same number of values.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn all_reduce(&mut self, values: &mut [f32]) -> Result<(), ClusterError>;

    /// Ends the processes of all ranks at once, with this exit code.
    fn abort(&mut self, code: u8) -> !;
}
