//! Messages between ranks, whatever carries them.

use super::ClusterError;
use crate::film::FrameMemory;

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Tag {
    /// A sign of life.
    Heartbeat = 1,
    /// What a rank is, and is about to render.
    Handshake = 2,
    /// All ranks may begin, or why not.
    Start = 3,
    /// The scene's records.
    Scene = 4,
    /// A rank wants work.
    WorkRequest = 5,
    /// Work, or that there is none left.
    Work = 6,
    /// Pixels.
    ImagePart = 7,
    /// What a rank's work took.
    Report = 8,
    /// The image is there.
    Done = 9,
    /// Measures the network.
    Ping = 10,
    /// What a checkpoint is of.
    Resume = 11,
    /// Stops by which all ranks show their rows.
    Exposure = 12,
}

impl Tag {
    /// All of them.
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

    /// That a number stands for.
    pub fn of(number: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|tag| *tag as i32 == number)
    }
}

/// What another rank sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// By whom.
    pub from: u32,
    /// What it is.
    pub tag: Tag,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Processes that can send each other messages: MPI, or threads of one process. Messages from one rank come in the order in which it sent them, but
/// for [`Tag::Heartbeat`].
pub trait Network {
    /// This process's number, from 0, which is the root's.
    fn rank(&self) -> u32;

    /// How many there are.
    fn ranks(&self) -> u32;

    /// Of the machine.
    fn host(&self) -> String;

    /// This rank's number among those on the same host.
    fn local_rank(&self) -> u32;

    /// Begins to send a message; it goes on when [`receive`](Self::receive) is called.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), ClusterError>;

    /// The same of words, which need not be copied.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    fn send_words(&mut self, to: u32, tag: Tag, words: Vec<u32>) -> Result<(), ClusterError> {
        self.send(to, tag, bytemuck::cast_slice(&words).to_vec())
    }

    /// The memory of words that were sent, to be used again: fresh memory costs as much as copying to it.
    fn reclaim(&mut self) -> Option<Vec<u32>> {
        None
    }

    /// The next message, if one is there. Whatever is on its way goes on.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`], and [`ClusterError::Protocol`] for a message of something else.
    fn receive(&mut self) -> Result<Option<Message>, ClusterError>;

    /// Messages that were not taken over yet by those to whom they were sent.
    fn unsent(&mut self) -> usize;

    /// Whether something is on its way: then whoever waits must not sleep, since it moves on only when this is asked.
    fn is_busy(&mut self) -> bool;

    /// Memory for frames that the ranks of the group share which run on the root's host; none on other hosts, and where a network has no such thing. All of
    /// the group call this, and [`unshare`](Self::unshare) when it is used no more.
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

    /// Gives it back. Nothing may hold the memory then.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn unshare(&mut self) -> Result<(), ClusterError> {
        Ok(())
    }

    /// From now on [`all_reduce`](Self::all_reduce) is among so many ranks. All ranks call this.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn group(&mut self, ranks: u32) -> Result<(), ClusterError>;

    /// The sum over the ranks of the group, in place: the report's own way of merging images, for comparison. They call it with as many values.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Mpi`].
    fn all_reduce(&mut self, values: &mut [f32]) -> Result<(), ClusterError>;

    /// Ends the processes of all ranks with this exit code, at once.
    fn abort(&mut self, code: u8) -> !;
}
