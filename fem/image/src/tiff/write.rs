//! Writer of labels to TIFF files.

use std::io::{Cursor, Seek, Write};
use std::path::Path;

use ::tiff::encoder::colortype::{ColorType, Gray16, Gray32};
use ::tiff::encoder::{Compression, DeflateLevel, Rational, TiffEncoder, TiffKind, TiffValue};
use ::tiff::tags::{ResolutionUnit, Tag};
use ::tiff::{TiffError, TiffResult};
use rayon::prelude::*;

use crate::{ImageError, Volume};
use fem_file::write_atomically;

/// Total size of the values (bytes) from which a file is written as BigTIFF.
const CLASSIC_BYTES: usize = 3 << 30;

/// Writes labels as a TIFF with one page per slice, compressed by deflate, with the voxel size in its tags.
///
/// Pages have 16 bits if the largest label fits, otherwise 32 bits. The file is written atomically: either completely
/// or not at all.
///
/// # Errors
/// [`ImageError`] if the volume is invalid or the file cannot be written.
///
/// # Example
/// ```
/// # let path = std::env::temp_dir().join(format!("fem-doc-labels-{}.tif", std::process::id()));
/// use fem_image::{Volume, tiff};
///
/// let labels = Volume::new([2, 2, 1], 0.0275, vec![0, 1, 1, 2])?;
/// tiff::write_labels(&path, &labels)?;
/// assert_eq!(tiff::read_labels(&path, None)?, labels);
/// # std::fs::remove_file(path).unwrap();
/// # Ok::<(), fem_image::ImageError>(())
/// ```
pub fn write_labels(path: &Path, labels: &Volume<u32>) -> Result<(), ImageError> {
    labels.check()?;
    let mut file = Cursor::new(Vec::new());
    let narrow = labels.values.par_iter().max().is_none_or(|&most| u16::try_from(most).is_ok());
    let bytes = labels.values.len() * if narrow { 2 } else { 4 };
    let encoded = if bytes < CLASSIC_BYTES {
        TiffEncoder::new(&mut file).and_then(|encoder| pages(encoder, labels, narrow))
    } else {
        TiffEncoder::new_big(&mut file).and_then(|encoder| pages(encoder, labels, narrow))
    };
    let failed = |source| ImageError::io("write", path, source);
    encoded.map_err(|error| match error {
        TiffError::IoError(source) => failed(source),
        other => failed(std::io::Error::other(other)),
    })?;
    write_atomically(path, &file.into_inner()).map_err(failed)
}

fn pages<W: Write + Seek, K: TiffKind>(
    encoder: TiffEncoder<W, K>,
    labels: &Volume<u32>,
    narrow: bool,
) -> TiffResult<()> {
    let mut encoder = encoder.with_compression(Compression::Deflate(DeflateLevel::Fast));
    let [nx, ny, _] = labels.shape;
    for (number, slice) in labels.values.chunks_exact(nx * ny).enumerate() {
        if narrow {
            let slice: Vec<u16> = slice.iter().map(|&label| label as u16).collect();
            page::<Gray16, W, K>(&mut encoder, labels, number, &slice)?;
        } else {
            page::<Gray32, W, K>(&mut encoder, labels, number, slice)?;
        }
    }
    Ok(())
}

fn page<C: ColorType, W: Write + Seek, K: TiffKind>(
    encoder: &mut TiffEncoder<W, K>,
    labels: &Volume<u32>,
    number: usize,
    slice: &[C::Inner],
) -> TiffResult<()>
where
    [C::Inner]: TiffValue,
{
    let [nx, ny, nz] = labels.shape;
    let mut image = encoder.new_image::<C>(u32::try_from(nx)?, u32::try_from(ny)?)?;
    if number == 0 {
        // the description has the format of ImageJ, with the voxel size as an additional line that contains all digits
        let voxel_mm = labels.voxel_mm;
        let description = format!(
            "ImageJ=1.53\nimages={nz}\nslices={nz}\nunit=cm\nspacing={}\nvoxel_mm={voxel_mm}\n",
            voxel_mm / 10.0
        );
        image.encoder().write_tag(Tag::ImageDescription, description.as_str())?;
    }
    image.resolution(ResolutionUnit::Centimeter, rational(10.0 / labels.voxel_mm));
    image.write_data(slice)
}

/// Returns a fraction close to a value, with the precision that 32-bit integers allow.
fn rational(value: f64) -> Rational {
    let largest = f64::from(u32::MAX);
    let d = (largest / value.max(1.0)).floor().clamp(1.0, 1e6);
    Rational { n: (value * d).round().clamp(1.0, largest) as u32, d: d as u32 }
}
