//! Meshes a packing at several spacings and prints the quality of the meshes.
//!
//! `cargo run --release -p fem-mesh --example meshing -- [spacing in mm]... [mode=auto] [grains=spheres.json]
//! [fraction=0.2] [radius=0.5] [film=0.05] [voxel=0.02] [vtu=out.vtu] [volume=touching] [side=256]`
//!
//! `grains` is a file with the centres and radii of spheres (`centres_mm`, `radii_mm`); without it a packing of
//! polyhedra is drawn. With `voxel` (mm), the labels of a scan are meshed instead of the exact grains. With `volume`,
//! the grey values of a volume of the example `segmentation` are segmented and then meshed, at a spacing of four
//! voxels (0.04 mm) unless spacings are given.

#[path = "../tests/support/phantom.rs"]
mod phantom;
#[path = "../tests/support/volumes.rs"]
mod volumes;

use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;

use fem_image::{Segmentation, Segmented};

use fem_mesh::{
    Grain, GrainField, GrainList, Meshed, Meshing, Packing, Scanner, SizeClass, VoxelGrains, vtu,
};
use phantom::{Imaged, VOXEL_MM};
use serde::Deserialize;

/// Contents of the file of spheres.
#[derive(Deserialize)]
struct Spheres {
    centres_mm: Vec<[f64; 3]>,
    radii_mm: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let (radius_mm, height_mm) = (2.5, 4.4);
    let mut packing = Packing { film_mm: 0.05, ..Packing::new(0.2, 1) };
    let (mut spacings, mut spheres, mut vtu_path) = (Vec::new(), None, None);
    let (mut voxel_mm, mut volume, mut side) = (None, None, 256);
    let mut meshing = Meshing::new(1.0);
    for argument in std::env::args().skip(1) {
        match argument.split_once('=') {
            None => spacings.push(argument.parse()?),
            Some(("mode", mode)) => meshing.mode = serde_json::from_str(&format!("\"{mode}\""))?,
            Some(("curved", curved)) => meshing.curved = curved.parse()?,
            Some(("grains", path)) => spheres = Some(path.to_owned()),
            Some(("fraction", fraction)) => packing.fraction = fraction.parse()?,
            Some(("film", film)) => packing.film_mm = film.parse()?,
            Some(("voxel", voxel)) => voxel_mm = Some(voxel.parse()?),
            Some(("vtu", path)) => vtu_path = Some(path.to_owned()),
            Some(("volume", name)) => volume = Some(name.to_owned()),
            Some(("side", voxels)) => side = voxels.parse()?,
            Some(("radius", radius)) => {
                let median_radius_mm = radius.parse()?;
                packing.sizes = vec![SizeClass { median_radius_mm, spread: 0.15, share: 1.0 }];
            }
            Some((key, _)) => return Err(format!("there is no setting `{key}`").into()),
        }
    }
    if let Some(name) = volume {
        let spacings = if spacings.is_empty() { vec![4.0 * VOXEL_MM] } else { spacings };
        return mesh_of_image(&name, side, &spacings, meshing, vtu_path.as_deref());
    }
    let clock = Instant::now();
    let grains = match spheres {
        Some(path) => {
            let Spheres { centres_mm, radii_mm } =
                serde_json::from_str(&std::fs::read_to_string(path)?)?;
            centres_mm.into_iter().zip(radii_mm).map(|(c, r)| Grain::sphere(c, r)).collect()
        }
        None => packing.fill(radius_mm, height_mm)?,
    };
    println!("{} grains in {:.1} s", grains.len(), clock.elapsed().as_secs_f64());
    let list = GrainList::new(grains, radius_mm, height_mm);
    let scan = match voxel_mm {
        Some(voxel_mm) => Some(Scanner::new(voxel_mm, 1).scan(radius_mm, height_mm, &list)?),
        None => None,
    };
    let voxels = scan.as_ref().map(|scan| VoxelGrains::new(&scan.labels, None, &scan.cylinder));
    let field: &dyn GrainField = match &voxels {
        Some(voxels) => voxels,
        None => &list,
    };
    println!("ready after {:.1} s", clock.elapsed().as_secs_f64());
    for spacing_mm in spacings {
        let clock = Instant::now();
        let meshed = Meshing { spacing_mm, ..meshing }.build(radius_mm, height_mm, field)?;
        report(spacing_mm, clock, &meshed, vtu_path.as_deref())?;
    }
    Ok(())
}

/// Prints the report of a mesh, and writes the mesh if a path is given.
fn report(
    spacing_mm: f64,
    clock: Instant,
    meshed: &Meshed,
    vtu_path: Option<&str>,
) -> Result<(), Box<dyn Error>> {
    let seconds = clock.elapsed().as_secs_f64();
    println!("spacing {spacing_mm} mm, {seconds:.1} s: {}", meshed.report);
    let wall = meshed.report.wall_error_mm;
    let median = meshed.report.median_volume_error(3.0).unwrap_or(0.0);
    println!(
        "  wall error {wall:.1e} mm, Euler characteristic {}, median volume error {:.2} %, \
         {} edges stayed straight",
        meshed.report.euler_characteristic,
        100.0 * median,
        meshed.report.straightened_edges
    );
    meshed.report.warnings().iter().for_each(|warning| println!("  warning: {warning}"));
    if let Some(path) = vtu_path {
        vtu::write(path, &meshed.mesh, &[], &[])?;
    }
    Ok(())
}

/// Segments and meshes grey values, and compares each mesh with the labels and with the ground truth.
fn mesh_of_image(
    name: &str,
    side: usize,
    spacings: &[f64],
    meshing: Meshing,
    vtu_path: Option<&str>,
) -> Result<(), Box<dyn Error>> {
    let clock = Instant::now();
    let taken = volumes::volume(name, side)
        .ok_or_else(|| format!("there is no volume `{name}`; use one of {:?}", volumes::NAMES))?;
    println!(
        "{name}: {} grains after {:.1} s",
        taken.volumes_mm3.len(),
        clock.elapsed().as_secs_f64()
    );
    let clock = Instant::now();
    let found = Segmentation::default().run(&taken.image, &mut |_| {})?;
    let (seconds, cylinder) = (clock.elapsed().as_secs_f64(), &found.cylinder);
    println!("segmented in {seconds:.1} s: {} grains", found.regions.len());
    let off = |found: f64, truth: f64| (found - truth).abs() / VOXEL_MM;
    let [x, y] = [0, 1].map(|k| off(cylinder.centre_mm[k], taken.centre_mm[k]));
    println!(
        "  axis {:.3}, radius {:.3}, bottom {:.3}, height {:.3} voxels from the truth",
        x.hypot(y),
        off(cylinder.radius_mm, taken.radius_mm),
        off(cylinder.bottom_mm, taken.bottom_mm),
        off(cylinder.height_mm(), taken.height_mm)
    );
    let matches = matches(&taken, &found);
    for &spacing_mm in spacings {
        let clock = Instant::now();
        let Segmented { labels, solid, cylinder, .. } = &found;
        let volumes = found.regions.iter().map(|grain| (grain.id, grain.volume_mm3));
        let grains = VoxelGrains::new(labels, Some(solid), cylinder).with_volumes(volumes);
        let (radius_mm, height_mm) = (cylinder.radius_mm, cylinder.height_mm());
        let meshed = Meshing { spacing_mm, ..meshing }.build(radius_mm, height_mm, &grains)?;
        report(spacing_mm, clock, &meshed, vtu_path)?;
        let mut errors = Vec::new();
        for (found, truth) in meshed.report.grains.iter().zip(&matches) {
            if let Some(truth) = truth.filter(|_| found.elements_across > 3.0) {
                errors.push((found.achieved_mm3 / taken.volumes_mm3[truth - 1] - 1.0).abs());
            }
        }
        errors.sort_by(f64::total_cmp);
        let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
        println!(
            "  interface error {:.3} voxels; relative error of the fraction {:+.2} % (labels) and {:+.2} % (truth); \
             median error of the volume {:.2} % for {} grains with more than three elements across",
            meshed.report.interface_rms_mm / VOXEL_MM,
            100.0 * (meshed.report.achieved_fraction / meshed.report.asked_fraction - 1.0),
            100.0 * (meshed.report.achieved_fraction / taken.fraction() - 1.0),
            100.0 * median,
            errors.len()
        );
    }
    Ok(())
}

/// Returns the matching true grain (from 1) of each segmented grain: their intersection over union exceeds one half.
fn matches(taken: &Imaged, found: &Segmented) -> Vec<Option<usize>> {
    let mut shared: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for (&truth, &label) in taken.truth.values.iter().zip(&found.labels.values) {
        *sizes.entry(truth).or_default() += 1;
        *shared.entry((label, truth)).or_default() += 1;
    }
    let mut matches = vec![None; found.regions.len()];
    for ((label, truth), count) in shared {
        if label > 0 && truth > 0 {
            let union = sizes[&truth] + found.regions[label as usize - 1].voxels - count;
            if 2 * count > union {
                matches[label as usize - 1] = Some(truth as usize);
            }
        }
    }
    matches
}
