//! Thread of a rank that renders while another one sends and receives.
//!
//! Tasks go to it through a channel, and products come back: image parts of an image
//! (`render_image`), or frames of a series (`series`).

use crate::Error;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use trisect::threads::{self, ThreadError};

/// Message from the thread.
enum Step<Product> {
    Product(Product),
    /// A task is done.
    Done,
    Failed(Error),
    /// The thread panicked, with this payload.
    Panicked(Box<dyn Any + Send>),
}

/// The thread, with the channels of its tasks and products.
pub(super) struct RenderThread<State, Task, Product> {
    tasks: Sender<Task>,
    steps: Receiver<Step<Product>>,
    thread: JoinHandle<State>,
    /// Tasks that are not done.
    open: usize,
}

impl<State, Task, Product> RenderThread<State, Task, Product>
where
    State: Send + 'static,
    Task: Send + 'static,
    Product: Send + 'static,
{
    /// Starts the thread. `work` passes any number of products of a task to its last argument.
    pub fn new(
        mut state: State,
        mut work: impl FnMut(&mut State, Task, &mut (dyn FnMut(Product) + Send)) -> Result<(), Error>
        + Send
        + 'static,
    ) -> Result<Self, ThreadError> {
        let (orders, received) = channel::<Task>();
        let (sender, steps) = channel();
        let thread = threads::spawn("render thread", move || {
            for order in received {
                let mut out = |product| {
                    let _ = sender.send(Step::Product(product)); // the receiver may have ended
                };
                let done = catch_unwind(AssertUnwindSafe(|| work(&mut state, order, &mut out)));
                let step = match done {
                    Ok(Ok(())) => Step::Done,
                    Ok(Err(error)) => Step::Failed(error),
                    Err(panic) => Step::Panicked(panic),
                };
                let is_last = !matches!(step, Step::Done);
                if sender.send(step).is_err() || is_last {
                    break;
                }
            }
            state
        })?;
        Ok(Self { tasks: orders, steps, thread, open: 0 })
    }

    /// Returns the number of tasks that are not done.
    pub fn open(&self) -> usize {
        self.open
    }

    /// Queues a task.
    pub fn submit(&mut self, order: Task) {
        self.open += usize::from(self.tasks.send(order).is_ok());
    }

    /// Returns the next product, if one arrives within this time.
    pub fn next_product(&mut self, within: Duration) -> Option<Result<Product, Error>> {
        let end = Instant::now() + within;
        loop {
            match self.steps.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(Step::Product(product)) => return Some(Ok(product)),
                Ok(Step::Done) => self.open -= 1,
                Ok(Step::Failed(error)) => return Some(Err(error)),
                // Otherwise this rank would send heartbeats for ever, and others wait for its part.
                Ok(Step::Panicked(panic)) => resume_unwind(panic),
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => {
                    std::thread::sleep(within);
                    return None;
                }
            }
        }
    }

    /// Ends the thread after its current task, and returns its state.
    pub fn end(self) -> State {
        drop(self.tasks);
        drop(self.steps);
        match self.thread.join() {
            Ok(state) => state,
            Err(panic) => resume_unwind(panic),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A panic of the thread is one of the rank: it does not leave others waiting.
    #[test]
    fn a_panic_is_not_silence() {
        let work = |state: &mut u32, task: u32, out: &mut (dyn FnMut(u32) + Send)| {
            assert!(task < 2, "a fault");
            *state += task;
            out(*state);
            Ok(())
        };
        let within = Duration::from_secs(60);
        let mut thread = RenderThread::new(0, work).unwrap();
        thread.submit(1);
        assert_eq!(thread.next_product(within).map(Result::unwrap), Some(1));
        thread.submit(2);
        let panic = catch_unwind(AssertUnwindSafe(|| thread.next_product(within)));
        assert!(panic.is_err());
        assert_eq!(thread.end(), 1);
    }
}
