//! Folders of PNG or BMP slices.

use std::path::{Path, PathBuf};

use super::pictures::Picture;
use super::{bmp, png};
use crate::ImageError;
use crate::slices::names::{Ordered, file_name};
use crate::slices::stack::{SliceReader, SliceSource, Stack};

/// File format of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PictureFormat {
    Png,
    Bmp,
}

impl PictureFormat {
    fn name(self) -> &'static str {
        match self {
            PictureFormat::Png => "PNG",
            PictureFormat::Bmp => "BMP",
        }
    }

    fn header(self, path: &Path) -> Result<Picture, ImageError> {
        match self {
            PictureFormat::Png => png::header(path),
            PictureFormat::Bmp => bmp::header(path),
        }
    }
}

/// Source of the slices of a stack of pictures.
#[derive(Debug)]
struct Pictures {
    format: PictureFormat,
    paths: Vec<PathBuf>,
    first: Picture,
}

impl SliceSource for Pictures {
    fn reader(&self) -> Box<dyn SliceReader + '_> {
        Box::new(PictureReader(self))
    }

    fn file_and_page(&self, slice: usize) -> (PathBuf, usize) {
        (self.paths[slice].clone(), 1)
    }
}

struct PictureReader<'a>(&'a Pictures);

impl SliceReader for PictureReader<'_> {
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError> {
        let Pictures { format, paths, first } = self.0;
        match format {
            PictureFormat::Png => png::values(&paths[slice], first, into),
            PictureFormat::Bmp => bmp::values(&paths[slice], into),
        }
    }
}

/// Reads the headers of all slices and creates their stack.
///
/// # Errors
/// [`ImageError::Page`]: slices of different size or type, coloured or damaged slices.
pub(super) fn scan(
    path: &Path,
    format: PictureFormat,
    ordered: Ordered,
) -> Result<Stack, ImageError> {
    let mut first: Option<Picture> = None;
    for path in &ordered.paths {
        let this = format.header(path)?;
        let first = first.get_or_insert_with(|| this.clone());
        let fail =
            |message, help| Err(ImageError::Page { path: path.clone(), page: 1, message, help });
        if (first.width, first.height) != (this.width, this.height) {
            let message = format!(
                "{} × {} voxels, but the first slice has {} × {}",
                this.width, this.height, first.width, first.height
            );
            return fail(
                message,
                "crop all slices to the same size, and remove other files from the folder",
            );
        }
        if first.sample != this.sample {
            let message = format!("{}, but the first slice has {}", this.sample, first.sample);
            return fail(
                message,
                "export all slices again with the same type and the same grey scale",
            );
        }
    }
    let Some(first) = first else {
        let help = "give a file or folder of slices";
        return Err(ImageError::Empty { path: path.into(), what: "slice", help });
    };
    let Ordered { paths, step, note } = ordered;
    let slices = paths.len();
    let mut notes: Vec<String> = note.into_iter().collect();
    if step != 1 {
        notes.push(format!(
            "Heights are wrong if slices are missing: the numbers in the names increase in steps of {step}."
        ));
    }
    let contents = match &paths[..] {
        [only] => format!("one {} file, {}", format.name(), file_name(only)),
        all => format!(
            "{slices} {} files, {} to {} by their numbers",
            format.name(),
            file_name(&all[0]),
            file_name(&all[slices - 1])
        ),
    };
    Ok(Stack {
        path: path.into(),
        files: paths.clone(),
        shape: [first.width, first.height, slices],
        sample: first.sample,
        size: first.size.clone(),
        contents,
        notes,
        source: Box::new(Pictures { format, paths, first }),
    })
}
