//! Reader of values stored consecutively in a file, plain or compressed.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::OnceLock;

use flate2::read::{MultiGzDecoder, ZlibDecoder};

use super::sample::{ByteOrder, SampleType, decode};
use super::stack::{SliceReader, SliceSource};
use crate::ImageError;
use fem_file::open_regular;

/// Slices stored consecutively, without any data between them.
#[derive(Debug)]
pub(crate) struct RawSlices {
    pub(crate) path: PathBuf,
    /// Bytes before the first value.
    pub(crate) offset: u64,
    /// Number of values of a slice.
    pub(crate) area: usize,
    pub(crate) sample: SampleType,
    pub(crate) order: ByteOrder,
    /// Number of slices.
    pub(crate) depth: usize,
    pub(crate) packing: Packing,
    /// All values of a compressed file; the file is unpacked when the first slice is read.
    pub(crate) unpacked: OnceLock<Result<Vec<u8>, ImageError>>,
}

/// Compression of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Plain,
    Zlib,
    Gzip,
}

impl RawSlices {
    /// Returns the size of all values (bytes).
    pub(crate) fn bytes(&self) -> usize {
        self.area * self.depth * self.sample.bytes()
    }

    /// Unpacks all values of a compressed file, because single slices cannot be addressed in such a file.
    fn unpack(&self) -> Result<Vec<u8>, ImageError> {
        let failed = |source| ImageError::io("read", &self.path, source);
        let mut file = BufReader::new(open_regular(&self.path).map_err(failed)?);
        file.seek(SeekFrom::Start(self.offset)).map_err(failed)?;
        let needed = self.bytes();
        let mut values = Vec::new();
        let read = match self.packing {
            Packing::Zlib => ZlibDecoder::new(file).take(needed as u64).read_to_end(&mut values),
            _ => MultiGzDecoder::new(file).take(needed as u64).read_to_end(&mut values),
        };
        let short = |unpacked_bytes: usize| ImageError::Page {
            path: self.path.clone(),
            page: unpacked_bytes / (self.area * self.sample.bytes()).max(1) + 1,
            message: format!("{unpacked_bytes} bytes unpacked, but the header declares {needed}"),
            help: "the file is truncated or the header belongs to another file: write both files again",
        };
        match read {
            Ok(unpacked_bytes) if unpacked_bytes == needed => Ok(values),
            Ok(unpacked_bytes) => Err(short(unpacked_bytes)),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(short(values.len())),
            Err(error) => Err(failed(error)),
        }
    }
}

impl SliceSource for RawSlices {
    fn reader(&self) -> Box<dyn SliceReader + '_> {
        Box::new(Reader { slices: self, file: None, bytes: Vec::new() })
    }

    fn file_and_page(&self, slice: usize) -> (PathBuf, usize) {
        (self.path.clone(), slice + 1)
    }
}

struct Reader<'a> {
    slices: &'a RawSlices,
    file: Option<File>,
    bytes: Vec<u8>,
}

impl Reader<'_> {
    fn load(&mut self, slice: usize) -> io::Result<()> {
        let RawSlices { path, offset, area, sample, .. } = self.slices;
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(open_regular(path)?),
        };
        self.bytes.resize(area * sample.bytes(), 0);
        file.seek(SeekFrom::Start(offset + (slice * self.bytes.len()) as u64))?;
        file.read_exact(&mut self.bytes)
    }
}

impl SliceReader for Reader<'_> {
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError> {
        let RawSlices { area, sample, order, packing, path, .. } = self.slices;
        if *packing == Packing::Plain {
            self.load(slice).map_err(|source| ImageError::io("read", path, source))?;
            decode(&self.bytes, *sample, *order, into);
            return Ok(());
        }
        let all = self.slices.unpacked.get_or_init(|| self.slices.unpack());
        let all = all.as_ref().map_err(Clone::clone)?;
        let length = area * sample.bytes();
        decode(&all[slice * length..(slice + 1) * length], *sample, *order, into);
        Ok(())
    }
}
