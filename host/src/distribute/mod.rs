//! One image over several processes: MPI's ranks, each with a backend of its own.
//!
//! `plan` says which rank renders what; each renders on one thread while another sends the pieces that are ready, each in the smallest type
//! that the output needs (`piece`), to the root alone (by rows) or up a tree of ranks (averages); the root puts them together (`canvas`).
//! The report "Parallelizing Ray Tracing" merged whole images by an all-reduce, whose time grew with each rank.
//!
//! Randomness is a function of seed, pixel, sample and dimension, and sums over chunks are exact: so it does not matter who renders what.

mod canvas;
pub mod cost;
pub mod devices;
mod error;
pub mod hello;
mod link;
pub mod local;
#[cfg(feature = "mpi")]
mod mailbox;
mod means;
#[cfg(feature = "mpi")]
pub mod mpi;
mod network;
mod order;
mod piece;
pub mod plan;
mod reduce;
mod report;
mod root;
mod series;
mod still;
#[cfg(feature = "mpi")]
mod transfer;
#[cfg(feature = "mpi")]
mod window;
mod work;
mod workshop;

pub use canvas::Picture;
pub use cost::choose;
pub use error::DistributeError;
pub use link::{Link, PATIENCE};
pub use means::MeanSum;
pub use network::{Message, Network, Tag};
pub use piece::{Piece, Travels};
pub use plan::{Balance, Mode, Plan};
pub use report::{ClusterReport, RankReport};
pub use root::Kept;
pub use series::{FrameCost, Render, Series, SeriesReport, Show, series};
pub use still::{onto, still};
pub use work::{Failure, Finished, Work};
