//! A thread that renders while another one sends and receives.

use crate::Error;
use crate::threads::{self, ThreadError};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What comes from the thread.
enum Step<Product> {
    Product(Product),
    /// An order is done.
    Done,
    Failed(Error),
}

/// The thread, what it is told, and what it made.
pub(super) struct RenderThread<State, Task, Product> {
    tasks: Sender<Task>,
    steps: Receiver<Step<Product>>,
    thread: JoinHandle<State>,
    /// Orders that are not done.
    open: usize,
}

impl<State, Task, Product> RenderThread<State, Task, Product>
where
    State: Send + 'static,
    Task: Send + 'static,
    Product: Send + 'static,
{
    /// `work` makes any number of products of an order.
    pub fn new(
        mut state: State,
        mut work: impl FnMut(&mut State, Task, &mut (dyn FnMut(Product) + Send)) -> Result<(), Error>
        + Send
        + 'static,
    ) -> Result<Self, ThreadError> {
        let (orders, received) = channel::<Task>();
        let (sender, steps) = channel();
        let thread = threads::spawn("thread that renders", move || {
            for order in received {
                let mut out = |product| {
                    let _ = sender.send(Step::Product(product)); // who ended wants nothing more
                };
                let done = work(&mut state, order, &mut out);
                let goes_on = done.is_ok();
                let step = done.map_or_else(Step::Failed, |()| Step::Done);
                if sender.send(step).is_err() || !goes_on {
                    break;
                }
            }
            state
        })?;
        Ok(Self { tasks: orders, steps, thread, open: 0 })
    }

    /// Orders that are not done.
    pub fn open(&self) -> usize {
        self.open
    }

    /// Gives an order.
    pub fn submit(&mut self, order: Task) {
        self.open += usize::from(self.tasks.send(order).is_ok());
    }

    /// The next product, if one comes within this time.
    pub fn next_product(&mut self, within: Duration) -> Option<Result<Product, Error>> {
        let end = Instant::now() + within;
        loop {
            match self.steps.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(Step::Product(product)) => return Some(Ok(product)),
                Ok(Step::Done) => self.open -= 1,
                Ok(Step::Failed(error)) => return Some(Err(error)),
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => {
                    std::thread::sleep(within);
                    return None;
                }
            }
        }
    }

    /// Ends the thread after what it is at, and gives back what it worked with.
    pub fn end(self) -> State {
        drop(self.tasks);
        drop(self.steps);
        match self.thread.join() {
            Ok(state) => state,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}
