//! Tests of TIFF pages compressed by ZSTD: strips and tiles, both byte orders, all predictors.

use std::path::Path;

use fem_image::tiff;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

const SHAPE: [usize; 3] = [37, 21, 3];
const TILE: usize = 16;

/// Layout of a file.
#[derive(Clone, Copy, Debug)]
struct Layout {
    is_big_endian: bool,
    has_tiles: bool,
    predictor: u16,
    /// TIFF tag SampleFormat: 1 unsigned, 2 signed, 3 floating-point.
    format: u16,
    bytes: usize,
}

impl Layout {
    fn number(self, value: u64, bytes: usize) -> Vec<u8> {
        match self.is_big_endian {
            true => value.to_be_bytes()[8 - bytes..].to_vec(),
            false => value.to_le_bytes()[..bytes].to_vec(),
        }
    }

    /// Returns the bytes of a row of values in the byte order of the file, after the predictor.
    fn row(self, values: &[u64]) -> Vec<u8> {
        let masked = |value: u64| value & (u64::MAX >> (64 - 8 * self.bytes));
        match self.predictor {
            2 => {
                let before = [0].into_iter().chain(values.iter().copied());
                let differences = values.iter().zip(before).map(|(a, b)| masked(a.wrapping_sub(b)));
                differences.flat_map(|value| self.number(value, self.bytes)).collect()
            }
            3 => {
                let shifts = (0..self.bytes).rev().map(|byte| 8 * byte);
                let planes: Vec<u8> = shifts
                    .flat_map(|shift| values.iter().map(move |value| (value >> shift) as u8))
                    .collect();
                let before = [0].into_iter().chain(planes.iter().copied());
                planes.iter().zip(before).map(|(a, b)| a.wrapping_sub(b)).collect()
            }
            _ => values.iter().flat_map(|&value| self.number(masked(value), self.bytes)).collect(),
        }
    }

    fn write(self, path: &Path, bits: impl Fn(usize) -> u64) {
        let [nx, ny, nz] = SHAPE;
        let number = |value: usize, bytes: usize| self.number(value as u64, bytes);
        let mut out = if self.is_big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        out.extend(number(42, 2));
        let mut link = out.len();
        out.extend(number(0, 4));
        let (width, rows) = if self.has_tiles { (TILE, TILE) } else { (nx, 8) };
        let (across, down) = (nx.div_ceil(width), ny.div_ceil(rows));
        for z in 0..nz {
            let mut chunks = Vec::new();
            for chunk in 0..across * down {
                let (left, top) = (chunk % across * width, chunk / across * rows);
                let height = if self.has_tiles { rows } else { rows.min(ny - top) };
                let value = |x: usize, y: usize| match x < nx && y < ny {
                    true => bits(x + nx * (y + ny * z)),
                    false => 99,
                };
                let bytes: Vec<u8> = (top..top + height)
                    .flat_map(|y| {
                        let row: Vec<u64> = (left..left + width).map(|x| value(x, y)).collect();
                        self.row(&row)
                    })
                    .collect();
                let packed = compress_to_vec(&bytes[..], CompressionLevel::Fastest);
                chunks.push((out.len(), packed.len()));
                out.extend(packed);
            }
            let offsets = out.len();
            chunks.iter().for_each(|(offset, _)| out.extend(number(*offset, 4)));
            let counts = out.len();
            chunks.iter().for_each(|(_, bytes)| out.extend(number(*bytes, 4)));
            let mut entries = vec![
                (256, 4, 1, nx),
                (257, 4, 1, ny),
                (258, 3, 1, 8 * self.bytes),
                (259, 3, 1, 50_000),
                (262, 3, 1, 1),
                (277, 3, 1, 1),
                (317, 3, 1, usize::from(self.predictor)),
                (339, 3, 1, usize::from(self.format)),
            ];
            match self.has_tiles {
                true => entries.extend([
                    (322, 4, 1, TILE),
                    (323, 4, 1, TILE),
                    (324, 4, chunks.len(), offsets),
                    (325, 4, chunks.len(), counts),
                ]),
                false => entries.extend([
                    (273, 4, chunks.len(), offsets),
                    (278, 4, 1, rows),
                    (279, 4, chunks.len(), counts),
                ]),
            }
            entries.sort();
            let start = out.len();
            out.splice(link..link + 4, number(start, 4));
            out.extend(number(entries.len(), 2));
            for (tag, kind, count, value) in entries {
                out.extend(number(tag, 2));
                out.extend(number(kind, 2));
                out.extend(number(count, 4));
                let short = kind == 3;
                out.extend(number(value, if short { 2 } else { 4 }));
                out.extend(if short { vec![0; 2] } else { Vec::new() });
            }
            link = out.len();
            out.extend(number(0, 4));
        }
        std::fs::write(path, out).unwrap();
    }
}

#[test]
fn zstd_is_unpacked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let noise = |n: usize| n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    for is_big_endian in [false, true] {
        for has_tiles in [false, true] {
            for (format, bytes, predictor) in [
                (1, 1, 1),
                (1, 2, 1),
                (1, 2, 2),
                (2, 2, 2),
                (1, 4, 2),
                (3, 4, 1),
                (3, 4, 3),
                (3, 8, 3),
            ] {
                let layout = Layout { is_big_endian, has_tiles, predictor, format, bytes };
                let number = |n: usize| match (format, bytes) {
                    (3, _) => f64::from((noise(n) as f32).sin()),
                    (2, _) => f64::from(noise(n) as i16),
                    (_, 1) => f64::from(noise(n) as u8),
                    (_, 2) => f64::from(noise(n) as u16),
                    _ => noise(n) as f64,
                };
                layout.write(&path, |n| match (format, bytes) {
                    (3, 4) => u64::from((number(n) as f32).to_bits()),
                    (3, _) => number(n).to_bits(),
                    (2, _) => number(n) as i64 as u64,
                    _ => number(n) as u64,
                });
                let read = tiff::read(&path, Some(0.01)).unwrap();
                assert_eq!(read.shape, SHAPE);
                for (n, &value) in read.values.iter().enumerate() {
                    assert_eq!(value, number(n) as f32, "{layout:?}, voxel {n}");
                }
            }
        }
    }
}

#[test]
fn damaged_zstd_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let layout =
        Layout { is_big_endian: false, has_tiles: false, predictor: 1, format: 1, bytes: 2 };
    layout.write(&path, |n| n as u64 % 5000);
    let whole = std::fs::read(&path).unwrap();
    for at in [8, 12, 30, 200] {
        let mut bytes = whole.clone();
        bytes[at..at + 8].fill(0xff);
        std::fs::write(&path, &bytes).unwrap();
        match tiff::read(&path, Some(0.01)) {
            Ok(volume) => assert_eq!(volume.shape, SHAPE),
            Err(error) => assert!(error.to_string().contains("stack.tif, page 1"), "{error}"),
        }
    }
    let mut bytes = whole;
    bytes[8..12].fill(0);
    std::fs::write(&path, &bytes).unwrap();
    let error = tiff::read(&path, Some(0.01)).unwrap_err().to_string();
    assert!(error.contains("stack.tif, page 1") && error.contains("damaged"), "{error}");
}
