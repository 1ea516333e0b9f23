//! Grid of densities, and its file: Mitsuba's `.vol`.

use crate::error::SceneError;
use std::path::Path;
use trisect_system::input;

/// Maximum number of voxels: kernels number texels in 32 bits.
const MAX_VOXELS: u64 = 1 << 30;

/// Bytes before the first density.
const HEADER: usize = 48;

/// Densities at the centres of the voxels of a unit cube.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityGrid {
    size: [u32; 3],
    densities: Vec<f32>,
    max: f32,
    /// Corners of the box that a file states.
    bounds: [[f32; 3]; 2],
}

impl DensityGrid {
    /// Creates a grid of `size` voxels along x, y and z. Densities are in the order of x, then y,
    /// then z.
    ///
    /// # Errors
    ///
    /// A message for a size that is 0, too large or not that of `densities`, and for a density that
    /// is negative or not finite.
    pub fn new(size: [u32; 3], densities: Vec<f32>) -> Result<Self, String> {
        let [x, y, z] = size;
        let count = size.iter().try_fold(1u64, |count, &n| count.checked_mul(u64::from(n)));
        let count = count.filter(|count| (1..=MAX_VOXELS).contains(count));
        if count != Some(densities.len() as u64) {
            return Err(format!(
                "a grid of {x} x {y} x {z} voxels with {} densities; give one each, at least 1 and at most 2^30",
                densities.len()
            ));
        }
        let valid = |density: &&f32| !(0.0..=1e18).contains(*density);
        if let Some((index, density)) = densities.iter().enumerate().find(|(_, density)| valid(density)) {
            return Err(format!("density {index} is {density}; it must be between 0 and 1e18"));
        }
        let max = densities.iter().fold(0.0f32, |max, &density| max.max(density));
        Ok(Self { size, densities, max, bounds: [[0.0; 3], [1.0; 3]] })
    }

    /// Reads a file.
    ///
    /// # Errors
    ///
    /// [`SceneError::Read`] for a file that cannot be read, [`SceneError::Malformed`] for one that
    /// is not a grid.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let bytes = input::read(path, input::readable()).map_err(|error| SceneError::read(path, error))?;
        Self::parse(&bytes, &path.display().to_string())
    }

    /// Reads the content of a file, which `name` stands for in messages.
    ///
    /// # Errors
    ///
    /// [`SceneError::Malformed`] for bytes that are not a grid.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self, SceneError> {
        let malformed = |place: &str, problem: String, remedy: &str| SceneError::Malformed {
            file: name.to_owned(),
            place: place.to_owned(),
            problem,
            remedy: remedy.to_owned(),
        };
        let Some((header, body)) = bytes.split_at_checked(HEADER) else {
            let problem = format!("it has {} bytes", bytes.len());
            return Err(malformed("header", problem, "a grid has a header of 48 bytes"));
        };
        if header[..4] != *b"VOL\x03" {
            let problem = "it does not begin with VOL and version 3".to_owned();
            return Err(malformed("header", problem, "write Mitsuba's format of volumes, version 3"));
        }
        let (words, _) = header[4..].as_chunks::<4>();
        let [encoding, x, y, z, channels, corners @ ..] = words else {
            return Err(malformed("header", "it is too short".to_owned(), "a grid has 48 bytes of it"));
        };
        let [encoding, x, y, z, channels] =
            [encoding, x, y, z, channels].map(|word| u32::from_le_bytes(*word));
        if (encoding, channels) != (1, 1) {
            let problem = format!("encoding {encoding} with {channels} channels");
            return Err(malformed("header", problem, "densities are encoding 1 (32-bit floats), 1 channel"));
        }
        let count = [x, y, z].iter().try_fold(1u64, |count, &n| count.checked_mul(u64::from(n)));
        if count.and_then(|count| count.checked_mul(4)) != Some(body.len() as u64) {
            let problem = format!("{} bytes follow the header of {x} x {y} x {z} voxels", body.len());
            return Err(malformed("densities", problem, "there are 4 bytes for each voxel"));
        }
        let (body, _) = body.as_chunks::<4>();
        let densities = body.iter().map(|word| f32::from_le_bytes(*word)).collect();
        let mut grid = Self::new([x, y, z], densities)
            .map_err(|problem| malformed("densities", problem, "correct the file"))?;
        for (bound, word) in grid.bounds.as_flattened_mut().iter_mut().zip(corners) {
            *bound = f32::from_le_bytes(*word);
        }
        let [low, high] = grid.bounds;
        if !low.iter().zip(&high).all(|(low, high)| low < high && low.is_finite() && high.is_finite()) {
            let problem = format!("the box from {low:?} to {high:?} is empty");
            return Err(malformed("header", problem, "each coordinate of its second corner is the greater"));
        }
        Ok(grid)
    }

    /// Returns the number of voxels along x, y and z.
    pub fn size(&self) -> [u32; 3] {
        self.size
    }

    /// Returns the densities in the order of x, then y, then z.
    pub fn densities(&self) -> &[f32] {
        &self.densities
    }

    /// Returns the maximum density.
    pub fn max(&self) -> f32 {
        self.max
    }

    /// Returns the corners of the box that the file states; those of the unit cube for a grid of a
    /// program.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        self.bounds
    }

    /// Returns the content of a file that holds the grid.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        let [x, y, z] = self.size;
        for word in [1, x, y, z, 1] {
            bytes.extend(word.to_le_bytes());
        }
        for number in self.bounds.as_flattened().iter().chain(&self.densities) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let grid = DensityGrid::new([2, 3, 1], vec![0.0, 1.0, 0.5, 2.0, 0.25, 0.75]).unwrap();
        let bytes = grid.to_bytes();
        assert_eq!(DensityGrid::parse(&bytes, "a.vol").unwrap(), grid);
        assert_eq!((grid.max(), bytes.len()), (2.0, 72));
    }

    /// Every file that is cut off or has a wrong byte is refused by name, or read as another grid.
    #[test]
    fn other_files_are_refused() {
        let bytes = DensityGrid::new([2, 2, 2], vec![0.5; 8]).unwrap().to_bytes();
        for end in 0..bytes.len() {
            let error = DensityGrid::parse(&bytes[..end], "a.vol").unwrap_err().to_string();
            assert!(error.starts_with("a.vol: "), "{error}");
        }
        for (place, value, part) in [
            (0, b'X', "VOL"),
            (3, 2, "version"),
            (4, 2, "encoding 2"),
            (8, 3, "3 x 2 x 2"),
            (11, 0xff, "voxels"),
            (20, 3, "3 channels"),
            (51, 0xff, "density 0"),
            (27, 0x7f, "box"),
        ] {
            let mut wrong = bytes.clone();
            wrong[place] = value;
            let error = DensityGrid::parse(&wrong, "a.vol").unwrap_err().to_string();
            assert!(error.contains(part), "{place}: {error}");
        }
        assert!(DensityGrid::new([0, 1, 1], vec![]).is_err());
        assert!(DensityGrid::new([u32::MAX; 3], vec![1.0]).is_err());
        assert!(DensityGrid::new([1; 3], vec![f32::NAN]).is_err());
    }
}
