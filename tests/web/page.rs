//! The page, built and served by its own command, in a browser.

use super::browser::Browser;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use trisect::checkpoint::Checkpoint;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::SceneDocument;

/// Options with which Chromium offers SwiftShader, which computes on the CPU.
pub const SOFTWARE_ADAPTER: [&str; 2] = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"];

/// Server of the built page.
pub struct Server {
    child: Child,
    /// Address of the page.
    pub url: String,
    /// Line that the build printed, with the page's size.
    pub built: String,
    folder: PathBuf,
}

/// Seconds after which a server ends that no test ended: that of a static variable is not dropped.
const LIFETIME: &str = "1200";

/// Returns the served page, which is built once, and the browser's file; `None` with a message
/// where something is missing and `REQUIRE_BACKENDS` does not name `webgpu`.
pub fn served() -> Option<(&'static Server, PathBuf)> {
    static SERVER: OnceLock<Result<Server, String>> = OnceLock::new();
    let found = Browser::find().ok_or_else(|| "there is no Chromium".to_owned());
    let found = found.and_then(|file| Ok((SERVER.get_or_init(|| Server::start("page")).as_ref()?, file)));
    let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
    match found {
        Ok(found) => Some(found),
        Err(why) if required.split(',').any(|name| name.trim() == "webgpu") => {
            panic!("REQUIRE_BACKENDS names webgpu, but {why}")
        }
        Err(why) => {
            eprintln!("SKIPPED for webgpu: {why}");
            None
        }
    }
}

impl Server {
    /// Builds the page into a folder of this name and serves it.
    pub fn start(name: &str) -> Result<Self, String> {
        let program = trisect_tests::binary().with_file_name("trisect-page");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let mut command = Command::new("timeout");
        command.arg(LIFETIME).arg(&program).arg("--output").arg(&folder).args(["--serve", "127.0.0.1:0"]);
        let started = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = started.map_err(|error| format!("{}: {error}", program.display()))?;
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut built = String::new();
        let url = lines.by_ref().map_while(Result::ok).find_map(|line| {
            eprintln!("{line}");
            let url = line.split_once(" at ").map(|(_, url)| url.to_owned());
            built = if url.is_none() { line } else { std::mem::take(&mut built) };
            url
        });
        let Some(url) = url else {
            let output = child.wait_with_output().unwrap();
            return Err(format!("the page is not built: {}", String::from_utf8_lossy(&output.stderr)));
        };
        Ok(Self { child, url, built, folder })
    }

    /// Replaces text in one of the page's own files.
    pub fn edit(&self, file: &str, from: &str, to: &str) {
        let path = self.folder.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches(from).count(), 1, "{from}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
    }

    /// Returns the folder of the page.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Puts a file among those that are served, and returns its path for the page.
    fn put(&self, from: &Path, path: &str) {
        let to = self.folder.join(path);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(from, to).unwrap();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // `timeout` passes on a signal that it can handle.
        let _ = Command::new("kill").arg(self.child.id().to_string()).status();
        let _ = self.child.wait();
    }
}

/// Page in a browser.
pub struct Page<'a> {
    server: &'a Server,
    /// Browser that shows it.
    pub browser: Browser,
}

impl<'a> Page<'a> {
    /// Opens the page without a scene on a backend, with one thread on the CPU.
    pub fn open(served: (&'a Server, PathBuf), options: &[&str], backend: &str) -> Self {
        Self::with_threads(served, options, backend, 1)
    }

    /// Opens the page without a scene on a backend, with this number of threads on the CPU.
    pub fn with_threads(
        (server, file): (&'a Server, PathBuf),
        options: &[&str],
        backend: &str,
        threads: u32,
    ) -> Self {
        let mut browser = Browser::start(file, options);
        browser.open(&format!("{}?backend={backend}&scene=none&threads={threads}", server.url));
        browser.value("trisect.ready.then(() => true)");
        Self { server, browser }
    }

    /// Loads a scene with the files that it names. Returns what the page says of it.
    pub fn load(&mut self, path: &Path) -> Value {
        let mut files = vec![path.to_owned()];
        files.extend(SceneDocument::load(path).unwrap().description.files);
        let root = trisect_tests::root();
        // Absolute paths are those of folders within the page.
        let named: Vec<String> = files
            .iter()
            .map(|file| file.strip_prefix(&root).unwrap_or(file).display().to_string())
            .map(|name| format!("given/{}", name.trim_start_matches('/')))
            .collect();
        files.iter().zip(&named).for_each(|(file, name)| self.server.put(file, name));
        let fetched = "async (of) => [of, await (await fetch(of)).arrayBuffer()]";
        let load = json!({ "do": "load", "path": named[0], "panorama": null });
        let files = json!(named);
        self.browser.value(&format!(
            "Promise.all({files}.map({fetched})).then((files) => trisect.renderer.call({load}, files, true)).then((a) => a.facts)"
        ))
    }

    /// Returns facts and bytes of the answer to a request.
    pub fn ask(&mut self, request: &Value) -> (Value, Vec<u8>) {
        let answer = self.browser.value(&format!(
            "trisect.renderer.call({request}).then(({{ facts, bytes }}) => {{
                let text = '';
                for (let at = 0; at < bytes.length; at += 32768) {{
                    text += String.fromCharCode(...bytes.subarray(at, at + 32768));
                }}
                return {{ facts, bytes: btoa(text) }};
            }})"
        ));
        let bytes = STANDARD.decode(answer["bytes"].as_str().unwrap()).unwrap();
        (answer["facts"].clone(), bytes)
    }

    /// Renders the image of these settings, and returns its film and the facts of its last part,
    /// with the number of rows that helpers rendered for all parts.
    pub fn film(&mut self, settings: &Settings) -> (Film, Value) {
        self.ask(&json!({ "do": "begin", "image": image(settings) }));
        let mut helped = 0;
        let facts = loop {
            let (mut facts, _) = self.ask(&json!({ "do": "part" }));
            helped += facts["helped"].as_u64().unwrap();
            if facts["done"] == json!(true) {
                facts["helped"] = json!(helped);
                break facts;
            }
        };
        let (_, bytes) = self.ask(&json!({ "do": "film" }));
        (Checkpoint::from_bytes(bytes, Path::new("page")).unwrap().film, facts)
    }

    /// Returns the primitives that the first sample of each pixel hits first.
    pub fn first_hits(&mut self, settings: &Settings) -> Vec<u32> {
        let request = json!({ "do": "first_hits", "image": image(settings), "sample": 0 });
        let (_, bytes) = self.ask(&request);
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
    }
}

fn image(settings: &Settings) -> Value {
    let Settings { width, height, samples, depth, seed, .. } = *settings;
    json!({
        "width": width, "height": height, "samples": samples, "depth": depth, "seed": seed,
        "independent": settings.sampler == trisect::render::Sampler::Independent,
        "denoise": if settings.guides { json!("svgf") } else { Value::Null },
    })
}
