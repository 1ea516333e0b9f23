//! Arguments of `trisect evaluate`.

use super::JsonArgs;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `trisect evaluate`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "times.json: {\"seconds\": [1.5, 1.6], \"processor_seconds\": 3.1}, each a number or a list with one number for each image; either may be missing."
)]
pub struct EvaluateArgs {
    /// Folder with a folder of images for each configuration, or with the images of one: .exr, .hdr
    /// or .pfm (linear), at least two, each rendered with its own seed. times.json beside the
    /// images has the seconds that they took.
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,

    /// Image of the reference, or folder with images of it that have different seeds; the noise of
    /// one image is unknown and counts as bias (default: the file or folder in FOLDER that is named
    /// reference).
    #[arg(long, value_name = "PATH")]
    pub reference: Option<PathBuf>,

    /// The images of a folder are frames of an animation, in the order of their names, and the
    /// reference is a folder with as many: each frame is compared with its own, and flicker is
    /// measured.
    #[arg(long)]
    pub frames: bool,

    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,
}
