//! Segments a stack of slices: prints statistics, and writes labels and a picture to a folder.
//!
//! ```text
//! cargo run --release -p fem-mesh --example real_images STACK VOXEL_MM FOLDER [SETTINGS]
//! ```
//!
//! SETTINGS are keys of `[specimen.image]` as JSON, for example `'{"specimen": "block"}'`. `breccia segment` does the
//! same from a case file. FOLDER gets `labels.tif` and `slices.png`: the middle slices across z, y and x.

use std::error::Error;
use std::fs::File;
use std::path::{Path, PathBuf};

use fem_image::{ReadOptions, Reading, RgbSlice, Segmentation, outlined_slice, tiff};

/// Width of the gap between two slices of the picture (pixels).
const GAP: usize = 4;
/// Grey value of the gap.
const BETWEEN: u8 = 255;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |name: &str| arguments.next().ok_or(format!("{name} is missing"));
    let stack = PathBuf::from(next("STACK")?);
    let voxel_mm: f64 = next("VOXEL_MM")?.parse()?;
    let folder = PathBuf::from(next("FOLDER")?);
    let settings: Segmentation = serde_json::from_str(&next("SETTINGS").unwrap_or("{}".into()))?;

    let options = ReadOptions { voxel_mm: Some(voxel_mm), ..ReadOptions::default() };
    let Reading { volume: image, header } = fem_image::read(&stack, &options)?;
    for warning in &header.warnings {
        println!("warning: {warning}");
    }
    let found = settings.run(&image, &mut |_| {})?;
    let statistics = &found.statistics;
    println!("{:?} voxels, {}", image.shape, if found.block { "block" } else { "cylinder" });
    let cylinder = &found.cylinder;
    println!(
        "radius {:.1}, height {:.1}, axis at {:.1?} voxels",
        cylinder.radius_mm / voxel_mm,
        cylinder.height_mm() / voxel_mm,
        cylinder.centre_mm.map(|c| c / voxel_mm)
    );
    println!(
        "{} grains, fraction {:.4} from grey values, {:.4} from voxels; voids {:.4}",
        statistics.grains,
        statistics.grain_fraction,
        statistics.voxel_fraction,
        found.void_fraction
    );
    println!(
        "D10, D50, D90: {:.1}, {:.1}, {:.1} voxels",
        statistics.d10_mm / voxel_mm,
        statistics.d50_mm / voxel_mm,
        statistics.d90_mm / voxel_mm
    );
    println!("thresholds: void {:?}, grain {:.0}", found.void_threshold, found.grain_threshold);
    for warning in &found.warnings {
        println!("warning: {warning}");
    }

    std::fs::create_dir_all(&folder)?;
    tiff::write_labels(&folder.join("labels.tif"), &found.labels)?;
    let middle = image.shape.map(|n| n / 2);
    let slice = |axis: usize| outlined_slice(&image, &found.labels, axis, middle[axis]);
    write_png(&folder.join("slices.png"), &[slice(2)?, slice(1)?, slice(0)?])
}

/// Writes slices side by side as a PNG file.
fn write_png(path: &Path, slices: &[RgbSlice]) -> Result<(), Box<dyn Error>> {
    let height = slices.iter().map(|slice| slice.height).max().unwrap_or(0);
    let width = slices.iter().map(|slice| slice.width + GAP).sum::<usize>() - GAP;
    let mut pixels = vec![BETWEEN; 3 * width * height];
    let mut left = 0;
    for slice in slices {
        for (row, line) in slice.pixels.chunks(3 * slice.width).enumerate() {
            let start = 3 * (row * width + left);
            pixels[start..start + line.len()].copy_from_slice(line);
        }
        left += slice.width + GAP;
    }
    let mut encoder = png::Encoder::new(File::create(path)?, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(())
}
