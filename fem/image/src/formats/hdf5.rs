//! Reader of HDF5 files (NeXus, ilastik, netCDF-4, MATLAB 7.3): one dataset of three dimensions.
//!
//! The axes of a dataset are z, y, x, from the slowest to the fastest. Chunks of a dataset usually contain parts of
//! many slices, so slices are read in slabs as thick as a chunk, and each chunk is unpacked only once.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fem_file::open_regular;
use hdf5_reader::group::Group;
use hdf5_reader::{
    Attribute, Dataset, Datatype, FileStorage, H5Type, Hdf5File, OpenOptions, SliceInfo,
    SliceInfoElem,
};

use super::detached::DENSEST;
use crate::ImageError;
use crate::listing::listed;
use crate::slices::names::file_name;
use crate::slices::sample::{NumberKind, SampleType};
use crate::slices::stack::{SliceReader, SliceSource, Stack};
use crate::slices::voxel_size::VoxelSize;

/// Largest size of a slab, i.e. of the slices that are read at once (bytes). Each thread stores one slab.
const SLAB_BYTES: usize = 128 << 20;
/// Largest number of groups and datasets of a file that are examined.
const MOST_OBJECTS: usize = 10_000;

/// Reads the header of a dataset and creates its stack. Without a name, the only volume of the file is used.
///
/// # Errors
/// [`ImageError`]: a damaged file, no volume or several volumes without a name, a name that is not a volume.
pub(super) fn scan(path: &Path, name: Option<&str>) -> Result<Stack, ImageError> {
    let file = open_file(path)?;
    let (name, dataset) = match name {
        Some(name) => (rooted(name), named(path, &file, name)?),
        None => only_volume(path, &file)?,
    };
    let Some(Layout { shape, before, sample }) = Layout::of(&dataset) else {
        return Err(ImageError::Series {
            path: path.into(),
            message: format!("{name} is {}", in_words(&dataset)),
            help: "name a dataset of three dimensions with integers or floating-point numbers",
        });
    };
    let file_bytes = std::fs::metadata(path).map_or(0, |meta| meta.len());
    let voxels =
        shape.iter().try_fold(sample.bytes() as u64, |n, &side| n.checked_mul(side as u64));
    let declared_bytes = voxels.unwrap_or(u64::MAX);
    if declared_bytes > file_bytes.saturating_mul(DENSEST) {
        return Err(ImageError::Implausible { path: path.into(), declared_bytes, file_bytes });
    }
    let chunk = dataset.chunks().and_then(|chunks| chunks.get(before).copied());
    let slice_bytes = shape[0] * shape[1] * sample.bytes();
    let thickest = (SLAB_BYTES / slice_bytes.max(1)).max(1);
    let stored = if chunk.is_some() { " in chunks" } else { "" };
    Ok(Stack {
        path: path.into(),
        files: vec![path.to_owned()],
        shape,
        sample,
        size: voxel_size(&dataset),
        contents: format!("one HDF5 file, {}, dataset {name}{stored}", file_name(path)),
        notes: Vec::new(),
        source: Box::new(Hdf5Slices {
            path: path.into(),
            name,
            shape,
            before,
            dimensions: dataset.ndim(),
            sample,
            slab: (chunk.unwrap_or(1) as usize).clamp(1, thickest),
        }),
    })
}

/// Opens a file without mapping it into memory: if another program truncated a mapped file, this program would crash.
fn open_file(path: &Path) -> Result<Hdf5File, ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let file = open_regular(path).map_err(failed)?;
    let storage = FileStorage::from_file(file).map_err(|error| damaged(path, &error))?;
    // switch the cache of chunks off, because each chunk is unpacked only once
    let options = OpenOptions::default().with_chunk_cache_bytes(0);
    Hdf5File::from_storage_with_options(Arc::new(storage), options)
        .map_err(|error| damaged(path, &error))
}

fn damaged(path: &Path, error: &hdf5_reader::error::Error) -> ImageError {
    ImageError::Series {
        path: path.into(),
        message: format!("the HDF5 file cannot be read: {error}"),
        help: "if another program can open the file, write the dataset again without filters other than gzip and shuffle, for example by h5repack or h5py",
    }
}

/// Returns the path of a dataset from the root of the file.
fn rooted(name: &str) -> String {
    format!("/{}", name.trim_matches('/'))
}

/// Opens a dataset by name.
fn named(path: &Path, file: &Hdf5File, name: &str) -> Result<Dataset, ImageError> {
    file.dataset(name).map_err(|_| {
        let all = datasets(file);
        ImageError::Series {
            path: path.into(),
            message: format!("there is no readable dataset {name}; {}", datasets_in_words(&all)),
            help: "correct dataset in [specimen.image]",
        }
    })
}

/// Returns the only volume of a file and its name.
fn only_volume(path: &Path, file: &Hdf5File) -> Result<(String, Dataset), ImageError> {
    let all = datasets(file);
    let is_volume = |(_, dataset): &(String, Dataset)| Layout::of(dataset).is_some();
    let (mut volumes, others): (Vec<_>, Vec<_>) = all.into_iter().partition(is_volume);
    let (message, help) = match volumes.len() {
        1 => return Ok(volumes.swap_remove(0)),
        0 => (
            format!("no dataset of three dimensions; {}", datasets_in_words(&others)),
            "write the volume as one dataset with the axes z, y, x",
        ),
        _ => (
            format!("several volumes; {}", datasets_in_words(&volumes)),
            "choose one by dataset in [specimen.image]",
        ),
    };
    Err(ImageError::Series { path: path.into(), message, help })
}

/// Returns a text that lists datasets with their sizes, for messages.
fn datasets_in_words(datasets: &[(String, Dataset)]) -> String {
    if datasets.is_empty() {
        return "the file has no datasets".into();
    }
    let sized = |(name, dataset): &(String, Dataset)| format!("{name} ({})", in_words(dataset));
    format!("the file has {}", listed(datasets.iter().map(sized), ", "))
}

/// Returns a text with the shape and the type of a dataset, for messages.
fn in_words(dataset: &Dataset) -> String {
    let shape: Vec<String> = dataset.shape().iter().map(u64::to_string).collect();
    let shape = if shape.is_empty() { "one value".into() } else { shape.join(" × ") };
    match sample(dataset.dtype()) {
        Some(sample) => format!("{shape}, {sample}"),
        None => format!("{shape}, not of a supported number type"),
    }
}

/// Returns all datasets of a file that can be opened, in the order of their paths. A dataset with several paths is
/// listed once, with its shortest path.
fn datasets(file: &Hdf5File) -> Vec<(String, Dataset)> {
    let mut opened: Vec<(String, Dataset)> = Vec::new();
    let mut waiting: Vec<(String, Group)> =
        file.root_group().map(|group| (String::new(), group)).into_iter().collect();
    let mut groups = BTreeSet::new();
    while let Some((path, group)) = waiting.pop() {
        // skip groups that were visited before, because a link may lead back to a group
        if !groups.insert(group.address()) || groups.len() + opened.len() > MOST_OBJECTS {
            continue;
        }
        let Ok((subgroups, dataset_names)) = group.member_names() else { continue };
        for name in dataset_names {
            if let Ok(dataset) = group.dataset(&name) {
                opened.push((format!("{path}/{name}"), dataset));
            }
        }
        for name in subgroups {
            if let Ok(subgroup) = group.group(&name) {
                waiting.push((format!("{path}/{name}"), subgroup));
            }
        }
    }
    opened.sort_by(|(a, _), (b, _)| (a.len(), a).cmp(&(b.len(), b)));
    let mut addresses = BTreeSet::new();
    opened.retain(|(_, dataset)| addresses.insert(dataset.address()));
    opened.sort_by(|(a, _), (b, _)| a.cmp(b));
    opened
}

/// Storage layout of a volume in a dataset.
struct Layout {
    /// Voxels along x, y, z.
    shape: [usize; 3],
    /// Number of axes of length 1 before z.
    before: usize,
    sample: SampleType,
}

impl Layout {
    /// Returns the layout of a dataset with three axes, and possibly further axes of length 1 before or after these
    /// axes; `None` for other datasets.
    fn of(dataset: &Dataset) -> Option<Self> {
        let (mut sides, mut before) = (dataset.shape(), 0);
        while sides.len() > 3 {
            match sides {
                [1, rest @ ..] => (sides, before) = (rest, before + 1),
                [rest @ .., 1] => sides = rest,
                _ => return None,
            }
        }
        let &[z, y, x] = sides else { return None };
        let side = |side: u64| usize::try_from(side).ok().filter(|&side| side > 0);
        Some(Layout {
            shape: [side(x)?, side(y)?, side(z)?],
            before,
            sample: sample(dataset.dtype())?,
        })
    }
}

/// Returns the number type of a dataset's values; `None` for types that are not supported, such as strings and half
/// precision.
fn sample(datatype: &Datatype) -> Option<SampleType> {
    let (kind, bytes) = match *datatype {
        Datatype::FixedPoint { size, signed: true, .. } => (NumberKind::Signed, size),
        Datatype::FixedPoint { size, signed: false, .. } => (NumberKind::Unsigned, size),
        Datatype::FloatingPoint { size: size @ (4 | 8), .. } => (NumberKind::Float, size),
        _ => return None,
    };
    matches!(bytes, 1 | 2 | 4 | 8).then_some(SampleType { kind, bits: 8 * bytes })
}

/// Returns the voxel size from the attribute `element_size_um` (z, y, x), which Fiji and ilastik write.
fn voxel_size(dataset: &Dataset) -> VoxelSize {
    const NAME: &str = "element_size_um";
    let unknown = || VoxelSize::Unknown(format!("the dataset has no attribute {NAME}"));
    let Ok(attribute) = dataset.attribute(NAME) else { return unknown() };
    match floats(&attribute).or_else(|| integers(&attribute)).as_deref() {
        Some(&[z, y, x]) => {
            VoxelSize::stated([x, y, z].map(|edge: f64| edge * 1e-3), format!("attribute {NAME}"))
        }
        _ => unknown(),
    }
}

/// Reads the numbers of an attribute of a floating-point type; `None` for other types.
fn floats(attribute: &Attribute) -> Option<Vec<f64>> {
    let single = |numbers: Vec<f32>| numbers.into_iter().map(f64::from).collect();
    attribute.read_1d::<f64>().or_else(|_| attribute.read_1d().map(single)).ok()
}

/// Reads the numbers of an attribute of an integer type (h5py writes a list of integers as such an attribute); `None`
/// for other types.
fn integers(attribute: &Attribute) -> Option<Vec<f64>> {
    fn numbers<T: H5Type + TryInto<i64>>(attribute: &Attribute) -> Option<Vec<f64>> {
        let numbers = attribute.read_1d::<T>().ok()?.into_iter();
        numbers.map(|number| number.try_into().ok().map(|number: i64| number as f64)).collect()
    }
    numbers::<i64>(attribute)
        .or_else(|| numbers::<u64>(attribute))
        .or_else(|| numbers::<i32>(attribute))
        .or_else(|| numbers::<u32>(attribute))
        .or_else(|| numbers::<i16>(attribute))
        .or_else(|| numbers::<u16>(attribute))
        .or_else(|| numbers::<i8>(attribute))
        .or_else(|| numbers::<u8>(attribute))
}

/// Slices of a dataset.
#[derive(Debug)]
struct Hdf5Slices {
    path: PathBuf,
    /// Path of the dataset in the file.
    name: String,
    /// Voxels along x, y, z.
    shape: [usize; 3],
    /// Number of axes of length 1 before z.
    before: usize,
    /// Number of axes of the dataset.
    dimensions: usize,
    sample: SampleType,
    /// Number of slices that are read at once.
    slab: usize,
}

impl Hdf5Slices {
    fn reader_of<T: H5Type + Copy + 'static>(
        &self,
        number: fn(T) -> f64,
    ) -> Box<dyn SliceReader + '_> {
        Box::new(Reader { slices: self, dataset: None, first: 0, values: Vec::new(), number })
    }

    /// Returns the selection of the slices `first` to `last` (excluded) of the dataset.
    fn selection(&self, first: usize, last: usize) -> SliceInfo {
        let all = SliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 };
        let mut selections = vec![all; self.dimensions];
        selections[self.before] =
            SliceInfoElem::Slice { start: first as u64, end: last as u64, step: 1 };
        SliceInfo { selections }
    }
}

impl SliceSource for Hdf5Slices {
    fn reader(&self) -> Box<dyn SliceReader + '_> {
        use NumberKind::{Float, Signed, Unsigned};
        match (self.sample.kind, self.sample.bits) {
            (Unsigned, 8) => self.reader_of::<u8>(f64::from),
            (Unsigned, 16) => self.reader_of::<u16>(f64::from),
            (Unsigned, 32) => self.reader_of::<u32>(f64::from),
            (Unsigned, _) => self.reader_of::<u64>(|value| value as f64),
            (Signed, 8) => self.reader_of::<i8>(f64::from),
            (Signed, 16) => self.reader_of::<i16>(f64::from),
            (Signed, 32) => self.reader_of::<i32>(f64::from),
            (Signed, _) => self.reader_of::<i64>(|value| value as f64),
            (Float, 32) => self.reader_of::<f32>(f64::from),
            (Float, _) => self.reader_of::<f64>(|value| value),
        }
    }

    fn file_and_page(&self, slice: usize) -> (PathBuf, usize) {
        (self.path.clone(), slice + 1)
    }
}

/// Reader of slices that stores the slab which contains the slice read last.
struct Reader<'a, T> {
    slices: &'a Hdf5Slices,
    dataset: Option<Dataset>,
    /// Number of the first slice in `values`.
    first: usize,
    values: Vec<T>,
    number: fn(T) -> f64,
}

impl<T: H5Type + Copy> Reader<'_, T> {
    /// Loads the slab that contains a slice.
    fn load(&mut self, slice: usize) -> Result<(), ImageError> {
        let Hdf5Slices { path, name, shape: [nx, ny, nz], slab, .. } = self.slices;
        let failed = |error| damaged(path, &error);
        let dataset = match &self.dataset {
            Some(dataset) => dataset,
            None => self.dataset.insert(open_file(path)?.dataset(name).map_err(failed)?),
        };
        self.first = slice - slice % slab;
        let last = (self.first + slab).min(*nz);
        self.values.clear();
        let read = dataset.read_slice::<T>(&self.slices.selection(self.first, last));
        self.values.extend(read.map_err(failed)?.iter().copied());
        if self.values.len() != nx * ny * (last - self.first) {
            return Err(ImageError::Series {
                path: path.clone(),
                message: format!("{name} changed while it was read"),
                help: "wait until the program that writes the file has ended",
            });
        }
        Ok(())
    }
}

impl<T: H5Type + Copy> SliceReader for Reader<'_, T> {
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError> {
        let area = into.len();
        let is_loaded =
            |first: usize, values: usize| slice >= first && (slice + 1 - first) * area <= values;
        if !is_loaded(self.first, self.values.len()) {
            self.load(slice)?;
        }
        let from = (slice - self.first) * area;
        let stored = &self.values[from..from + area];
        into.iter_mut().zip(stored).for_each(|(into, &value)| *into = (self.number)(value));
        Ok(())
    }
}
