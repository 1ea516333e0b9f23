//! Channels of an OpenEXR file.

use rayon::prelude::*;
use std::borrow::Cow;

/// Number of samples that a task of the thread pool converts.
pub(super) const TASK: usize = 1 << 14;

/// Samples of a channel, row by row, top row first.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Numbers that have 16 bits if the encoding permits.
    Color(Vec<f32>),
    /// 32-bit floating-point numbers.
    F32(Vec<f32>),
    /// 32-bit unsigned integers.
    U32(Vec<u32>),
}

/// Channel of an OpenEXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name in the file; the part before the last dot names a layer.
    pub name: Cow<'static, str>,
    /// One sample for each pixel.
    pub samples: Samples,
}

impl Channel {
    /// Makes a channel.
    pub fn new(name: impl Into<Cow<'static, str>>, samples: Samples) -> Self {
        Self { name: name.into(), samples }
    }
}

/// Returns three channels of colours, named `prefix` and R, G and B.
pub fn color_channels(prefix: &str, values: &[[f32; 3]]) -> Vec<Channel> {
    channels(prefix, ["R", "G", "B"], values, Samples::Color)
}

/// Returns three channels, named `prefix` and `names`.
pub fn channels(
    prefix: &str,
    names: [&str; 3],
    values: &[[f32; 3]],
    samples: impl Fn(Vec<f32>) -> Samples,
) -> Vec<Channel> {
    let column = |c: usize| values.par_iter().with_min_len(TASK).map(|value| value[c]).collect();
    let channel = |(c, name)| Channel::new(format!("{prefix}{name}"), samples(column(c)));
    names.into_iter().enumerate().map(channel).collect()
}
