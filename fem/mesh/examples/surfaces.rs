//! Writes the grains of a packing to STL files and reads them again; prints times and changes of volume.
//!
//! `cargo run --release -p fem-mesh --example surfaces -- [spacing in mm]... [fraction=0.2] [radius=0.5] [film=0.05]
//! [seed=1] [smoothing=0] [decimation=20] [least=0] [grow=1.0] [curved=true]`
//!
//! `grow` scales each grain before its file is written, so that grains touch and overlap. The files are written to a
//! temporary folder. Without a spacing, no mesh is generated.

use std::error::Error;
use std::time::Instant;

use fem_mesh::{GrainList, GrainMode, Meshing, Packing, SizeClass, Surface, SurfaceImport, stl};
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let mut packing = Packing { film_mm: 0.05, ..Packing::new(0.2, 1) };
    let (mut spacings, mut grow, mut curved) = (Vec::new(), 1.0, true);
    let folder = tempfile::tempdir()?;
    let mut import = SurfaceImport {
        decimation: 20.0,
        margin_mm: 0.05,
        ..SurfaceImport::new(folder.path().to_owned())
    };
    for argument in std::env::args().skip(1) {
        match argument.split_once('=') {
            Some(("fraction", value)) => packing.fraction = value.parse()?,
            Some(("radius", value)) => {
                let median_radius_mm = value.parse()?;
                packing.sizes = vec![SizeClass { median_radius_mm, spread: 0.15, share: 1.0 }];
            }
            Some(("film", value)) => packing.film_mm = value.parse()?,
            Some(("seed", value)) => packing.seed = value.parse()?,
            Some(("smoothing", value)) => import.smoothing_passes = value.parse()?,
            Some(("decimation", value)) => import.decimation = value.parse()?,
            Some(("least", value)) => import.least_distance_mm = value.parse()?,
            Some(("grow", value)) => grow = value.parse()?,
            Some(("curved", value)) => curved = value.parse()?,
            Some((key, _)) => return Err(format!("there is no setting `{key}`").into()),
            None => spacings.push(argument.parse::<f64>()?),
        }
    }
    let (radius_mm, height_mm) = (2.5, 4.4);
    let truth = GrainList::new(packing.fill(radius_mm, height_mm)?, radius_mm, height_mm);
    let grain_numbers = 1..=truth.list().len() as u32;

    let start = Instant::now();
    let surfaces: Vec<Surface> =
        grain_numbers.into_par_iter().map(|number| truth.surface(number).scaled(grow)).collect();
    for (number, surface) in (1..).zip(&surfaces) {
        let at = |corner: u32| surface.points[corner as usize];
        let triangles: Vec<stl::Triangle> =
            surface.triangles.iter().map(|triangle| triangle.map(at)).collect();
        stl::write(folder.path().join(format!("{number}.stl")), "grain", &triangles)?;
    }
    let volume: f64 = surfaces.iter().map(Surface::volume).sum();
    println!("{} files, {volume:.4} mm³: {:.1} s", surfaces.len(), start.elapsed().as_secs_f64());

    let start = Instant::now();
    let found = import.read([Some(radius_mm), Some(height_mm)])?;
    println!("{}: {:.1} s", found.in_words(), start.elapsed().as_secs_f64());
    found.warnings().iter().for_each(|warning| println!("warning: {warning}"));
    let shrunk = found.factors.iter().filter(|&&factor| factor < 1.0).count();
    let least = found.factors.iter().copied().fold(1.0, f64::min);
    println!(
        "{shrunk} grains shrunk, smallest factor {least:.4}; volume {:+.2} %",
        100.0 * (found.volume_mm3() / volume - 1.0)
    );
    for spacing_mm in spacings {
        let start = Instant::now();
        let meshing = Meshing { mode: GrainMode::Auto, curved, ..Meshing::new(spacing_mm) };
        let meshed = meshing.build(radius_mm, height_mm, &found.grains()?)?;
        let errors = meshed.report.grains.iter().zip(&found.surfaces);
        let mut errors: Vec<f64> = errors
            .map(|(grain, surface)| (grain.achieved_mm3 / surface.volume() - 1.0).abs())
            .collect();
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| 100.0 * errors[(share * (errors.len() - 1) as f64) as usize];
        println!(
            "spacing {spacing_mm} mm: {} tetrahedra, fraction {:.5} (of the files {:.5}), error of a grain's volume: median \
             {:.2} %, 95 % {:.2} %, largest {:.2} %; {:.1} s",
            meshed.mesh.tets.len(),
            meshed.report.achieved_fraction,
            found.fraction(),
            at(0.5),
            at(0.95),
            at(1.0),
            start.elapsed().as_secs_f64()
        );
    }
    Ok(())
}
