//! Reader of pages compressed by ZSTD; the TIFF decoder can decompress such pages only with a C library.
//!
//! References: TIFF, revision 6.0, sections 14 and 15 (differencing, tiles); TIFF Technical Note 3 (floating-point
//! predictor), Adobe 2005; compression number 50000, libtiff 4.0.10.

use std::io::{Read, Seek, SeekFrom};

use ::tiff::decoder::Decoder;
use ::tiff::tags::{ByteOrder as FileOrder, Tag};
use ruzstd::decoding::StreamingDecoder;

use crate::slices::sample::{ByteOrder, NumberKind, SampleType, decode};

/// Division of a page into strips or tiles (*chunks*).
struct Chunks {
    /// Width and height of the page.
    page: [usize; 2],
    /// Width and height of a chunk.
    size: [usize; 2],
    are_tiles: bool,
    offsets: Vec<u64>,
    bytes: Vec<u64>,
    sample: SampleType,
    order: ByteOrder,
    predictor: u16,
}

/// Decodes the decoder's current page. An error is a message without the path of the file.
pub(super) fn samples<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    into: &mut [f64],
) -> Result<(), String> {
    let chunks = Chunks::of(decoder)?;
    let [width, height] = chunks.page;
    let [across, rows] = [width.div_ceil(chunks.size[0]), chunks.size[1]];
    if chunks.offsets.len() != across * height.div_ceil(rows)
        || chunks.bytes.len() != chunks.offsets.len()
    {
        return Err(format!("{} strips or tiles do not cover the page", chunks.offsets.len()));
    }
    let mut numbers = vec![0.0; chunks.size[0] * rows];
    for (chunk, (&offset, &bytes)) in chunks.offsets.iter().zip(&chunks.bytes).enumerate() {
        let [left, top] = [chunk % across * chunks.size[0], chunk / across * rows];
        // the last strip can have fewer rows than the other strips, whereas the last tile is padded
        let stored = if chunks.are_tiles { rows } else { rows.min(height - top) };
        let unpacked = chunks.unpacked(decoder, offset, bytes, stored)?;
        decode(&unpacked, chunks.sample, chunks.order, &mut numbers);
        for (row, values) in
            numbers.chunks_exact(chunks.size[0]).enumerate().take(rows.min(height - top))
        {
            let (start, count) = ((top + row) * width + left, chunks.size[0].min(width - left));
            into[start..start + count].copy_from_slice(&values[..count]);
        }
    }
    Ok(())
}

impl Chunks {
    fn of<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, String> {
        let mut number = |tag: Tag| -> Result<Option<u64>, String> {
            decoder.find_tag_unsigned(tag).map_err(|error| error.to_string())
        };
        let size = |value: Option<u64>, name: &str| match value {
            Some(value) if (1..=u64::from(u32::MAX)).contains(&value) => Ok(value as usize),
            _ => Err(format!("the tag {name} is missing or 0")),
        };
        let width = size(number(Tag::ImageWidth)?, "ImageWidth")?;
        let height = size(number(Tag::ImageLength)?, "ImageLength")?;
        let tile = number(Tag::TileWidth)?;
        let chunk = match tile {
            Some(_) => [size(tile, "TileWidth")?, size(number(Tag::TileLength)?, "TileLength")?],
            None => {
                let rows = number(Tag::RowsPerStrip)?.unwrap_or(u64::MAX).min(height as u64);
                [width, size(Some(rows), "RowsPerStrip")?]
            }
        };
        if chunk[0] > (2 * width).max(1024) || chunk[1] > (2 * height).max(1024) {
            return Err(format!(
                "tiles of {} × {} voxels are larger than the page",
                chunk[0], chunk[1]
            ));
        }
        let bits = number(Tag::BitsPerSample)?.unwrap_or(1) as u8;
        let kind = match number(Tag::SampleFormat)?.unwrap_or(1) {
            2 => NumberKind::Signed,
            3 => NumberKind::Float,
            _ => NumberKind::Unsigned,
        };
        if kind == NumberKind::Float && bits < 32 {
            return Err("floating-point numbers of 16 bits with ZSTD are not supported".to_owned());
        }
        if number(Tag::PhotometricInterpretation)? == Some(0) {
            return Err(
                "white is zero, which is not supported with ZSTD: invert the page".to_owned()
            );
        }
        let predictor = number(Tag::Predictor)?.unwrap_or(1) as u16;
        if !matches!(predictor, 1..=3)
            || (predictor == 3) != (kind == NumberKind::Float && predictor != 1)
        {
            return Err(format!("predictor {predictor} does not suit its number type"));
        }
        let mut list = |tag: Tag| -> Result<Vec<u64>, String> {
            let list = decoder.find_tag_unsigned_vec(tag).map_err(|error| error.to_string())?;
            Ok(list.unwrap_or_default())
        };
        let (offsets, bytes) = match tile {
            Some(_) => (list(Tag::TileOffsets)?, list(Tag::TileByteCounts)?),
            None => (list(Tag::StripOffsets)?, list(Tag::StripByteCounts)?),
        };
        let order = match decoder.byte_order() {
            FileOrder::LittleEndian => ByteOrder::Little,
            FileOrder::BigEndian => ByteOrder::Big,
        };
        let (page, sample) = ([width, height], SampleType { kind, bits });
        Ok(Self {
            page,
            size: chunk,
            are_tiles: tile.is_some(),
            offsets,
            bytes,
            sample,
            order,
            predictor,
        })
    }

    /// Decompresses `rows` rows of a chunk and reverses the predictor.
    fn unpacked<R: Read + Seek>(
        &self,
        decoder: &mut Decoder<R>,
        offset: u64,
        bytes: u64,
        rows: usize,
    ) -> Result<Vec<u8>, String> {
        let file = decoder.inner();
        file.seek(SeekFrom::Start(offset)).map_err(|error| error.to_string())?;
        let packed = StreamingDecoder::new(file.take(bytes)).map_err(|error| error.to_string())?;
        let row = self.size[0] * self.sample.bytes();
        let mut unpacked = Vec::new();
        let read = packed.take((row * rows) as u64).read_to_end(&mut unpacked);
        read.map_err(|error| error.to_string())?;
        if unpacked.len() < row * rows {
            return Err(format!("{} bytes unpacked for {}", unpacked.len(), row * rows));
        }
        for row in unpacked.chunks_exact_mut(row) {
            match self.predictor {
                2 => self.add_up(row),
                3 => self.join_bytes(row),
                _ => {}
            }
        }
        Ok(unpacked)
    }

    /// Reverses the differencing predictor: replaces the differences between neighbours in a row by their cumulative
    /// sums.
    fn add_up(&self, row: &mut [u8]) {
        let bytes = self.sample.bytes();
        let mut sum = 0_u64;
        for value in row.chunks_exact_mut(bytes) {
            let mut wide = [0_u8; 8];
            wide[..bytes].copy_from_slice(value);
            if self.order == ByteOrder::Big {
                wide[..bytes].reverse();
            }
            sum = sum.wrapping_add(u64::from_le_bytes(wide));
            wide = sum.to_le_bytes();
            if self.order == ByteOrder::Big {
                wide[..bytes].reverse();
            }
            value.copy_from_slice(&wide[..bytes]);
        }
    }

    /// Reverses the floating-point predictor. The predictor stores the most significant bytes of all values of a row
    /// first, then the next bytes, and so on; then it stores differences between neighbouring bytes.
    fn join_bytes(&self, row: &mut [u8]) {
        let (bytes, values) = (self.sample.bytes(), row.len() / self.sample.bytes());
        (1..row.len()).for_each(|n| row[n] = row[n].wrapping_add(row[n - 1]));
        let planes = row.to_vec();
        for (n, value) in row.chunks_exact_mut(bytes).enumerate() {
            for (significance, byte) in value.iter_mut().enumerate() {
                let plane = match self.order {
                    ByteOrder::Big => significance,
                    ByteOrder::Little => bytes - 1 - significance,
                };
                *byte = planes[plane * values + n];
            }
        }
    }
}
