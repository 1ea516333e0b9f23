//! Options that cannot be combined with `--frames` and `--shutter`.

use crate::cli::{MotionArgs, RenderArgs};
use trisect::error::MotionError;
use trisect::layers::Aov;

/// Refuses options that are for an image of a scene that does not move.
pub fn refuse(arguments: &RenderArgs) -> Result<(), MotionError> {
    let MotionArgs { frames, shutter, .. } = &arguments.motion;
    let Some(with) = arguments.motion.option() else { return Ok(()) };
    let error = |what, with, remedy| Err(MotionError::Beside { what, with, remedy });
    if arguments.motion.camera_path.is_some() && arguments.job.camera.is_given() {
        return error("--camera-path", "options of the camera", "the file has the camera of each frame");
    }
    if arguments.checkpointing.checkpoint.is_some() {
        return match frames {
            Some(_) => error(
                "--checkpoint",
                with,
                "each complete frame is written, and --frames K..END continues with frame K",
            ),
            None => error("--checkpoint", with, "render the image without --checkpoint"),
        };
    }
    if shutter.is_some() {
        let goal = &arguments.goal;
        let goals = [
            ("--budget", goal.budget.is_some()),
            ("--target-error", goal.target_error.is_some()),
            ("--quality", goal.quality.is_some()),
        ];
        if let Some((what, _)) = goals.into_iter().find(|goal| goal.1) {
            return error(what, "--shutter", "its samples are divided over moments: name --spp");
        }
        let one_moment = [
            ("--aov id", Aov::Id),
            ("--aov cryptomatte", Aov::Cryptomatte),
            ("--aov geometric-normal", Aov::GeometricNormal),
            ("--aov uv", Aov::Uv),
            ("--aov motion", Aov::Motion),
        ];
        if let Some((what, _)) = one_moment.into_iter().find(|(_, aov)| arguments.aov.contains(aov)) {
            return error(
                what,
                "--shutter",
                "a pixel shows several moments: render the layer without --shutter",
            );
        }
    }
    Ok(())
}
