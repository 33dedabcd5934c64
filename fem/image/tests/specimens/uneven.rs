//! Tests of images in which the brightness or the grain fraction varies along the axis.

use fem_image::{Segmentation, Segmented, score};

use crate::scene::{AIR, GRAIN, MATRIX, Pillar, Scene};

const SHAPE: [usize; 3] = [80; 3];

fn pillar() -> Pillar {
    Pillar::amid(SHAPE, 32.0, 64.0)
}

/// Returns a specimen with balls only in its lower half.
fn filled_below() -> Scene {
    let pillar = pillar();
    let mut scene = Scene::filled(SHAPE, AIR);
    scene.paint(|p| pillar.distance(p), MATRIX);
    let below = Pillar { ends: [pillar.ends[0], 40.0], ..pillar };
    scene.add_balls(&below, 6.0, 0.2, GRAIN);
    scene
}

/// Returns the scene with a brightness that rises by 20 % from the lowest slice to the highest slice.
fn drifting(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let area = SHAPE[0] * SHAPE[1];
    for (at, grey) in scene.grey.iter_mut().enumerate() {
        let height = ((at / area) as f32 + 0.5) / SHAPE[2] as f32 - 0.5;
        *grey = AIR + (*grey - AIR) * (1.0 + 0.2 * height);
    }
    scene
}

fn run(scene: &Scene) -> Segmented {
    Segmentation::default().run(&scene.image(), &mut |_| {}).unwrap()
}

/// Returns the panoptic quality, and the grain fraction divided by the true fraction.
fn quality(found: &Segmented, scene: &Scene) -> [f64; 2] {
    let quality = score(&scene.labels(), &found.labels).unwrap().panoptic_quality;
    [quality, found.statistics.grain_fraction / scene.fraction(pillar().volume())]
}

#[test]
fn drift_along_the_axis_does_not_reduce_the_quality() {
    for scene in [Scene::specimen(SHAPE, pillar(), 6.0, 0.2), filled_below()] {
        let even = run(&scene);
        assert!((even.top_over_bottom - 1.0).abs() < 0.005, "{}", even.top_over_bottom);
        let found = run(&drifting(&scene));
        // the height of the specimen is 0.8 of the height of the image
        let truth = (1.0 + 0.08) / (1.0 - 0.08);
        assert!((found.top_over_bottom - truth).abs() < 0.005, "{}", found.top_over_bottom);
        let [[even_quality, even_ratio], [quality, ratio]] =
            [quality(&even, &scene), quality(&found, &scene)];
        println!("{even_quality} {quality}, {even_ratio} {ratio}");
        assert!(quality > even_quality - 0.002, "{quality}, without drift {even_quality}");
        assert!((even_ratio - 1.0).abs() < 0.01 && (ratio - 1.0).abs() < 0.01, "{ratio}");
    }
}

/// Grains in only one part of the specimen are not mistaken for a variation of brightness: the result is the same as
/// without correction of brightness.
#[test]
fn grains_in_one_half_only_are_not_mistaken_for_drift() {
    let scene = filled_below();
    let found = run(&scene);
    let as_it_is = Segmentation { beam_hardening: false, ..Segmentation::default() };
    let left = as_it_is.run(&scene.image(), &mut |_| {}).unwrap();
    assert!((left.grain_threshold / found.grain_threshold - 1.0).abs() < 0.005);
    let same = score(&left.labels, &found.labels).unwrap();
    assert!(same.panoptic_quality > 0.99, "{same:?}");
    assert_eq!(found.regions.len(), scene.volumes.len());
}
