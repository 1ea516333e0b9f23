//! `trisect resume --distribute`: continues a render over ranks.

use super::super::resume::{check_output, command};
use super::ClusterSession;
use super::render::{self, ResumeState};
use crate::cli::ResumeArgs;
use serde::{Deserialize, Serialize};
use std::process::ExitCode;
use trisect::checkpoint::{Checkpoint, Header, Place};
use trisect_cluster::{ClusterError, Tag};
use trisect_lab::Error;

/// Facts about the root's checkpoint that all ranks need.
#[derive(Serialize, Deserialize)]
struct CheckpointInfo {
    header: Header,
    guides: bool,
}

/// Continues a render over all ranks; only the root reads the checkpoint.
pub fn run(arguments: &ResumeArgs) -> Result<ExitCode, Error> {
    let mut crew = ClusterSession::start(&arguments.cluster.ranks, arguments.threads)?;
    let begun =
        begin(&mut crew, arguments).and_then(|before| Ok((command(arguments, &before.header)?, before)));
    match begun {
        Ok((command, before)) => render::render_film(crew, &command, Some(before)),
        Err(error) => Ok(crew.give_up(&error)),
    }
}

/// Reads the checkpoint on the root, which sends its header to the other ranks.
fn begin(crew: &mut ClusterSession, arguments: &ResumeArgs) -> Result<ResumeState, Error> {
    if crew.link.is_root() {
        let place = Place::of(&arguments.file);
        let file = arguments.file.clone();
        let checkpoint = crew.link.run_while_polling(move || Checkpoint::read(&file))??;
        check_output(arguments, &command(arguments, &checkpoint.header)?)?;
        let told =
            CheckpointInfo { header: checkpoint.header.clone(), guides: !checkpoint.film.aovs.is_empty() };
        crew.link.send_all(Tag::Resume, &serde_json::to_vec(&told).unwrap_or_default())?;
        return Ok(ResumeState {
            place,
            header: told.header,
            aovs: told.guides,
            checkpoint: Some(checkpoint),
        });
    }
    let message = crew.link.expect(Tag::Resume)?;
    let CheckpointInfo { header, guides } = serde_json::from_slice(&message.bytes).map_err(|error| {
        ClusterError::Protocol { rank: message.from, message: format!("no checkpoint header: {error}") }
    })?;
    let place = Place::new(&arguments.file);
    Ok(ResumeState { place, header, aovs: guides, checkpoint: None })
}
