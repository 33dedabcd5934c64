//! Reader of a single page: declared size and type, and samples.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::{CompressionMethod, Tag};
use ::tiff::{ColorType, TiffError};

use super::zstd;
use crate::ImageError;
use crate::slices::sample::{NumberKind, SampleType};
use fem_file::open_regular;

pub(super) type Reader = Decoder<BufReader<File>>;

/// Size and type that a page declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Declared {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) sample: SampleType,
    pub(super) compression: u16,
    /// Whether the page is a reduced copy of another page.
    pub(super) preview: bool,
}

/// Compression methods that change grey values: JPEG (old and new), JPEG 2000, WebP, JPEG XL.
const LOSSY: [u16; 6] = [6, 7, 34_712, 50_001, 50_002, 52_546];

impl Declared {
    pub(super) fn is_uncompressed(&self) -> bool {
        self.compression == CompressionMethod::None.to_u16()
    }

    pub(super) fn bytes(&self) -> u64 {
        (self.width as u64).saturating_mul(self.height as u64) * u64::from(self.sample.bits / 8)
    }
}

/// Opens a file. Decoding a page returns an error if the page needs more than `most` bytes.
pub(super) fn open_decoder(path: &Path, most: u64) -> Result<Reader, ImageError> {
    let file = open_regular(path).map_err(|source| ImageError::io("read", path, source))?;
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most;
    limits.intermediate_buffer_size = most;
    limits.ifd_value_size = limits.ifd_value_size.min(most);
    let decoder = Decoder::new(BufReader::with_capacity(1 << 16, file));
    Ok(decoder.map_err(|error| refused(path, 1, &error))?.with_limits(limits))
}

/// Reads and checks the declared size and type of the decoder's current page.
pub(super) fn declared(
    path: &Path,
    page: usize,
    decoder: &mut Reader,
    file_bytes: u64,
) -> Result<Declared, ImageError> {
    let fail = |message: String, help| ImageError::Page { path: path.into(), page, message, help };
    let tiff = |error| refused(path, page, &error);
    let (width, height) = decoder.dimensions().map_err(tiff)?;
    let bits = match decoder.colortype().map_err(tiff)? {
        ColorType::Gray(bits @ (8 | 16 | 32 | 64)) => bits,
        ColorType::Gray(bits) => {
            let help = "save it with 8, 16 or 32 bits per voxel";
            return Err(fail(format!("{bits} bits per voxel"), help));
        }
        ColorType::Multiband { num_samples, .. } => {
            let help = "save a single grey channel";
            return Err(fail(format!("{num_samples} values per pixel (channels)"), help));
        }
        other => {
            let help = "save it in grey";
            return Err(fail(format!("its pixels are colours ({other:?})"), help));
        }
    };
    let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).ok().flatten();
    let number = match format.and_then(|all| all.first().copied()) {
        Some(2) => NumberKind::Signed,
        Some(3) => NumberKind::Float,
        _ => NumberKind::Unsigned,
    };
    let method = decoder.find_tag_unsigned::<u16>(Tag::Compression).ok().flatten();
    let compression = method.unwrap_or(CompressionMethod::None.to_u16());
    if LOSSY.contains(&compression) {
        let help = "JPEG and similar methods change grey values: export the scan again with LZW, deflate, ZSTD or no compression";
        return Err(fail(format!("its compression is lossy (method {compression})"), help));
    }
    let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType).ok().flatten();
    let this = Declared {
        width: width as usize,
        height: height as usize,
        sample: SampleType { kind: number, bits },
        compression,
        preview: kind.is_some_and(|kind| kind & 1 == 1),
    };
    let stored = [Tag::StripByteCounts, Tag::TileByteCounts]
        .into_iter()
        .filter_map(|tag| decoder.find_tag_unsigned_vec::<u64>(tag).ok().flatten())
        .flatten()
        .fold(0_u64, u64::saturating_add);
    let uncompressed = this.is_uncompressed();
    if stored > file_bytes || (uncompressed && file_bytes < this.bytes()) {
        let message = format!(
            "its {} × {} voxels take {} bytes, but the file has {file_bytes}",
            this.width,
            this.height,
            stored.max(if uncompressed { this.bytes() } else { 0 })
        );
        return Err(fail(message, "the file is truncated: write or copy it again"));
    }
    Ok(this)
}

/// Decodes the decoder's current page.
pub(super) fn samples(
    path: &Path,
    page: usize,
    decoder: &mut Reader,
    into: &mut [f64],
) -> Result<(), ImageError> {
    let method = decoder.find_tag_unsigned::<u16>(Tag::Compression).ok().flatten();
    if method == Some(CompressionMethod::ZSTD.to_u16()) {
        return zstd::samples(decoder, into).map_err(|message| {
            let help = "the file is damaged: write or copy it again";
            ImageError::Page { path: path.into(), page, message, help }
        });
    }
    let samples = decoder.read_image().map_err(|error| refused(path, page, &error))?;
    let length = numbers(&samples, into);
    if length < into.len() {
        let message = format!("{length} values for {} voxels", into.len());
        let help = "the file is damaged: write or copy it again";
        return Err(ImageError::Page { path: path.into(), page, message, help });
    }
    Ok(())
}

/// Converts samples of any type to numbers; returns the number of samples.
fn numbers(samples: &DecodingResult, into: &mut [f64]) -> usize {
    fn copy<S: Copy>(from: &[S], to: &mut [f64], number: impl Fn(S) -> f64) -> usize {
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = number(from));
        from.len()
    }
    match samples {
        DecodingResult::U8(from) => copy(from, into, f64::from),
        DecodingResult::U16(from) => copy(from, into, f64::from),
        DecodingResult::U32(from) => copy(from, into, f64::from),
        DecodingResult::U64(from) => copy(from, into, |v| v as f64),
        DecodingResult::I8(from) => copy(from, into, f64::from),
        DecodingResult::I16(from) => copy(from, into, f64::from),
        DecodingResult::I32(from) => copy(from, into, f64::from),
        DecodingResult::I64(from) => copy(from, into, |v| v as f64),
        DecodingResult::F16(from) => copy(from, into, f64::from),
        DecodingResult::F32(from) => copy(from, into, f64::from),
        DecodingResult::F64(from) => copy(from, into, |v| v),
    }
}

/// Returns the error for a page that the decoder rejects.
pub(super) fn refused(path: &Path, page: usize, error: &TiffError) -> ImageError {
    let help = match error {
        TiffError::IoError(_) => "the file is truncated: write or copy it again",
        TiffError::UnsupportedError(_) => {
            "save it in grey, uncompressed or by LZW, deflate, PackBits or ZSTD"
        }
        _ => "the file is damaged: write or copy it again",
    };
    ImageError::Page { path: path.into(), page, message: error.to_string(), help }
}
