//! One image over several processes: the ranks of an MPI job, each with its own backend.
//!
//! `plan` assigns the work. Each rank renders on one thread while another sends the finished image
//! parts, each in the smallest format that the output needs (`image_part`): directly to the root
//! (rows) or up a tree of ranks (averages). The root puts them together (`assembler`). The report
//! "Parallelizing Ray Tracing" merged whole images by an all-reduce, whose time grew with each
//! rank.
//!
//! Random numbers depend only on seed, pixel, sample and dimension, and sums over chunks are exact.
//! So the image does not depend on which rank renders what.

#![warn(clippy::too_many_lines)]

mod assembler;
pub mod cost;
pub mod devices;
mod error;
mod frame_series;
pub mod handshake;
mod heartbeat;
mod image_part;
pub mod local;
mod means;
#[cfg(feature = "mpi")]
pub mod mpi;
mod network;
pub mod plan;
mod rank_render;
mod reduce;
mod render_image;
mod render_thread;
mod root;
mod route;
mod series;
mod work;
mod work_item;

pub use assembler::AssembledImage;
pub use cost::choose;
pub use error::{ClusterError, Error};
pub use heartbeat::{DEFAULT_PATIENCE, Heartbeat};
pub use image_part::{ImagePart, WireFormat};
pub use means::MeanSum;
pub use network::{Message, Network, Tag};
pub use plan::{Balance, ClusterPlan, DistributionMode};
pub use render_image::{render_image, render_into_film};
pub use root::ResumableFilm;
pub use series::{FrameCost, FrameSeries, Render, SeriesReport, Show, series};
pub use trisect::stats::{ClusterReport, RankReport};
pub use work::{Failure, Finished, Work};
