//! Tests of averages over blocks during reading, compared with averages of the whole volume in memory.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use ::tiff::encoder::colortype::{ColorType, Gray8, Gray16, Gray32, Gray32Float};
use ::tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffValue};
use fem_image::{ImageError, Volume, tiff};

/// Shape of the stack: no edge is a multiple of 2 or 3, so that incomplete blocks remain.
const SHAPE: [usize; 3] = [23, 19, 11];

/// Returns the mean of each complete block of `bin`³ voxels, computed voxel by voxel.
fn blocks(whole: &Volume<f32>, bin: usize) -> Volume<f32> {
    let shape = whole.shape.map(|side| side / bin);
    let mut values = Vec::new();
    for n in 0..shape.iter().product() {
        let block = [n % shape[0], n / shape[0] % shape[1], n / (shape[0] * shape[1])];
        let within = (0..bin.pow(3)).map(|m| [m % bin, m / bin % bin, m / (bin * bin)]);
        let voxel = |own: [usize; 3]| std::array::from_fn(|k| bin * block[k] + own[k]);
        let sum: f64 = within.map(|own| f64::from(*whole.at(voxel(own)))).sum();
        values.push((sum / bin.pow(3) as f64) as f32);
    }
    Volume::new(shape, bin as f64 * whole.voxel_mm, values).unwrap()
}

/// Compares binned reading with [`blocks`]: exactly if all sums are integers, otherwise up to rounding errors.
fn assert_binned(path: &Path, exact: bool) {
    let whole = tiff::read(path, Some(0.02)).unwrap();
    assert_eq!(whole.shape, SHAPE);
    for bin in [1, 2, 3, 5, 11] {
        let (found, expected) =
            (tiff::read_binned(path, Some(0.02), bin).unwrap(), blocks(&whole, bin));
        assert_eq!((found.shape, found.voxel_mm), (expected.shape, expected.voxel_mm), "{bin}");
        for (n, (a, b)) in found.values.iter().zip(&expected.values).enumerate() {
            let near = if exact { a == b } else { (a - b).abs() <= 1e-6 * b.abs() };
            assert!(near, "bin {bin}, voxel {n}: {a}, not {b}");
        }
    }
}

/// Returns a pseudo-random number below `limit`.
fn noise(n: usize, limit: usize) -> usize {
    n.wrapping_mul(0x9e37_79b9_7f4a_7c15) % limit
}

fn slice<C: ColorType>(z: usize, value: impl Fn(usize) -> C::Inner) -> Vec<C::Inner> {
    let area = SHAPE[0] * SHAPE[1];
    (z * area..(z + 1) * area).map(value).collect()
}

/// Writes pages in strips of `rows` rows.
fn pages<C: ColorType>(
    path: &Path,
    slices: std::ops::Range<usize>,
    rows: u32,
    compression: Compression,
    value: impl Fn(usize) -> C::Inner + Copy,
) where
    [C::Inner]: TiffValue,
{
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = TiffEncoder::new(file).unwrap().with_compression(compression);
    for z in slices {
        let mut image = encoder.new_image::<C>(SHAPE[0] as u32, SHAPE[1] as u32).unwrap();
        image.rows_per_strip(rows).unwrap();
        image.write_data(&slice::<C>(z, value)).unwrap();
    }
}

#[test]
fn pages_of_one_file_are_averaged_for_every_number_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    for rows in [1, 4, 19] {
        let compression = Compression::Deflate(DeflateLevel::Fast);
        pages::<Gray8>(&path, 0..SHAPE[2], rows, compression, |n| noise(n, 256) as u8);
        assert_binned(&path, true);
        pages::<Gray16>(&path, 0..SHAPE[2], rows, Compression::Lzw, |n| noise(n, 65_536) as u16);
        assert_binned(&path, true);
        let none = Compression::Uncompressed;
        pages::<Gray32>(&path, 0..SHAPE[2], rows, none, |n| noise(n, 1 << 32) as u32);
        assert_binned(&path, true);
        let value = |n| (noise(n, 1 << 20) as f32).sin();
        pages::<Gray32Float>(&path, 0..SHAPE[2], rows, none, value);
        assert_binned(&path, false);
    }
}

#[test]
fn a_folder_of_slices_is_averaged() {
    let folder = tempfile::tempdir().unwrap();
    for z in 0..SHAPE[2] {
        let path = folder.path().join(format!("slice{z}.tif"));
        pages::<Gray16>(&path, z..z + 1, 7, Compression::Packbits, |n| noise(n, 4000) as u16);
    }
    assert_binned(folder.path(), true);
    // a folder of files; one file has several pages
    std::fs::remove_file(folder.path().join("slice10.tif")).unwrap();
    std::fs::remove_file(folder.path().join("slice9.tif")).unwrap();
    let path = folder.path().join("slice9.tif");
    pages::<Gray16>(&path, 9..11, 7, Compression::Packbits, |n| noise(n, 4000) as u16);
    assert_binned(folder.path(), true);
}

/// Writes a file of 16-bit pages in tiles of 16 × 16 pixels, as the standard defines them; the encoder of the `tiff`
/// crate writes strips only.
fn tiled(path: &Path, value: impl Fn(usize) -> u16) {
    const TILE: usize = 16;
    let [nx, ny, nz] = SHAPE;
    let (across, down) = (nx.div_ceil(TILE), ny.div_ceil(TILE));
    let (tiles, bytes) = (across * down, 2 * TILE * TILE);
    let page = tiles * bytes + 8 * tiles + 2 + 12 * 10 + 4;
    let mut out = b"II\x2a\0".to_vec();
    out.extend((8 + tiles as u32 * (bytes as u32 + 8)).to_le_bytes());
    for z in 0..nz {
        let start = 8 + z * page;
        assert_eq!(out.len(), start);
        for tile in 0..tiles {
            for n in 0..TILE * TILE {
                let x = tile % across * TILE + n % TILE;
                let y = tile / across * TILE + n / TILE;
                // padding of the tiles beyond the page, which must not be read
                let grey = if x < nx && y < ny { value(x + nx * (y + ny * z)) } else { 65_535 };
                out.extend(grey.to_le_bytes());
            }
        }
        let offsets = (start + tiles * bytes) as u32;
        (0..tiles).for_each(|tile| out.extend(((start + tile * bytes) as u32).to_le_bytes()));
        (0..tiles).for_each(|_| out.extend((bytes as u32).to_le_bytes()));
        let entries: [(u16, u16, u32, u32); 10] = [
            (256, 4, 1, nx as u32),
            (257, 4, 1, ny as u32),
            (258, 3, 1, 16),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            (277, 3, 1, 1),
            (322, 4, 1, TILE as u32),
            (323, 4, 1, TILE as u32),
            (324, 4, tiles as u32, offsets),
            (325, 4, tiles as u32, offsets + 4 * tiles as u32),
        ];
        out.extend((entries.len() as u16).to_le_bytes());
        for (tag, kind, count, value) in entries {
            out.extend(tag.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend(count.to_le_bytes());
            out.extend(value.to_le_bytes());
        }
        let next = if z + 1 < nz { out.len() + 4 + tiles * (bytes + 8) } else { 0 };
        out.extend((next as u32).to_le_bytes());
    }
    File::create(path).unwrap().write_all(&out).unwrap();
}

#[test]
fn tiles_are_averaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    tiled(&path, |n| noise(n, 60_000) as u16);
    let whole = tiff::read(&path, Some(1.0)).unwrap();
    assert!((0..whole.values.len()).all(|n| whole.values[n] == noise(n, 60_000) as f32));
    assert_binned(&path, true);
}

#[test]
fn threads_do_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let value = |n| (noise(n, 1 << 20) as f32).sin();
    pages::<Gray32Float>(&path, 0..SHAPE[2], 4, Compression::Uncompressed, value);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tiff::read_binned(&path, Some(1.0), 2).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn invalid_bins_are_refused_and_errors_state_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let value = |n| if n == 7 * SHAPE[0] * SHAPE[1] + 30 { f32::NAN } else { 1.0 };
    pages::<Gray32Float>(&path, 0..SHAPE[2], 4, Compression::Uncompressed, value);
    for bin in [0, 12, 1 << 40] {
        let error = tiff::read_binned(&path, Some(1.0), bin).unwrap_err();
        assert!(matches!(error, ImageError::Parameter { field: "bin", .. }), "{error}");
    }
    let error = tiff::read_binned(&path, Some(1.0), 2).unwrap_err().to_string();
    assert!(error.contains("stack.tif, page 8: voxel 30 has the value NaN"), "{error}");
    // slices beyond the last complete block are not read, so the NaN in page 8 causes no error
    let error = tiff::read_binned(&path, Some(1.0), 6).map(|volume| volume.shape);
    assert_eq!(error.unwrap(), [3, 3, 1]);
}
