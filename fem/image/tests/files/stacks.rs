//! Tests of stacks that do not form one volume, and of the descriptions of stacks in words.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use ::tiff::encoder::TiffEncoder;
use ::tiff::encoder::colortype::{Gray8, Gray16};
use ::tiff::tags::{ResolutionUnit, Tag};
use fem_image::{ImageError, ReadOptions, StackHeader, read, read_labels};

const GIVEN: ReadOptions = ReadOptions { voxel_mm: Some(0.02), bin: 1, dataset: None };

/// Writes pages of 3 × 2 voxels with a resolution of 400 pixels per centimetre; the value of a voxel is the page
/// number, and the first page has a description.
fn pages(path: &Path, count: u16, description: &str) {
    let mut encoder = TiffEncoder::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    for page in 0..count {
        let mut image = encoder.new_image::<Gray16>(3, 2).unwrap();
        image.resolution(ResolutionUnit::Centimeter, ::tiff::encoder::Rational { n: 400, d: 1 });
        if page == 0 && !description.is_empty() {
            image.encoder().write_tag(Tag::ImageDescription, description).unwrap();
        }
        image.write_data(&[page; 6]).unwrap();
    }
}

fn ome(sizes: [usize; 3], physical: &str) -> String {
    let [z, c, t] = sizes;
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\">\
         <Image ID=\"Image:0\"><Pixels ID=\"Pixels:0\" DimensionOrder=\"XYZCT\" Type=\"uint16\" SizeX=\"3\" SizeY=\"2\" \
         SizeZ=\"{z}\" SizeC=\"{c}\" SizeT=\"{t}\" {physical}><TiffData/></Pixels></Image></OME>"
    )
}

#[test]
fn a_single_volume_is_read_and_several_volumes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    let imagej = |images: usize, dimensions: &str| {
        format!("ImageJ=1.54f\nimages={images}\n{dimensions}\nunit=mm\nspacing=0.02\n")
    };
    for (count, description, expected) in [
        (6, imagej(6, "slices=6"), Ok(0)),
        // if a file has a single dimension, its entries are the slices, even if the dimension is named frames or
        // channels
        (6, imagej(6, "frames=6"), Ok(1)),
        (6, imagej(6, "channels=6"), Ok(1)),
        (
            6,
            imagej(6, "channels=2\nslices=3\nhyperstack=true"),
            Err("2 channels × 3 slices × 1 times"),
        ),
        (6, imagej(6, "slices=3\nframes=2"), Err("1 channels × 3 slices × 2 times")),
        (6, imagej(10, "slices=10"), Err("has 6 pages, but declares 10")),
        (6, ome([6, 1, 1], ""), Ok(0)),
        (6, ome([3, 2, 1], ""), Err("2 channels × 3 slices × 1 times")),
        (6, ome([3, 1, 2], ""), Err("1 channels × 3 slices × 2 times")),
        (5, ome([6, 1, 1], ""), Err("has 5 pages, but declares 6")),
        (6, ome([6, 1, 1], "").replace("</OME>", "<Image ID=\"Image:1\"/></OME>"), Err("2 images")),
        (6, "<OME <".to_owned(), Err("OME description cannot be read")),
        (6, "{\"shape\": [6, 2, 3]}".to_owned(), Ok(0)),
        (6, "{\"shape\": [2, 3, 2, 3], \"truncated\": true}".to_owned(), Err("shape [2, 3, 2, 3]")),
    ] {
        pages(&path, count, &description);
        match (read(&path, &GIVEN), expected) {
            (Ok(reading), Ok(warnings)) => {
                assert_eq!(reading.volume.shape, [3, 2, 6], "{description}");
                let found = &reading.header.warnings;
                // only warnings about dimensions count: a voxel size that differs from the resolution causes another
                // warning
                let found = found.iter().filter(|text| text.contains("declares them as"));
                assert_eq!(found.count(), warnings, "{description}");
            }
            (Err(error @ ImageError::Series { .. }), Err(part)) => {
                let error = error.to_string();
                assert!(error.contains(part) && error.contains("stack.tif"), "{error}");
            }
            (other, _) => panic!("{description}: {other:?}"),
        }
    }
}

#[test]
fn the_spacing_of_slices_is_part_of_the_voxel_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.ome.tif");
    let size = |physical: &str| {
        pages(&path, 6, &ome([6, 1, 1], physical));
        StackHeader::read(&path, &ReadOptions::default()).map(|header| header.voxel_mm)
    };
    let edges =
        |x: &str, y: &str, z: &str| format!("PhysicalSizeX=\"{x}\" PhysicalSizeY=\"{y}\" {z}");
    assert_eq!(size(&edges("12.5", "12.5", "PhysicalSizeZ=\"12.5\"")).unwrap(), 0.0125);
    let mm = "PhysicalSizeXUnit=\"mm\" PhysicalSizeYUnit=\"mm\" PhysicalSizeZ=\"12.5\" PhysicalSizeZUnit=\"&#181;m\"";
    assert_eq!(size(&edges("0.0125", "0.0125", mm)).unwrap(), 0.0125);
    let error = size(&edges("12.5", "12.5", "PhysicalSizeZ=\"50\"")).unwrap_err();
    assert!(matches!(error, ImageError::Anisotropic { .. }), "{error}");
    let message = error.to_string();
    for part in [
        "stack.ome.tif",
        "0.0125 × 0.0125 × 0.05 mm (0.05 mm from slice to slice, along z)",
        "cubes of 0.0125 mm",
        "zoom(image, (4, 1, 1), order=1)",
        "voxel_mm",
    ] {
        assert!(message.contains(part), "{message}");
    }
    for unknown in [
        "",
        "PhysicalSizeX=\"12.5\"",
        &edges("12.5", "12.5", "PhysicalSizeXUnit=\"pixel\""),
        &edges("5000", "5000", ""),
    ] {
        let error = size(unknown).unwrap_err();
        assert!(matches!(error, ImageError::NoVoxelSize { .. }), "{error}");
    }
}

/// Writes the slices `order` of a noisy image of a cylinder with small grains, in air and in the frame of a
/// reconstruction. The blur of the ends extends over four slices. `scale` is applied to the slices from number 20 (from
/// 0).
fn write_scan(path: &Path, order: impl Iterator<Item = usize>, scale: f64) {
    let side = 48;
    let mut encoder = TiffEncoder::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    let profile = |z: usize| match z.min(39 - z) {
        0..3 => 0.0,
        3 => 0.01,
        4 => 0.22,
        5 => 0.78,
        6 => 0.99,
        _ => 1.0,
    };
    // reproducible random numbers from 0 to 1
    let random = |n: usize| {
        let hash = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let hash = (hash ^ (hash >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((hash ^ (hash >> 32)) % 4001) as f64 / 4000.0
    };
    let balls: Vec<[f64; 3]> =
        (0..240).map(|n| [0, 1, 2].map(|k| 40.0 * random(1_000_000 + 3 * n + k) - 20.0)).collect();
    for z in order {
        let noise = |n: usize| 4000.0 * random(z * side * side + n) - 2000.0;
        let grey = |n: usize| {
            let [x, y] = [n % side, n / side].map(|c| c as f64 - 23.5);
            let off = x.hypot(y);
            if off > 23.4 {
                return 0;
            }
            let at = [x, y, z as f64 - 19.5];
            let square = |ball: &[f64; 3]| (0..3).map(|k| (at[k] - ball[k]).powi(2)).sum::<f64>();
            let is_grain = balls.iter().any(|ball| square(ball) < 9.0);
            let inside = if off < 20.0 { profile(z) } else { 0.0 };
            let material = if is_grain { 36_000.0 } else { 20_000.0 };
            let grey = 8000.0 + inside * material + noise(n);
            (if z < 20 { grey } else { scale * grey }) as u16
        };
        let slice: Vec<u16> = (0..side * side).map(grey).collect();
        encoder.write_image::<Gray16>(side as u32, side as u32, &slice).unwrap();
    }
}

/// The blurred ends of a specimen do not look like a change of the grey scale, and the frame of a reconstruction does
/// not hide the difference between slices of air and slices of the specimen.
#[test]
fn the_continuity_of_a_stack_is_checked_when_the_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.tif");
    let warnings = |order: &mut dyn Iterator<Item = usize>, scale: f64| {
        write_scan(&path, order, scale);
        let mut warnings = read(&path, &GIVEN).unwrap().header.warnings;
        warnings.retain(|text| !text.contains("voxel_mm"));
        warnings
    };
    assert_eq!(warnings(&mut (0..40), 1.0), Vec::<String>::new());
    for (found, part) in [
        (warnings(&mut (0..40), 1.1), "after slice 20 grey values are multiplied by 1.1"),
        (warnings(&mut (0..80).map(|k| k / 2), 1.0), "every slice is stored 2 times"),
        (
            warnings(&mut (0..16).chain(22..40), 1.0),
            "slices 16 and 17 differ as slices elsewhere that are",
        ),
    ] {
        assert!(found.len() == 1 && found[0].contains(part), "{found:?}, not {part}");
    }
}

#[test]
fn a_stack_behind_one_page_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.tif");
    pages(&path, 1, "ImageJ=1.54f\nimages=4\nslices=4\nunit=mm\nspacing=0.025\n");
    // ImageJ writes the values of all slices after the values of the first slice
    let one = std::fs::read(&path).unwrap();
    let mut decoder = ::tiff::decoder::Decoder::new(std::io::Cursor::new(&one)).unwrap();
    let offset = decoder.get_tag_u64_vec(Tag::StripOffsets).unwrap()[0];
    // the encoder writes the directory after the values, where ImageJ would write further values: the test moves the
    // values to the end
    let mut bytes = one.clone();
    let moved = bytes.len() as u32;
    let entry =
        one.windows(8).position(|w| w[..2] == [0x11, 1] && w[4..8] == [1, 0, 0, 0]).unwrap();
    assert_eq!(
        u64::from(u32::from_le_bytes(one[entry + 8..entry + 12].try_into().unwrap())),
        offset
    );
    bytes[entry + 8..entry + 12].copy_from_slice(&moved.to_le_bytes());
    (0..4_u16).for_each(|page| (0..6).for_each(|_| bytes.extend((10 * page).to_le_bytes())));
    std::fs::write(&path, &bytes).unwrap();
    let reading = read(&path, &GIVEN).unwrap();
    assert_eq!(reading.volume.shape, [3, 2, 4]);
    assert!(reading.volume.values.iter().enumerate().all(|(n, &v)| v == (10 * (n / 6)) as f32));
    std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    let error = read(&path, &GIVEN).unwrap_err().to_string();
    assert!(error.contains("has 1 page, but declares 4"), "{error}");
}

#[test]
fn folders_are_one_series_of_one_type() {
    let folder = tempfile::tempdir().unwrap();
    let name = |n: i32| folder.path().join(format!("z{n:+}.tif"));
    for n in -3..4 {
        pages(&name(n), 1, "");
        let mut encoder = TiffEncoder::new(File::create(name(n)).unwrap()).unwrap();
        encoder.write_image::<Gray16>(3, 2, &[(n + 100) as u16; 6]).unwrap();
    }
    let reading = read(folder.path(), &GIVEN).unwrap();
    let slices: Vec<f32> = reading.volume.values.chunks(6).map(|slice| slice[0]).collect();
    assert_eq!(slices, [97.0, 98.0, 99.0, 100.0, 101.0, 102.0, 103.0]);
    let words = reading.header.in_words();
    for part in [
        "7 TIFF files, z-3.tif to z+3.tif by their numbers",
        "16-bit unsigned",
        "3 × 2 × 7 voxels of 0.020000 mm (voxel_mm as given)",
    ] {
        assert!(words.contains(part), "{words}");
    }
    assert_eq!(reading.header.files.len(), 7);
    assert_eq!(read_labels(folder.path(), &GIVEN).unwrap().volume.values[6], 98);

    let refused = || read(folder.path(), &GIVEN).unwrap_err().to_string();
    let copy = folder.path().join("z+2 (1).tif");
    std::fs::copy(name(2), &copy).unwrap();
    assert!(refused().contains("one series") && refused().contains("z+2 (1).tif"), "{}", refused());
    std::fs::remove_file(copy).unwrap();

    let mut encoder = TiffEncoder::new(File::create(name(1)).unwrap()).unwrap();
    encoder.write_image::<Gray8>(3, 2, &[101; 6]).unwrap();
    drop(encoder);
    assert!(
        refused()
            .contains("z+1.tif, page 1: 8-bit unsigned integers, but the first page has 16-bit"),
        "{}",
        refused()
    );

    std::fs::remove_file(name(1)).unwrap();
    assert!(refused().contains("z+0.tif is followed by z+2.tif"), "{}", refused());

    // the parent of the folder of slices
    let above = tempfile::tempdir().unwrap();
    std::fs::create_dir(above.path().join("slices")).unwrap();
    let error = read(above.path(), &GIVEN).unwrap_err().to_string();
    assert!(error.contains("the folder contains no slice, only the folders slices"), "{error}");
}

#[test]
fn each_file_of_a_set_declares_the_pages_of_the_whole_set() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..3 {
        pages(&folder.path().join(format!("s{n}.ome.tif")), 1, &ome([3, 1, 1], ""));
    }
    assert_eq!(read(folder.path(), &GIVEN).unwrap().volume.shape, [3, 2, 3]);
    let error = read(&folder.path().join("s1.ome.tif"), &GIVEN).unwrap_err().to_string();
    assert!(error.contains("has 1 page, but declares 3") && error.contains("folder"), "{error}");
    std::fs::remove_file(folder.path().join("s2.ome.tif")).unwrap();
    let error = read(folder.path(), &GIVEN).unwrap_err().to_string();
    assert!(error.contains("has 1 page, but declares 3"), "{error}");
}

#[test]
fn doubtful_stacks_cause_warnings() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..5 {
        pages(&folder.path().join(format!("s{:03}.tif", 2 * n)), 1, "");
    }
    std::fs::write(folder.path().join("notes.txt"), "scanned in May").unwrap();
    let mut preview = File::create(folder.path().join("preview.png")).unwrap();
    preview.write_all(b"\x89PNG\r\n\x1a\n").unwrap();
    let reading = read(folder.path(), &GIVEN).unwrap();
    let warnings = reading.header.warnings.join("\n");
    for part in [
        "steps of 2",
        "ignored images of the folder: 1 PNG",
        "voxel_mm = 0.02, but",
        "0.025 × 0.025 × 0.025 mm",
    ] {
        assert!(warnings.contains(part), "{warnings}");
    }
    let tags = ReadOptions::default();
    let header = StackHeader::read(folder.path(), &tags).unwrap();
    assert_eq!(header.voxel_mm, 0.025);
    assert!(header.voxel_origin.contains("TIFF tags"), "{}", header.voxel_origin);

    // noise with one blank page
    let path = folder.path().join("stack.tif");
    let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
    for page in 0..12_usize {
        let noise = |n: usize| ((n + 4096 * page).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 54) as u16;
        let values =
            (0..4096).map(|n| if page == 6 { 0 } else { 9000 + noise(n) }).collect::<Vec<_>>();
        encoder.write_image::<Gray16>(64, 64, &values).unwrap();
    }
    drop(encoder);
    let warnings = read(&path, &GIVEN).unwrap().header.warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("slice 7 differs"), "{warnings:?}");
}
