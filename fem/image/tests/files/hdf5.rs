//! Tests of HDF5 volumes in files written by h5py (`hdf5/write.py`).

use std::path::{Path, PathBuf};

use fem_image::{ImageError, ReadOptions, StackHeader, read, read_label_values};

const SHAPE: [usize; 3] = [5, 3, 4];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files/hdf5").join(name)
}

fn dataset(name: &str) -> ReadOptions {
    ReadOptions { voxel_mm: Some(0.02), bin: 1, dataset: Some(name.into()) }
}

/// Returns the values of the test volumes, x + 10 y + 100 z, transformed by `value`.
fn expected(value: impl Fn(f32) -> f32) -> Vec<f32> {
    let [nx, ny, nz] = SHAPE;
    let at = |n: usize| n % nx + 10 * (n / nx % ny) + 100 * (n / (nx * ny));
    (0..nx * ny * nz).map(|n| value(at(n) as f32)).collect()
}

#[test]
fn the_only_volume_of_a_file_is_read_with_its_voxel_size() {
    let reading = read(&file("contiguous.h5"), &ReadOptions::default()).unwrap();
    assert_eq!(reading.volume.shape, SHAPE);
    assert_eq!(reading.volume.values, expected(|value| value));
    assert_eq!(reading.header.voxel_mm, 0.02);
    let words = reading.header.in_words();
    for part in ["dataset /exchange/data", "16-bit unsigned", "element_size_um"] {
        assert!(words.contains(part), "{part:?} is not in {words}");
    }

    // h5py writes a list of integers as 64-bit integers
    for name in ["long", "short"] {
        let options = ReadOptions { voxel_mm: None, ..dataset(name) };
        let header = StackHeader::read(&file("integers.h5"), &options).unwrap();
        assert_eq!(header.voxel_mm, 0.02, "{name}");
    }

    // slices of a chunked volume are read in slabs; their order and number do not matter
    let given = ReadOptions { voxel_mm: Some(0.02), ..ReadOptions::default() };
    let chunked = read(&file("chunked.h5"), &given).unwrap();
    assert_eq!(chunked.volume.values, expected(|value| value - 200.0));
    let error = read(&file("chunked.h5"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ImageError::Anisotropic { .. }), "{error}");

    // a volume with additional axes of one time and one channel
    let ilastik = read(&file("ilastik.h5"), &given).unwrap();
    assert_eq!(ilastik.volume.shape, SHAPE);
    assert_eq!(ilastik.volume.values, expected(|value| (value / 2.0).floor() % 256.0));
    let binned = read(&file("ilastik.h5"), &ReadOptions { bin: 2, ..given.clone() }).unwrap();
    assert_eq!(binned.volume.shape, [2, 1, 2]);
    let error = read(&file("ilastik.h5"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ImageError::NoVoxelSize { .. }), "{error}");
}

#[test]
fn one_of_several_volumes_is_selected_by_name() {
    let path = file("several.h5");
    let values = |name: &str| read(&path, &dataset(name)).unwrap().volume.values;
    assert_eq!(values("/entry/labels"), expected(|value| value));
    assert_eq!(values("entry/image"), expected(|value| value));
    assert_eq!(values("/entry/exact"), expected(|value| value / 8.0));
    let labels = read_label_values(&path, &dataset("/entry/wide")).unwrap().volume.values;
    assert_eq!(labels[20], 110 - (1 << 40));

    for options in [ReadOptions::default(), dataset("/entry/lables")] {
        let error = StackHeader::read(&path, &options).unwrap_err().to_string();
        for part in ["several.h5: ", "/entry/labels (4 × 3 × 5, 32-bit unsigned", "dataset in"] {
            assert!(error.contains(part), "{part:?} is not in {error}");
        }
        assert!(!error.contains("/entry/deep/raw"), "a second path of /entry/image: {error}");
    }
    for (name, part) in [
        ("/entry/lzf", "the HDF5 file cannot be read: "),
        ("/entry/half", "not of a supported number type"),
    ] {
        let error = read(&path, &dataset(name)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn files_without_a_volume_and_damaged_files_are_refused() {
    let error = read(&file("none.h5"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("/movie (2 × 4 × 3 × 5") && error.contains("/slice (3 × 5"), "{error}");
    let error = read(&file("none.h5"), &dataset("/movie")).unwrap_err().to_string();
    assert!(error.contains("/movie is 2 × 4 × 3 × 5"), "{error}");

    // a truncated file, or a file with changed bytes, results in an error or in another volume, never in a panic
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.h5");
    for name in ["contiguous.h5", "chunked.h5", "several.h5"] {
        let whole = std::fs::read(file(name)).unwrap();
        let options = match name {
            "several.h5" => dataset("/entry/exact"),
            _ => ReadOptions { voxel_mm: Some(0.02), ..ReadOptions::default() },
        };
        for length in (8..whole.len()).step_by(whole.len() / 40) {
            std::fs::write(&path, &whole[..length]).unwrap();
            // the damage may be in another dataset, which follows the volume in the file
            if let Ok(reading) = read(&path, &options) {
                let complete = read(&file(name), &options).unwrap();
                assert_eq!(reading.volume, complete.volume, "{name} of {length} bytes");
            }
        }
        for at in (8..whole.len()).step_by(29) {
            let mut changed = whole.clone();
            changed[at] ^= 0xff;
            std::fs::write(&path, changed).unwrap();
            let _ = read(&path, &options);
        }
    }
}

#[test]
fn a_dataset_is_allowed_only_for_hdf5_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(file("contiguous.h5"), folder.path().join("scan.h5")).unwrap();
    let reading = read(folder.path(), &dataset("/exchange/data")).unwrap();
    assert_eq!(reading.volume.values, expected(|value| value));
    let header = "NDims = 3\nDimSize = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = v.raw\n";
    std::fs::write(folder.path().join("v.raw"), [7]).unwrap();
    std::fs::write(folder.path().join("v.mhd"), header).unwrap();
    let error = read(&folder.path().join("v.mhd"), &dataset("/data")).unwrap_err().to_string();
    assert!(error.contains("v.mhd: this is not an HDF5 file"), "{error}");
}
