//! Tests of the volumes of grains with a radius of a few voxels.

use fem_image::{Contrast, Segmentation, Segmented, Volume};

use crate::scene::{AIR, GRAIN, MATRIX, Pillar, Scene, VOXEL_MM};

const SHAPE: [usize; 3] = [80; 3];

fn pillar() -> Pillar {
    Pillar::amid(SHAPE, 32.0, 64.0)
}

fn run(image: &Volume<f32>, grain_threshold: Option<f64>) -> Segmented {
    let settings = Segmentation { grain_threshold, ..Segmentation::default() };
    settings.run(image, &mut |_| {}).unwrap()
}

/// Returns the grain fraction and the median grain volume, each divided by the true value.
fn ratios(found: &Segmented, scene: &Scene) -> [f64; 2] {
    let median = |mut volumes: Vec<f64>| {
        volumes.sort_by(f64::total_cmp);
        volumes[volumes.len() / 2]
    };
    let volumes = found.regions.iter().map(|grain| grain.volume_mm3 / VOXEL_MM.powi(3)).collect();
    let fraction = found.statistics.grain_fraction / scene.fraction(pillar().volume());
    [fraction, median(volumes) / median(scene.volumes.clone())]
}

#[test]
fn small_grains_have_the_correct_volume() {
    let middle = f64::from(MATRIX + GRAIN) / 2.0;
    for (radius, fraction) in [(3.0, 0.02), (3.0, 0.05), (3.0, 0.2), (4.0, 0.1), (6.0, 0.05)] {
        let scene = Scene::specimen(SHAPE, pillar(), radius, fraction);
        let image = scene.image();
        for threshold in [None, Some(middle)] {
            let found = run(&image, threshold);
            let [fraction_ratio, volume_ratio] = ratios(&found, &scene);
            let case = format!(
                "radius {radius}, fraction {fraction}, {threshold:?}: {fraction_ratio} {volume_ratio}"
            );
            println!("{case}");
            assert_eq!(found.regions.len(), scene.volumes.len(), "{case}");
            assert!((fraction_ratio - 1.0).abs() < 0.03, "{case}");
            assert!((volume_ratio - 1.0).abs() < 0.1, "{case}");
        }
    }
}

/// In a thin cylinder hardly any voxel of the matrix is away from grains and wall. The last value of a case is the relative
/// difference of the brightness at the wall and at the axis.
#[test]
fn a_thin_cylinder_has_its_radius_and_its_grain_fraction() {
    for (cylinder_radius, radius, fraction, cupping) in [
        (9.5, 3.0, 0.05, 0.0),
        (9.5, 6.0, 0.2, 0.0),
        (10.0, 3.0, 0.15, 0.15),
        (12.5, 3.0, 0.2, 0.0),
        (13.0, 4.0, 0.26, 0.0),
        (14.0, 6.0, 0.2, 0.15),
        (16.0, 3.0, 0.18, 0.0),
        (20.0, 3.0, 0.2, 0.0),
    ] {
        let thin = Pillar::amid(SHAPE, cylinder_radius, 60.0);
        let mut scene = Scene::specimen(SHAPE, thin, radius, fraction);
        let truth = scene.fraction(thin.volume());
        scene.cup(&thin, cupping);
        let found = run(&scene.image(), None);
        let error = found.cylinder.radius_mm / VOXEL_MM - cylinder_radius;
        let ratio = found.statistics.grain_fraction / truth;
        let case = format!(
            "radius {cylinder_radius}, grains {radius}, fraction {truth:.3}, cupping {cupping}: {error:+.3}, {ratio:.4}"
        );
        println!("{case}");
        assert!(error.abs() < 0.1, "{case}");
        let is_thin = cylinder_radius < 12.0;
        assert!((ratio - 1.0).abs() < if is_thin { 0.06 } else { 0.03 }, "{case}");
        let is_warned = found
            .warnings
            .iter()
            .any(|warning| warning.contains("the grain fraction is uncertain"));
        assert_eq!(is_warned, is_thin, "{case}: {:?}", found.warnings);
    }
}

/// Dark grains in a thin cylinder have the same fraction as bright grains.
#[test]
fn a_thin_cylinder_of_dark_grains_has_its_grain_fraction() {
    let thin = Pillar::amid(SHAPE, 12.0, 60.0);
    let mut scene = Scene::filled(SHAPE, AIR);
    scene.paint(|p| thin.distance(p), GRAIN);
    scene.add_balls(&thin, 4.0, 0.15, MATRIX);
    let dark = Segmentation { contrast: Contrast::Dark, ..Segmentation::default() };
    let found = dark.run(&scene.image(), &mut |_| {}).unwrap();
    let ratio = found.statistics.grain_fraction / scene.fraction(thin.volume());
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    assert_eq!(found.regions.len(), scene.volumes.len());
}

/// In still thinner cylinders the fraction is wrong, and a warning states the limit.
#[test]
fn a_cylinder_below_the_limit_of_the_radius_causes_a_warning() {
    for (radius, is_warned) in [(8.0, true), (11.5, true), (12.5, false)] {
        let narrow = Pillar::amid(SHAPE, radius, 60.0);
        let found = run(&Scene::specimen(SHAPE, narrow, 4.0, 0.05).image(), None);
        let is_about_radius = |w: &String| w.contains("the specimen has a radius of ");
        assert_eq!(found.warnings.iter().any(is_about_radius), is_warned, "{:?}", found.warnings);
    }
}

/// The reported threshold is the grey value half way between the materials. If the user gives this value as
/// `grain_threshold`, the grains are the same.
#[test]
fn the_reported_threshold_gives_the_same_grains_when_it_is_given() {
    let scene = Scene::specimen(SHAPE, pillar(), 4.0, 0.1);
    let image = scene.image();
    let found = run(&image, None);
    let middle = f64::from(MATRIX + GRAIN) / 2.0;
    assert!((found.grain_threshold - middle).abs() < 200.0, "{}", found.grain_threshold);
    let again = run(&image, Some(found.grain_threshold));
    let [a, b] = [&found, &again].map(|found| found.statistics.grain_fraction);
    assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
}

/// Grains with hardly more contrast than the noise are separated from the matrix by their grey values alone.
#[test]
fn grains_of_low_contrast_are_separated() {
    let shape = [96; 3];
    let pillar = Pillar::amid(shape, 38.0, 78.0);
    let mut scene = Scene::filled(shape, crate::scene::AIR);
    scene.paint(|p| pillar.distance(p), MATRIX);
    scene.add_balls(&pillar, 9.0, 0.2, MATRIX + 2_500.0);
    let found = run(&scene.image_with(0.7, 833.0), None);
    let score = fem_image::score(&scene.labels(), &found.labels).unwrap();
    assert!(score.panoptic_quality > 0.8, "{score:?}");
    let ratio = found.statistics.grain_fraction / scene.fraction(pillar.volume());
    assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
}
