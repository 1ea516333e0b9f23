//! Portable float maps (PFM, Debevec): a text header, then 32-bit floats, bottom row first.

use crate::Image;

/// Returns the bytes of a PFM file with three channels, little endian.
pub fn encode(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    for row in image.pixels.chunks(image.width.max(1) as usize).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

/// Decodes a PFM file with one or three channels in either byte order.
pub fn decode(bytes: &[u8]) -> Result<Image, String> {
    let mut rest = bytes;
    let mut word = || -> Result<&str, String> {
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("the header ends early")?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).ok_or("the header ends early")?;
        let (word, after) = rest[start..].split_at(length);
        rest = &after[1..]; // exactly one white space before the data
        str::from_utf8(word).map_err(|_| "the header is not text".to_owned())
    };
    let channels = match word()? {
        "PF" => 3u128,
        "Pf" => 1,
        other => return Err(format!("not a portable float map: it begins with {other:?}")),
    };
    let number = |text: &str| text.parse::<u32>().map_err(|_| format!("{text:?} is not a size"));
    let (width, height) = (number(word()?)?, number(word()?)?);
    let scale = word()?;
    let little = match scale.parse::<f32>() {
        Ok(scale) if scale != 0.0 && scale.is_finite() => scale < 0.0,
        _ => return Err(format!("{scale:?} is not a scale")),
    };
    let bytes = u128::from(width) * u128::from(height) * channels * 4;
    if rest.len() as u128 != bytes {
        return Err(format!("{width}x{height} needs {bytes} bytes of data, there are {}", rest.len()));
    }
    let value = |bytes: [u8; 4]| if little { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) };
    let rows = rest.as_chunks().0.chunks((width as usize * channels as usize).max(1)).rev();
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in rows {
        match channels {
            3 => pixels.extend(row.as_chunks().0.iter().map(|pixel: &[[u8; 4]; 3]| pixel.map(value))),
            _ => pixels.extend(row.iter().map(|&grey| [value(grey); 3])),
        }
    }
    Ok(Image { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bottom_row_first_both_byte_orders_one_channel() {
        let mut big = b"Pf 1 2\n1.0\n".to_vec();
        big.extend([2.0f32, 1.0].iter().flat_map(|v| v.to_be_bytes()));
        let image = decode(&big).unwrap();
        assert_eq!(image.pixels, [[1.0; 3], [2.0; 3]]);
        assert_eq!(decode(&encode(&image)).unwrap(), image);
    }

    #[test]
    fn broken_files_are_refused() {
        let cases: [&[u8]; 8] = [
            b"",
            b"PF",
            b"P6\n1 1\n255\n",
            b"PF\n-1 1\n-1.0\n",
            b"PF\n1 1\n0\n",
            b"PF\n1 1\n-1.0\nabc",
            b"PF\n4294967295 4294967295\n-1.0\n",
            b"Pf\n2147483648 2147483648\n-1.0\n",
        ];
        for case in cases {
            assert!(decode(case).is_err(), "{:?}", String::from_utf8_lossy(case));
        }
    }
}
