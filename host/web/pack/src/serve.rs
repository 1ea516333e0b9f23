//! Server of the page's files.

use crate::PageError;
use std::fs::File;
use std::path::{Component, Path, PathBuf};
use tiny_http::{Header, Request, Response, Server, StatusCode};

/// Extensions with their media types.
const TYPES: [(&str, &str); 6] = [
    ("html", "text/html; charset=utf-8"),
    ("css", "text/css"),
    ("js", "text/javascript"),
    ("json", "application/json"),
    ("svg", "image/svg+xml"),
    ("wasm", "application/wasm"),
];

/// Serves a folder until the process is ended.
pub fn serve(folder: &Path, address: &str) -> Result<(), PageError> {
    let server = Server::http(address)
        .map_err(|error| PageError::Serve { address: address.to_owned(), message: error.to_string() })?;
    println!("serving {} at http://{}/", folder.display(), server.server_addr());
    for request in server.incoming_requests() {
        respond(folder, request);
    }
    Ok(())
}

/// Answers a request. A client that went away is no error.
fn respond(folder: &Path, request: Request) {
    let file = file_of(request.url()).map(|path| folder.join(path));
    let opened = file.as_ref().and_then(|path| File::open(path).ok().filter(|_| path.is_file()));
    let _ = match (opened, file) {
        (Some(opened), Some(path)) => {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            let kind = TYPES.iter().find(|(name, _)| *name == extension);
            let kind = kind.map_or("application/octet-stream", |(_, kind)| kind);
            let headers = [("Content-Type", kind), ("Cache-Control", "no-cache")];
            let headers = headers.iter().flat_map(|(name, value)| Header::from_bytes(*name, *value));
            request.respond(headers.fold(Response::from_file(opened), Response::with_header))
        }
        _ => request.respond(Response::from_string("not found\n").with_status_code(StatusCode(404))),
    };
}

/// Returns the relative path of the file that a URL names; `None` for one outside the folder.
fn file_of(url: &str) -> Option<PathBuf> {
    let path = url.split(['?', '#']).next()?.trim_start_matches('/');
    let path = if path.is_empty() { "index.html" } else { path };
    let path = PathBuf::from(path);
    path.components().all(|part| matches!(part, Component::Normal(_))).then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_the_folder_are_served() {
        assert_eq!(file_of("/"), Some("index.html".into()));
        assert_eq!(file_of("/scenes/a.ron?x=1"), Some("scenes/a.ron".into()));
        for outside in ["/../secret", "/scenes/../../secret", "//../x"] {
            assert_eq!(file_of(outside), None, "{outside}");
        }
    }
}
