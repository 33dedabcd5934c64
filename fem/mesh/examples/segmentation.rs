//! Scores and times of the segmentation on volumes of 256³ voxels whose truth is known.
//!
//! ```text
//! cargo run --release -p fem-mesh --example segmentation [FOLDER] [SIDE] [VOLUME ...]
//! ```
//!
//! Images and truths are written to FOLDER if it is given and not `-`; `tests/python/segmentation.py` runs
//! scikit-image on the same files. Volumes are `separate`, `touching`, `fines`, `scanned` and `rough`; all
//! unless some are named. With the variable STEPS set, the seconds of each step are told too.

#[path = "../tests/support/phantom.rs"]
mod phantom;
#[path = "../tests/support/volumes.rs"]
mod volumes;

use std::path::PathBuf;
use std::time::Instant;

use fem_image::{SeedRule, Segmentation, Volume, score, tiff};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().filter(|folder| folder != "-").map(PathBuf::from);
    let side: usize = arguments.next().map_or(Ok(256), |side| side.parse())?;
    let mut names: Vec<String> = arguments.collect();
    if names.is_empty() {
        names = volumes::NAMES.map(str::to_owned).to_vec();
    }
    println!(
        "volume     rule       grains found matched     PQ   Dice   Rand     VI  fraction  voxels   truth  D50 error seconds"
    );
    for name in names {
        let taken = volumes::volume(&name, side)
            .ok_or_else(|| format!("there is no volume `{name}`: take {:?}", volumes::NAMES))?;
        let folder = match &folder {
            Some(folder) => folder.clone(),
            None => std::env::temp_dir().join(format!("segmentation-{}", std::process::id())),
        };
        std::fs::create_dir_all(&folder)?;
        let file = folder.join(format!("{name}.tif"));
        let grey = taken.image.values.iter().map(|&value| value.max(0.0) as u32).collect();
        tiff::write_labels(&file, &Volume::new(taken.image.shape, taken.image.voxel_mm, grey)?)?;
        tiff::write_labels(&folder.join(format!("{name}-truth.tif")), &taken.truth)?;

        for (rule, seeds) in [("h-maxima", SeedRule::HMaxima), ("spacing", SeedRule::Spacing)] {
            let start = Instant::now();
            let mut step = (Instant::now(), String::new());
            let image = tiff::read(&file, None)?;
            let settings = Segmentation { seeds, ..Segmentation::default() };
            let verbose = std::env::var_os("STEPS").is_some();
            let found = settings.run(&image, &mut |name| {
                if verbose {
                    eprintln!("{:>40} {:.2} s", step.1, step.0.elapsed().as_secs_f64());
                    step = (Instant::now(), name.to_owned());
                }
            })?;
            if verbose {
                eprintln!("{:>40} {:.2} s", step.1, step.0.elapsed().as_secs_f64());
                eprintln!("{:?} {:?}", found.cylinder, found.warnings);
                eprintln!(
                    "truth: centre {:?}, radius {}, bottom {}, height {}",
                    taken.centre_mm, taken.radius_mm, taken.bottom_mm, taken.height_mm
                );
            }
            let seconds = start.elapsed().as_secs_f64();
            let s = score(&taken.truth, &found.labels)?;
            let mut volumes = taken.volumes_mm3.clone();
            volumes.sort_by(f64::total_cmp);
            let all: f64 = volumes.iter().sum();
            let mut below = 0.0;
            let middle = volumes.iter().find(|&&volume| {
                below += volume;
                below >= 0.5 * all
            });
            let d50 = (6.0 * middle.copied().unwrap_or(f64::NAN) / std::f64::consts::PI).cbrt();
            println!(
                "{name:10} {rule:10} {:6} {:5} {:7} {:6.4} {:6.4} {:6.4} {:6.4}   {:.4}   {:.4}  {:.4} {:+9.4} {seconds:7.2}",
                s.truth,
                s.found,
                s.matched,
                s.panoptic_quality,
                s.dice,
                s.rand,
                s.variation_of_information,
                found.statistics.grain_fraction,
                found.statistics.voxel_fraction,
                taken.fraction(),
                found.statistics.d50_mm / d50 - 1.0,
            );
        }
    }
    Ok(())
}
