//! Description of a stack in the tags of a file: voxel size, number of images, channels and times.
//!
//! TIFF tags contain pixels per inch or centimetre, along x and y. ImageJ writes `key=value` lines with the unit of
//! length of these resolutions, the spacing of slices, and the numbers of channels, slices and frames. OME writes XML
//! with voxel sizes along x, y, z. Python's tifffile writes the shape of the array as JSON.

use std::borrow::Cow;
use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::decoder::ifd::Value;
use ::tiff::tags::Tag;
use quick_xml::escape::unescape;
use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};

use crate::slices::voxel_size::{VoxelSize, is_screen, millimetres};

/// Description of a whole file, read from the tags of its first page.
#[derive(Clone, Debug)]
pub(super) struct Description {
    pub(super) size: VoxelSize,
    /// Number of images in the file, or in all files of a set.
    pub(super) images: Option<usize>,
    /// Numbers of channels, slices and times (in this order).
    pub(super) dimensions: Option<[usize; 3]>,
    /// Error message if the file contains several independent images.
    pub(super) series: Option<String>,
    pub(super) is_imagej: bool,
}

impl Description {
    /// Reads the tags of the decoder's current page.
    pub(super) fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Self {
        let text = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default();
        if text.contains("<OME") {
            return ome(&text).unwrap_or_else(|error| Self {
                series: Some(format!("its OME description cannot be read ({error})")),
                ..Self::of_tags(decoder, "")
            });
        }
        Self::of_tags(decoder, &text)
    }

    fn of_tags<R: Read + Seek>(decoder: &mut Decoder<R>, text: &str) -> Self {
        let is_imagej = text.starts_with("ImageJ=");
        let count = |name: &str| number(text, name).filter(|n| *n >= 1.0).map(|n| n as usize);
        let dimensions = is_imagej
            .then(|| ["channels", "slices", "frames"].map(|name| count(name).unwrap_or(1)));
        let shape = shape(text);
        let series = shape
            .as_ref()
            .filter(|shape| shape.len() > 3)
            .map(|shape| format!("its array has the shape {shape:?}: more than one volume"));
        Self {
            size: voxel_size(decoder, text),
            images: count("images").filter(|_| is_imagej),
            dimensions,
            series,
            is_imagej,
        }
    }
}

/// Returns the shape of the array in tifffile's JSON, without dimensions of size 1.
fn shape(text: &str) -> Option<Vec<usize>> {
    let text = text.trim_start().strip_prefix('{')?;
    let (_, list) = text.split_once("\"shape\"")?;
    let (list, _) = list.split_once('[')?.1.split_once(']')?;
    let sizes = list.split(',').map(|size| size.trim().parse().ok());
    let sizes: Option<Vec<usize>> = sizes.collect();
    Some(sizes?.into_iter().filter(|size| *size > 1).collect())
}

fn value<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let mut lines = text.lines().filter_map(|line| line.split_once('='));
    lines.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim())
}

fn number(text: &str, name: &str) -> Option<f64> {
    value(text, name)?.parse().ok()
}

fn is_positive(value: &f64) -> bool {
    value.is_finite() && *value > 0.0
}

fn voxel_size<R: Read + Seek>(decoder: &mut Decoder<R>, text: &str) -> VoxelSize {
    if let Some(exact) = number(text, "voxel_mm").filter(is_positive) {
        // this crate has written the value: no check for default values of other programs is needed
        let origin = "voxel_mm in its tags".to_owned();
        return VoxelSize::Stated { size_mm: [exact; 3], origin };
    }
    let per_unit = [Tag::XResolution, Tag::YResolution].map(|tag| ratio(decoder, tag));
    let [Some(x), Some(y)] = per_unit.map(|value| value.filter(is_positive)) else {
        return VoxelSize::Unknown("its tags contain no resolution".into());
    };
    let unit_tag = decoder.find_tag_unsigned::<u16>(Tag::ResolutionUnit).ok().flatten();
    let Some(unit) = value(text, "unit") else {
        return match unit_tag.unwrap_or(2) {
            2 => VoxelSize::per_inch(x, y, "resolution in its TIFF tags"),
            3 if is_screen(2.54 * x) => VoxelSize::per_inch(2.54 * x, 2.54 * y, "TIFF tags"),
            3 => VoxelSize::stated(
                [10.0 / x, 10.0 / y, 10.0 / x],
                "resolution in its TIFF tags; slice spacing assumed equal",
            ),
            _ => VoxelSize::Unknown("its resolution has no unit of length".into()),
        };
    };
    let unknown = |name: &str| {
        let message = format!("its unit of length '{name}' is unknown");
        VoxelSize::Unknown(message)
    };
    let named = |name: &'static str| value(text, name).unwrap_or(unit);
    let [Some(unit_mm), Some(y_mm), Some(z_mm)] =
        [unit, named("yunit"), named("zunit")].map(millimetres)
    else {
        let all = [unit, named("yunit"), named("zunit")];
        return unknown(all.into_iter().find(|name| millimetres(name).is_none()).unwrap_or(unit));
    };
    if unit_mm == 25.4 && is_screen(x) {
        return VoxelSize::per_inch(x, y, "ImageJ's unit is the inch");
    }
    let [x, y] = [unit_mm / x, y_mm / y];
    match number(text, "spacing").filter(is_positive) {
        Some(spacing) => {
            VoxelSize::stated([x, y, spacing * z_mm], "ImageJ's description in its tags")
        }
        None => VoxelSize::stated(
            [x, y, x],
            "ImageJ's description in its tags, which states no slice spacing: assumed equal",
        ),
    }
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

/// Reads an OME description (schema 2016-06: lengths without a unit are in µm).
fn ome(text: &str) -> Result<Description, quick_xml::Error> {
    let mut reader = quick_xml::Reader::from_str(text);
    let (mut images, mut pixels) = (0, None);
    loop {
        match reader.read_event()? {
            Event::Start(tag) | Event::Empty(tag) => match tag.local_name().as_ref() {
                "Image" => images += 1,
                "Pixels" if pixels.is_none() => pixels = Some(attributes(&tag)),
                _ => {}
            },
            Event::Eof => break,
            _ => {}
        }
    }
    let pixels = pixels.unwrap_or_default();
    let text =
        |name: &str| pixels.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str());
    let number = |name: &str| text(name).and_then(|value| value.trim().parse::<f64>().ok());
    let count = |name: &str| number(name).filter(|n| *n >= 1.0).map_or(1, |n| n as usize);
    let dimensions = ["SizeC", "SizeZ", "SizeT"].map(count);
    let edge = |axis: char| -> Result<Option<f64>, String> {
        let Some(length) = number(&format!("PhysicalSize{axis}")).filter(is_positive) else {
            return Ok(None);
        };
        let unit = text(&format!("PhysicalSize{axis}Unit")).unwrap_or("µm");
        let unit_mm = millimetres(unit);
        unit_mm
            .map(|mm| Some(mm * length))
            .ok_or_else(|| format!("its unit of length '{unit}' is unknown"))
    };
    let size = match (edge('X'), edge('Y'), edge('Z')) {
        (Err(message), ..) | (_, Err(message), _) | (.., Err(message)) => {
            VoxelSize::Unknown(message)
        }
        (Ok(Some(x)), Ok(Some(y)), Ok(Some(z))) => {
            VoxelSize::stated([x, y, z], "PhysicalSize of its OME description")
        }
        (Ok(Some(x)), Ok(Some(y)), Ok(None)) => VoxelSize::stated(
            [x, y, x],
            "PhysicalSize of its OME description, which states no size along z: assumed equal",
        ),
        _ => VoxelSize::Unknown("its OME description states no physical size".into()),
    };
    let series = (images > 1).then(|| format!("its OME description has {images} images"));
    let total = dimensions.into_iter().fold(1, usize::saturating_mul);
    Ok(Description {
        size,
        images: Some(total),
        dimensions: Some(dimensions),
        series,
        is_imagej: false,
    })
}

fn attributes(tag: &BytesStart<'_>) -> Vec<(String, String)> {
    let attribute = |attribute: Attribute<'_>| {
        // some programs write the letter µ in the unit µm as an XML escape
        let value = unescape(&attribute.value)
            .map_or_else(|_| attribute.value.to_string(), Cow::into_owned);
        (attribute.key.local_name().as_ref().to_owned(), value)
    };
    tag.attributes().with_checks(false).flatten().map(attribute).collect()
}
