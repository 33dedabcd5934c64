//! Complete segmentation of images with known ground truth.

use std::collections::BTreeMap;

use fem_image::{
    ImageError, SeedRule, Segmentation, Segmented, SpecimenForm, Volume, outlined_slice, score,
};

use crate::phantom::{Imaged, Phantom};

fn phantom() -> Imaged {
    Phantom::new(96, 0.35, 9.0, 1.5).take()
}

fn run(image: &Volume<f32>) -> Segmented {
    Segmentation::default().run(image, &mut |_| {}).unwrap()
}

#[test]
fn grains_are_found_in_a_cylinder_in_air() {
    let taken = phantom();
    let mut steps = Vec::new();
    let settings = Segmentation::default();
    let found = settings.run(&taken.image, &mut |step| steps.push(step.to_owned())).unwrap();
    assert!(found.warnings.is_empty() && !found.block, "{:?}", found.warnings);
    assert_eq!(steps.first().map(String::as_str), Some("grey values"));

    let voxel = taken.image.voxel_mm;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 0.15 * voxel, "{a} mm, not {b} mm");
    near(found.cylinder.radius_mm, taken.radius_mm);
    near(found.cylinder.bottom_mm, taken.bottom_mm);
    near(found.cylinder.height_mm(), taken.height_mm);
    near(found.cylinder.centre_mm[0], taken.centre_mm[0]);
    near(found.cylinder.centre_mm[1], taken.centre_mm[1]);
    assert!((found.rim_over_centre - 1.12).abs() < 0.02, "{}", found.rim_over_centre);

    let score = score(&taken.truth, &found.labels).unwrap();
    println!("{score:?} {:?}", found.statistics);
    assert!(score.panoptic_quality > 0.85, "{score:?}");
    assert!(score.dice > 0.95, "{score:?}");
    assert!(score.found.abs_diff(score.truth) * 50 <= score.truth, "{score:?}");
    let fraction = found.statistics.grain_fraction;
    assert!((fraction / taken.fraction() - 1.0).abs() < 0.01, "{fraction}");
    assert!((found.statistics.voxel_fraction / taken.fraction() - 1.0).abs() < 0.03);
}

#[test]
fn volumes_between_voxels_are_those_of_the_grains() {
    let taken = phantom();
    let found = run(&taken.image);
    let mut overlaps = BTreeMap::new();
    for (&truth, &label) in taken.truth.values.iter().zip(&found.labels.values) {
        *overlaps.entry((truth, label)).or_insert(0_usize) += 1;
    }
    let mut errors = Vec::new();
    for region in &found.regions {
        let own = overlaps.iter().filter(|((truth, label), _)| *label == region.id && *truth != 0);
        let Some((&(truth, _), &count)) = own.max_by_key(|(_, count)| **count) else { continue };
        if 10 * count > 9 * region.voxels {
            let exact = taken.volumes_mm3[truth as usize - 1];
            errors.push((region.volume_mm3 / exact - 1.0).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors.len() > 30, "{}", errors.len());
    assert!(errors[errors.len() / 2] < 0.03, "median error {}", errors[errors.len() / 2]);
    let shares = found.solid.values.iter().map(|&share| f64::from(share)).sum::<f64>();
    let volume: f64 = found.regions.iter().map(|region| region.volume_mm3).sum();
    assert!((shares * taken.image.voxel_mm.powi(3) / volume - 1.0).abs() < 0.05);
}

#[test]
fn threads_do_not_show() {
    let taken = phantom();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&taken.image))
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.labels, three.labels);
    assert_eq!(one.solid, three.solid);
    assert_eq!(one.regions, three.regions);
    assert_eq!(one.statistics, three.statistics);
}

/// Returns a volume whose voxel (i, j, k) has the value of the voxel `from([i, j, k])` of another volume.
fn moved<T: Copy>(
    volume: &Volume<T>,
    shape: [usize; 3],
    from: impl Fn([usize; 3]) -> [usize; 3],
) -> Volume<T> {
    let [nx, ny, nz] = shape;
    let voxels = (0..nx * ny * nz).map(|n| [n % nx, n / nx % ny, n / (nx * ny)]);
    let values = voxels.map(|voxel| *volume.at(from(voxel))).collect();
    Volume::new(shape, volume.voxel_mm, values).unwrap()
}

/// Asserts that two label volumes define the same grains, up to their numbering.
fn assert_same_partition(a: &Volume<u32>, b: &Volume<u32>) {
    let (mut forth, mut back) = (BTreeMap::new(), BTreeMap::new());
    for (at, (&a, &b)) in a.values.iter().zip(&b.values).enumerate() {
        assert_eq!(a == 0, b == 0, "voxel {at}");
        assert_eq!(*forth.entry(a).or_insert(b), b, "voxel {at}");
        assert_eq!(*back.entry(b).or_insert(a), a, "voxel {at}");
    }
}

#[test]
fn a_turned_or_mirrored_image_has_the_same_grains() {
    let taken = phantom();
    let n = taken.image.shape[0] - 1;
    let straight = run(&taken.image).labels;
    type Map = fn(usize, [usize; 3]) -> [usize; 3];
    let turns: [Map; 4] = [
        |n, [x, y, z]| [n - y, x, z],
        |n, [x, y, z]| [n - x, y, z],
        |_, [x, y, z]| [y, x, z],
        |n, [x, y, z]| [x, n - y, n - z],
    ];
    for turn in turns {
        let map = |voxel| turn(n, voxel);
        let labels = run(&moved(&taken.image, taken.image.shape, map)).labels;
        assert_same_partition(&labels, &moved(&straight, straight.shape, map));
    }
}

#[test]
fn a_block_may_lie_on_any_side() {
    let taken = phantom();
    let block = moved(&taken.image, [50, 44, 40], |[x, y, z]| [x + 22, y + 25, z + 27]);
    let straight = run(&block);
    assert!(straight.block);
    assert!((straight.statistics.volume_mm3 / (50.0 * 44.0 * 40.0 * 1e-6) - 1.0).abs() < 1e-12);
    assert_eq!(straight.cylinder.radius_mm, 0.22);
    assert!(straight.regions.iter().any(|region| region.touches_boundary));
    let map = |[x, y, z]: [usize; 3]| [49 - z, x, y];
    let turned = run(&moved(&block, [44, 40, 50], map));
    assert_same_partition(&turned.labels, &moved(&straight.labels, [44, 40, 50], map));
}

#[test]
fn seeds_by_spacing_split_grains() {
    let taken = Phantom::new(96, 0.35, 13.0, 1.5).take();
    let spaced = |spacing_voxels| {
        let settings =
            Segmentation { seeds: SeedRule::Spacing, spacing_voxels, ..Segmentation::default() };
        settings.run(&taken.image, &mut |_| {}).unwrap().regions.len()
    };
    let ours = run(&taken.image);
    let close = spaced(2);
    assert!(close > spaced(4) && close > ours.regions.len(), "{close}");
    assert_eq!(ours.regions.len(), taken.volumes_mm3.len());
}

#[test]
fn thresholds_can_be_given() {
    let taken = phantom();
    let found = run(&taken.image);
    let grain_threshold = Some(found.grain_threshold);
    let by_grain = Segmentation { grain_threshold, ..Segmentation::default() };
    let by_both = Segmentation { void_threshold: found.void_threshold, ..by_grain.clone() };
    // a given void threshold moves the wall of the specimen; by default the wall has the mean grey value of air and
    // matrix
    for (settings, error) in [(by_grain, 1e-3), (by_both.clone(), 0.02)] {
        let again = settings.run(&taken.image, &mut |_| {}).unwrap();
        let score = score(&found.labels, &again.labels).unwrap();
        assert!(score.panoptic_quality > 0.99, "{score:?}");
        let fraction = again.statistics.grain_fraction;
        assert!((fraction / found.statistics.grain_fraction - 1.0).abs() < error, "{fraction}");
    }
    // a higher threshold reduces the grain fraction, both by voxels and by subvoxel volumes
    let settings =
        Segmentation { grain_threshold: Some(found.grain_threshold + 2000.0), ..by_both };
    let less = settings.run(&taken.image, &mut |_| {}).unwrap();
    assert!(less.statistics.voxel_fraction < 0.95 * found.statistics.voxel_fraction);
    // the subvoxel grain fraction equals the voxel fraction
    let ratio = less.statistics.grain_fraction / less.statistics.voxel_fraction;
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    let shares = less.solid.values.iter().map(|&share| f64::from(share)).sum::<f64>();
    let volume: f64 = less.regions.iter().map(|region| region.volume_mm3).sum();
    assert!((shares * taken.image.voxel_mm.powi(3) / volume - 1.0).abs() < 1e-4);
}

/// Returns an image of balls of a given radius (voxels) and the volume fraction of the balls. As in concrete, the grey
/// values of balls (34000) and matrix (31000) differ hardly more than the texture of the matrix.
fn pebbles(radius: f64) -> (Volume<f32>, f64) {
    let side: usize = 54;
    // the balls form a lattice; their centres have different positions relative to the voxels
    let centre = |cell: f64, other: f64| 9.0 * (cell + 0.5) + 0.4 * (1.7 * cell + other).sin();
    let share = |voxel: [usize; 3]| {
        let cell = voxel.map(|at| (at / 9) as f64);
        let middle = [0, 1, 2].map(|k| centre(cell[k], cell[(k + 1) % 3]));
        let samples = (0..512).map(|n| [n % 8, n / 8 % 8, n / 64]);
        let inside = samples.filter(|sample| {
            let off = |k: usize| voxel[k] as f64 + (sample[k] as f64 + 0.5) / 8.0 - middle[k];
            (0..3).map(|k| off(k).powi(2)).sum::<f64>() < radius * radius
        });
        inside.count() as f64 / 512.0
    };
    let values = (0..side.pow(3)).map(|n| {
        let voxel = [n % side, n / side % side, n / (side * side)];
        let texture = 250.0 * (n as f64 * 12.9898).sin() + 250.0 * (n as f64 * 0.37).cos();
        (31_000.0 + 3_000.0 * share(voxel) + texture) as f32
    });
    let image = Volume::new([side; 3], 0.01, values.collect()).unwrap();
    let balls = 6.0_f64.powi(3) * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    (image, balls / (side as f64).powi(3))
}

#[test]
fn grains_without_interior_voxels_have_the_correct_volume() {
    // the diameter is five voxels: no voxel is two voxels away from the surface. The mean grey value of grains cannot
    // be measured in the interior; an earlier version then computed a fraction of 0
    let (image, fraction) = pebbles(2.7);
    let settings = Segmentation {
        specimen: SpecimenForm::Block,
        median: false,
        min_grain_voxels: 10,
        grain_threshold: Some(32_500.0),
        ..Segmentation::default()
    };
    let found = settings.run(&image, &mut |_| {}).unwrap();
    assert_eq!(found.regions.len(), 216);
    let statistics = &found.statistics;
    // the grey value of a voxel is its mean over the voxel, which shrinks a ball of radius R by σ² / R with σ² = 1/12
    // voxel²: 0.03 voxels, or 3.5 % of this volume; the texture has an effect of the same size
    assert!((statistics.grain_fraction / fraction - 1.0).abs() < 0.05, "{statistics:?}");
    let ratio = statistics.grain_fraction / statistics.voxel_fraction;
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    assert!(statistics.d10_mm > 0.0 && found.regions.iter().all(|grain| grain.volume_mm3 > 0.0));
    // with a threshold computed from the image, the fraction is computed from the grey values of all grain voxels,
    // because no voxel is in the interior of a grain
    let settings = Segmentation { grain_threshold: None, ..settings };
    let found = settings.run(&image, &mut |_| {}).unwrap();
    let ratio = found.statistics.grain_fraction / fraction;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn one_grain_that_fills_most_of_the_specimen_gives_a_warning() {
    let taken = phantom();
    let found = run(&taken.image);
    let told = |settings: Segmentation, image: &Volume<f32>| {
        let found = settings.run(image, &mut |_| {}).unwrap();
        let about = |warning: &&String| warning.contains("probably not a single grain");
        (found.regions.len(), found.warnings.iter().find(about).cloned())
    };
    assert_eq!(told(Segmentation::default(), &taken.image).1, None);
    // with this low threshold matrix counts as grain
    let low = 0.7 * found.void_threshold.unwrap() + 0.3 * found.grain_threshold;
    let low = Segmentation { grain_threshold: Some(low), ..Segmentation::default() };
    let (_, warning) = told(low, &taken.image);
    let warning = warning.expect("no warning, although matrix and grains are one grain");
    let share: f64 = warning.split_whitespace().nth(3).unwrap().parse().unwrap();
    assert!((90.0..=100.0).contains(&share), "{warning}");
    for part in ["grain 1 is", "% of the specimen", "try another grain_threshold"] {
        assert!(warning.contains(part), "{part:?} is not in {warning:?}");
    }
    // many grains, one of which has most of the volume: balls, and a slab that is a quarter of the block
    let (mut balls, _) = pebbles(2.7);
    let slab = balls.values.len() / 4;
    balls.values[..slab].fill(34_000.0);
    let block = Segmentation {
        specimen: SpecimenForm::Block,
        median: false,
        min_grain_voxels: 10,
        ..Segmentation::default()
    };
    let (grains, warning) = told(block.clone(), &balls);
    let warning = warning.expect("no warning, although the slab has most of the grain volume");
    assert!(grains > 100, "{grains}");
    for part in
        ["% of all grains", "give grain_threshold in [specimen.image]; the computed value is 32"]
    {
        assert!(warning.contains(part), "{part:?} is not in {warning:?}");
    }
    // no warning for a single grain: a small image may show only one grain
    let few =
        Volume::new([20; 3], 0.01, (0..8000).map(|n| if n < 3000 { 2.0 } else { 1.0 }).collect());
    assert_eq!(told(block, &few.unwrap()), (1, None));
}

#[test]
fn a_threshold_within_air_is_refused() {
    let taken = phantom();
    let void = run(&taken.image).void_threshold.unwrap();
    let settings = Segmentation { grain_threshold: Some(void - 1.0), ..Segmentation::default() };
    let error = settings.run(&taken.image, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("grain_threshold") && error.contains("void_threshold"), "{error}");
}

#[test]
fn an_image_of_nothing_is_refused() {
    let run = |settings: Segmentation, image: &Volume<f32>| settings.run(image, &mut |_| {});
    let volume = |value: fn(usize) -> f32| {
        Volume::new([20, 20, 20], 0.01, (0..8000).map(value).collect()).unwrap()
    };
    let settings = Segmentation::default;
    let error = run(settings(), &volume(|_| 3.0)).unwrap_err();
    assert!(matches!(error, ImageError::NoContrast { .. }), "{error}");
    let error = run(settings(), &volume(|n| if n == 421 { f32::NAN } else { n as f32 }));
    let error = error.unwrap_err();
    assert_eq!(
        error.to_string(),
        "voxel [1, 1, 1] has the grey value NaN; replace such values in the image"
    );
    let cylinder = Segmentation { specimen: SpecimenForm::Cylinder, ..settings() };
    let error = run(cylinder, &volume(|n| (n % 7) as f32)).unwrap_err();
    assert!(matches!(error, ImageError::NoCylinder { .. }), "{error}");
    let error = run(Segmentation { h_voxels: -1.0, ..settings() }, &volume(|n| n as f32));
    assert_eq!(error.unwrap_err().to_string(), "h_voxels = -1 must be from 0 to 100 voxels");
    // thresholds also split pure noise into two classes; the result is a warning or an error
    let noise = volume(|n| ((n * 7919) % 1009) as f32);
    match run(settings(), &noise) {
        Ok(found) => assert!(!found.warnings.is_empty()),
        Err(error) => assert!(matches!(error, ImageError::NoContrast { .. }), "{error}"),
    }
}

#[test]
fn settings_are_keys_with_defaults() {
    let read = serde_json::from_str::<Segmentation>;
    assert_eq!(read("{}").unwrap(), Segmentation::default());
    let settings = read(r#"{"specimen": "block", "seeds": "spacing", "h_voxels": 1.0}"#).unwrap();
    assert_eq!((settings.specimen, settings.seeds), (SpecimenForm::Block, SeedRule::Spacing));
    assert!(read(r#"{"h_voxel": 1.0}"#).is_err());
}

#[test]
fn slices_are_drawn() {
    let taken = phantom();
    let found = run(&taken.image);
    let slice = outlined_slice(&taken.image, &found.labels, 2, 48).unwrap();
    let coloured = slice.pixels.chunks_exact(3).filter(|p| p[0] != p[1] || p[1] != p[2]).count();
    assert!(coloured > 200, "{coloured}");
}
