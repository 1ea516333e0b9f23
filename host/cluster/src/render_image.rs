//! One image over all ranks.
//!
//! Each rank has two threads: one renders, the other sends finished image parts and receives
//! messages. An image part is sent while the next one is rendered.

use super::heartbeat::Heartbeat;
use super::network::Network;
use super::rank_render::{RankRender, Turn};
use super::root::ResumableFilm;
use super::work::{Failure, Finished, Work};
use trisect::render::{RenderObserver, Renderer};

/// Renders an image over all ranks; each rank calls this with the same work. Returns the image on
/// the root, `None` on the others, and the renderer for the next image. `ended` returns whether the
/// process was asked to end.
///
/// # Errors
///
/// [`Failure`] with the partial image: an error of this rank or another, a rank that was silent for
/// too long, or a request to end. The caller must then end the job, because the other ranks wait.
pub fn render_image<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    work: &Work,
    observer: &mut dyn RenderObserver,
    ended: &dyn Fn() -> bool,
) -> Result<(Option<Finished>, Renderer), Failure> {
    render_into_film(link, renderer, work, None, observer, ended)
}

/// Renders the samples that the root's film `kept` lacks, chunk by chunk, until it is complete or
/// its observer ends the render. The work is that of [`Work::for_film`]; other ranks pass no film.
/// The complete film has the bits of one that one process rendered. Without a film on the root, the
/// work is an image as in [`render_image`].
///
/// # Errors
///
/// Errors of [`render_image`], and of a film that does not fit the work. [`Failure::partial`]
/// returns the film, unless it did not fit.
pub fn render_into_film<N: Network>(
    link: &mut Heartbeat<N>,
    renderer: Renderer,
    work: &Work,
    kept: Option<ResumableFilm<'_>>,
    observer: &mut dyn RenderObserver,
    ended: &dyn Fn() -> bool,
) -> Result<(Option<Finished>, Renderer), Failure> {
    let mut rank = RankRender::start(link, renderer, work, kept)?;
    loop {
        match rank.turn(link, observer, ended) {
            Ok(Turn::Goes) => {}
            Ok(Turn::Done(finished)) => {
                return Ok((finished.map(|finished| *finished), rank.into_renderer()));
            }
            Err(error) => return Err(rank.failed(error)),
        }
    }
}
