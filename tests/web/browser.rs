//! Headless Chromium, driven by the DevTools protocol.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

/// Longest time that a request may take: the longest is the compilation of a kernel.
const PATIENCE: Duration = Duration::from_secs(240);

/// Names of the browser.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Browser with one page.
pub struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    requests: u64,
    _profile: TempDir,
}

impl Browser {
    /// Returns the browser's file, if there is one.
    pub fn find() -> Option<PathBuf> {
        let folders = std::env::var_os("PATH")?;
        let folders: Vec<PathBuf> = std::env::split_paths(&folders).collect();
        NAMES.iter().flat_map(|name| folders.iter().map(move |of| of.join(name))).find(|file| file.is_file())
    }

    /// Starts the browser with further options.
    pub fn start(file: PathBuf, options: &[&str]) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut command = Command::new(file);
        command.args([
            "--headless=new",
            "--no-sandbox",
            "--remote-debugging-port=0",
            "--window-size=1280,800",
        ]);
        command.arg(format!("--user-data-dir={}", profile.path().display())).args(options);
        command.arg("about:blank").stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let url = loop {
            let line = lines.next().expect("the browser ended").unwrap();
            if let Some((_, url)) = line.split_once("DevTools listening on ") {
                break url.to_owned();
            }
        };
        // Read on, so that the browser's messages do not fill the pipe.
        std::thread::spawn(move || lines.for_each(drop));
        let address = url.trim_start_matches("ws://").split('/').next().unwrap();
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(url.as_str(), stream).unwrap();
        let mut browser = Self { child, socket, session: String::new(), requests: 0, _profile: profile };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        browser.session = text(&browser.call("Target.attachToTarget", attach)["sessionId"]);
        browser.call("Page.enable", json!({}));
        browser.call("DOM.enable", json!({}));
        browser
    }

    /// Calls a method of the protocol, and returns its result.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.requests += 1;
        let mut request = json!({ "id": self.requests, "method": method, "params": parameters });
        if !self.session.is_empty() {
            request["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(request.to_string())).unwrap();
        loop {
            let message =
                self.socket.read().unwrap_or_else(|error| panic!("no answer to {request}: {error}"));
            let Ok(content) = message.to_text() else { continue };
            let Ok(mut answer) = serde_json::from_str::<Value>(content) else { continue };
            if answer["id"] == json!(self.requests) {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
        }
    }

    /// Returns the value of an expression in the page, of a promise when it is kept.
    pub fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut result = self.call("Runtime.evaluate", parameters);
        let failed = &result["exceptionDetails"];
        assert!(failed.is_null(), "{expression}: {failed}");
        result["result"]["value"].take()
    }

    /// Returns the text of an expression's value.
    pub fn text(&mut self, expression: &str) -> String {
        text(&self.value(expression))
    }

    /// Waits until an expression is true.
    pub fn wait_for(&mut self, expression: &str) {
        let asking = std::time::Instant::now();
        while self.value(expression) != json!(true) {
            assert!(asking.elapsed() < PATIENCE, "never: {expression}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Loads a page.
    pub fn open(&mut self, url: &str) {
        self.call("Page.navigate", json!({ "url": url }));
        self.wait_for("document.readyState === 'complete'");
    }

    /// Picks files in the control `selector`, as a user does.
    pub fn pick(&mut self, selector: &str, files: &[PathBuf]) {
        let document = self.call("DOM.getDocument", json!({}));
        let root = &document["root"]["nodeId"];
        let node = self.call("DOM.querySelector", json!({ "nodeId": root, "selector": selector }));
        let files: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
        self.call("DOM.setFileInputFiles", json!({ "nodeId": node["nodeId"], "files": files }));
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), ToOwned::to_owned)
}
