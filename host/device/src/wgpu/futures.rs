//! Values of futures. A thread blocks for them; in a browser WebAssembly's stack is suspended,
//! because events arrive only while no code runs.

#[cfg(not(target_family = "wasm"))]
pub(super) use pollster::block_on;

#[cfg(target_family = "wasm")]
mod browser {
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};

    #[link(wasm_import_module = "./suspend.js")]
    #[allow(unsafe_code, reason = "the page has this function, without arguments")]
    unsafe extern "C" {
        /// Returns after the browser has handled events. The page imports it as a suspending
        /// function, and promises the exports that call it.
        #[link_name = "suspend"]
        pub safe fn handle_events();
    }

    /// Returns the value of a future that events complete.
    pub fn block_on<T>(future: impl Future<Output = T>) -> T {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        loop {
            if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
                return value;
            }
            handle_events();
        }
    }
}

#[cfg(target_family = "wasm")]
pub(super) use browser::{block_on, handle_events};
