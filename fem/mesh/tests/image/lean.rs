//! Segmentation of a tilted specimen from the virtual scanner, compared with the upright specimen.

use fem_image::{Segmentation, Segmented, score};

use fem_mesh::{GrainField, GrainList, Packing, Scan, Scanner, SizeClass, VoxelGrains};

const VOXEL: f64 = 0.02;
const RADIUS: f64 = 34.0 * VOXEL;
const HEIGHT: f64 = 72.0 * VOXEL;
/// Tilt of the axis along x and y: 6.8 voxels over the height, 5.4°.
const LEAN: [f64; 2] = [0.08, -0.05];

/// Returns about forty grains with a diameter of 13 voxels.
fn grains() -> GrainList {
    let packing = Packing {
        sizes: vec![SizeClass { median_radius_mm: 6.5 * VOXEL, spread: 0.1, share: 1.0 }],
        film_mm: 3.0 * VOXEL,
        ..Packing::new(0.25, 3)
    };
    GrainList::new(packing.fill(RADIUS, HEIGHT).unwrap(), RADIUS, HEIGHT)
}

fn scan(grains: &GrainList, lean: [f64; 2]) -> Scan {
    let scanner = Scanner { lean, hardening: 0.6, ..Scanner::new(VOXEL, 5) };
    scanner.scan(RADIUS, HEIGHT, grains).unwrap()
}

fn segment(scan: &Scan, follow_lean: bool) -> Segmented {
    let settings = Segmentation { follow_lean, ..Segmentation::default() };
    settings.run(&scan.grey, &mut |_| {}).unwrap()
}

/// Returns the Dice coefficient of true and segmented grains: twice the number of grid points in both a true and a
/// segmented grain, divided by the number of points in true grains plus the number of points in segmented grains.
fn dice(grains: &GrainList, found: &Segmented) -> f64 {
    let seen = VoxelGrains::new(&found.labels, Some(&found.solid), &found.cylinder);
    let (mut both, mut all) = (0, 0);
    for n in 0..64_000 {
        let at = [n % 40, n / 40 % 40, n / 1600].map(|k| (k as f64 + 0.5) / 40.0);
        let x = [(2.0 * at[0] - 1.0) * RADIUS, (2.0 * at[1] - 1.0) * RADIUS, at[2] * HEIGHT];
        if x[0].hypot(x[1]) < 0.95 * RADIUS {
            let inside = [grains.grain_at(x) > 0, seen.grain_at(x) > 0];
            both += 2 * usize::from(inside == [true; 2]);
            all += inside.map(usize::from).iter().sum::<usize>();
        }
    }
    both as f64 / all as f64
}

#[test]
fn a_tilted_specimen_is_segmented_like_the_upright_specimen() {
    let grains = grains();
    let (upright, leaning) = (scan(&grains, [0.0; 2]), scan(&grains, LEAN));
    assert_eq!(upright.cylinder.lean, [0.0; 2]);
    let truth = leaning.cylinder;
    let (reference, found) = (segment(&upright, true), segment(&leaning, true));
    assert_eq!(reference.cylinder.lean, [0.0; 2]);
    assert!(found.warnings.is_empty() && !found.block, "{:?}", found.warnings);
    assert_eq!(found.labels.shape, leaning.grey.shape, "labels keep the voxels of the image");

    let cylinder = found.cylinder;
    println!("{:?}, {cylinder:?}, truly {truth:?}", reference.cylinder);
    let near = |a: f64, b: f64| assert!((a - b).abs() < 0.15 * VOXEL, "{a} mm, not {b} mm");
    near(cylinder.radius_mm, RADIUS);
    near(cylinder.height_mm(), HEIGHT);
    near(cylinder.bottom_mm, truth.bottom_mm);
    for k in 0..2 {
        near(cylinder.centre_mm[k], truth.centre_mm[k]);
        assert!((cylinder.lean[k] - LEAN[k]).abs() < 0.002, "{cylinder:?}");
    }

    let (a, b) = (&reference.statistics, &found.statistics);
    println!("{a:?} {b:?}");
    assert_eq!(b.grains, a.grains);
    assert!((b.grain_fraction / a.grain_fraction - 1.0).abs() < 0.01, "{a:?} {b:?}");
    assert!((b.d50_mm / a.d50_mm - 1.0).abs() < 0.01, "{a:?} {b:?}");
    assert!((found.rim_over_centre / reference.rim_over_centre - 1.0).abs() < 0.01);
    let quality = [(&upright, &reference), (&leaning, &found)]
        .map(|(scan, found)| score(&scan.labels, &found.labels).unwrap().panoptic_quality);
    println!("{quality:?}");
    assert!(quality[1] > quality[0] - 0.01, "{quality:?}");

    // in the coordinates of the specimen, which the mesh uses, the grains are at their true positions
    let places = [&reference, &found].map(|found| dice(&grains, found));
    println!("{places:?}");
    assert!(places[0] > 0.92 && places[1] > places[0] - 0.01, "{places:?}");

    // without correction of the tilt there is a warning, and the grains are not at their true positions
    let told = segment(&leaning, false);
    assert_eq!(told.cylinder.lean, [0.0; 2]);
    // a second warning may say that the grain fraction is uncertain
    let Some(warning) = told.warnings.iter().find(|warning| warning.contains("is tilted by"))
    else {
        panic!("{:?}", told.warnings)
    };
    for part in ["is tilted by 6.", "follow_lean = true", "turn the image upright"] {
        assert!(warning.contains(part), "{part:?} is not in {warning:?}");
    }
    let place = dice(&grains, &told);
    assert!(place < places[1] - 0.05, "{place}");
}
