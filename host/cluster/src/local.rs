//! Ranks that are threads of one process: for tests, and to try the cluster code without MPI.

use super::ClusterError;
use super::network::{Message, Network, Tag};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Barrier, Mutex};

/// Rank that is a thread; a channel to each other rank carries the messages.
pub struct Local {
    rank: u32,
    peers: Vec<Sender<Message>>,
    inbox: Receiver<Message>,
    shared: Arc<Shared>,
}

struct Shared {
    barrier: Barrier,
    sum: Mutex<Vec<f32>>,
}

impl Local {
    /// Returns `count` ranks, the root first.
    pub fn ranks(count: u32) -> Vec<Self> {
        let (peers, inboxes): (Vec<_>, Vec<_>) = (0..count).map(|_| channel()).unzip();
        let shared = Arc::new(Shared { barrier: Barrier::new(count as usize), sum: Mutex::new(Vec::new()) });
        let rank = |(rank, inbox)| Self { rank, peers: peers.clone(), inbox, shared: shared.clone() };
        (0..).zip(inboxes).map(rank).collect()
    }
}

impl Network for Local {
    fn rank(&self) -> u32 {
        self.rank
    }

    fn ranks(&self) -> u32 {
        self.peers.len() as u32
    }

    fn host(&self) -> String {
        format!("thread-{}", self.rank)
    }

    fn local_rank(&self) -> u32 {
        self.rank
    }

    fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), ClusterError> {
        // Messages to a rank that has ended are lost. As with processes, the others notice its
        // silence.
        if let Some(peer) = self.peers.get(to as usize) {
            let _ = peer.send(Message { from: self.rank, tag, bytes });
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, ClusterError> {
        Ok(self.inbox.try_recv().ok())
    }

    fn unsent(&mut self) -> usize {
        0
    }

    fn is_busy(&mut self) -> bool {
        false
    }

    fn group(&mut self, _ranks: u32) -> Result<(), ClusterError> {
        Ok(())
    }

    fn all_reduce(&mut self, values: &mut [f32]) -> Result<(), ClusterError> {
        let lock = || self.shared.sum.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        lock().resize(values.len(), 0.0);
        self.shared.barrier.wait();
        lock().iter_mut().zip(&*values).for_each(|(sum, value)| *sum += value);
        self.shared.barrier.wait();
        values.copy_from_slice(&lock());
        if self.shared.barrier.wait().is_leader() {
            lock().clear();
        }
        self.shared.barrier.wait();
        Ok(())
    }

    fn abort(&mut self, code: u8) -> ! {
        std::process::exit(i32::from(code))
    }
}
