//! Raw voxel values that a header describes. The values are in the file of the header or in a separate file.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::ImageError;
use crate::slices::names::file_name;
use crate::slices::raw::{Packing, RawSlices};
use crate::slices::sample::{ByteOrder, SampleType};
use crate::slices::stack::Stack;
use crate::slices::voxel_size::VoxelSize;
use crate::volume::MAX_VOXELS;

/// Upper bound of the compression ratio of deflate (uncompressed bytes per compressed byte).
pub(super) const DENSEST: u64 = 1100;

/// Position of the first value in its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Begin {
    At(u64),
    /// The values are at the end of the file: their position follows from the length of the file.
    FromEnd,
}

/// Header of raw values: format, shape, number type and position of the values.
#[derive(Clone, Debug)]
pub(super) struct RawHeader {
    pub(super) format: &'static str,
    pub(super) shape: [usize; 3],
    pub(super) sample: SampleType,
    pub(super) order: ByteOrder,
    pub(super) size: VoxelSize,
    pub(super) data: PathBuf,
    pub(super) begin: Begin,
    pub(super) packing: Packing,
}

impl RawHeader {
    /// Creates the stack that a header describes, and checks that the file of values has the length
    /// that follows from the header.
    ///
    /// # Errors
    /// [`ImageError`] if the file of values does not exist, or has more or fewer bytes than the header
    /// declares.
    pub(super) fn stack(self, header: &Path) -> Result<Stack, ImageError> {
        let RawHeader { format, shape, sample, order, size, data, begin, packing } = self;
        let meta =
            std::fs::metadata(&data).map_err(|error| ImageError::io("read", &data, error))?;
        let file_bytes = meta.len();
        let voxels = shape.iter().try_fold(1_u64, |n, &side| n.checked_mul(side as u64));
        // the limit is so large that an image can be read as averages over blocks of up to 64³ voxels, which is more
        // than needed in practice
        let Some(voxels) = voxels.filter(|n| (1..MAX_VOXELS << 18).contains(n)) else {
            let help = "write the three numbers of voxels along x, y, z";
            return Err(ImageError::Series {
                path: header.into(),
                message: format!("declares {shape:?} voxels"),
                help,
            });
        };
        let needed = voxels * sample.bytes() as u64;
        let offset = match begin {
            Begin::At(offset) => offset,
            Begin::FromEnd => file_bytes.saturating_sub(needed),
        };
        let stored = file_bytes.saturating_sub(offset);
        let plain = packing == Packing::Plain;
        if plain && stored != needed {
            let help = match stored < needed {
                true => {
                    "the file is truncated or the header belongs to another file: compare sizes and type"
                }
                false => {
                    "correct sizes and type, or give the number of bytes before the values (HeaderSize, byte skip; -1: the values are the last bytes)"
                }
            };
            let message = format!(
                "has {stored} bytes of values, but {} declares {needed} ({} × {} × {} {sample})",
                file_name(header),
                shape[0],
                shape[1],
                shape[2]
            );
            return Err(ImageError::Series { path: data, message, help });
        }
        if !plain && needed > stored.saturating_mul(DENSEST) {
            return Err(ImageError::Implausible { path: data, declared_bytes: needed, file_bytes });
        }
        let mut contents = format!("{format}, values in {}", file_name(&data));
        if !plain {
            contents.push_str(" (compressed)");
        }
        if sample.bits > 8 && plain {
            contents.push_str(match order {
                ByteOrder::Little => ", lowest byte first",
                ByteOrder::Big => ", highest byte first",
            });
        }
        let mut files = vec![header.to_owned()];
        if data != header {
            files.push(data.clone());
        }
        let slices = RawSlices {
            path: data,
            offset,
            area: shape[0] * shape[1],
            sample,
            order,
            depth: shape[2],
            packing,
            unpacked: OnceLock::new(),
        };
        Ok(Stack {
            path: header.into(),
            files,
            shape,
            sample,
            size,
            contents,
            notes: Vec::new(),
            source: Box::new(slices),
        })
    }
}

/// Parser of the values of a text header; errors contain file and line.
pub(super) struct Lines<'a> {
    pub(super) path: &'a Path,
}

impl Lines<'_> {
    /// Returns an error that names the header file and one of its lines.
    pub(super) fn refuse(
        &self,
        line: usize,
        message: impl Into<String>,
        help: &'static str,
    ) -> ImageError {
        ImageError::Header { path: self.path.into(), line, message: message.into(), help }
    }

    /// Parses numbers separated by spaces.
    pub(super) fn numbers<T: std::str::FromStr>(
        &self,
        line: usize,
        key: &str,
        text: &str,
    ) -> Result<Vec<T>, ImageError> {
        let numbers: Result<Vec<T>, _> = text.split_whitespace().map(str::parse).collect();
        numbers.map_err(|_| {
            self.refuse(
                line,
                format!("{key} = {text} is not a list of numbers"),
                "separate numbers by spaces",
            )
        })
    }

    /// Parses the numbers of voxels along x, y, z. Additional dimensions of size 1 before x or after z are ignored.
    pub(super) fn shape(
        &self,
        line: usize,
        key: &str,
        text: &str,
    ) -> Result<[usize; 3], ImageError> {
        let all: Vec<usize> = self.numbers(line, key, text)?;
        let mut sizes = &all[..];
        while let [1, rest @ ..] | [rest @ .., 1] = sizes
            && sizes.len() > 3
        {
            sizes = rest;
        }
        match *sizes {
            [x, y, z] => Ok([x, y, z]),
            _ => Err(self.refuse(
                line,
                format!("{key} = {text} is not a volume of three dimensions"),
                "write a single channel and a single time as a separate volume",
            )),
        }
    }
}
