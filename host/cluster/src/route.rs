//! Way of image parts to the root: directly, or up a tree of ranks that add them.

use super::ClusterError;
use super::heartbeat::Heartbeat;
use super::image_part::ImagePart;
use super::network::{Network, Tag};
use super::reduce::Reduce;
use super::root::Root;
use super::work::Work;
use crate::Error;
use trisect::render::Settings;

/// Destination of image parts.
pub(super) enum Route {
    /// The root.
    Direct,
    /// The parent in the tree of ranks.
    Tree(Reduce),
}

/// Passes an image part of this rank or another one to its destination.
pub(super) fn deliver<N: Network>(
    link: &mut Heartbeat<N>,
    route: &mut Route,
    root: Option<&mut Root<'_>>,
    from: u32,
    piece: ImagePart,
    work: &Work,
) -> Result<(), Error> {
    let own = from == link.rank();
    let mut root = root;
    if let Some(root) = root.as_mut() {
        root.count(&piece);
    }
    match route {
        Route::Tree(reduce) => {
            let Settings { width, .. } = work.settings;
            match (reduce.parent, root) {
                (Some(parent), _) if reduce.children == 0 => {
                    // A leaf's sums are sent unchanged.
                    reduce.count(from, &piece)?;
                    link.send(parent, Tag::ImagePart, piece.into_bytes())?;
                }
                (Some(parent), _) => {
                    if let Some(strip) = reduce.add(from, piece)? {
                        link.send(parent, Tag::ImagePart, ImagePart::of_strip(&strip, width).into_bytes())?;
                    }
                }
                (None, Some(root)) => {
                    reduce.count(from, &piece)?;
                    root.assembler.add(from, &piece)?;
                }
                (None, None) => {}
            }
            Ok(())
        }
        Route::Direct => match root {
            Some(root) => root.take(from, &piece),
            None if own => Ok(link.send(0, Tag::ImagePart, piece.into_bytes())?),
            None => Err(ClusterError::Protocol {
                rank: from,
                message: "an image part to a rank that is not the root".to_owned(),
            }
            .into()),
        },
    }
}
