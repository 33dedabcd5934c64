//! Tests of formats other than TIFF: raw values with headers, pictures, and formats that are recognised but not
//! supported.

use std::io::Write;
use std::path::Path;

use fem_image::{ImageError, ReadOptions, StackHeader, Volume, files_of, read, read_labels};
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

const SHAPE: [usize; 3] = [5, 4, 3];
const GIVEN: ReadOptions = ReadOptions { voxel_mm: Some(0.02), bin: 1, dataset: None };
const TAGS: ReadOptions = ReadOptions { voxel_mm: None, bin: 1, dataset: None };

fn value(n: usize) -> f64 {
    (n * 37 % 120) as f64
}

fn assert_values(volume: &Volume<f32>, shift: f64) {
    assert_eq!(volume.shape, SHAPE);
    for (n, &found) in volume.values.iter().enumerate() {
        assert_eq!(f64::from(found), value(n) + shift, "voxel {n}");
    }
}

/// Returns the test values in all number types: name of the type in MetaImage and in NRRD, the number added to the
/// values, and the bytes of the values.
fn types(is_big: bool) -> Vec<(&'static str, &'static str, f64, Vec<u8>)> {
    let all = |shift: f64, bytes: &dyn Fn(f64) -> Vec<u8>| -> Vec<u8> {
        (0..60)
            .flat_map(|n| {
                let mut bytes = bytes(value(n) + shift);
                if is_big {
                    bytes.reverse();
                }
                bytes
            })
            .collect()
    };
    vec![
        ("MET_UCHAR", "uint8", 0.0, all(0.0, &|v| vec![v as u8])),
        ("MET_CHAR", "int8", -60.0, all(-60.0, &|v| (v as i8).to_le_bytes().to_vec())),
        (
            "MET_USHORT",
            "unsigned short",
            40_000.0,
            all(40_000.0, &|v| (v as u16).to_le_bytes().to_vec()),
        ),
        ("MET_SHORT", "short", -9000.0, all(-9000.0, &|v| (v as i16).to_le_bytes().to_vec())),
        ("MET_UINT", "uint", 70_000.0, all(70_000.0, &|v| (v as u32).to_le_bytes().to_vec())),
        ("MET_INT", "int32", -70_000.0, all(-70_000.0, &|v| (v as i32).to_le_bytes().to_vec())),
        (
            "MET_LONG_LONG",
            "int64",
            -70_000.0,
            all(-70_000.0, &|v| (v as i64).to_le_bytes().to_vec()),
        ),
        ("MET_FLOAT", "float", 0.5, all(0.5, &|v| (v as f32).to_le_bytes().to_vec())),
        ("MET_DOUBLE", "double", 0.25, all(0.25, &|v| v.to_le_bytes().to_vec())),
    ]
}

fn packed(bytes: &[u8], gzip: bool) -> Vec<u8> {
    if gzip {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        return encoder.finish().unwrap();
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn metaimage_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (header, raw) = (folder.path().join("scan.mhd"), folder.path().join("scan.raw"));
    for is_big in [false, true] {
        for (name, _, shift, bytes) in types(is_big) {
            for (is_packed, skipped) in [(false, 0), (false, 7), (true, 0)] {
                let start = format!(
                    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = {}\nCompressedData = {}\n\
                     DimSize = 5 4 3\nElementSpacing = 0.0125 0.0125 0.0125\nElementType = {name}\n",
                    if is_big { "True" } else { "False" },
                    if is_packed { "True" } else { "False" },
                );
                let bytes = if is_packed { packed(&bytes, false) } else { bytes.clone() };
                let mut file = vec![0xee; skipped];
                file.extend(&bytes);
                std::fs::write(&raw, &file).unwrap();
                for skip in [skipped.to_string(), "-1".to_owned()] {
                    if is_packed && skip == "-1" {
                        continue;
                    }
                    let text = format!("{start}HeaderSize = {skip}\nElementDataFile = scan.raw\n");
                    std::fs::write(&header, text).unwrap();
                    let reading = read(&header, &TAGS).unwrap();
                    assert_values(&reading.volume, shift);
                    assert_eq!(reading.volume.voxel_mm, 0.0125);
                }
                // values in the same file, after the header
                let own = folder.path().join("scan.mha");
                let mut all = format!("{start}ElementDataFile = LOCAL\n").into_bytes();
                all.extend(&bytes);
                std::fs::write(&own, all).unwrap();
                assert_values(&read(&own, &TAGS).unwrap().volume, shift);
            }
        }
    }
    assert_eq!(files_of(&header), [header.clone(), raw.clone()]);
    assert_eq!(files_of(&folder.path().join("scan.mha")).len(), 1);
    let words = read(&header, &TAGS).unwrap().header.in_words();
    for part in [
        "MetaImage, values in scan.raw (compressed), 64-bit floating",
        "0.012500 mm (ElementSpacing of the header, in mm)",
    ] {
        assert!(words.contains(part), "{words}");
    }
    // a folder with one header and its values
    std::fs::remove_file(folder.path().join("scan.mha")).unwrap();
    assert_eq!(read(folder.path(), &TAGS).unwrap().volume.shape, SHAPE);
}

#[test]
fn nrrd_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (own, header, raw) = (
        folder.path().join("scan.nrrd"),
        folder.path().join("scan.nhdr"),
        folder.path().join("scan.raw"),
    );
    for is_big in [false, true] {
        for (_, name, shift, bytes) in types(is_big) {
            for encoding in ["raw", "gzip"] {
                let start = format!(
                    "NRRD0004\n# comment\ntype: {name}\ndimension: 3\nsizes: 5 4 3\nencoding: {encoding}\nendian: {}\n\
                     space dimension: 3\nspace units: \"um\" \"um\" \"um\"\nspace directions: (0,12.5,0) (12.5,0,0) (0,0,-12.5)\n\
                     scanner:=CT\n",
                    if is_big { "big" } else { "little" }
                );
                let bytes = if encoding == "gzip" { packed(&bytes, true) } else { bytes.clone() };
                let mut all = format!("{start}\n").into_bytes();
                all.extend(&bytes);
                std::fs::write(&own, all).unwrap();
                std::fs::write(&raw, &bytes).unwrap();
                std::fs::write(&header, format!("{start}data file: scan.raw\n")).unwrap();
                for path in [&own, &header] {
                    let reading = read(path, &TAGS).unwrap();
                    assert_values(&reading.volume, shift);
                    assert!((reading.volume.voxel_mm / 0.0125 - 1.0).abs() < 1e-12);
                }
            }
        }
    }
    assert_eq!(files_of(&header), [header.clone(), raw]);
    let words = StackHeader::read(&own, &TAGS).unwrap().in_words();
    assert!(words.contains("NRRD, values in scan.nrrd (compressed)"), "{words}");

    let size = |lines: &str| {
        let start = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 2\nencoding: raw\n";
        std::fs::write(&own, format!("{start}{lines}\n\nab")).unwrap();
        StackHeader::read(&own, &TAGS).map(|header| header.voxel_mm)
    };
    assert_eq!(size("spacings: 0.3 0.3 0.3\nspace: left-posterior-superior").unwrap(), 0.3);
    assert!(matches!(
        size("spacings: 0.3 0.3 0.4\nspace: LPS"),
        Err(ImageError::Anisotropic { .. })
    ));
    for unknown in [
        "spacings: 0.3 0.3 0.3",
        "spacings: 1 1 1\nspace: LPS",
        "spacings: 3 3 3\nspace units: px px px",
        "content: none",
    ] {
        let error = size(unknown).unwrap_err();
        assert!(matches!(error, ImageError::NoVoxelSize { .. }), "{unknown}: {error}");
    }
}

#[test]
fn errors_of_invalid_headers_state_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let header = folder.path().join("scan.mhd");
    std::fs::write(folder.path().join("scan.raw"), [0; 60]).unwrap();
    let good = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementSpacing = 1e-2 1e-2 1e-2\nElementDataFile = scan.raw\n";
    std::fs::write(&header, good).unwrap();
    assert_eq!(read(&header, &TAGS).unwrap().volume.shape, SHAPE);
    for (from, to, part) in [
        ("5 4 3", "5 4", "scan.mhd:2: DimSize = 5 4 is not a volume"),
        ("5 4 3", "5 4 x", "scan.mhd:2: DimSize = 5 4 x is not a list of numbers"),
        ("5 4 3", "5 4 4", "scan.raw: has 60 bytes of values, but scan.mhd declares 80"),
        ("5 4 3", "5 4 2", "scan.raw: has 60 bytes of values, but scan.mhd declares 40"),
        ("5 4 3", "5 0 3", "declares [5, 0, 3] voxels"),
        ("5 4 3", "18446744073709551615 3 3", "declares [18446744073709551615, 3, 3] voxels"),
        ("MET_UCHAR", "MET_RGB", "scan.mhd:3: ElementType = MET_RGB"),
        ("MET_UCHAR", "MET_USHORT", "declares 120 (5 × 4 × 3 16-bit"),
        ("NDims = 3", "NDims = 2", "scan.mhd:1: NDims = 2"),
        ("NDims = 3", "NDims = 3\nElementNumberOfChannels = 3", "scan.mhd:2: 3 channels"),
        ("NDims = 3", "NDims = 3\nBinaryData = False", "scan.mhd:2: the values are text"),
        ("NDims = 3", "NDims = 3\nHeaderSize = many", "scan.mhd:2: HeaderSize = many"),
        ("NDims = 3", "NDims = 3\nsomething", "scan.mhd:2: 'something' is not a line"),
        (
            "scan.raw",
            "slice%03d.raw",
            "scan.mhd:5: ElementDataFile = slice%03d.raw names several files",
        ),
        ("scan.raw", "other.raw", "cannot read"),
        ("ElementDataFile = scan.raw", "", "ElementDataFile is missing"),
        ("ElementType = MET_UCHAR\n", "", "ElementType is missing"),
        // default spacings that MetaIO writes if the spacing is unknown
        ("1e-2 1e-2 1e-2", "1 1 1", "voxels of 1 × 1 × 1 mm"),
        ("ElementSpacing = 1e-2 1e-2 1e-2\n", "", "no ElementSpacing"),
    ] {
        std::fs::write(&header, good.replace(from, to)).unwrap();
        let error = read(&header, &TAGS).unwrap_err().to_string();
        assert!(error.contains(part), "{to}: {error}");
    }
    let packed_header = good.replace("NDims = 3", "NDims = 3\nCompressedData = True");
    std::fs::write(&header, packed_header).unwrap();
    std::fs::write(folder.path().join("scan.raw"), packed(&[0; 50], false)).unwrap();
    let error = read(&header, &TAGS).unwrap_err().to_string();
    assert!(error.contains("50 bytes unpacked, but the header declares 60"), "{error}");

    let nrrd = folder.path().join("scan.nrrd");
    let good = "NRRD0004\ntype: uint16\nsizes: 1 1 2\nencoding: raw\nendian: little\n\nabcd";
    std::fs::write(&nrrd, good).unwrap();
    assert_eq!(read(&nrrd, &GIVEN).unwrap().volume.shape, [1, 1, 2]);
    for (from, to, part) in [
        ("1 1 2", "2 1 1 2", "scan.nrrd:3: sizes = 2 1 1 2 is not a volume"),
        ("uint16", "block", "scan.nrrd:2: type: block"),
        ("raw", "bzip2", "scan.nrrd:4: the encoding bzip2"),
        ("endian: little\n", "", "endian is missing"),
        ("endian: little", "endian: middle", "scan.nrrd:5: endian: middle"),
        ("abcd", "abc", "has 3 bytes of values"),
        ("\n\nabcd", "\n", "no empty line ends the header"),
        ("endian", "line skip: 2\nendian", "line skip 2"),
    ] {
        std::fs::write(&nrrd, good.replace(from, to)).unwrap();
        let error = read(&nrrd, &GIVEN).unwrap_err().to_string();
        assert!(error.contains(part), "{to}: {error}");
    }
}

fn png(
    path: &Path,
    colour: png::ColorType,
    depth: png::BitDepth,
    per_metre: Option<u32>,
    data: &[u8],
) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 5, 4);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == png::ColorType::Indexed {
        encoder.set_palette((0..=255_u8).flat_map(|n| [n; 3]).collect::<Vec<_>>());
    }
    let unit = png::Unit::Meter;
    encoder.set_pixel_dims(per_metre.map(|n| png::PixelDimensions { xppu: n, yppu: n, unit }));
    encoder.write_header().unwrap().write_image_data(data).unwrap();
}

#[test]
fn png_slices_are_read() {
    use png::{BitDepth, ColorType};
    let folder = tempfile::tempdir().unwrap();
    let slice = |z: usize| folder.path().join(format!("s{z}.png"));
    let greys = |z: usize| (20 * z..20 * (z + 1)).map(value);
    for (colour, depth, shift) in [
        (ColorType::Grayscale, BitDepth::Eight, 0.0),
        (ColorType::Grayscale, BitDepth::Sixteen, 30_000.0),
        (ColorType::Rgb, BitDepth::Eight, 0.0),
        (ColorType::Rgb, BitDepth::Sixteen, 500.0),
        (ColorType::Indexed, BitDepth::Eight, 0.0),
    ] {
        for z in 0..3 {
            let count = if colour == ColorType::Rgb { 3 } else { 1 };
            let bytes = |v: f64| match depth {
                BitDepth::Sixteen => ((v + shift) as u16).to_be_bytes().to_vec(),
                _ => vec![v as u8],
            };
            let data: Vec<u8> = greys(z).flat_map(|v| bytes(v).repeat(count)).collect();
            png(&slice(z), colour, depth, Some(40_000), &data);
        }
        let reading = read(folder.path(), &TAGS).unwrap();
        assert_values(&reading.volume, shift);
        assert!((reading.volume.voxel_mm / 0.025 - 1.0).abs() < 1e-9);
        let words = reading.header.in_words();
        assert!(words.contains("3 PNG files, s0.png to s2.png by their numbers"), "{words}");
    }
    assert_eq!(read_labels(folder.path(), &TAGS).unwrap().volume.values[1], 37);

    let refused = |options| read(folder.path(), options).unwrap_err().to_string();
    for (colour, depth, per_metre, data, part) in [
        (
            ColorType::Grayscale,
            BitDepth::Sixteen,
            Some(40_000),
            vec![0; 40],
            "s1.png, page 1: 16-bit",
        ),
        (ColorType::Rgba, BitDepth::Eight, Some(40_000), vec![0; 80], "transparency"),
        (ColorType::Grayscale, BitDepth::Four, None, vec![0; 12], "4 bits per voxel"),
    ] {
        png(&slice(1), colour, depth, per_metre, &data);
        assert!(refused(&TAGS).contains(part), "{}", refused(&TAGS));
    }
    let coloured: Vec<u8> = (0..60).collect();
    png(&slice(1), ColorType::Rgb, BitDepth::Eight, None, &coloured);
    assert!(
        refused(&TAGS).contains("s1.png, page 1: pixel 0 has the colours 0, 1, 2"),
        "{}",
        refused(&TAGS)
    );
    // files without a resolution, and with default resolutions of screens and printers
    for per_metre in [None, Some(2835), Some(11_811)] {
        (0..3).for_each(|z| {
            png(&slice(z), ColorType::Grayscale, BitDepth::Eight, per_metre, &[7; 20])
        });
        let error = read(folder.path(), &TAGS).unwrap_err();
        assert!(matches!(error, ImageError::NoVoxelSize { .. }), "{error}");
    }
    let whole = std::fs::read(slice(2)).unwrap();
    std::fs::write(slice(2), &whole[..whole.len() / 2]).unwrap();
    assert!(refused(&GIVEN).contains("s2.png, page 1"), "{}", refused(&GIVEN));
}

/// Writes a bitmap of 5 × 4 pixels.
fn bmp(path: &Path, bits: u16, is_upward: bool, grey: impl Fn(usize) -> u8) {
    let row = (5 * usize::from(bits / 8)).next_multiple_of(4);
    let palette = if bits == 8 { 1024 } else { 0 };
    let offset = 54 + palette;
    let mut out = b"BM".to_vec();
    let long = |out: &mut Vec<u8>, value: i32| out.extend(value.to_le_bytes());
    long(&mut out, (offset + 4 * row) as i32);
    long(&mut out, 0);
    long(&mut out, offset as i32);
    long(&mut out, 40);
    long(&mut out, 5);
    long(&mut out, if is_upward { 4 } else { -4 });
    out.extend(1_u16.to_le_bytes());
    out.extend(bits.to_le_bytes());
    [0, (4 * row) as i32, 40_000, 40_000, 0, 0].into_iter().for_each(|value| long(&mut out, value));
    // the palette is inverted, so that an index differs from its grey value
    (0..palette / 4).for_each(|n| out.extend([255 - n as u8, 255 - n as u8, 255 - n as u8, 0]));
    for n in 0..4 {
        let y = if is_upward { 3 - n } else { n };
        let start = out.len();
        for x in 0..5 {
            let grey = grey(x + 5 * y);
            match bits {
                8 => out.push(255 - grey),
                _ => out.extend(vec![grey; usize::from(bits / 8)]),
            }
        }
        out.resize(start + row, 0);
    }
    std::fs::write(path, out).unwrap();
}

#[test]
fn bitmaps_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let slice = |z: usize| folder.path().join(format!("s{z}.bmp"));
    for bits in [8, 24, 32] {
        for is_upward in [false, true] {
            (0..3).for_each(|z| bmp(&slice(z), bits, is_upward, |n| value(n + 20 * z) as u8));
            let reading = read(folder.path(), &TAGS).unwrap();
            assert_values(&reading.volume, 0.0);
            assert!((reading.volume.voxel_mm / 0.025 - 1.0).abs() < 1e-9);
        }
    }
    let whole = std::fs::read(slice(1)).unwrap();
    for (at, value, part) in
        [(28, 4, "4 bits per pixel"), (30, 1, "compressed"), (18, 9, "its header declares")]
    {
        let mut bytes = whole.clone();
        bytes[at] = value;
        std::fs::write(slice(1), bytes).unwrap();
        let error = read(folder.path(), &TAGS).unwrap_err().to_string();
        assert!(error.contains("s1.bmp, page 1") && error.contains(part), "{error}");
    }
}

#[test]
fn errors_of_unsupported_formats_describe_the_conversion() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.dat");
    let at = |offset: usize, magic: &[u8]| {
        let mut bytes = vec![0; 400];
        bytes[offset..offset + magic.len()].copy_from_slice(magic);
        bytes
    };
    let mut nifti = at(344, b"n+1\0");
    nifti[..4].copy_from_slice(&348_i32.to_le_bytes());
    let ole = at(0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1");
    for (bytes, format, help) in [
        (ole, "OLE file (Zeiss TXM or TXRM)", "TIFF stack"),
        (at(128, b"DICM"), "DICOM", "Image Sequence"),
        (packed(&nifti, true), "NIfTI", "nibabel"),
        (nifti, "NIfTI", "nibabel"),
        (at(0, b"\xff\xd8\xff\xe0"), "JPEG", "changes grey values"),
        (at(0, b"\0\0\0\x0cjP  \r\n\x87\n"), "JPEG", "changes grey values"),
        (at(0, b"# AmiraMesh BINARY-LITTLE-ENDIAN 2.1"), "Amira", "3D TIFF"),
        (
            b"{volume1}\n[representation]\nsize = 10 10 10\n".to_vec(),
            "VGI",
            "ElementDataFile = scan.vol",
        ),
        (at(0, b"\x93NUMPY"), "NumPy", "numpy.load"),
        (at(0, b"MATLAB 5.0 MAT-file"), "MATLAB", "loadmat"),
        (at(0, b"CDF\x01"), "netCDF", "netcdf_file"),
        (at(0, b"CTDATA-HEADER_V1"), "Scanco ISQ", "Tiff"),
        (at(208, b"MAP "), "MRC", "mrcfile"),
        (at(0, b"SIMPLE  ="), "FITS", "astropy"),
        (at(0, b"ZISRAWFILE"), "CZI", "Fiji"),
        (at(0, b"# vtk DataFile Version 3.0"), "VTK", "MetaImage"),
        (at(0, b"<VTKFile type=\"ImageData\">"), "VTK", "MetaImage"),
        (at(0, b"GIF89a"), "GIF", "TIFF or PNG"),
        (at(0, b"PK\x03\x04"), "ZIP", "unpack"),
        (packed(b"text", true), "gzip", "gunzip"),
        (at(0, b"\xfd7zXZ\0"), "xz", "unxz"),
        (at(257, b"ustar"), "TAR", "unpack"),
        (b"{\nHeaderID = EH:1;\nDim_1 = 10 ;\n}".to_vec(), "EDF", "fabio"),
        (vec![7; 300], "an unknown format", "ElementDataFile = scan.dat"),
        (Vec::new(), "an unknown format", "need a header"),
    ] {
        std::fs::write(&path, &bytes).unwrap();
        for error in
            [read(&path, &GIVEN).unwrap_err(), StackHeader::read(&path, &GIVEN).unwrap_err()]
        {
            assert!(matches!(error, ImageError::Format { .. }), "{error}");
            let error = error.to_string();
            assert!(
                error.contains("scan.dat") && error.contains(format) && error.contains(help),
                "{error}"
            );
        }
        // a folder of such files
        if !format.contains("unknown") {
            let error = read(folder.path(), &GIVEN).unwrap_err().to_string();
            assert!(error.contains(format), "{error}");
        }
    }
    std::fs::remove_file(&path).unwrap();
    std::fs::write(folder.path().join(".zarray"), "{}").unwrap();
    let error = read(folder.path(), &GIVEN).unwrap_err().to_string();
    assert!(error.contains("Zarr") && error.contains("zarr.open"), "{error}");
    assert!(matches!(read(&path, &GIVEN), Err(ImageError::Io { .. })));
    // a damaged file named `.tif` is read as TIFF
    let path = folder.path().join("scan.tif");
    std::fs::write(&path, "this is text, not an image").unwrap();
    assert!(read(&path, &GIVEN).unwrap_err().to_string().contains("TIFF signature"));
}

#[test]
fn blocks_of_other_formats_are_averaged() {
    let folder = tempfile::tempdir().unwrap();
    let header = folder.path().join("scan.mhd");
    let bytes: Vec<u8> = (0..64).collect();
    std::fs::write(folder.path().join("scan.raw"), packed(&bytes, false)).unwrap();
    let text = "NDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nCompressedData = True\nElementSpacing = 0.01 0.01 0.01\nElementDataFile = scan.raw\n";
    std::fs::write(&header, text).unwrap();
    let reading = read(&header, &ReadOptions { bin: 2, ..TAGS }).unwrap();
    assert_eq!((reading.volume.shape, reading.volume.voxel_mm), ([2; 3], 0.02));
    // the block contains the values 0, 1, 4, 5, and in the next slice these values plus 16; the mean is 10.5
    assert_eq!(reading.volume.values[0], 10.5);
    assert_eq!(reading.header.shape, [2; 3]);
    assert!(reading.header.in_words().contains("after binning by 2"));
}
