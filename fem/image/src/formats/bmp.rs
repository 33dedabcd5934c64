//! Slices in uncompressed Windows bitmaps: 8 bits with a palette of greys, or 24 or 32 bits with equal colours.
//!
//! Reference: Microsoft, Bitmap Storage and BITMAPINFOHEADER structure.

use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::pictures::{Picture, equal_colours, refused};
use crate::ImageError;
use crate::slices::sample::SampleType;
use crate::slices::voxel_size::VoxelSize;
use fem_file::open_regular;

/// Total length of the file header and the bitmap header (bytes).
const HEADER: usize = 54;

/// Header data of a bitmap.
struct Header {
    width: usize,
    height: usize,
    /// Whether the rows are stored from bottom to top.
    is_upward: bool,
    bits: u16,
    offset: u64,
    palette_at: u64,
    colours: usize,
    per_metre: [i32; 2],
}

impl Header {
    fn read(path: &Path, file: &mut impl Read) -> Result<Self, ImageError> {
        let mut bytes = [0; HEADER];
        file.read_exact(&mut bytes).map_err(|source| ImageError::io("read", path, source))?;
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let long = |at: usize| {
            i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let (width, height, bits, method) = (long(18), long(22), word(28), long(30));
        if !matches!(bits, 8 | 24 | 32) {
            return Err(refused(
                path,
                format!("{bits} bits per pixel"),
                "save it as an 8-bit grey image",
            ));
        }
        if method != 0 {
            let message = format!("it is compressed (method {method})");
            return Err(refused(path, message, "save it without compression"));
        }
        if width < 1 || height == 0 || height == i32::MIN {
            let message = format!("{width} × {height} voxels");
            return Err(refused(path, message, "the file is damaged: write it again"));
        }
        let colours = if long(46) > 0 { long(46).min(256) as usize } else { 256 };
        Ok(Self {
            width: width as usize,
            height: height.unsigned_abs() as usize,
            is_upward: height > 0,
            bits,
            offset: long(10).max(0) as u64,
            palette_at: 14 + long(14).max(0) as u64,
            colours,
            per_metre: [long(38), long(42)],
        })
    }

    /// Returns the size of a stored row (bytes); rows are padded to a multiple of 4 bytes.
    fn row_bytes(&self) -> usize {
        (self.width * usize::from(self.bits / 8)).next_multiple_of(4)
    }
}

/// Reads the size and the resolution of a slice.
pub(super) fn header(path: &Path) -> Result<Picture, ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let mut file = open_regular(path).map_err(failed)?;
    let header = Header::read(path, &mut file)?;
    let (file_bytes, declared) = (
        file.metadata().map_err(failed)?.len(),
        header.offset + header.row_bytes() as u64 * header.height as u64,
    );
    if file_bytes < declared {
        let message =
            format!("the file has {file_bytes} bytes, but its header declares {declared}");
        return Err(refused(path, message, "the file is truncated: write or copy it again"));
    }
    let size = match header.per_metre {
        [x, y] if x > 0 && y > 0 => {
            let per_inch = |per_metre: i32| f64::from(per_metre) * 0.0254;
            let origin = "resolution of the BMP file; slice spacing assumed equal";
            VoxelSize::per_inch(per_inch(x), per_inch(y), origin)
        }
        _ => VoxelSize::Unknown(
            "BMP files without a resolution do not state the size of a voxel".into(),
        ),
    };
    let (width, height) = (header.width, header.height);
    Ok(Picture { width, height, sample: SampleType::unsigned(8), size })
}

/// Reads the values of a slice.
pub(super) fn values(path: &Path, into: &mut [f64]) -> Result<(), ImageError> {
    let failed = |source| ImageError::io("read", path, source);
    let mut file = BufReader::new(open_regular(path).map_err(failed)?);
    let header = Header::read(path, &mut file)?;
    // the palette stores blue, green, red and a padding byte for each colour
    let mut palette = vec![0; if header.bits == 8 { 4 * header.colours } else { 0 }];
    file.seek(SeekFrom::Start(header.palette_at)).map_err(failed)?;
    file.read_exact(&mut palette).map_err(failed)?;
    file.seek(SeekFrom::Start(header.offset)).map_err(failed)?;
    let mut row = vec![0; header.row_bytes()];
    let mut colours = vec![0.0; 3 * header.width];
    for n in 0..header.height {
        file.read_exact(&mut row).map_err(failed)?;
        let pixel = usize::from(header.bits / 8);
        for (colour, bytes) in colours.chunks_exact_mut(3).zip(row.chunks_exact(pixel)) {
            let all = match header.bits {
                8 => palette.get(4 * usize::from(bytes[0])..).unwrap_or_default(),
                _ => bytes,
            };
            let Some(all) = all.first_chunk::<3>() else {
                let message = format!("a voxel has colour {} of {}", bytes[0], header.colours);
                return Err(refused(path, message, "the file is damaged: write it again"));
            };
            colour.iter_mut().zip(all).for_each(|(colour, &byte)| *colour = f64::from(byte));
        }
        let y = if header.is_upward { header.height - 1 - n } else { n };
        equal_colours(path, &colours, &mut into[y * header.width..(y + 1) * header.width])?;
    }
    Ok(())
}
