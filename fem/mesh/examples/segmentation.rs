//! Scores and times of the segmentation on volumes with known ground truth.
//!
//! ```text
//! cargo run --release -p fem-mesh --example segmentation [FOLDER] [SIDE] [VOLUME ...]
//! ```
//!
//! VOLUME is `separate`, `touching`, `fines`, `scanned` or `rough` (SIDE³ voxels; default: SIDE = 256), `many`
//! (thousands of grains), a synthetic specimen of 112³ voxels such as `r3-0.1` or `chip`, or a group: `volumes` (the
//! first five volumes) or `specimens` (all specimens of 112³ voxels). Without a VOLUME, both groups are processed.
//!
//! Images, true labels and `scores.csv` are written to FOLDER, or to a temporary folder if FOLDER is `-` or missing;
//! `tests/python/segmentation.py` runs scikit-image on the same files. If the environment variable STEPS is set, the
//! processor seconds of each step are printed too.

#[path = "../tests/support/agreement.rs"]
mod agreement;
#[path = "../tests/support/phantom.rs"]
mod phantom;
#[path = "../tests/support/specimen.rs"]
mod specimen;
#[path = "../tests/support/specimens.rs"]
mod specimens;
#[path = "../tests/support/usage.rs"]
mod usage;
#[path = "../tests/support/volumes.rs"]
mod volumes;

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use agreement::{assigned, median};
use fem_image::{Contrast, SeedRule, Segmentation, Segmented, Volume, score, tiff};
use phantom::Imaged;

/// Header of `scores.csv`. Volumes and lengths are in voxels.
const COLUMNS: &str = "volume,rule,middle_grey,true_grains,grains,matched,pq,dice,true_fraction,fraction,voxel_fraction,\
    true_median,median,true_d50,d50,right,missing,small,true_radius,radius,true_height,height,seconds,processor_seconds,megabytes,contrast";
/// Maximum size of a small true grain (voxels): a sphere of 6 voxels in diameter, half the diameter of grains in the
/// paper.
const SMALL: u64 = 113;

/// Settings for one segmentation of a volume.
struct Rule {
    name: &'static str,
    settings: Segmentation,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().filter(|folder| folder != "-").map(PathBuf::from);
    let mut side = 256;
    let mut names = Vec::new();
    for argument in arguments {
        match argument.parse() {
            Ok(number) => side = number,
            Err(_) => names.push(argument),
        }
    }
    if names.is_empty() {
        names = vec!["volumes".to_owned(), "specimens".to_owned()];
    }
    let folder = match folder {
        Some(folder) => folder,
        None => std::env::temp_dir().join(format!("segmentation-{}", std::process::id())),
    };
    std::fs::create_dir_all(&folder)?;
    println!(
        "volume       rule       true found match     PQ   Dice fraction  true    error  median    D50   right radius (true) height (true)  seconds processor   MB"
    );
    let mut table = format!("{COLUMNS}\n");
    for name in &names {
        for member in members(name) {
            score_volume(&member, side, &folder, &mut table)?;
        }
    }
    std::fs::write(folder.join("scores.csv"), table)?;
    Ok(())
}

/// Returns the names of the volumes in a group; any other name is the name of a single volume.
fn members(name: &str) -> Vec<String> {
    match name {
        "volumes" => volumes::NAMES.map(str::to_owned).to_vec(),
        "specimens" => specimens::specimens().into_iter().map(|(name, _)| name).collect(),
        name => vec![name.to_owned()],
    }
}

/// Returns a volume, its middle grey value (NaN if unknown) and the settings of its segmentations; `None` for an
/// unknown name.
fn volume(name: &str, side: usize) -> Option<(Imaged, f64, Vec<Rule>)> {
    let auto = Segmentation::default();
    if let Some((_, specimen)) =
        specimens::specimens().into_iter().find(|(candidate, _)| candidate == name)
    {
        let middle = specimen.middle_grey();
        let auto = Segmentation { contrast: specimen.contrast(), ..auto };
        let by_hand = Segmentation { grain_threshold: Some(middle), ..auto.clone() };
        let rules = vec![
            Rule { name: "auto", settings: auto },
            Rule { name: "by hand", settings: by_hand },
        ];
        return Some((specimen.take(), middle, rules));
    }
    let spacing = Segmentation { seeds: SeedRule::Spacing, ..auto.clone() };
    let rules = vec![
        Rule { name: "h-maxima", settings: auto },
        Rule { name: "spacing", settings: spacing },
    ];
    Some((volumes::volume(name, side)?, f64::NAN, rules))
}

fn score_volume(
    name: &str,
    side: usize,
    folder: &Path,
    table: &mut String,
) -> Result<(), Box<dyn Error>> {
    let (mut taken, middle, rules) = volume(name, side).ok_or_else(|| {
        let groups = ["volumes", "specimens"].map(members).concat().join(", ");
        format!(
            "there is no volume `{name}`; use `volumes`, `specimens`, `many` or one of {groups}"
        )
    })?;
    let file = folder.join(format!("{name}.tif"));
    // the image is moved from memory to a file, from which the segmentation reads it: the peak memory counts it once
    let grey = std::mem::take(&mut taken.image.values);
    let grey = grey.into_iter().map(|value| value.max(0.0) as u32).collect();
    tiff::write_labels(&file, &Volume::new(taken.image.shape, taken.image.voxel_mm, grey)?)?;
    tiff::write_labels(&folder.join(format!("{name}-truth.tif")), &taken.truth)?;
    for rule in rules {
        let (before, start) = (usage::restart_peak(), Instant::now());
        let processor = usage::processor_seconds();
        let found = run(&file, &rule.settings, &taken);
        let cost = Cost {
            seconds: start.elapsed().as_secs_f64(),
            processor_seconds: usage::processor_seconds() - processor,
            megabytes: (usage::peak() - before) / 1e6,
        };
        match found {
            Ok(found) => report(name, &rule, middle, &taken, &found, &cost, table)?,
            Err(error) => println!("{name:12} {:10} {error}", rule.name),
        }
    }
    Ok(())
}

/// Computing cost of a segmentation, from the file to labels and statistics.
struct Cost {
    seconds: f64,
    processor_seconds: f64,
    megabytes: f64,
}

fn run(file: &Path, settings: &Segmentation, taken: &Imaged) -> Result<Segmented, Box<dyn Error>> {
    let verbose = std::env::var_os("STEPS").is_some();
    let mut step = (usage::processor_seconds(), "reading".to_owned());
    let image = tiff::read(file, None)?;
    let mut next = |name: &str| {
        if verbose {
            let now = usage::processor_seconds();
            eprintln!("{:>40} {:.2} processor s", step.1, now - step.0);
            step = (now, name.to_owned());
        }
    };
    let found = settings.run(&image, &mut next)?;
    next("");
    if verbose {
        eprintln!("{:?} block {} {:?}", found.cylinder, found.block, found.warnings);
        eprintln!(
            "truth: centre {:?}, radius {}, bottom {}, height {}",
            taken.centre_mm, taken.radius_mm, taken.bottom_mm, taken.height_mm
        );
    }
    Ok(found)
}

fn report(
    name: &str,
    rule: &Rule,
    middle: f64,
    taken: &Imaged,
    found: &Segmented,
    cost: &Cost,
    table: &mut String,
) -> Result<(), Box<dyn Error>> {
    let s = score(&taken.truth, &found.labels)?;
    let contrast = match rule.settings.contrast {
        Contrast::Bright => "bright",
        Contrast::Dark => "dark",
    };
    let rule = rule.name;
    let voxel = found.labels.voxel_mm;
    let true_median = median(taken.volumes_mm3.iter().copied());
    let found_median = median(found.regions.iter().map(|region| region.volume_mm3));
    let true_d50 = diameter_of_half(&taken.volumes_mm3);
    let shares = assigned(&taken.truth.values, &found.labels.values, SMALL);
    let statistics = &found.statistics;
    // the true fraction refers to the specimen without its voids
    let solid = 1.0 - found.void_fraction;
    let [fraction, truth] = [statistics.grain_fraction / solid, taken.fraction()];
    let cylinder = &found.cylinder;
    let [radius, height] = [cylinder.radius_mm, cylinder.height_mm()].map(|x| x / voxel);
    let [true_radius, true_height] = [taken.radius_mm, taken.height_mm].map(|x| x / voxel);
    let form = if found.block { " block" } else { "" };
    println!(
        "{name:12} {rule:8} {:6} {:5} {:5} {:6.4} {:6.4}   {fraction:.4} {truth:.4} {:+6.1} % {:+5.1} % {:+5.1} % {:5.1} % {radius:5.1} ({true_radius:5.1}) {height:5.1} ({true_height:5.1}) {:8.2} {:9.2} {:4.0}{form}",
        s.truth,
        s.found,
        s.matched,
        s.panoptic_quality,
        s.dice,
        100.0 * (fraction / truth - 1.0),
        100.0 * (found_median / true_median - 1.0),
        100.0 * (statistics.d50_mm / true_d50 - 1.0),
        100.0 * shares.right,
        cost.seconds,
        cost.processor_seconds,
        cost.megabytes,
    );
    let volume = voxel.powi(3);
    writeln!(
        table,
        "{name},{rule},{middle},{},{},{},{},{},{truth},{fraction},{},{},{},{},{},{},{},{},{true_radius},{radius},{true_height},{height},{},{},{},{contrast}",
        s.truth,
        s.found,
        s.matched,
        s.panoptic_quality,
        s.dice,
        statistics.voxel_fraction / solid,
        true_median / volume,
        found_median / volume,
        true_d50 / voxel,
        statistics.d50_mm / voxel,
        shares.right,
        shares.missing,
        shares.small,
        cost.seconds,
        cost.processor_seconds,
        cost.megabytes,
    )?;
    Ok(())
}

/// Returns the median diameter by volume (mm): half of the total grain volume belongs to grains whose equivalent sphere
/// has a smaller diameter.
fn diameter_of_half(volumes_mm3: &[f64]) -> f64 {
    let mut volumes = volumes_mm3.to_vec();
    volumes.sort_by(f64::total_cmp);
    let all: f64 = volumes.iter().sum();
    let mut below = 0.0;
    let middle = volumes.iter().find(|&&volume| {
        below += volume;
        below >= 0.5 * all
    });
    (6.0 * middle.copied().unwrap_or(f64::NAN) / std::f64::consts::PI).cbrt()
}
