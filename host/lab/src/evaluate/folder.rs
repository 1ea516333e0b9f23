//! Evaluates the images of a folder: a sub-folder for each configuration, or one configuration.

use super::frames::{FrameErrors, check_count};
use super::set::MIN_IMAGES;
use super::{EvaluateError, Evaluation, FramesEvaluation, ImageSet, ReferenceImages, Row, Times};
use crate::accuracy::Truth;
use std::path::{Path, PathBuf};
use trisect::image::{Image, ImageError};
use trisect::memory;
use trisect::output::Format;

/// Name, without extension, of a file or folder that is the reference unless another is named.
const REFERENCE: &str = "reference";

/// Name of the file of times beside the images of a configuration.
const TIMES: &str = "times.json";

/// Bytes per pixel of an image in memory.
const IMAGE: u64 = 12;

/// Bytes per pixel of what an evaluation computes besides its images, mainly FLIP.
const COMPUTED: u64 = 200;

/// Files of the images of several configurations, and of their reference.
#[derive(Clone, Debug)]
pub struct ImageFolder {
    sets: Vec<SetFiles>,
    reference: Vec<PathBuf>,
}

/// Images of a configuration as files.
#[derive(Clone, Debug)]
struct SetFiles {
    name: String,
    folder: PathBuf,
    images: Vec<PathBuf>,
    /// File of their times, if there is one.
    times: Option<PathBuf>,
}

/// Content of a folder, in the order of the names, without hidden entries.
struct Content {
    images: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

impl ImageFolder {
    /// Lists the configurations of a folder: its sub-folders of images, or the images in the folder
    /// itself. A file `times.json` beside the images has [their times](Times::read). `reference` is
    /// an image or a folder of images with different seeds; without it, the file or folder named
    /// `reference` in the folder. Images are .exr, .hdr or .pfm files; other files are ignored.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] for folders that cannot be read or have no images, and without a
    /// reference.
    pub fn open(folder: &Path, reference: Option<&Path>) -> Result<Self, EvaluateError> {
        let content = Content::read(folder)?;
        let path = reference.map(Path::to_owned).or_else(|| content.reference());
        let path = path.ok_or_else(|| EvaluateError::NoReference { path: folder.to_owned() })?;
        let sets = content.sets(folder, &path)?;
        let reference = match path.is_dir() {
            true => Content::read(&path)?.images,
            false if Format::of(&path)?.is_display() => return Err(EvaluateError::ForDisplay { path }),
            false => vec![path.clone()],
        };
        match reference.is_empty() {
            true => Err(EvaluateError::NoImages { path }),
            false => Ok(Self { sets, reference }),
        }
    }

    /// Lists the configurations of a folder as [`open`](Self::open) does, for a comparison with
    /// another reference. A file or folder named `reference` in it is left out.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] for folders that cannot be read or have no images.
    pub fn without_reference(folder: &Path) -> Result<Self, EvaluateError> {
        let content = Content::read(folder)?;
        let reference = content.reference().unwrap_or_default();
        Ok(Self { sets: content.sets(folder, &reference)?, reference: Vec::new() })
    }

    /// Returns the files of all images and times.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.reference.iter().chain(self.sets.iter().flat_map(|set| set.images.iter().chain(&set.times)))
    }

    /// Reads and evaluates the images. One configuration at a time is in memory.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] with the file and a remedy: see [`evaluate`](super::evaluate).
    pub fn evaluate(&self) -> Result<Evaluation, EvaluateError> {
        let reference = ReferenceImages::new(read_images(&self.reference)?, &labels(&self.reference))?;
        let truth = reference.truth()?;
        let mut found = Evaluation::new(&reference);
        for files in &self.sets {
            let known = (&reference.labels[..], &reference.images[..]);
            found.rows.push(Row::of(&files.read()?, known, &truth)?);
        }
        Ok(found)
    }

    /// Reads all images, one configuration at a time, and checks that they can be evaluated against
    /// a reference of this size.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] with the file and a remedy: see [`evaluate`](super::evaluate).
    pub fn check(&self, width: u32, height: u32) -> Result<(), EvaluateError> {
        for files in &self.sets {
            let set = files.read()?;
            set.check((&[], &[]))?;
            let (size, other_size) = ((set.images[0].width, set.images[0].height), (width, height));
            if size != other_size {
                let (image, other) = (set.labels[0].clone(), "the measurement".to_owned());
                return Err(EvaluateError::Size { image, size, other, other_size });
            }
        }
        Ok(())
    }

    /// Reads and evaluates the images against another reference. Returns the result of each
    /// configuration with its name.
    pub fn rows(&self, truth: &Truth) -> impl Iterator<Item = (&str, Result<Row, EvaluateError>)> {
        let row = |files: &SetFiles| Row::of(&files.read()?, (&[], &[]), truth);
        self.sets.iter().map(move |files| (files.name.as_str(), row(files)))
    }

    /// Reads and evaluates the images as frames of an animation, in the order of their names. Two
    /// frames and their references are in memory.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] with the file and a remedy: see
    /// [`evaluate_frames`](super::evaluate_frames).
    pub fn evaluate_frames(&self) -> Result<FramesEvaluation, EvaluateError> {
        let count = self.reference.len();
        check_count("the reference", count, count)?;
        self.sets.iter().try_for_each(|set| check_count(&set.name, set.images.len(), count))?;
        let first = Image::read(&self.reference[0])?;
        let mut found = FramesEvaluation::new((first.width, first.height), count);
        for files in &self.sets {
            let set = ImageSet::new(files.name.clone(), Vec::new(), files.times()?);
            set.times.check(&set.name, count)?;
            let mut errors = FrameErrors::new(count);
            for (path, reference) in files.images.iter().zip(&self.reference) {
                let read = |path: &Path| -> Result<(String, Image), EvaluateError> {
                    Ok((path.display().to_string(), Image::read(path)?))
                };
                errors.add(read(path)?, read(reference)?)?;
            }
            found.rows.push(errors.finish(&set));
        }
        Ok(found)
    }
}

impl Content {
    fn read(folder: &Path) -> Result<Self, EvaluateError> {
        let (mut images, mut folders) = (Vec::new(), Vec::new());
        for entry in std::fs::read_dir(folder).map_err(EvaluateError::io(folder))? {
            let path = entry.map_err(EvaluateError::io(folder))?.path();
            let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if is_hidden {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if Format::of(&path).is_ok_and(|format| !format.is_display()) {
                images.push(path);
            }
        }
        images.sort();
        folders.sort();
        Ok(Self { images, folders })
    }

    /// Returns the file or folder that is the reference unless another is named.
    fn reference(&self) -> Option<PathBuf> {
        let is_it = |path: &&PathBuf| path.file_stem().is_some_and(|stem| stem == REFERENCE);
        self.folders.iter().chain(&self.images).find(is_it).cloned()
    }

    /// Returns the configurations of the folder at `path`, without the reference.
    fn sets(&self, path: &Path, reference: &Path) -> Result<Vec<SetFiles>, EvaluateError> {
        let is_reference = |path: &&PathBuf| match (path.canonicalize(), reference.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => false,
        };
        let images: Vec<PathBuf> = self.images.iter().filter(|path| !is_reference(path)).cloned().collect();
        let mut folders = self.folders.iter().filter(|path| !is_reference(path)).peekable();
        if !images.is_empty() {
            if let Some(folder) = folders.peek() {
                return Err(EvaluateError::Mixed { path: path.to_owned(), folder: (*folder).clone() });
            }
            return Ok(vec![SetFiles::new(path, images)]);
        }
        let mut sets = Vec::new();
        for folder in folders {
            let mut images = Self::read(folder)?.images;
            images.retain(|path| !is_reference(&path));
            if images.is_empty() {
                return Err(EvaluateError::NoImages { path: folder.clone() });
            }
            sets.push(SetFiles::new(folder, images));
        }
        match sets.is_empty() {
            true => Err(EvaluateError::NoImages { path: path.to_owned() }),
            false => Ok(sets),
        }
    }
}

impl SetFiles {
    fn new(folder: &Path, images: Vec<PathBuf>) -> Self {
        let times = Some(folder.join(TIMES)).filter(|times| times.exists());
        Self { name: name_of(folder), folder: folder.to_owned(), images, times }
    }

    fn times(&self) -> Result<Times, EvaluateError> {
        Ok(self.times.as_deref().map(Times::read).transpose()?.unwrap_or_default())
    }

    fn read(&self) -> Result<ImageSet, EvaluateError> {
        let times = self.times()?;
        if self.images.len() < MIN_IMAGES {
            let (set, count) = (self.folder.display().to_string(), self.images.len());
            return Err(EvaluateError::TooFew { set, count, least: MIN_IMAGES });
        }
        let images = read_images(&self.images)?;
        Ok(ImageSet { name: self.name.clone(), images, labels: labels(&self.images), times })
    }
}

/// Returns the name of a folder, also of one such as `.`.
fn name_of(folder: &Path) -> String {
    let full = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    full.file_name().unwrap_or(full.as_os_str()).to_string_lossy().into_owned()
}

fn labels(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|path| path.display().to_string()).collect()
}

/// Reads images, after a check that all of them, if they have the size of the first one, fit into
/// memory.
fn read_images(files: &[PathBuf]) -> Result<Vec<Image>, EvaluateError> {
    let mut images = Vec::new();
    for (place, path) in files.iter().enumerate() {
        let image = Image::read(path)?;
        if place == 0 {
            let (width, height) = (u64::from(image.width), u64::from(image.height));
            let each = IMAGE * files.len() as u64 + COMPUTED;
            let (needed, free) = (width.saturating_mul(height).saturating_mul(each), memory::available());
            if needed > free {
                let path = path.clone();
                return Err(ImageError::TooLarge { path, width, height, needed, free }.into());
            }
        }
        images.push(image);
    }
    Ok(images)
}
