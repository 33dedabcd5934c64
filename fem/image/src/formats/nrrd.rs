//! Reader of NRRD files: `.nrrd` with the values in the same file, `.nhdr` with the values in a separate file.
//!
//! Reference: Definition of NRRD file format, <https://teem.sourceforge.net/nrrd/format.html>.

use std::io::Read;
use std::path::Path;

use super::detached::{Begin, Lines, RawHeader};
use crate::ImageError;
use crate::slices::raw::Packing;
use crate::slices::sample::{ByteOrder, NumberKind, SampleType};
use crate::slices::stack::Stack;
use crate::slices::voxel_size::{VoxelSize, millimetres};
use fem_file::open_regular;

/// Maximum length of a header (bytes).
const MOST_BYTES: u64 = 1 << 20;

/// Reads a header and creates its stack.
///
/// # Errors
/// [`ImageError`] with file and line: missing or invalid fields, or a file of values that does not match the header.
pub(super) fn scan(path: &Path) -> Result<Stack, ImageError> {
    header(path)?.stack(path)
}

/// Fields of a header (line number, name, value).
#[derive(Default)]
struct Fields {
    all: Vec<(usize, String, String)>,
    /// Number of lines of the header.
    lines: usize,
    /// Position of the first byte after the empty line that ends the header; `None` if there is no empty line.
    end: Option<usize>,
}

impl Fields {
    fn of(bytes: &[u8]) -> Self {
        let (mut fields, mut at) = (Fields::default(), 0);
        while at < bytes.len() {
            let end =
                bytes[at..].iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |n| at + n);
            let line = String::from_utf8_lossy(&bytes[at..end]).trim_end().to_owned();
            (at, fields.lines) = ((end + 1).min(bytes.len()), fields.lines + 1);
            if line.is_empty() {
                fields.end = Some(at);
                return fields;
            }
            // ignore comments and lines `key:=value`, which contain free text
            if line.starts_with('#') || line.contains(":=") {
                continue;
            }
            if let Some((key, value)) = line.split_once(": ") {
                let key = key.trim().to_ascii_lowercase().replace(' ', "");
                fields.all.push((fields.lines, key, value.trim().to_owned()));
            }
        }
        fields
    }

    fn get(&self, key: &str) -> Option<(usize, &str)> {
        let field = self.all.iter().find(|(_, name, _)| name == key);
        field.map(|(line, _, value)| (*line, value.as_str()))
    }
}

/// Reads a header, including the path and the encoding of the file of values.
pub(super) fn header(path: &Path) -> Result<RawHeader, ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let mut bytes = Vec::new();
    let file = open_regular(path).map_err(failed)?;
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(failed)?;
    let (lines, fields) = (Lines { path }, Fields::of(&bytes));
    let needed = |key: &str| {
        fields.get(key).ok_or_else(|| {
            lines.refuse(
                fields.lines,
                format!("the field {key} is missing"),
                "add it to the header",
            )
        })
    };
    let (line, sizes) = needed("sizes")?;
    let shape = lines.shape(line, "sizes", sizes)?;
    let (line, name) = needed("type")?;
    let sample = number_type(&lines, line, name)?;
    let (line, encoding) = needed("encoding")?;
    let packing = match encoding.to_ascii_lowercase().as_str() {
        "raw" => Packing::Plain,
        "gzip" | "gz" => Packing::Gzip,
        other => {
            let message = format!("the encoding {other} is not supported");
            return Err(lines.refuse(
                line,
                message,
                "write the file with the encoding raw or gzip",
            ));
        }
    };
    let order = match fields.get("endian") {
        Some((_, "little")) => ByteOrder::Little,
        Some((_, "big")) => ByteOrder::Big,
        Some((line, other)) => {
            let message = format!("endian: {other}");
            return Err(lines.refuse(line, message, "allowed: little, big"));
        }
        None if sample.bits == 8 => ByteOrder::Little,
        None => {
            let help = "add `endian: little` or `endian: big`";
            return Err(lines.refuse(fields.lines, "the field endian is missing", help));
        }
    };
    let skip = |key: &str| -> Result<i64, ImageError> {
        let Some((line, text)) = fields.get(key) else { return Ok(0) };
        let all: Vec<i64> = lines.numbers(line, key, text)?;
        Ok(all.first().copied().unwrap_or(0))
    };
    let (line_skip, byte_skip) = (skip("lineskip")?, skip("byteskip")?);
    if line_skip != 0 || byte_skip < -1 || (byte_skip != 0 && packing != Packing::Plain) {
        let help =
            "remove the lines before the values; bytes can be skipped only in uncompressed values";
        let message = format!("line skip {line_skip}, byte skip {byte_skip}");
        return Err(lines.refuse(fields.lines, message, help));
    }
    let (data, start) = match fields.get("datafile") {
        Some((line, list)) if list.starts_with("LIST") || list.contains('%') => {
            let help = "write the values into one file, or name the folder of slices as the stack";
            return Err(lines.refuse(line, format!("data file: {list} names several files"), help));
        }
        Some((_, file)) => (path.with_file_name(file), 0),
        None => match fields.end {
            Some(end) => (path.to_owned(), end as u64),
            None => {
                let help = "name the file of values by `data file: NAME`";
                return Err(lines.refuse(fields.lines, "no empty line ends the header", help));
            }
        },
    };
    let begin = match byte_skip {
        -1 => Begin::FromEnd,
        bytes => Begin::At(start + bytes as u64),
    };
    let size = voxel_size(&lines, &fields)?;
    Ok(RawHeader { format: "NRRD", shape, sample, order, size, data, begin, packing })
}

/// Returns the voxel size: the spacings, or the lengths of the space directions, times the unit of length. Lengths in
/// anatomical spaces without a unit are in mm.
fn voxel_size(lines: &Lines<'_>, fields: &Fields) -> Result<VoxelSize, ImageError> {
    let (line, edges) = match (fields.get("spacings"), fields.get("spacedirections")) {
        (Some((line, text)), _) => {
            let edges: Vec<f64> = lines.numbers(line, "spacings", text)?;
            (line, edges.into_iter().filter(|edge| !edge.is_nan()).map(f64::abs).collect())
        }
        (None, Some((line, text))) => (line, directions(lines, line, text)?),
        (None, None) => {
            return Ok(VoxelSize::Unknown(
                "the header has neither spacings nor space directions".into(),
            ));
        }
    };
    let [x, y, z] = edges[..] else {
        let help = "write one length for each of the three axes";
        return Err(lines.refuse(line, format!("{} spacings", edges.len()), help));
    };
    let unit = fields.get("spaceunits").or(fields.get("units")).map(|(_, units)| {
        units.split_whitespace().next().unwrap_or_default().trim_matches('"').to_owned()
    });
    let space = fields.get("space").map_or("", |(_, space)| space);
    let is_anatomical =
        space.contains("superior") || space.contains("inferior") || space.len() == 3;
    let (unit_mm, origin) = match unit {
        Some(unit) => match millimetres(&unit) {
            Some(mm) => (mm, format!("spacings of the header, in {unit}")),
            None => {
                return Ok(VoxelSize::Unknown(format!("its unit of length '{unit}' is unknown")));
            }
        },
        None if is_anatomical => {
            (1.0, format!("spacings of the header, in mm by its space {space}"))
        }
        None => {
            let message = format!("its spacings {x}, {y}, {z} have no unit (space units)");
            return Ok(VoxelSize::Unknown(message));
        }
    };
    Ok(VoxelSize::stated([x, y, z].map(|edge| edge * unit_mm), origin))
}

/// Returns the lengths of vectors such as `(0.01,0,0) (0,0.01,0) (0,0,0.01)`.
fn directions(lines: &Lines<'_>, line: usize, text: &str) -> Result<Vec<f64>, ImageError> {
    let vectors =
        text.split('(').skip(1).map(|vector| vector.split(')').next().unwrap_or_default());
    let length = |vector: &str| -> Option<f64> {
        let squares: Option<Vec<f64>> =
            vector.split(',').map(|c| c.trim().parse::<f64>().ok().map(|c| c * c)).collect();
        Some(squares?.into_iter().sum::<f64>().sqrt())
    };
    let lengths: Option<Vec<f64>> = vectors.map(length).collect();
    lengths.ok_or_else(|| {
        lines.refuse(line, format!("space directions: {text}"), "write three vectors (x,y,z)")
    })
}

fn number_type(lines: &Lines<'_>, line: usize, name: &str) -> Result<SampleType, ImageError> {
    use NumberKind::{Float, Signed, Unsigned};
    let (kind, bits) = match name {
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => (Unsigned, 8),
        "signed char" | "int8" | "int8_t" => (Signed, 8),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            (Unsigned, 16)
        }
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            (Signed, 16)
        }
        "uint" | "unsigned int" | "uint32" | "uint32_t" => (Unsigned, 32),
        "int" | "signed int" | "int32" | "int32_t" => (Signed, 32),
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            (Unsigned, 64)
        }
        "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => {
            (Signed, 64)
        }
        "float" => (Float, 32),
        "double" => (Float, 64),
        _ => {
            let help =
                "allowed: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float, double";
            return Err(lines.refuse(line, format!("type: {name}"), help));
        }
    };
    Ok(SampleType { kind, bits })
}
