//! Server of the page's files.

use crate::PageError;
use axum::Router;
use axum::http::header::CACHE_CONTROL;
use axum::http::{HeaderName, HeaderValue};
use std::io;
use std::net::TcpListener;
use std::path::Path;
use tower_http::services::ServeDir;
use tower_http::set_header::SetResponseHeaderLayer;

/// Serves a folder until the process is ended.
pub fn serve(folder: &Path, address: &str) -> Result<(), PageError> {
    let listen = || {
        let listener = TcpListener::bind(address)?;
        println!("serving {} at http://{}/", folder.display(), listener.local_addr()?);
        answer(folder, listener)
    };
    listen().map_err(|error| PageError::Serve { address: address.to_owned(), message: error.to_string() })
}

/// Headers of each response: browsers ask for files anew, and isolate the page from other origins,
/// without which its workers cannot share memory.
const HEADERS: [(HeaderName, &str); 3] = [
    (CACHE_CONTROL, "no-cache"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-embedder-policy"), "require-corp"),
];

/// Answers all requests that arrive, with files of a folder.
fn answer(folder: &Path, listener: TcpListener) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let mut files = Router::new().fallback_service(ServeDir::new(folder));
    for (name, value) in HEADERS {
        files = files.layer(SetResponseHeaderLayer::overriding(name, HeaderValue::from_static(value)));
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    runtime.block_on(async { axum::serve(tokio::net::TcpListener::from_std(listener)?, files).await })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::io::{BufRead, BufReader, Read, Write};
    use std::net::{SocketAddr, TcpStream};
    use std::time::Duration;

    /// Serves a folder with `index.html`, `main.js` and `trisect.wasm`, beside a file that is not
    /// part of it, until the test's process ends.
    fn served() -> SocketAddr {
        let folder = tempfile::tempdir().unwrap().keep();
        let page = folder.join("page");
        std::fs::create_dir(&page).unwrap();
        std::fs::write(folder.join("secret"), "secret").unwrap();
        for name in ["index.html", "main.js", "trisect.wasm"] {
            std::fs::write(page.join(name), name).unwrap();
        }
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        std::thread::spawn(move || answer(&page, listener));
        address
    }

    /// Asks for a path, and returns the response's head, in lower case, and its body.
    fn get(stream: &mut TcpStream, path: &str) -> (String, String) {
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        let mut reader = BufReader::new(stream);
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            assert_ne!(reader.read_line(&mut head).unwrap(), 0, "no answer to {path}: {head}");
        }
        let head = head.to_lowercase();
        let length = head.lines().find_map(|line| line.strip_prefix("content-length: "));
        let mut body = vec![0; length.map_or(0, |length| length.parse().unwrap())];
        reader.read_exact(&mut body).unwrap();
        (head, String::from_utf8(body).unwrap())
    }

    #[test]
    fn files_have_their_types() {
        let mut stream = TcpStream::connect(served()).unwrap();
        for (path, name, kind) in [
            ("/", "index.html", "text/html"),
            ("/main.js?version=1", "main.js", "text/javascript"),
            ("/trisect.wasm", "trisect.wasm", "application/wasm"),
        ] {
            let (head, body) = get(&mut stream, path);
            assert_eq!(body, name);
            assert!(head.contains(&format!("content-type: {kind}")), "{head}");
            for (name, value) in HEADERS {
                assert!(head.contains(&format!("{name}: {value}")), "{head}");
            }
        }
    }

    #[test]
    fn only_files_of_the_folder_are_served() {
        let address = served();
        for outside in ["/../secret", "/%2e%2e/secret", "/x/../../secret", "//../secret", "/none"] {
            let (head, body) = get(&mut TcpStream::connect(address).unwrap(), outside);
            assert!(head.starts_with("http/1.1 4"), "{outside}: {head}");
            assert!(!body.contains("secret"), "{outside}");
        }
    }

    /// Browsers keep connections open, and open some ahead, which must not hold up others.
    #[test]
    fn idle_connections_do_not_hold_up_others() {
        let address = served();
        let mut open: Vec<TcpStream> = (0..64).map(|_| TcpStream::connect(address).unwrap()).collect();
        for stream in open.iter_mut().step_by(2) {
            assert_eq!(get(stream, "/main.js").1, "main.js");
        }
        assert_eq!(get(&mut TcpStream::connect(address).unwrap(), "/main.js").1, "main.js");
        // Those that were open ahead are answered, too.
        assert_eq!(get(&mut open[1], "/main.js").1, "main.js");
    }
}
