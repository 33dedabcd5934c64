//! Tests of stacks in TIFF files: kinds of pages, voxel sizes, and invalid files.

use std::fs::File;
use std::io::{BufWriter, Cursor, Seek, Write};
use std::path::Path;

use ::tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32, Gray32Float, Gray64Float, GrayI8, GrayI16, GrayI32, RGB8,
};
use ::tiff::encoder::{
    Compression, DeflateLevel, Predictor, Rational, TiffEncoder, TiffKind, TiffValue,
};
use ::tiff::tags::{ResolutionUnit, Tag};
use fem_image::{ImageError, Volume, tiff};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const SHAPE: [usize; 3] = [5, 4, 3];

fn pages<C: ColorType, W: Write + Seek, K: TiffKind>(
    encoder: TiffEncoder<W, K>,
    compression: Compression,
    value: impl Fn(usize) -> C::Inner,
) where
    [C::Inner]: TiffValue,
{
    let mut encoder = encoder.with_compression(compression);
    for page in 0..SHAPE[2] {
        let values: Vec<C::Inner> = (0..20).map(|n| value(n + 20 * page)).collect();
        encoder.write_image::<C>(5, 4, &values).unwrap();
    }
}

fn file(path: &Path) -> BufWriter<File> {
    BufWriter::new(File::create(path).unwrap())
}

fn assert_reads<C: ColorType>(value: impl Fn(usize) -> C::Inner, expected: impl Fn(usize) -> f32)
where
    [C::Inner]: TiffValue,
{
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let kinds = [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Deflate(DeflateLevel::Fast),
        Compression::Packbits,
    ];
    for compression in kinds {
        for big in [false, true] {
            if big {
                pages::<C, _, _>(TiffEncoder::new_big(file(&path)).unwrap(), compression, &value);
            } else {
                pages::<C, _, _>(TiffEncoder::new(file(&path)).unwrap(), compression, &value);
            }
            let read = tiff::read(&path, Some(0.02)).unwrap();
            assert_eq!((read.shape, read.voxel_mm), (SHAPE, 0.02));
            for (n, &found) in read.values.iter().enumerate() {
                assert_eq!(found, expected(n), "voxel {n}");
            }
        }
    }
}

#[test]
fn all_kinds_of_grey_values_are_read() {
    assert_reads::<Gray8>(|n| 4 * n as u8, |n| 4.0 * n as f32);
    assert_reads::<Gray16>(|n| 1000 * n as u16, |n| 1000.0 * n as f32);
    assert_reads::<Gray32>(|n| 100_000 * n as u32, |n| 100_000.0 * n as f32);
    assert_reads::<GrayI8>(|n| n as i8 - 30, |n| n as f32 - 30.0);
    assert_reads::<GrayI16>(|n| 500 * (n as i16 - 30), |n| 500.0 * (n as f32 - 30.0));
    assert_reads::<GrayI32>(|n| 70_000 * (n as i32 - 30), |n| 70_000.0 * (n as f32 - 30.0));
    assert_reads::<Gray32Float>(|n| n as f32 * 0.1 - 2.0, |n| n as f32 * 0.1 - 2.0);
    assert_reads::<Gray64Float>(|n| f64::from(n as f32 * 0.1), |n| n as f32 * 0.1);
}

#[test]
fn the_predictor_of_differences_is_reversed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let encoder = TiffEncoder::new(file(&path)).unwrap().with_predictor(Predictor::Horizontal);
    pages::<Gray16, _, _>(encoder, Compression::Lzw, |n| (n * n * 17) as u16);
    let read = tiff::read(&path, Some(1.0)).unwrap();
    assert_eq!(read.values[59], (59 * 59 * 17) as f32);
}

fn one_page(path: &Path, width: u32, values: &[u16]) {
    let mut encoder = TiffEncoder::new(file(path)).unwrap();
    encoder.write_image::<Gray16>(width, values.len() as u32 / width, values).unwrap();
}

#[test]
fn a_folder_is_read_in_the_order_of_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for n in [10_u16, 9, 8, 12, 11] {
        let end = if n == 8 { "TIFF" } else { "tif" };
        one_page(&folder.path().join(format!("slice_{n}.{end}")), 2, &[n, n, n, n]);
    }
    std::fs::write(folder.path().join("notes.txt"), "no slice").unwrap();
    std::fs::write(folder.path().join("._slice_13.tif"), "what some systems leave").unwrap();
    let read = tiff::read(folder.path(), Some(1.0)).unwrap();
    assert_eq!(read.shape, [2, 2, 5]);
    let slices: Vec<f32> = read.values.chunks(4).map(|slice| slice[0]).collect();
    assert_eq!(slices, [8.0, 9.0, 10.0, 11.0, 12.0]);

    one_page(&folder.path().join("slice_13.tif"), 4, &[0; 4]);
    let error = tiff::read(folder.path(), Some(1.0)).unwrap_err().to_string();
    assert!(
        error.contains("slice_13.tif, page 1: 4 × 1 voxels, but the first page has 2 × 2"),
        "{error}"
    );
}

fn tagged(path: &Path, unit: ResolutionUnit, per_unit: [Rational; 2], description: &str) {
    let mut encoder = TiffEncoder::new(file(path)).unwrap();
    for _ in 0..2 {
        let mut image = encoder.new_image::<Gray8>(2, 2).unwrap();
        image.resolution_unit(unit);
        let [x, y] = per_unit.clone();
        image.x_resolution(x);
        image.y_resolution(y);
        image.encoder().write_tag(Tag::ImageDescription, description).unwrap();
        image.write_data(&[1, 2, 3, 4]).unwrap();
    }
}

#[test]
fn voxel_sizes_are_read_from_tags() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let ratio = |n, d| Rational { n, d };
    let size = |unit, x: Rational, y: Rational, description: &str| {
        tagged(&path, unit, [x, y], description);
        tiff::read(&path, None).map(|volume| volume.voxel_mm)
    };
    let near = |found: Result<f64, ImageError>, expected: f64| {
        let found = found.unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found}, not {expected}");
    };
    let (none, inch, cm) = (ResolutionUnit::None, ResolutionUnit::Inch, ResolutionUnit::Centimeter);
    near(size(cm, ratio(400, 1), ratio(400, 1), "scanned"), 0.025);
    near(size(inch, ratio(2540, 1), ratio(2540, 1), "scanned"), 0.01);
    let imagej = "ImageJ=1.53t\nimages=2\nslices=2\nunit=micron\nspacing=12.5\n";
    near(size(none, ratio(8, 100), ratio(8, 100), imagej), 0.0125);
    near(size(none, ratio(80, 1), ratio(80, 1), "ImageJ=1.5\nunit=mm\nspacing=0.0125"), 0.0125);

    let unlike =
        size(none, ratio(8, 100), ratio(8, 100), &imagej.replace("12.5", "25")).unwrap_err();
    assert!(matches!(unlike, ImageError::Anisotropic { .. }), "{unlike}");
    assert!(unlike.to_string().contains("0.0125 × 0.0125 × 0.025 mm"), "{unlike}");
    let unlike = size(cm, ratio(400, 1), ratio(200, 1), "");
    assert!(matches!(unlike, Err(ImageError::Anisotropic { .. })));
    // the spacing of slices may have a different unit
    let units = imagej.replace("12.5", "0.0125\nzunit=mm");
    near(size(none, ratio(8, 100), ratio(8, 100), &units), 0.0125);
    let screens = [72, 96, 150, 300, 600].map(|n| size(inch, ratio(n, 1), ratio(n, 1), ""));
    for unknown in screens.into_iter().chain([
        size(none, ratio(400, 1), ratio(400, 1), ""),
        // 300 pixels per inch, a default resolution
        size(cm, ratio(11_811, 100), ratio(11_811, 100), ""),
        size(none, ratio(72, 1), ratio(72, 1), "ImageJ=1.5\nunit=inch"),
        // voxels of 10 mm, 25.4 mm, 1 mm, 1 pm
        size(cm, ratio(1, 1), ratio(1, 1), ""),
        size(inch, ratio(1, 1), ratio(1, 1), ""),
        size(none, ratio(1, 1), ratio(1, 1), "ImageJ=1.5\nunit=mm"),
        size(none, ratio(1000, 1), ratio(1000, 1), "ImageJ=1.5\nunit=nm"),
        size(cm, ratio(0, 1), ratio(1, 0), ""),
        size(none, ratio(1, 1), ratio(1, 1), "ImageJ=1.5\nunit=pixel"),
    ]) {
        let error = unknown.unwrap_err();
        assert!(matches!(error, ImageError::NoVoxelSize { .. }), "{error}");
    }
    assert_eq!(tiff::read(&path, Some(0.5)).unwrap().voxel_mm, 0.5);
    assert!(matches!(tiff::read(&path, Some(-1.0)), Err(ImageError::Parameter { .. })));
}

#[test]
fn labels_are_read_back_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("labels.tif");
    for most in [7_u32, 65_535, 65_536, 4_000_000_000] {
        let values = (0..60).map(|n| if n == 31 { most } else { n % 7 }).collect();
        let labels = Volume::new(SHAPE, 0.012058, values).unwrap();
        tiff::write_labels(&path, &labels).unwrap();
        assert_eq!(tiff::read_labels(&path, None).unwrap(), labels);
        assert_eq!(tiff::read(&path, None).unwrap().shape, SHAPE);
    }
    // other programs can also read the voxel size
    let bytes = std::fs::read(&path).unwrap();
    let mut decoder = ::tiff::decoder::Decoder::new(Cursor::new(&bytes)).unwrap();
    assert_eq!(decoder.get_tag_u32(Tag::ResolutionUnit).unwrap(), 3);
    let description = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap();
    assert!(description.contains("unit=cm\nspacing=0.0012058\n"), "{description}");

    pages::<Gray32Float, _, _>(
        TiffEncoder::new(file(&path)).unwrap(),
        Compression::Uncompressed,
        |n| n as f32 / 2.0,
    );
    let error = tiff::read_labels(&path, Some(1.0)).unwrap_err().to_string();
    assert!(error.contains("page 1: voxel 1 has the value 0.5"), "{error}");
}

#[test]
fn errors_of_invalid_stacks_state_file_and_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let refused = || tiff::read(&path, Some(1.0)).unwrap_err().to_string();

    assert!(matches!(tiff::read(&path, Some(1.0)), Err(ImageError::Io { .. })));
    assert!(matches!(tiff::read(folder.path(), None), Err(ImageError::Empty { .. })));
    std::fs::write(&path, "").unwrap();
    assert!(refused().contains("stack.tif, page 1"), "{}", refused());
    std::fs::write(&path, "this is text, not an image").unwrap();
    assert!(refused().contains("TIFF signature"), "{}", refused());

    let mut encoder = TiffEncoder::new(file(&path)).unwrap();
    encoder.write_image::<RGB8>(1, 1, &[1, 2, 3]).unwrap();
    drop(encoder);
    assert!(refused().contains("page 1: its pixels are colours"), "{}", refused());

    let mut encoder = TiffEncoder::new(file(&path)).unwrap();
    let mut image = encoder.new_image::<Gray8>(2, 1).unwrap();
    image.encoder().write_tag(Tag::ImageDescription, "ImageJ=1.5\nimages=3\n").unwrap();
    image.write_data(&[1, 2]).unwrap();
    drop(encoder);
    assert!(refused().contains("has 1 page, but declares 3"), "{}", refused());

    let value = |n: usize| if n == 27 { f32::NAN } else { 1.0 };
    pages::<Gray32Float, _, _>(
        TiffEncoder::new(file(&path)).unwrap(),
        Compression::Uncompressed,
        value,
    );
    assert!(refused().contains("page 2: voxel 7 has the value NaN"), "{}", refused());

    let encoder = TiffEncoder::new(file(&path)).unwrap();
    pages::<Gray16, _, _>(encoder, Compression::Uncompressed, |n| n as u16);
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 3, 8, 40, whole.len() / 2, whole.len() - 7] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(refused().contains("stack.tif, page "), "{}", refused());
    }
}

/// Damaged files are rejected or read without a panic. Memory is bounded by the declared size, which is compared with
/// the length of the file.
#[test]
fn damaged_files_are_read_or_refused_in_bounded_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let kinds = [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Deflate(DeflateLevel::Fast),
        Compression::Packbits,
    ];
    let mut read = 0;
    for (kind, compression) in kinds.into_iter().enumerate() {
        for big in [false, true] {
            let mut whole = Cursor::new(Vec::new());
            if big {
                let encoder = TiffEncoder::new_big(&mut whole).unwrap();
                pages::<Gray32Float, _, _>(encoder, compression, |n| n as f32);
            } else {
                let encoder = TiffEncoder::new(&mut whole).unwrap();
                pages::<Gray16, _, _>(encoder, compression, |n| (n * kind) as u16);
            }
            let whole = whole.into_inner();
            for _ in 0..400 {
                let mut bytes = whole.clone();
                for _ in 0..rng.random_range(1..4) {
                    let at = rng.random_range(0..bytes.len());
                    bytes[at] = match rng.random_range(0..4) {
                        0 => 0,
                        1 => 0xff,
                        2 => bytes[at] ^ (1 << rng.random_range(0..8)),
                        _ => rng.random(),
                    };
                }
                if rng.random_bool(0.2) {
                    bytes.truncate(rng.random_range(0..bytes.len()));
                }
                std::fs::write(&path, &bytes).unwrap();
                if let Ok(volume) = tiff::read(&path, Some(1.0)) {
                    assert!(volume.values.len() <= 3000 * bytes.len());
                    read += 1;
                }
                let _ = tiff::read_labels(&path, None);
            }
        }
    }
    assert!(read > 100, "only {read} were read");
}
