//! Meshes of a packing at several spacings, and how good they are.
//!
//! `cargo run --example meshing -- [spacing in mm]... [mode=auto] [grains=spheres.json]
//! [fraction=0.2] [radius=0.5] [film=0.05] [voxel=0.02] [vtu=out.vtu]`
//!
//! `grains` is a file with the centres and radii of spheres (`centres_mm`, `radii_mm`); without it a
//! packing of polyhedra is drawn. With `voxel` (mm) the labels of a scan are meshed instead of the
//! grains themselves.

use std::error::Error;
use std::time::Instant;

use fem::{Grain, GrainField, GrainList, Meshing, Packing, Scanner, SizeClass, VoxelGrains, vtu};
use serde::Deserialize;

/// The file of spheres.
#[derive(Deserialize)]
struct Spheres {
    centres_mm: Vec<[f64; 3]>,
    radii_mm: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let (radius_mm, height_mm) = (2.5, 4.4);
    let mut packing = Packing { film_mm: 0.05, ..Packing::new(0.2, 1) };
    let (mut spacings, mut spheres, mut picture) = (Vec::new(), None, None);
    let mut voxel_mm = None;
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
            Some(("vtu", path)) => picture = Some(path.to_owned()),
            Some(("radius", radius)) => {
                let median_radius_mm = radius.parse()?;
                packing.sizes = vec![SizeClass { median_radius_mm, spread: 0.15, share: 1.0 }];
            }
            Some((key, _)) => return Err(format!("there is no setting `{key}`").into()),
        }
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
        let seconds = clock.elapsed().as_secs_f64();
        println!("spacing {spacing_mm} mm, {seconds:.1} s: {}", meshed.report);
        let wall = meshed.report.wall_error_mm;
        let median = meshed.report.median_volume_error(3.0).unwrap_or(0.0);
        println!(
            "  wall error {wall:.1e} mm, Euler characteristic {}, median volume error {:.2} %, \
             {} edges kept straight",
            meshed.report.euler_characteristic,
            100.0 * median,
            meshed.report.straightened_edges
        );
        meshed.report.warnings().iter().for_each(|warning| println!("  warning: {warning}"));
        if let Some(path) = &picture {
            vtu::write(path, &meshed.mesh, &[], &[])?;
        }
    }
    Ok(())
}
