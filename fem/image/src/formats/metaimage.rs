//! Reader of MetaImage files: `.mhd` with the values in a separate file, `.mha` with the values in the same file.
//!
//! Reference: MetaIO, <https://itk.org/Wiki/MetaIO/Documentation>. Lengths are in mm by the convention of ITK.

use std::io::Read;
use std::path::Path;

use super::detached::{Begin, Lines, RawHeader};
use crate::ImageError;
use crate::slices::raw::Packing;
use crate::slices::sample::{ByteOrder, NumberKind, SampleType};
use crate::slices::stack::Stack;
use crate::slices::voxel_size::VoxelSize;
use fem_file::open_regular;

/// Maximum length of a header (bytes).
const MOST_BYTES: u64 = 1 << 20;

/// Reads a header and creates its stack.
///
/// # Errors
/// [`ImageError`] with file and line: missing or invalid keys, or a file of values that does not match the header.
pub(super) fn scan(path: &Path) -> Result<Stack, ImageError> {
    header(path)?.stack(path)
}

/// Reads a header, including the path of the file of values.
pub(super) fn header(path: &Path) -> Result<RawHeader, ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let mut bytes = Vec::new();
    let file = open_regular(path).map_err(failed)?;
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(failed)?;
    let lines = Lines { path };
    let (mut shape, mut sample, mut data) = (None, None, None);
    let (mut order, mut packing, mut begin) = (ByteOrder::Little, Packing::Plain, Begin::At(0));
    let (mut spacing, mut size): (Option<Vec<f64>>, _) = (None, None);
    let (mut at, mut number) = (0, 0);
    while data.is_none() && at < bytes.len() {
        let end =
            bytes[at..].iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |n| at + n);
        let line = String::from_utf8_lossy(&bytes[at..end]).into_owned();
        (at, number) = ((end + 1).min(bytes.len()), number + 1);
        if line.trim().is_empty() {
            continue;
        }
        let Some((key, value)) =
            line.split_once('=').map(|(key, value)| (key.trim(), value.trim()))
        else {
            let message = format!(
                "'{}' is not a line of the form `key = value`",
                line.trim().escape_default()
            );
            return Err(lines.refuse(number, message, "write the header again"));
        };
        let is_true = matches!(value.to_ascii_lowercase().as_str(), "true" | "1");
        match key {
            "NDims" if value != "3" && value != "4" => {
                let help = "write a volume of three dimensions";
                return Err(lines.refuse(number, format!("NDims = {value}"), help));
            }
            "DimSize" => shape = Some(lines.shape(number, key, value)?),
            "ElementType" => sample = Some(element(&lines, number, value)?),
            "ElementSpacing" => spacing = Some(lines.numbers(number, key, value)?),
            "ElementSize" => size = Some(lines.numbers(number, key, value)?),
            "ElementByteOrderMSB" | "BinaryDataByteOrderMSB" if is_true => order = ByteOrder::Big,
            "CompressedData" if is_true => packing = Packing::Zlib,
            "BinaryData" if !is_true => {
                let help = "write the values as binary numbers (BinaryData = True)";
                return Err(lines.refuse(number, "the values are text", help));
            }
            "ElementNumberOfChannels" if value != "1" => {
                let message = format!("{value} channels per voxel");
                return Err(lines.refuse(number, message, "write a single grey channel"));
            }
            "HeaderSize" => {
                begin = match value.parse::<i64>() {
                    Ok(-1) => Begin::FromEnd,
                    Ok(bytes) if bytes >= 0 => Begin::At(bytes as u64),
                    _ => {
                        let message = format!("HeaderSize = {value}");
                        return Err(lines.refuse(
                            number,
                            message,
                            "write a number of bytes, or -1",
                        ));
                    }
                }
            }
            // `ElementDataFile` is the last key of the header; the values follow
            "ElementDataFile" => data = Some((number, value.to_owned())),
            _ => {}
        }
    }
    let missing = |key: &str| {
        lines.refuse(
            number,
            format!("{key} is missing before this line"),
            "add the key, see the table of formats in docs/how-to/images.md",
        )
    };
    let (line, named) = data.ok_or_else(|| missing("ElementDataFile"))?;
    let data = match named.as_str() {
        "LOCAL" | "Local" | "local" => {
            begin = Begin::At(at as u64);
            path.to_owned()
        }
        list if list.starts_with("LIST") || list.contains('%') => {
            let help = "write the values into one file, or name the folder of slices as the stack";
            return Err(lines.refuse(
                line,
                format!("ElementDataFile = {list} names several files"),
                help,
            ));
        }
        file => path.with_file_name(file),
    };
    let size = match spacing.as_ref().or(size.as_ref()).map(Vec::as_slice) {
        Some(&[x, y, z, ..]) => {
            VoxelSize::stated([x, y, z].map(f64::abs), "ElementSpacing of the header, in mm")
        }
        _ => VoxelSize::Unknown("the header has no ElementSpacing".into()),
    };
    Ok(RawHeader {
        format: "MetaImage",
        shape: shape.ok_or_else(|| missing("DimSize"))?,
        sample: sample.ok_or_else(|| missing("ElementType"))?,
        order,
        size,
        data,
        begin,
        packing,
    })
}

fn element(lines: &Lines<'_>, line: usize, name: &str) -> Result<SampleType, ImageError> {
    use NumberKind::{Float, Signed, Unsigned};
    let (kind, bits) = match name {
        "MET_UCHAR" => (Unsigned, 8),
        "MET_CHAR" => (Signed, 8),
        "MET_USHORT" => (Unsigned, 16),
        "MET_SHORT" => (Signed, 16),
        "MET_UINT" | "MET_ULONG" => (Unsigned, 32),
        "MET_INT" | "MET_LONG" => (Signed, 32),
        "MET_ULONG_LONG" => (Unsigned, 64),
        "MET_LONG_LONG" => (Signed, 64),
        "MET_FLOAT" => (Float, 32),
        "MET_DOUBLE" => (Float, 64),
        _ => {
            let help = "allowed: MET_UCHAR, MET_CHAR, MET_USHORT, MET_SHORT, MET_UINT, MET_INT, MET_ULONG_LONG, MET_LONG_LONG, MET_FLOAT, MET_DOUBLE";
            return Err(lines.refuse(line, format!("ElementType = {name}"), help));
        }
    };
    Ok(SampleType { kind, bits })
}
