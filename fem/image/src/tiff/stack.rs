//! Reader of the files and pages of a TIFF stack; checks that the pages form one volume.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use ::tiff::tags::{ByteOrder as FileOrder, Tag};

use super::describe::Description;
use super::page::{Declared, Reader, declared, open_decoder, refused, samples};
use crate::ImageError;
use crate::slices::names::{Ordered, file_name};
use crate::slices::raw::{Packing, RawSlices};
use crate::slices::sample::ByteOrder;
use crate::slices::stack::{SliceReader, SliceSource, Stack};

/// Upper bound of the compression ratio (uncompressed bytes per compressed byte) of all supported compression methods.
const DENSEST: u64 = 3000;
const CHANNELS_HELP: &str = "save one channel of one time as a separate stack (ImageJ: Image > Duplicate, then File > Save As > Tiff)";

/// A file of a stack.
#[derive(Debug)]
struct SliceFile {
    path: PathBuf,
    bytes: u64,
}

impl SliceFile {
    /// Returns an upper bound of the memory that decoding a page of the file needs (bytes).
    fn most_bytes(&self) -> u64 {
        self.bytes.saturating_mul(DENSEST)
    }
}

/// The files of a stack, and for each slice the indices (from 0) of its file and of its page in the file.
#[derive(Debug)]
struct Pages {
    files: Vec<SliceFile>,
    slices: Vec<(usize, usize)>,
}

impl SliceSource for Pages {
    fn reader(&self) -> Box<dyn SliceReader + '_> {
        Box::new(PageReader { pages: self, open_file: None })
    }

    fn file_and_page(&self, slice: usize) -> (PathBuf, usize) {
        let (file, page) = self.slices[slice];
        (self.files[file].path.clone(), page + 1)
    }
}

/// Reader of pages. A file stays open until a slice of another file is read.
struct PageReader<'a> {
    pages: &'a Pages,
    /// The open file: its index, and its decoder.
    open_file: Option<(usize, Reader)>,
}

impl SliceReader for PageReader<'_> {
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError> {
        let (file, number) = self.pages.slices[slice];
        let source = &self.pages.files[file];
        let (path, page) = (&source.path, number + 1);
        let decoder = match &mut self.open_file {
            Some((open_index, decoder)) if *open_index == file => decoder,
            other => &mut other.insert((file, open_decoder(path, source.most_bytes())?)).1,
        };
        decoder.seek_to_image(number).map_err(|error| refused(path, page, &error))?;
        samples(path, page, decoder, into)
    }
}

/// Reads the headers of all pages and creates the stack. `paths` are the files in the order of their slices; `path` is
/// the file or folder given by the user.
///
/// # Errors
/// [`ImageError`]; see [`read`](super::read()) and [`read_binned`](super::read_binned).
pub(crate) fn scan(
    path: &Path,
    paths: Vec<PathBuf>,
    ordered: Option<&Ordered>,
) -> Result<Stack, ImageError> {
    let mut pages = Pages { files: Vec::with_capacity(paths.len()), slices: Vec::new() };
    let mut first: Option<(Declared, Description)> = None;
    let mut incomplete = None;
    let (mut declared_bytes, mut file_bytes) = (0_u64, 0_u64);
    for path in &paths {
        let meta = std::fs::metadata(path).map_err(|error| ImageError::io("read", path, error))?;
        let file = SliceFile { path: path.clone(), bytes: meta.len() };
        file_bytes += file.bytes;
        let mut decoder = open_decoder(path, file.most_bytes())?;
        let description = Description::of(&mut decoder);
        check_dimensions(path, &description)?;
        let before = pages.slices.len();
        let mut last = None;
        for number in 0.. {
            if number > 0 {
                if !decoder.more_images() {
                    break;
                }
                let refuse = |error| refused(path, number + 1, &error);
                decoder.next_image().map_err(refuse)?;
            }
            let this = declared(path, number + 1, &mut decoder, file.bytes)?;
            if this.preview {
                continue;
            }
            let (page, _) = first.get_or_insert_with(|| (this, description.clone()));
            check_alike(path, number, page, &this)?;
            declared_bytes = declared_bytes.saturating_add(this.bytes());
            pages.slices.push((pages.files.len(), number));
            last = Some(this);
        }
        let count = pages.slices.len() - before;
        let images = description.images.unwrap_or(0);
        if let (Some(page), true, 1, 1) = (last, images > count, count, paths.len())
            && let Some(raw) = behind_one_page(path, page, &description, images, file.bytes)?
        {
            return Ok(one_file(path, page, description, images, Box::new(raw)));
        }
        if images > count {
            incomplete.get_or_insert((path.clone(), count, images));
        }
        if declared_bytes > file_bytes.saturating_mul(DENSEST) {
            let path = path.clone();
            return Err(ImageError::Implausible { path, declared_bytes, file_bytes });
        }
        pages.files.push(file);
    }
    let Some((page, description)) = first else {
        let help = "give a file or folder of slices";
        return Err(ImageError::Empty { path: path.into(), what: "page", help });
    };
    let slices = pages.slices.len();
    // each file of a set declares the number of pages of the whole set
    if let Some((file, count, images)) = incomplete.filter(|(.., images)| *images != slices) {
        let page = if count == 1 { "page" } else { "pages" };
        return Err(ImageError::Series {
            path: file,
            message: format!("has {count} {page}, but declares {images}"),
            help: "the file is truncated or belongs to a set of files: copy it again, or give the folder that contains the whole set",
        });
    }
    let mut stack = one_file(path, page, description, slices, Box::new(pages));
    if let Some(ordered) = ordered {
        let [first, last] = [paths.first(), paths.last()]
            .map(|path| path.map_or(String::new(), |path| file_name(path)));
        let pages =
            if slices == paths.len() { String::new() } else { format!(" with {slices} pages") };
        stack.contents =
            format!("{} TIFF files{pages}, {first} to {last} by their numbers", paths.len());
        stack.notes.extend(ordered.note.clone());
        if ordered.step != 1 && slices == paths.len() {
            stack.notes.push(format!(
                "Heights are wrong if slices are missing: the numbers in the names increase in steps of {}.",
                ordered.step
            ));
        }
    }
    stack.files = paths;
    Ok(stack)
}

fn one_file(
    path: &Path,
    page: Declared,
    description: Description,
    slices: usize,
    source: Box<dyn SliceSource>,
) -> Stack {
    let mut notes = Vec::new();
    if let Some([channels, _, times]) = description.dimensions
        && slices > 1
        && channels.max(times) > 1
    {
        let what = if channels > 1 { "channels" } else { "times" };
        notes.push(format!(
            "Heights are wrong if the {slices} images are not slices: {} declares them as {what}.",
            path.display()
        ));
    }
    Stack {
        path: path.into(),
        files: vec![path.into()],
        shape: [page.width, page.height, slices],
        sample: page.sample,
        size: description.size,
        contents: format!("TIFF of {slices} {}", if slices == 1 { "page" } else { "pages" }),
        notes,
        source,
    }
}

/// Returns an error for a file with more than one volume.
fn check_dimensions(path: &Path, description: &Description) -> Result<(), ImageError> {
    let refuse =
        |message| Err(ImageError::Series { path: path.into(), message, help: CHANNELS_HELP });
    if let Some(series) = &description.series {
        return refuse(series.clone());
    }
    match description.dimensions {
        // if only one of the dimensions is larger than 1, its entries are the slices, even if the dimension is named
        // channels or times
        Some(counts) if counts.iter().filter(|count| **count > 1).count() > 1 => {
            let [channels, slices, times] = counts;
            refuse(format!(
                "declares {channels} channels × {slices} slices × {times} times: more than one volume"
            ))
        }
        _ => Ok(()),
    }
}

/// Returns the slices of a file that declares only one page, after which the values of all slices follow. ImageJ writes
/// stacks above 4 GB in this way. Returns `None` for other files.
fn behind_one_page(
    path: &Path,
    page: Declared,
    description: &Description,
    images: usize,
    file_bytes: u64,
) -> Result<Option<RawSlices>, ImageError> {
    if !description.is_imagej || !page.is_uncompressed() {
        return Ok(None);
    }
    let mut decoder = open_decoder(path, file_bytes.saturating_mul(DENSEST))?;
    let offsets = decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets).ok().flatten();
    let Some(offset) = offsets.and_then(|offsets| offsets.first().copied()) else {
        return Ok(None);
    };
    // a directory (TIFF IFD) after the first value could lie between the values of two slices, and would then be read
    // as values
    if decoder.ifd_pointer().is_none_or(|directory| directory.0 > offset) {
        return Ok(None);
    }
    let needed = (images as u64).saturating_mul(page.bytes()).saturating_add(offset);
    let order = match decoder.byte_order() {
        FileOrder::LittleEndian => ByteOrder::Little,
        FileOrder::BigEndian => ByteOrder::Big,
    };
    Ok((needed <= file_bytes).then(|| RawSlices {
        path: path.into(),
        offset,
        area: page.width * page.height,
        sample: page.sample,
        order,
        depth: images,
        packing: Packing::Plain,
        unpacked: OnceLock::new(),
    }))
}

/// Returns an error if a page differs from the first page in size or type.
fn check_alike(
    path: &Path,
    number: usize,
    first: &Declared,
    this: &Declared,
) -> Result<(), ImageError> {
    let fail = |message, help| {
        Err(ImageError::Page { path: path.into(), page: number + 1, message, help })
    };
    if (first.width, first.height) != (this.width, this.height) {
        let message = format!(
            "{} × {} voxels, but the first page has {} × {}",
            this.width, this.height, first.width, first.height
        );
        return fail(
            message,
            "crop all slices to the same size, and remove other files from the folder",
        );
    }
    if first.sample != this.sample {
        let message = format!("{}, but the first page has {}", this.sample, first.sample);
        return fail(message, "export all slices again with the same type and the same grey scale");
    }
    Ok(())
}

/// Returns the paths of the `.tif` and `.tiff` files in a folder.
pub(super) fn slices_of(folder: &Path) -> Result<Vec<PathBuf>, ImageError> {
    let failed = |source| ImageError::io("read", folder, source);
    let mut slices = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let extension = path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
        if !hidden && matches!(extension.as_deref(), Some("tif" | "tiff")) {
            slices.push(path);
        }
    }
    if slices.is_empty() {
        let help = "a folder must contain one .tif or .tiff file for each slice";
        return Err(ImageError::Empty { path: folder.into(), what: "slice", help });
    }
    Ok(slices)
}
