//! Heartbeats between ranks, so that a lost rank does not keep the others waiting.
//!
//! [`Heartbeat`] wraps a [`Network`]; the other modules send and receive through it.

use super::ClusterError;
use super::network::{Message, Network, Tag};
use std::collections::VecDeque;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use trisect::threads;

/// Time between two heartbeats.
const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(500);

/// Default time without a message after which a rank counts as lost.
pub const DEFAULT_PATIENCE: Duration = Duration::from_secs(6);

/// Duration of one sleep of a rank that waits for work or messages.
pub(super) const POLL_INTERVAL: Duration = Duration::from_micros(100);

/// Network whose ranks watch each other: the root watches all ranks, the others watch the root.
pub struct Heartbeat<N> {
    network: N,
    patience: Duration,
    /// Number of ranks that take part; the others wait.
    active: u32,
    /// Time of the last message from each rank.
    last_heard: Vec<Instant>,
    last_sent: Instant,
    /// Host name of each rank, as far as known.
    pub(super) hosts: Vec<String>,
    /// Messages that arrived before they were requested.
    waiting: VecDeque<Message>,
    /// Bytes that this rank has sent, without heartbeats.
    pub(super) sent: u64,
}

impl<N: Network> Heartbeat<N> {
    /// Wraps a network. A rank counts as lost after `patience` without a message from it.
    pub fn new(network: N, patience: Duration) -> Self {
        let now = Instant::now();
        let ranks = network.ranks() as usize;
        let mut hosts = vec!["an unknown host".to_owned(); ranks];
        if let Some(own) = hosts.get_mut(network.rank() as usize) {
            *own = network.host();
        }
        let heard = vec![now; ranks];
        let active = network.ranks();
        Self {
            network,
            patience,
            active,
            last_heard: heard,
            last_sent: now,
            hosts,
            waiting: VecDeque::new(),
            sent: 0,
        }
    }

    /// Returns the number of this rank.
    pub fn rank(&self) -> u32 {
        self.network.rank()
    }

    /// Returns the number of ranks that take part.
    pub fn ranks(&self) -> u32 {
        self.active
    }

    /// Lets only the first `ranks` ranks take part; the others wait.
    ///
    /// # Errors
    ///
    /// Same as [`Network::group`].
    pub fn limit_ranks(&mut self, ranks: u32) -> Result<(), ClusterError> {
        self.active = ranks.clamp(1, self.network.ranks());
        self.network.group(self.active)
    }

    /// Returns whether this rank is the root.
    pub fn is_root(&self) -> bool {
        self.rank() == 0
    }

    /// Lets all ranks take part; the [group](Network::group) of the network stays.
    pub fn use_all_ranks(&mut self) {
        self.active = self.network.ranks();
    }

    /// Returns the underlying network.
    pub fn network(&mut self) -> &mut N {
        &mut self.network
    }

    /// Returns the host name of a rank, as far as known.
    pub fn host_of(&self, rank: u32) -> String {
        self.hosts.get(rank as usize).cloned().unwrap_or_default()
    }

    /// Sends a message.
    ///
    /// # Errors
    ///
    /// Same as [`Network::send`].
    pub fn send(&mut self, to: u32, tag: Tag, bytes: Vec<u8>) -> Result<(), ClusterError> {
        self.sent += bytes.len() as u64;
        self.network.send(to, tag, bytes)
    }

    /// Sends a message of 32-bit words.
    ///
    /// # Errors
    ///
    /// Same as [`Network::send_words`].
    pub fn send_words(&mut self, to: u32, tag: Tag, words: Vec<u32>) -> Result<(), ClusterError> {
        self.sent += size_of_val(&words[..]) as u64;
        self.network.send_words(to, tag, words)
    }

    /// Sends a message to all ranks that take part except this one.
    ///
    /// # Errors
    ///
    /// Same as [`Network::send`].
    pub fn send_all(&mut self, tag: Tag, bytes: &[u8]) -> Result<(), ClusterError> {
        let own = self.rank();
        (0..self.ranks()).filter(|&rank| rank != own).try_for_each(|to| self.send(to, tag, bytes.to_vec()))
    }

    /// Sends and processes heartbeats, and returns the next message, if there is one.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Silent`] for a lost rank, and the errors of [`Network::receive`].
    pub fn receive(&mut self) -> Result<Option<Message>, ClusterError> {
        match self.waiting.pop_front() {
            Some(message) => Ok(Some(message)),
            None => self.poll(),
        }
    }

    fn poll(&mut self) -> Result<Option<Message>, ClusterError> {
        let now = Instant::now();
        let own = self.rank();
        // A rank that was itself stopped has heard from no one meanwhile. It restarts the timeouts
        // instead of reporting the others as lost.
        let slept = now.duration_since(self.last_sent) > 2 * HEARTBEAT_INTERVAL;
        if now.duration_since(self.last_sent) >= HEARTBEAT_INTERVAL {
            self.last_sent = now;
            let to = if own == 0 { 1..self.network.ranks() } else { 0..1 };
            // Unsent heartbeats must not pile up. A rank that does not receive them is reported as
            // silent anyway.
            if self.network.unsent() < 4 * self.ranks() as usize + 64 {
                to.clone().try_for_each(|to| self.network.send(to, Tag::Heartbeat, Vec::new()))?;
            }
            if slept {
                to.for_each(|rank| self.hear(rank, now));
            }
        }
        while let Some(message) = self.network.receive()? {
            self.hear(message.from, now);
            if message.tag != Tag::Heartbeat {
                return Ok(Some(message));
            }
        }
        let watched = if own == 0 { 1..self.network.ranks() } else { 0..1 };
        for rank in watched.filter(|&rank| rank != own) {
            let heard = self.last_heard.get(rank as usize).copied().unwrap_or(now);
            let silent = now.saturating_duration_since(heard);
            if silent > self.patience {
                let host = self.host_of(rank);
                return Err(ClusterError::Silent { rank, host, seconds: silent.as_secs() });
            }
        }
        Ok(None)
    }

    fn hear(&mut self, rank: u32, now: Instant) {
        if let Some(heard) = self.last_heard.get_mut(rank as usize) {
            *heard = now;
        }
    }

    /// Returns how long to wait for other events before the next poll: zero while a transfer is in
    /// progress.
    pub(super) fn nap(&mut self) -> Duration {
        if self.network.is_busy() { Duration::ZERO } else { POLL_INTERVAL }
    }

    /// Runs `work` on its own thread and polls meanwhile, so that this rank keeps sending
    /// heartbeats.
    ///
    /// # Errors
    ///
    /// Same as [`receive`](Self::receive); the work then continues, and its result is lost. Also
    /// [`ClusterError::Threads`] if the thread cannot be started.
    pub fn run_while_polling<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ClusterError> {
        self.poll_until_done(work, |link| {
            let message = link.poll()?;
            link.waiting.extend(message);
            Ok(())
        })
    }

    /// Runs work that is left after an error, on its own thread and to its end. Incoming messages,
    /// silent ranks and errors of the network are ignored.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Threads`] if the thread cannot be started, [`ClusterError::Protocol`] if the
    /// work ends without a result.
    pub fn run_to_completion<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ClusterError> {
        self.poll_until_done(work, |link| {
            let _ = link.poll();
            Ok(())
        })
    }

    fn poll_until_done<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
        meanwhile: impl Fn(&mut Self) -> Result<(), ClusterError>,
    ) -> Result<T, ClusterError> {
        let (sender, receiver) = channel();
        let thread = threads::spawn("worker thread", move || {
            let _ = sender.send(work());
        })?;
        loop {
            match receiver.recv_timeout(self.nap()) {
                Ok(done) => return Ok(done),
                Err(RecvTimeoutError::Timeout) => meanwhile(self)?,
                Err(RecvTimeoutError::Disconnected) => match thread.join() {
                    Err(panic) => std::panic::resume_unwind(panic),
                    Ok(()) => {
                        return Err(ClusterError::Protocol {
                            rank: self.rank(),
                            message: "no result of its work".to_owned(),
                        });
                    }
                },
            }
        }
    }

    /// Waits for the next message with this tag and returns it; others are kept for later.
    ///
    /// # Errors
    ///
    /// Same as [`receive`](Self::receive).
    pub fn expect(&mut self, tag: Tag) -> Result<Message, ClusterError> {
        loop {
            if let Some(at) = self.waiting.iter().position(|message| message.tag == tag)
                && let Some(message) = self.waiting.remove(at)
            {
                return Ok(message);
            }
            match self.poll()? {
                Some(message) => self.waiting.push_back(message),
                None => std::thread::sleep(self.nap()),
            }
        }
    }

    /// Waits until all messages are sent; see [`Network::unsent`].
    ///
    /// # Errors
    ///
    /// Same as [`receive`](Self::receive).
    pub fn flush(&mut self) -> Result<(), ClusterError> {
        while self.network.unsent() > 0 {
            if let Some(message) = self.poll()? {
                self.waiting.push_back(message);
            }
            std::thread::yield_now();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::super::local::Local;
    use super::*;

    fn pair(patience: Duration) -> [Heartbeat<Local>; 2] {
        let mut links = Local::ranks(2).into_iter().map(|local| Heartbeat::new(local, patience));
        [links.next().unwrap(), links.next().unwrap()]
    }

    #[test]
    fn silence_is_noticed_on_both_sides() {
        let [mut root, mut other] = pair(Duration::from_millis(1200));
        root.hosts[1] = "there".to_owned();
        // Both are alive: neither reports silence, though no message is sent.
        let watch = std::thread::spawn(move || {
            let start = Instant::now();
            while start.elapsed() < Duration::from_millis(2000) {
                assert_eq!(other.receive(), Ok(None));
                std::thread::sleep(POLL_INTERVAL);
            }
        });
        while !watch.is_finished() {
            assert_eq!(root.receive(), Ok(None));
            std::thread::sleep(POLL_INTERVAL);
        }
        watch.join().unwrap();
        // The other one has ended.
        let start = Instant::now();
        let error = loop {
            if let Err(error) = root.receive() {
                break error;
            }
            std::thread::sleep(POLL_INTERVAL);
        };
        assert_eq!(error, ClusterError::Silent { rank: 1, host: "there".to_owned(), seconds: 1 });
        assert!(start.elapsed() < Duration::from_secs(3));
    }

    #[test]
    fn work_does_not_silence_a_rank() {
        let [mut root, mut other] = pair(Duration::from_millis(1200));
        let worker = std::thread::spawn(move || {
            let sum = other.run_while_polling(|| {
                std::thread::sleep(Duration::from_millis(1800));
                6 * 7
            });
            other.send(0, Tag::Report, vec![sum.unwrap()]).unwrap();
            other
        });
        assert_eq!(root.expect(Tag::Report).unwrap().bytes, [42]);
        worker.join().unwrap();
    }

    /// A lost rank does not keep the root from writing the partial image.
    #[test]
    fn what_is_left_is_done() {
        let [mut root, other] = pair(Duration::from_millis(100));
        std::thread::sleep(Duration::from_millis(50));
        let write = || std::thread::sleep(Duration::from_millis(1500));
        assert_eq!(root.run_to_completion(write), Ok(()));
        // Negative control.
        let stopped = root.run_while_polling(write);
        assert!(matches!(stopped, Err(ClusterError::Silent { rank: 1, .. })), "{stopped:?}");
        drop(other);
    }

    #[test]
    fn messages_wait_for_whom_they_are() {
        let [mut root, mut other] = pair(DEFAULT_PATIENCE);
        other.send(0, Tag::WorkRequest, vec![1]).unwrap();
        other.send(0, Tag::Handshake, vec![2]).unwrap();
        assert_eq!(root.expect(Tag::Handshake).unwrap().bytes, [2]);
        assert_eq!(root.receive().unwrap().unwrap().bytes, [1]);
        assert_eq!(other.sent, 2);
    }
}
