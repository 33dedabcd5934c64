//! Tests of the location of specimens that are off-centre, on or in other objects, or located by the user.

use fem_image::{Contrast, ImageError, Segmentation, Segmented, SpecimenRegion, Volume};

use crate::scene::{AIR, GRAIN, MATRIX, Pillar, Scene, VOXEL_MM};

const SHAPE: [usize; 3] = [80; 3];

fn pillar() -> Pillar {
    Pillar::amid(SHAPE, 30.0, 60.0)
}

fn run(image: &Volume<f32>) -> Segmented {
    Segmentation::default().run(image, &mut |_| {}).unwrap()
}

fn assert_found(found: &Segmented, truth: &Pillar) {
    let cylinder = found.cylinder;
    let near = |mm: f64, voxels: f64| {
        assert!((mm / VOXEL_MM - voxels).abs() < 0.3, "{cylinder:?}, truly {truth:?}");
    };
    assert!(!found.block);
    near(cylinder.radius_mm, truth.radius);
    near(cylinder.bottom_mm, truth.ends[0]);
    near(cylinder.top_mm, truth.ends[1]);
    near(cylinder.centre_mm[0], truth.centre[0]);
    near(cylinder.centre_mm[1], truth.centre[1]);
}

#[test]
fn plain_cylinders_are_located_at_any_position() {
    let centre = [28.0, 52.0];
    for truth in [Pillar::amid(SHAPE, 13.0, 60.0), Pillar { centre, radius: 21.0, ..pillar() }] {
        for fraction in [0.02, 0.2] {
            let scene = Scene::specimen(SHAPE, truth, 4.0, fraction);
            let found = run(&scene.image());
            assert_found(&found, &truth);
            assert_eq!(found.warnings, Vec::<String>::new());
        }
    }
}

#[test]
fn a_tube_around_the_specimen_is_removed_with_a_warning() {
    let truth = Pillar { radius: 26.0, ..pillar() };
    let mut scene = Scene::specimen(SHAPE, truth, 5.0, 0.2);
    let [x0, y0] = truth.centre;
    let off = |x: f64, y: f64| (x - x0).hypot(y - y0);
    scene.paint(|[x, y, z]| (off(x, y) - 35.0).max(31.0 - off(x, y)).max(3.0 - z), MATRIX);
    let found = run(&scene.image());
    assert_found(&found, &truth);
    assert!(
        found.warnings.iter().any(|told| told.contains("a tube of 31.0")),
        "{:?}",
        found.warnings
    );
}

#[test]
fn a_pedestal_is_removed_with_a_warning() {
    let truth = pillar();
    let mut scene = Scene::specimen(SHAPE, truth, 5.0, 0.2);
    let [x0, y0] = truth.centre;
    scene.paint(|[x, y, z]| ((x - x0).hypot(y - y0) - 25.0).max(z - truth.ends[0]), MATRIX);
    let found = run(&scene.image());
    assert_found(&found, &truth);
    assert!(
        found.warnings.iter().any(|told| told.contains("as a pedestal")),
        "{:?}",
        found.warnings
    );
    let ratio = found.statistics.grain_fraction / scene.fraction(truth.volume());
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

/// Returns the signed distance of a point from a cylinder that leans along x; negative inside. The middle of its axis is
/// `middle`, and `slope` is dx/dz of the axis.
fn leaning(middle: [f64; 3], [radius, height]: [f64; 2], slope: f64, p: [f64; 3]) -> f64 {
    let cos = (1.0 + slope * slope).sqrt().recip();
    let [x, y, z] = [0, 1, 2].map(|k| p[k] - middle[k]);
    let (across, along) = (cos * (x - slope * z), cos * (slope * x + z));
    (across.hypot(y) - radius).max(along.abs() - height / 2.0)
}

/// Returns a cylinder that leans along x, with balls on its axis.
fn leaning_specimen(middle: [f64; 3], size: [f64; 2], slope: f64) -> Scene {
    let mut scene = Scene::filled(SHAPE, AIR);
    scene.paint(|p| leaning(middle, size, slope, p), MATRIX);
    let cos = (1.0 + slope * slope).sqrt().recip();
    let count = (size[1] / 13.0) as usize;
    for n in 0..count {
        let along = 13.0 * (n as f64 - (count as f64 - 1.0) / 2.0);
        let off = [slope * cos * along, 0.0, cos * along];
        scene.add_ball([0, 1, 2].map(|k| middle[k] + off[k]), 5.0, GRAIN);
    }
    scene
}

/// The sections of a leaning cylinder are ellipses, whose area exceeds the area of the cylinder's circle.
#[test]
fn a_cylinder_that_leans_by_25_degrees_is_located() {
    let (size, slope) = ([20.0, 50.0], 25.0_f64.to_radians().tan());
    let found = run(&leaning_specimen([40.0, 40.0, 40.0], size, slope).image());
    let cylinder = found.cylinder;
    assert!((cylinder.lean[0] - slope).abs() < 0.005, "{cylinder:?}");
    for (mm, voxels) in [(cylinder.radius_mm, size[0]), (cylinder.height_mm(), size[1])] {
        assert!((mm / VOXEL_MM - voxels).abs() < 0.4, "{cylinder:?}");
    }
    assert_eq!(found.warnings, Vec::<String>::new());
}

/// The lower edge of a leaning specimen stands on a pedestal with the radius of the specimen, or the specimen stands on
/// a narrower pedestal that leans like the specimen.
#[test]
fn a_pedestal_below_a_leaning_specimen_is_removed_with_a_warning() {
    let (size, slope) = ([26.0, 52.0], 0.08);
    let middle = [40.0, 40.0, 44.0];
    let upright = |[x, y, z]: [f64; 3]| ((x - 40.0).hypot(y - 40.0) - 26.0).max(z - 13.0);
    let narrower = |p: [f64; 3]| {
        let below = leaning(middle, [20.0, 200.0], slope, p);
        below.max((slope * (p[0] - middle[0]) + p[2] - middle[2]) / 1.0032 + 26.0)
    };
    for pedestal in [&upright as &dyn Fn([f64; 3]) -> f64, &narrower] {
        let mut scene = leaning_specimen(middle, size, slope);
        scene.paint(pedestal, MATRIX);
        let found = run(&scene.image());
        let cylinder = found.cylinder;
        assert!(found.warnings.iter().any(|w| w.contains("as a pedestal")), "{:?}", found.warnings);
        assert!((cylinder.radius_mm / VOXEL_MM - size[0]).abs() < 0.4, "{cylinder:?}");
        assert!((cylinder.height_mm() / VOXEL_MM - size[1]).abs() < 1.0, "{cylinder:?}");
        // the middle of the axis has moved with the lower end
        let truth = middle.map(|c| c * VOXEL_MM);
        let found_middle = cylinder.to_image([0.0, 0.0, cylinder.height_mm() / 2.0]);
        assert!(
            (0..3).all(|k| (found_middle[k] - truth[k]).abs() < 0.7 * VOXEL_MM),
            "{cylinder:?}"
        );
    }
}

/// Layers of matrix without grains at both ends change neither the location nor the grain fraction.
#[test]
fn layers_without_grains_at_the_ends_belong_to_the_specimen() {
    for (radius, fraction, layer) in [(4.0, 0.1, 6.0), (5.0, 0.25, 12.0), (9.0, 0.25, 18.0)] {
        let truth = pillar();
        let [bottom, top] = truth.ends;
        let inner = Pillar { ends: [bottom + layer, top - layer], ..truth };
        let mut scene = Scene::filled(SHAPE, AIR);
        scene.paint(|p| truth.distance(p), MATRIX);
        scene.add_balls(&inner, radius, fraction, GRAIN);
        let found = run(&scene.image());
        assert_found(&found, &truth);
        let ratio = found.statistics.grain_fraction / scene.fraction(truth.volume());
        println!(
            "radius {radius}, fraction {fraction}, layers of {layer}: {ratio} {:?}",
            found.warnings
        );
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}

/// A reconstruction writes one exact value outside its circle, which must not be classified as air.
#[test]
fn the_circle_of_the_reconstruction_is_not_the_wall() {
    let truth = pillar();
    let mut image = Scene::specimen(SHAPE, truth, 5.0, 0.2).image();
    for (n, value) in image.values.iter_mut().enumerate() {
        let [x, y] = [n % 80, n / 80 % 80].map(|c| c as f64 - 39.5);
        if x.hypot(y) > 39.0 {
            *value = 0.0;
        }
    }
    assert_found(&run(&image), &truth);
}

#[test]
fn a_given_region_overrides_the_fitted_cylinder() {
    let truth = pillar();
    let image = Scene::specimen(SHAPE, truth, 5.0, 0.2).image();
    let region = SpecimenRegion {
        centre_px: Some([39.0, 41.0]),
        radius_px: Some(25.0),
        slices: Some([16, 60]),
        mask: None,
    };
    let with = |region: SpecimenRegion| Segmentation { region, ..Segmentation::default() };
    let found = with(region.clone()).run(&image, &mut |_| {}).unwrap();
    let given = Pillar { centre: [39.0, 41.0], radius: 25.0, ends: [15.0, 60.0] };
    assert_found(&found, &given);
    // the user gives only the slices; the other values are determined from the image
    let part = SpecimenRegion { slices: Some([16, 60]), ..SpecimenRegion::default() };
    let found = with(part).run(&image, &mut |_| {}).unwrap();
    assert_found(&found, &Pillar { ends: [15.0, 60.0], ..truth });
    // a region outside the image is rejected with the name of the key
    let beyond = SpecimenRegion { slices: Some([16, 81]), ..region };
    let error = with(beyond).run(&image, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("region.slices = 81"), "{error}");
}

/// A region inside the specimen cuts grains. The fraction refers to the parts of the grains inside the region.
#[test]
fn a_region_inside_the_specimen_has_the_fraction_of_the_region() {
    let region = SpecimenRegion {
        centre_px: Some([40.0, 40.0]),
        radius_px: Some(20.0),
        slices: Some([21, 60]),
        mask: None,
    };
    let cut = Pillar { centre: [40.0, 40.0], radius: 20.0, ends: [20.0, 60.0] };
    let is_in_region = |at: usize| {
        let voxel = [at % SHAPE[0], at / SHAPE[0] % SHAPE[1], at / (SHAPE[0] * SHAPE[1])];
        cut.distance(voxel.map(|c| c as f64 + 0.5)) < 0.0
    };
    for (contrast, [matrix, grain]) in
        [(Contrast::Bright, [MATRIX, GRAIN]), (Contrast::Dark, [GRAIN, MATRIX])]
    {
        let mut scene = Scene::filled(SHAPE, AIR);
        let specimen = Pillar::amid(SHAPE, 34.0, 68.0);
        scene.paint(|p| specimen.distance(p), matrix);
        scene.add_balls(&specimen, 5.0, 0.3, grain);
        let shares = (0..scene.grey.len())
            .filter(|&at| is_in_region(at))
            .map(|at| f64::from((scene.grey[at] - matrix) / (grain - matrix)));
        let truth = shares.sum::<f64>() / cut.volume();
        let settings = Segmentation { region: region.clone(), contrast, ..Segmentation::default() };
        let found = settings.run(&scene.image(), &mut |_| {}).unwrap().statistics;
        let [grey, voxels] = [found.grain_fraction, found.voxel_fraction];
        println!("{contrast:?} {truth}: {grey} from grey values, {voxels} from voxels");
        assert!((grey / truth - 1.0).abs() < 0.03, "{contrast:?}: {grey} instead of {truth}");
        assert!((voxels / truth - 1.0).abs() < 0.03, "{contrast:?}: {voxels} instead of {truth}");
    }
}

#[test]
fn a_mask_defines_the_specimen() {
    let truth = pillar();
    let image = Scene::specimen(SHAPE, truth, 5.0, 0.2).image();
    let inner = Pillar { radius: 22.0, ends: [20.0, 60.0], ..truth };
    let mask = |pillar: Pillar| {
        let mut scene = Scene::filled(SHAPE, 0.0);
        scene.paint(|p| pillar.distance(p), 255.0);
        Volume::new(SHAPE, VOXEL_MM, scene.grey).unwrap()
    };
    let settings = Segmentation::default();
    let found = settings.run_masked(&image, Some(&mask(inner)), &mut |_| {}).unwrap();
    assert_found(&found, &inner);
    let small = Volume::new([2; 3], VOXEL_MM, vec![1.0; 8]).unwrap();
    let error = settings.run_masked(&image, Some(&small), &mut |_| {}).unwrap_err();
    assert!(matches!(error, ImageError::Mask { .. }), "{error}");
}
