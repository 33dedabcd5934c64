//! The size of a voxel in a file's tags.
//!
//! TIFF has pixels per inch or centimetre, along x and y. ImageJ writes `key=value` lines into the
//! description: the unit of length that the resolution then refers to, and the spacing of slices.

use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::decoder::ifd::Value;
use ::tiff::tags::Tag;

/// Resolutions (pixels per inch) that programs write without having measured anything.
const SCREENS: [f64; 3] = [72.0, 96.0, 300.0];
/// Edges that differ by less than this share are equal.
const CUBIC: f64 = 1e-3;

/// What the tags say of the voxel size.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum VoxelSize {
    /// The edge of a cube (mm).
    Cube(f64),
    /// Unlike edges (mm).
    Unlike([f64; 3]),
    /// Nothing of use, in words.
    Unknown(String),
}

/// How many slices ImageJ says that there are; beyond 4 GB it writes one page and the others after it.
pub(super) fn declared_images<R: Read + Seek>(decoder: &mut Decoder<R>) -> Option<usize> {
    let description = decoder.get_tag_ascii_string(Tag::ImageDescription).ok()?;
    let count = description.lines().find_map(|line| line.strip_prefix("images="))?;
    count.trim().parse().ok()
}

/// Reads the tags of the page at which a decoder stands.
pub(super) fn voxel_size<R: Read + Seek>(decoder: &mut Decoder<R>) -> VoxelSize {
    let description = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default();
    let key = |name: &str| {
        let mut lines = description.lines();
        lines.find_map(|line| line.split_once('=').filter(|(key, _)| key.trim() == name))
    };
    let number = |name: &str| key(name).and_then(|(_, text)| text.trim().parse::<f64>().ok());
    let positive = |value: &f64| value.is_finite() && *value > 0.0;
    if let Some(exact) = number("voxel_mm").filter(positive) {
        return VoxelSize::Cube(exact);
    }

    let per_unit = [Tag::XResolution, Tag::YResolution].map(|tag| ratio(decoder, tag));
    let [Some(x), Some(y)] = per_unit.map(|value| value.filter(positive)) else {
        return VoxelSize::Unknown("its tags hold no resolution".into());
    };
    let unit_tag = decoder.find_tag_unsigned::<u16>(Tag::ResolutionUnit).ok().flatten();
    let named = key("unit").map(|(_, text)| text.trim().to_owned());
    let unit_mm = match named.as_deref().map(millimetres) {
        Some(Some(unit)) => unit,
        Some(None) => {
            let name = named.unwrap_or_default();
            return VoxelSize::Unknown(format!("its unit of length '{name}' is not known"));
        }
        None => match unit_tag.unwrap_or(2) {
            2 if SCREENS.contains(&x) => {
                return VoxelSize::Unknown(format!(
                    "a resolution of {x} per inch is a screen's or printer's"
                ));
            }
            2 => 25.4,
            3 => 10.0,
            _ => return VoxelSize::Unknown("its resolution has no unit of length".into()),
        },
    };
    let [x, y] = [unit_mm / x, unit_mm / y];
    let z = number("spacing").filter(positive).map_or(x, |spacing| spacing * unit_mm);
    let equal = |a: f64, b: f64| (a - b).abs() <= CUBIC * a.max(b);
    if equal(x, y) && equal(x, z) { VoxelSize::Cube(x) } else { VoxelSize::Unlike([x, y, z]) }
}

fn ratio<R: Read + Seek>(decoder: &mut Decoder<R>, tag: Tag) -> Option<f64> {
    match decoder.find_tag(tag).ok()?? {
        Value::Rational(n, d) => Some(f64::from(n) / f64::from(d)),
        Value::List(list) => match list.first()? {
            Value::Rational(n, d) => Some(f64::from(*n) / f64::from(*d)),
            _ => None,
        },
        Value::Float(value) => Some(f64::from(value)),
        Value::Double(value) => Some(value),
        _ => None,
    }
}

/// A unit of length in mm.
fn millimetres(name: &str) -> Option<f64> {
    Some(match name {
        "m" | "meter" | "metre" => 1000.0,
        "cm" | "centimeter" | "centimetre" => 10.0,
        "mm" | "millimeter" | "millimetre" => 1.0,
        "um" | "µm" | "μm" | "\\u00B5m" | "micron" | "microns" | "micrometer" | "micrometre" => {
            1e-3
        }
        "nm" | "nanometer" | "nanometre" => 1e-6,
        "inch" | "in" => 25.4,
        _ => return None,
    })
}
