//! Option `--background`.

use trisect::metrics::srgb;

/// Background of an image, seen where camera rays reach the sky.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// The sky.
    #[default]
    Sky,
    /// Nothing: the image file has alpha.
    Transparent,
    /// A colour, linear Rec. 709.
    Color([f32; 3]),
}

impl Background {
    /// Returns whether the sky is hidden from camera rays.
    pub fn hides_sky(self) -> bool {
        self != Self::Sky
    }
}

/// Reads `sky`, `transparent`, three linear numbers, or an sRGB colour such as `#ffd0a0`.
pub fn parse_background(text: &str) -> Result<Background, String> {
    let form = || "must be sky, transparent, linear R,G,B such as 0.2,0.3,0.4, or #rrggbb in sRGB".to_owned();
    match text {
        "sky" => return Ok(Background::Sky),
        "transparent" => return Ok(Background::Transparent),
        _ => {}
    }
    if let Some(digits) = text.strip_prefix('#') {
        let is_color = digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        let color = u32::from_str_radix(digits, 16).ok().filter(|_| is_color).ok_or_else(form)?;
        let [_, red, green, blue] = color.to_be_bytes();
        return Ok(Background::Color([red, green, blue].map(|byte| srgb::decode(f32::from(byte) / 255.0))));
    }
    let numbers: Vec<f32> =
        text.split(',').map(|word| word.trim().parse().map_err(|_| form())).collect::<Result<_, _>>()?;
    let color: [f32; 3] = numbers.try_into().map_err(|_| form())?;
    match color.iter().all(|channel| (0.0..=1e18).contains(channel)) {
        true => Ok(Background::Color(color)),
        false => Err(format!("{text}: each channel must be 0 or more and at most 1e18")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds() {
        assert_eq!(parse_background("sky"), Ok(Background::Sky));
        assert_eq!(parse_background("transparent"), Ok(Background::Transparent));
        assert_eq!(parse_background("0.5, 0,2"), Ok(Background::Color([0.5, 0.0, 2.0])));
        assert_eq!(parse_background("#FF0000"), Ok(Background::Color([1.0, 0.0, 0.0])));
        let Ok(Background::Color([grey, ..])) = parse_background("#808080") else { panic!() };
        assert!((grey - 0.2158).abs() < 1e-3, "{grey}");
        for bad in ["", "red", "#12345", "#12345g", "#+12345", "1,2", "1,2,3,4", "1,2,x"] {
            assert!(parse_background(bad).unwrap_err().contains("#rrggbb"), "{bad}");
        }
        for bad in ["-1,0,0", "nan,0,0", "inf,0,0"] {
            assert!(parse_background(bad).unwrap_err().contains("0 or more"), "{bad}");
        }
    }
}
