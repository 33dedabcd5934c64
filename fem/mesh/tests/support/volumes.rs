//! Test volumes for segmentation and meshes: three synthetic images of packings, and two from the virtual scanner,
//! which also simulates beam hardening, rings, photon noise and texture.

use std::f64::consts::PI;

use fem_mesh::{Grain, GrainList, Packing, Scanner, SizeClass};

use super::phantom::{Imaged, Phantom, VOXEL_MM};

/// Names of the volumes of 256³ voxels: separate grains, grains in contact, two sizes with fines, and a good and a
/// bad scan. The additional volume `many` has the grain sizes of the paper.
pub(crate) const NAMES: [&str; 5] = ["separate", "touching", "fines", "scanned", "rough"];
/// Width of the air around a scanned cylinder (voxels).
const MARGIN: usize = 6;

/// Returns the volume of this name with `side` voxels along each edge, or `None` if there is no such volume.
pub(crate) fn volume(name: &str, side: usize) -> Option<Imaged> {
    let scale = side as f64 / 256.0;
    let taken = match name {
        "separate" => Phantom::new(side, 0.32, 13.0 * scale, 3.0).take(),
        "touching" => Phantom::new(side, 0.53, 15.4 * scale, 0.5).take(),
        "fines" => Phantom {
            radii: vec![(7.5, 0.96), (3.0, 0.04)],
            fines: 0.02,
            ..Phantom::new(side, 0.29, 7.5, 1.0)
        }
        .take(),
        "scanned" => scanned(side, &of_one_size(side), Scanner::new(VOXEL_MM, 1)),
        "rough" => {
            let good = Scanner::new(VOXEL_MM, 1);
            let rough = Scanner { hardening: 1.0, rings: 0.004, photons: 2e4, ..good };
            scanned(side, &of_one_size(side), rough)
        }
        // the size of grains in voxels does not depend on `side`: 5 400 grains at the default of 256
        "many" => scanned(side * 5 / 4, &of_the_paper(), Scanner::new(VOXEL_MM, 1)),
        _ => return None,
    };
    Some(taken)
}

/// Returns a packing of about 300 grains at a volume fraction of 0.32.
fn of_one_size(side: usize) -> Packing {
    let voxels = (side - 2 * MARGIN) as f64;
    let median_radius_mm = 13.8 * VOXEL_MM * voxels / 244.0;
    Packing {
        sizes: vec![SizeClass { median_radius_mm, spread: 0.15, share: 1.0 }],
        film_mm: 3.0 * VOXEL_MM,
        ..Packing::new(0.32, 1)
    }
}

/// Returns a packing with the grain sizes of the paper (voxel 12 µm): half of the volume below 75 µm and half above
/// 150 µm, with a volume-weighted mean diameter of 13 voxels, at the volume fraction of specimen M-50-01.
fn of_the_paper() -> Packing {
    let [fine, coarse] = [(2.0, 0.3), (7.7, 0.2)];
    let mean_volume = |(median, spread): (f64, f64)| median.powi(3) * (4.5 * spread * spread).exp();
    let class =
        |(median, spread), share| SizeClass { median_radius_mm: median * VOXEL_MM, spread, share };
    Packing {
        sizes: vec![class(coarse, mean_volume(coarse)), class(fine, mean_volume(fine))],
        film_mm: 0.5 * VOXEL_MM,
        ..Packing::new(0.268, 1)
    }
}

/// Scans a packing with the virtual scanner.
fn scanned(side: usize, packing: &Packing, scanner: Scanner) -> Imaged {
    let voxels = (side - 2 * MARGIN) as f64;
    let (radius_mm, height_mm) = (0.5 * voxels * VOXEL_MM, voxels * VOXEL_MM);
    let grains = packing.fill(radius_mm, height_mm).expect("the packing can be made");
    let volumes_mm3 = grains.iter().map(Grain::volume_mm3).collect();
    let list = GrainList::new(grains, radius_mm, height_mm);
    let scanner = Scanner { margin: MARGIN, ..scanner };
    let scan = scanner.scan(radius_mm, height_mm, &list).expect("the scan can be made");
    Imaged {
        image: scan.grey,
        truth: scan.labels,
        volumes_mm3,
        specimen_mm3: PI * radius_mm * radius_mm * height_mm,
        radius_mm,
        bottom_mm: scan.cylinder.bottom_mm,
        height_mm,
        centre_mm: scan.cylinder.centre_mm,
    }
}
