//! Goals of a render other than a number of samples: `--budget`, `--target-error`, `--quality`.

use super::time::parse_time;
use super::{DenoiseArgs, JobArgs};
use clap::{Args, ValueEnum};
use std::time::Duration;
use trisect::adaptive::{Adaptive, DEFAULT_MAX_SAMPLES, Free, Goal, Request};
use trisect::denoise::{DenoiseError, Denoiser};

/// Goal of a render in place of `--spp`.
#[derive(Clone, Debug, Args)]
pub struct GoalArgs {
    /// Render the best image within this time, such as 500ms, 2s or 1.5m, counted from the first
    /// sample after compiling the kernels to the finished image. Chooses roulette, sampler,
    /// denoiser and adaptive sampling if they are not given.
    #[arg(help_heading = "Goal in place of --spp", long, value_name = "TIME", value_parser = parse_time, conflicts_with_all = ["target_error", "quality", "spp"])]
    pub budget: Option<Duration>,

    /// Render until the estimated relative error of the image, the root of its relMSE, is at most
    /// this percentage, such as 1%. Chooses roulette, sampler and adaptive sampling if they are not
    /// given.
    #[arg(help_heading = "Goal in place of --spp", long, value_name = "PERCENT", value_parser = parse_percent, conflicts_with_all = ["quality", "spp"])]
    pub target_error: Option<f64>,

    /// Goal by name: a time or an error.
    #[arg(help_heading = "Goal in place of --spp", long, value_enum, conflicts_with = "spp")]
    pub quality: Option<QualityGoal>,

    /// With --budget, --target-error or --quality: distribution of samples over the image (default:
    /// auto).
    #[arg(help_heading = "Goal in place of --spp", long, value_enum)]
    pub adaptive: Option<Adaptive>,

    /// With --target-error or --quality final: maximum mean samples per pixel; the last pass may
    /// exceed it by one sample or a few percent (default: docs/how-to/samples-and-budgets.md).
    #[arg(help_heading = "Goal in place of --spp", long, value_name = "N", value_parser = super::parse_count)]
    pub max_spp: Option<u32>,
}

/// Values of `--quality`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QualityGoal {
    /// Short for --budget 1s.
    Draft,
    /// Short for --budget 10s.
    Preview,
    /// Short for --target-error 1%.
    Final,
}

impl GoalArgs {
    /// Returns a warning for each given option that has no effect on this command.
    pub fn without_effect(&self) -> Vec<&'static str> {
        let Self { budget, target_error, quality, adaptive, max_spp } = self;
        let has_error = target_error.is_some() || *quality == Some(QualityGoal::Final);
        let has_goal = has_error || budget.is_some() || quality.is_some();
        let mut lines = Vec::new();
        if adaptive.is_some() && !has_goal {
            lines.push("--adaptive has no effect without a goal; add --budget, --target-error or --quality");
        }
        if max_spp.is_some() && !has_error {
            lines.push("--max-spp has no effect without --target-error or --quality final; add one of them");
        }
        lines
    }
}

impl GoalArgs {
    /// Returns the goal with the settings of `job` that it may choose, or `None` without a goal.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] for invalid parameters of the filter.
    pub fn request(&self, job: &JobArgs, filter: &DenoiseArgs) -> Result<Option<Request>, DenoiseError> {
        let error = |target| Goal::Error { target, max_samples: self.max_spp.unwrap_or(DEFAULT_MAX_SAMPLES) };
        let goal = match (self.budget, self.target_error, self.quality) {
            (Some(time), _, _) => Goal::Time(time),
            (_, Some(target), _) => error(target),
            (_, _, Some(QualityGoal::Draft)) => Goal::Time(Duration::from_secs(1)),
            (_, _, Some(QualityGoal::Preview)) => Goal::Time(Duration::from_secs(10)),
            (_, _, Some(QualityGoal::Final)) => error(0.01),
            (None, None, None) => return Ok(None),
        };
        let adaptive = self.adaptive.unwrap_or(Adaptive::Auto);
        let JobArgs { roulette, roulette_depth, sampler, .. } = job;
        let timed = matches!(goal, Goal::Time(_));
        let free = Free {
            roulette: roulette.is_none() && roulette_depth.is_none(),
            roulette_depth: roulette_depth.is_none(),
            sampler: sampler.is_none(),
            denoise: timed && filter.denoise.is_none(),
        };
        let denoisers = match free.denoise {
            true => Denoiser::choices()?,
            false => filter.denoise()?.into_iter().collect(),
        };
        Ok(Some(Request { goal, adaptive, free, denoisers }))
    }
}

fn parse_percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').unwrap_or(text).trim();
    match number.parse::<f64>() {
        Ok(percent) if percent > 0.0 && percent < 100.0 => Ok(percent / 100.0),
        _ => Err("write it as 1% or 0.5%, above 0 and below 100".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_without_effect_are_named() {
        let none =
            GoalArgs { budget: None, target_error: None, quality: None, adaptive: None, max_spp: None };
        let both = GoalArgs { adaptive: Some(Adaptive::On), max_spp: Some(8), ..none.clone() };
        assert_eq!(both.without_effect().len(), 2);
        let timed = GoalArgs { quality: Some(QualityGoal::Draft), ..both.clone() };
        assert!(matches!(timed.without_effect()[..], [line] if line.starts_with("--max-spp")));
        let with_error = GoalArgs { target_error: Some(0.01), ..both };
        assert!(with_error.without_effect().is_empty() && none.without_effect().is_empty());
    }

    #[test]
    fn percents() {
        assert_eq!(parse_percent("1%"), Ok(0.01));
        assert_eq!(parse_percent("0.5"), Ok(0.005));
        for bad in ["", "0", "100%", "-1%", "nan", "x"] {
            assert!(parse_percent(bad).is_err(), "{bad}");
        }
    }
}
