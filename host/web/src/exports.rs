//! Functions that the worker calls. [`perform`] suspends while the device works; the others return
//! at once.

use super::request::Request;
use super::session::{Answer, Session};
use serde_json::json;
use std::cell::RefCell;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use trisect::input::in_memory;
use wasm_bindgen::prelude::wasm_bindgen;

static STOP: AtomicBool = AtomicBool::new(false);

thread_local! {
    static SESSION: RefCell<Session> = RefCell::new(Session::new(report, &STOP));
    static REQUEST: RefCell<String> = const { RefCell::new(String::new()) };
    static ANSWER: RefCell<Answer> = RefCell::new(Answer::default());
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = self, js_name = postMessage)]
    fn post_message(message: &str);
}

fn report(done: u64, total: u64) {
    post_message(&json!({ "progress": [done, total] }).to_string());
}

/// Prepares the module: a panic's message goes to the page.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| {
        post_message(&json!({ "panic": panic.to_string() }).to_string());
    }));
}

/// Gives a file its content.
#[wasm_bindgen]
pub fn put_file(path: &str, content: Vec<u8>) {
    in_memory::put(Path::new(path), content);
}

/// Forgets all files.
#[wasm_bindgen]
pub fn forget_files() {
    in_memory::clear();
}

/// Sets the request that [`perform`] answers, as JSON.
#[wasm_bindgen]
pub fn set_request(text: String) {
    REQUEST.set(text);
}

/// Returns the facts of the last answer as JSON.
#[wasm_bindgen]
pub fn facts() -> String {
    ANSWER.with_borrow(|answer| answer.facts.to_string())
}

/// Returns the bytes of the last answer, once.
#[wasm_bindgen]
pub fn take_bytes() -> Vec<u8> {
    ANSWER.with_borrow_mut(|answer| std::mem::take(&mut answer.bytes))
}

/// Ends the render after the submission that runs.
#[wasm_bindgen]
pub fn stop() {
    STOP.store(true, Ordering::Relaxed);
}

/// Answers the request. The page promises this export, because it suspends.
#[unsafe(no_mangle)]
#[allow(unsafe_code, reason = "no other function has this name")]
pub extern "C" fn perform() {
    let text = REQUEST.take();
    let answer = match serde_json::from_str::<Request>(&text) {
        Ok(request) => SESSION.with_borrow_mut(|session| session.answer(request)),
        Err(error) => Ok(json!({ "error": format!("the page sent a malformed request: {error}") }).into()),
    };
    ANSWER.set(answer.unwrap_or_else(|error| json!({ "error": error.to_string() }).into()));
}
