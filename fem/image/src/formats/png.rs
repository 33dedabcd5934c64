//! Slices in PNG files.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Transformations, Unit};

use super::pictures::{Picture, equal_colours, refused};
use crate::ImageError;
use crate::slices::sample::{ByteOrder, SampleType, decode};
use crate::slices::voxel_size::VoxelSize;
use fem_file::open_regular;

fn decoder(path: &Path) -> Result<Decoder<BufReader<File>>, ImageError> {
    let file = open_regular(path).map_err(|source| ImageError::io("read", path, source))?;
    let limits = Limits { bytes: usize::MAX };
    Ok(Decoder::new_with_limits(BufReader::with_capacity(1 << 16, file), limits))
}

fn damaged(path: &Path, error: &DecodingError) -> ImageError {
    refused(path, error.to_string(), "the file is damaged: write or copy it again")
}

/// Reads the size and the type of a slice.
pub(super) fn header(path: &Path) -> Result<Picture, ImageError> {
    let mut decoder = decoder(path)?;
    let info = decoder.read_header_info().map_err(|error| damaged(path, &error))?;
    let bits = match (info.bit_depth, info.color_type) {
        (BitDepth::Sixteen, ColorType::Grayscale | ColorType::Rgb) => 16,
        (BitDepth::Eight, ColorType::Grayscale | ColorType::Rgb | ColorType::Indexed) => 8,
        (depth, ColorType::Grayscale | ColorType::Indexed) => {
            let message = format!("{} bits per voxel", depth as u8);
            return Err(refused(path, message, "save it with 8 or 16 bits per voxel"));
        }
        (_, other) => {
            let message = format!("its pixels have transparency ({other:?})");
            return Err(refused(path, message, "save it in grey"));
        }
    };
    let (width, height) = (info.width as usize, info.height as usize);
    let reader = decoder.read_info().map_err(|error| damaged(path, &error))?;
    let size = match reader.info().pixel_dims {
        Some(size) if size.unit == Unit::Meter && size.xppu > 0 && size.yppu > 0 => {
            let per_inch = |per_metre: u32| f64::from(per_metre) * 0.0254;
            let origin = "resolution of the PNG file; slice spacing assumed equal";
            VoxelSize::per_inch(per_inch(size.xppu), per_inch(size.yppu), origin)
        }
        _ => VoxelSize::Unknown(
            "PNG files without a resolution do not state the size of a voxel".into(),
        ),
    };
    Ok(Picture { width, height, sample: SampleType::unsigned(bits), size })
}

/// Reads the values of a slice.
pub(super) fn values(path: &Path, picture: &Picture, into: &mut [f64]) -> Result<(), ImageError> {
    let mut decoder = decoder(path)?;
    let colour = decoder.read_header_info().map_err(|error| damaged(path, &error))?.color_type;
    if colour == ColorType::Indexed {
        decoder.set_transformations(Transformations::EXPAND);
    }
    let mut reader = decoder.read_info().map_err(|error| damaged(path, &error))?;
    let Some(length) = reader.output_buffer_size() else {
        return Err(refused(
            path,
            "the slice has more bytes than this machine can address".into(),
            "crop the slices",
        ));
    };
    let mut bytes = vec![0; length];
    reader.next_frame(&mut bytes).map_err(|error| damaged(path, &error))?;
    if colour == ColorType::Grayscale {
        decode(&bytes, picture.sample, ByteOrder::Big, into);
        return Ok(());
    }
    let channels = bytes.len() / (into.len() * picture.sample.bytes()).max(1);
    if channels != 3 {
        let message = format!("{channels} values per pixel");
        return Err(refused(path, message, "save it in grey, without transparency"));
    }
    let mut colours = vec![0.0; 3 * into.len()];
    decode(&bytes, picture.sample, ByteOrder::Big, &mut colours);
    equal_colours(path, &colours, into)
}
