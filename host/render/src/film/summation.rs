//! Place where the chunks of a film add up.

use serde::Serialize;
use trisect_device::DeviceKind;
use trisect_shared::totals::{AOV_TOTAL_WORDS, TOTAL_WORDS};

/// Place where the chunks of a film add up. The film has the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Summation {
    /// A GPU with enough memory for several chunks, or for an adaptive image without AOVs;
    /// otherwise the host. Ranks also leave chunks to a host whose memory is fast enough.
    #[default]
    Auto,
    /// The host, which reads each chunk.
    Host,
    /// The device, which the host reads once. The render fails if it lacks the memory.
    Device,
}

impl Summation {
    /// Returns whether a device of this kind adds up so many chunks, if it has the memory.
    pub fn is_by_device(self, chunks: usize, kind: DeviceKind) -> bool {
        match self {
            Self::Host => false,
            Self::Device => true,
            Self::Auto => chunks > 1 && kind == DeviceKind::Gpu,
        }
    }

    /// Bytes that the totals of a pixel take on a device.
    pub const BYTES_PER_PIXEL: u64 = TOTAL_WORDS as u64 * 4;

    /// Additional bytes of a pixel with AOVs.
    pub const BYTES_PER_PIXEL_OF_AOVS: u64 = AOV_TOTAL_WORDS as u64 * 4;
}
