//! The sRGB transfer function (IEC 61966-2-1), between linear Rec. 709 and
//! display-encoded values. Nominal range of both sides: [0, 1].

/// Encodes one linear value for an sRGB display.
///
/// Values above 1 continue along the power segment and negative values along the linear one, so
/// nothing is clipped here. NaN stays NaN.
#[must_use]
pub fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes one sRGB-encoded value to a linear one. This is the inverse of [`encode`] in single
/// precision, up to the step of about 1e-8 that the standard's rounded constants leave where the
/// two segments meet.
#[must_use]
pub fn decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes one linear value as an 8-bit sRGB code, rounded to nearest.
///
/// Clips to [0, 255]; NaN gives 0.
#[must_use]
pub fn encode_u8(linear: f32) -> u8 {
    // A float-to-integer cast saturates, and maps NaN to 0.
    (encode(linear) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_round_trip() {
        for code in 0..=255_u8 {
            assert_eq!(encode_u8(decode(f32::from(code) / 255.0)), code);
        }
    }

    #[test]
    fn known_values() {
        assert_eq!(encode(0.0), 0.0);
        assert!((encode(1.0) - 1.0).abs() < 1e-6);
        // Middle grey, 18 %, is code 118 of 255.
        assert_eq!(encode_u8(0.18), 118);
        assert!((decode(0.5) - 0.214_041_14).abs() < 1e-6);
    }

    #[test]
    fn the_segments_meet() {
        for x in [0.003_130_7_f32, 0.003_130_8, 0.003_130_9] {
            assert!((encode(x) - 12.92 * x).abs() < 1e-5);
            assert!((decode(encode(x)) - x).abs() < 1e-7);
        }
    }

    #[test]
    fn codes_clip_outside_the_display_range() {
        assert_eq!(encode_u8(-3.0), 0);
        assert_eq!(encode_u8(1e30), 255);
        assert_eq!(encode_u8(f32::INFINITY), 255);
        assert_eq!(encode_u8(f32::NEG_INFINITY), 0);
        assert_eq!(encode_u8(f32::NAN), 0);
    }
}
