//! Tests of grains that are darker than the matrix.

use fem_image::{Contrast, Segmentation, Segmented, SpecimenForm, Volume, score};

use crate::scene::{AIR, Pillar, Scene};

const SHAPE: [usize; 3] = [80; 3];
/// Grey values of matrix and grain, with the contrast of the bright grains in other tests.
const MATRIX: f32 = 44_000.0;
const GRAIN: f32 = 28_000.0;
const WHITE: f32 = 60_000.0;

fn pillar() -> Pillar {
    Pillar::amid(SHAPE, 32.0, 64.0)
}

fn scene() -> Scene {
    let mut scene = Scene::filled(SHAPE, AIR);
    scene.paint(|p| pillar().distance(p), MATRIX);
    scene.add_balls(&pillar(), 6.0, 0.2, GRAIN);
    scene
}

fn inverted(image: &Volume<f32>) -> Volume<f32> {
    let values = image.values.iter().map(|value| WHITE - value).collect();
    Volume::new(image.shape, image.voxel_mm, values).unwrap()
}

fn run(image: &Volume<f32>, settings: &Segmentation) -> Segmented {
    settings.run(image, &mut |_| {}).unwrap()
}

fn dark() -> Segmentation {
    Segmentation { contrast: Contrast::Dark, ..Segmentation::default() }
}

fn assert_found(found: &Segmented, scene: &Scene, cylinder: f64) {
    assert_eq!(found.regions.len(), scene.volumes.len());
    let ratio = found.statistics.grain_fraction / scene.fraction(cylinder);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    let score = score(&scene.labels(), &found.labels).unwrap();
    assert!(score.panoptic_quality > 0.93, "{score:?}");
}

/// Dark grains are segmented as accurately as bright grains, both if air is the darkest and if air is the brightest
/// material.
#[test]
fn dark_grains_are_segmented_in_dark_and_in_bright_air() {
    let scene = scene();
    let image = scene.image();
    let middle = f64::from(MATRIX + GRAIN) / 2.0;
    let found = run(&image, &dark());
    assert_found(&found, &scene, pillar().volume());
    assert!((found.grain_threshold - middle).abs() < 300.0, "{}", found.grain_threshold);
    assert!(found.void_threshold.is_some_and(|grey| grey > f64::from(AIR) && grey < 28_000.0));
    assert!((found.cylinder.radius_mm - 0.32).abs() < 0.002, "{:?}", found.cylinder);
    let by_hand = run(&image, &Segmentation { grain_threshold: Some(middle), ..dark() });
    assert_found(&by_hand, &scene, pillar().volume());

    // the inverted image of the same specimen has bright grains in bright air
    let mut bright = Scene::filled(SHAPE, AIR);
    bright.paint(|p| pillar().distance(p), GRAIN);
    bright.add_balls(&pillar(), 6.0, 0.2, MATRIX);
    let image = inverted(&bright.image());
    let found = run(&image, &dark());
    assert_found(&found, &bright, pillar().volume());
    let middle = f64::from(WHITE) - middle;
    assert!((found.grain_threshold - middle).abs() < 300.0, "{}", found.grain_threshold);
    let thresholds = Segmentation {
        grain_threshold: Some(middle),
        void_threshold: found.void_threshold,
        ..dark()
    };
    assert_found(&run(&image, &thresholds), &bright, pillar().volume());
    // the error message suggests settings for this image
    let error = Segmentation::default().run(&image, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("contrast = \"dark\""), "{error}");
}

/// The blurred rim of a void has the grey values of dark grains, but the rim is not segmented as a grain.
#[test]
fn the_rims_of_voids_are_not_segmented_as_grains() {
    let mut scene = scene();
    let pores = [[40.0, 40.0, 20.0], [30.0, 52.0, 40.0], [50.0, 44.0, 58.0]];
    let away = |p: [f64; 3], middle: [f64; 3]| {
        (0..3).map(|k| (p[k] - middle[k]).powi(2)).sum::<f64>().sqrt() - 5.0
    };
    for pore in pores {
        scene.paint(|p| away(p, pore), AIR);
    }
    let found = run(&scene.image(), &dark());
    let (mut rim, mut shell) = (0, 0);
    for (at, label) in
        found.labels.values.iter().enumerate().filter(|(at, _)| scene.truth[*at] == 0)
    {
        let p = [at % 80, at / 80 % 80, at / 6400].map(|c| c as f64 + 0.5);
        if pores.iter().any(|pore| away(p, *pore).abs() < 2.0) {
            shell += 1;
            rim += usize::from(*label != 0);
        }
    }
    assert!(rim * 50 < shell, "{rim} of {shell} voxels");
    let volume = 3.0 * 4.0 / 3.0 * std::f64::consts::PI * 125.0 / pillar().volume();
    assert!((found.void_fraction / volume - 1.0).abs() < 0.2, "{} {volume}", found.void_fraction);
}

/// A block has no surroundings: its voids are the voxels darker than the given threshold.
#[test]
fn dark_grains_of_a_block_are_segmented() {
    let scene = scene();
    let image = scene.image();
    let side = 40;
    let cut = |volume: &Volume<f32>| {
        let voxels =
            (0..side * side * side).map(|n| [n % side, n / side % side, n / (side * side)]);
        let values = voxels.map(|voxel| *volume.at(voxel.map(|c| c + 20))).collect();
        Volume::new([side; 3], volume.voxel_mm, values).unwrap()
    };
    let block = Segmentation { specimen: SpecimenForm::Block, ..dark() };
    let found = run(&cut(&image), &block);
    let truth = scene.labels();
    let grains = (0..side * side * side)
        .filter(|n| *truth.at([n % side, n / side % side, n / (side * side)].map(|c| c + 20)) != 0)
        .count();
    let ratio = found.statistics.voxel_fraction * side.pow(3) as f64 / grains as f64;
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    assert!(found.block && found.void_threshold.is_none());
}
