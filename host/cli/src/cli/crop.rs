//! Value of `--crop`.

use std::ops::Range;
use trisect::render::{Settings, SettingsError};

/// Part of an image: x and y of its upper left corner, and of its lower right one, which is
/// outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CropWindow {
    /// Shares of width and height.
    Shares([f64; 4]),
    /// Numbers of pixels.
    Pixels([u32; 4]),
}

impl CropWindow {
    /// Returns the settings of this part of an image. Shares are rounded to whole pixels.
    ///
    /// # Errors
    ///
    /// [`SettingsError::NoSuchCrop`] for a part that is empty or beyond the image.
    pub fn of(self, settings: Settings) -> Result<Settings, SettingsError> {
        let pixel = |share: f64, of: u32| (share * f64::from(of)).round() as u32;
        let [x0, y0, x1, y1] = match self {
            Self::Pixels(pixels) => pixels,
            Self::Shares([x0, y0, x1, y1]) => {
                let (width, height) = (settings.width, settings.height);
                [pixel(x0, width), pixel(y0, height), pixel(x1, width), pixel(y1, height)]
            }
        };
        let range = |from: u32, to: u32| Range { start: from, end: to };
        settings.cropped(range(x0, x1), range(y0, y1))
    }
}

/// Parses four numbers: shares if none is above 1, else pixels.
pub fn parse_crop(text: &str) -> Result<CropWindow, String> {
    let form = || "must be X0,Y0,X1,Y1: shares from 0 to 1, or pixels".to_owned();
    let words: Vec<&str> = text.split(',').map(str::trim).collect();
    let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    let numbers: [f64; 4] = numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(form)?;
    let [x0, y0, x1, y1] = numbers;
    if !numbers.iter().all(|number| *number >= 0.0 && number.is_finite()) {
        return Err(form());
    }
    if x0 >= x1 || y0 >= y1 {
        return Err("the second corner must be to the right of the first one, and below it".to_owned());
    }
    if numbers.iter().all(|number| *number <= 1.0) {
        return Ok(CropWindow::Shares(numbers));
    }
    let pixels: Option<Vec<u32>> = words.iter().map(|word| word.parse().ok()).collect();
    let pixels = pixels.and_then(|pixels| pixels.try_into().ok());
    pixels.map(CropWindow::Pixels).ok_or_else(|| "pixels must be whole numbers".to_owned())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn shares_and_pixels() {
        assert_eq!(parse_crop("0,0.25,0.5,1"), Ok(CropWindow::Shares([0.0, 0.25, 0.5, 1.0])));
        assert_eq!(parse_crop("0, 10,320,200"), Ok(CropWindow::Pixels([0, 10, 320, 200])));
        for bad in ["", "0,0,1", "0,0,1,1,1", "-0.1,0,1,1", "nan,0,1,1", "0,0,inf,1", "x,0,1,1"] {
            assert!(parse_crop(bad).unwrap_err().contains("X0,Y0,X1,Y1"), "{bad}");
        }
        for bad in ["0.5,0,0.5,1", "9,0,8,5", "0,1,1,0.5"] {
            assert!(parse_crop(bad).unwrap_err().contains("second corner"), "{bad}");
        }
        assert!(parse_crop("0,0,10.5,20").unwrap_err().contains("whole"));
        let of = |text: &str| parse_crop(text).unwrap().of(Settings::new(101, 50));
        let part = of("0.25,0.5,0.75,1").unwrap();
        assert_eq!((part.width, part.height), (51, 25));
        assert!(of("0,0,102,50").is_err() && of("0,0,0.001,1").is_err());
    }
}
