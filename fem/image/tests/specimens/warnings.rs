//! Tests of warnings about results that are wrong although the segmentation succeeds, and of valid images, which must
//! cause none of these warnings.

use fem_image::{Contrast, Segmentation, Segmented, SpecimenForm, SpecimenRegion, Volume};

use crate::scene::{AIR, GRAIN, MATRIX, Pillar, Scene};

const SHAPE: [usize; 3] = [80; 3];

fn pillar() -> Pillar {
    Pillar::amid(SHAPE, 32.0, 64.0)
}

fn run(image: &Volume<f32>, settings: &Segmentation) -> Segmented {
    settings.run(image, &mut |_| {}).unwrap()
}

fn contrast(contrast: Contrast) -> Segmentation {
    Segmentation { contrast, ..Segmentation::default() }
}

/// Returns the first warning that contains a text.
fn warning<'a>(found: &'a Segmented, part: &str) -> Option<&'a String> {
    found.warnings.iter().find(|warning| warning.contains(part))
}

#[track_caller]
fn assert_warned(found: &Segmented, part: &str) {
    assert!(warning(found, part).is_some(), "{part} is not in {:?}", found.warnings);
}

#[track_caller]
fn assert_silent(found: &Segmented, part: &str) {
    assert!(warning(found, part).is_none(), "{part} is in {:?}", found.warnings);
}

/// Returns a pillar of matrix with balls of another material.
fn balls(radius: f64, fraction: f64, [matrix, grain]: [f32; 2]) -> Scene {
    let mut scene = Scene::filled(SHAPE, AIR);
    scene.paint(|p| pillar().distance(p), matrix);
    scene.add_balls(&pillar(), radius, fraction, grain);
    scene
}

const EXCHANGED: &str = "grains and matrix are exchanged";

#[test]
fn dark_grains_are_reported_if_the_contrast_is_absent_or_wrong() {
    for (radius, fraction) in [(6.0, 0.2), (4.0, 0.1), (5.0, 0.3)] {
        let image = balls(radius, fraction, [GRAIN, MATRIX]).image();
        let found = run(&image, &Segmentation::default());
        assert_warned(&found, EXCHANGED);
        assert_warned(&found, "set contrast = \"dark\"");
        assert_silent(&run(&image, &contrast(Contrast::Dark)), EXCHANGED);
    }
    let image = balls(6.0, 0.2, [MATRIX, GRAIN]).image();
    let found = run(&image, &contrast(Contrast::Dark));
    assert_warned(&found, "set contrast = \"bright\"");
    // air is the brightest material, and grains are brighter than the matrix
    let mut image = balls(6.0, 0.2, [GRAIN, MATRIX]).image();
    image.values.iter_mut().for_each(|value| *value = 60_000.0 - *value);
    assert_warned(&run(&image, &contrast(Contrast::Dark)), "invert the grey values");
}

#[test]
fn bright_balls_rods_plates_and_sponges_are_not_reported_as_exchanged() {
    for (radius, fraction) in [(3.0, 0.02), (3.0, 0.3), (6.0, 0.3), (9.0, 0.05), (9.0, 0.3)] {
        let found =
            run(&balls(radius, fraction, [MATRIX, GRAIN]).image(), &Segmentation::default());
        assert_silent(&found, EXCHANGED);
    }
    let block = Segmentation { specimen: SpecimenForm::Block, ..Segmentation::default() };
    let spacing = 16.0;
    // distance from the nearest line or plane of a lattice
    let off = move |c: f64| (c / spacing - (c / spacing).round()) * spacing;
    type Body = Box<dyn Fn([f64; 3]) -> f64>;
    let bodies: [(&str, Body); 3] = [
        ("rods", Box::new(move |[x, y, _]| off(x + 3.0).hypot(off(y + 5.0)) - 4.5)),
        ("plates", Box::new(move |[x, y, _]| (off(0.8 * x + 0.6 * y)).abs() - 3.5)),
        // a structure like snow: a gyroid with more grain than air
        (
            "sponge",
            Box::new(|p| {
                let [[s, t, u], [a, b, c]] =
                    [p.map(|c| (0.35 * c).sin()), p.map(|c| (0.35 * c).cos())];
                -(s * b + t * c + u * a + 0.3) / 0.35
            }),
        ),
    ];
    for (name, body) in bodies {
        let mut scene = Scene::filled(SHAPE, MATRIX);
        scene.paint(&body, GRAIN);
        let found = run(&scene.image(), &block);
        assert!(warning(&found, EXCHANGED).is_none(), "{name}: {:?}", found.warnings);
    }
}

/// Grains that touch and overlap fill half of the specimen or more. The matrix in the gaps consists of separate parts.
#[test]
fn touching_grains_are_not_reported_as_exchanged() {
    let block = |contrast| Segmentation {
        contrast,
        specimen: SpecimenForm::Block,
        ..Segmentation::default()
    };
    for (fraction, radius) in [(0.5, 4.0), (0.6, 4.0), (0.6, 6.0)] {
        for (contrast, materials) in
            [(Contrast::Bright, [MATRIX, GRAIN]), (Contrast::Dark, [GRAIN, MATRIX])]
        {
            let mut scene = Scene::filled(SHAPE, materials[0]);
            let found_fraction = scene.add_touching_balls(radius, fraction, materials[1]);
            let found = run(&scene.image(), &block(contrast));
            println!(
                "{contrast:?}, radius {radius}, fraction {found_fraction:.3}: {:.3}, {:?}",
                found.statistics.grain_fraction, found.warnings
            );
            assert_silent(&found, EXCHANGED);
        }
    }
}

/// Separate dark cubes fill more than half of the specimen. Their flat faces have no curvature.
#[test]
fn dense_separate_dark_grains_are_reported_as_exchanged() {
    let (side, pitch) = (10.0, 12.0);
    let mut scene = Scene::filled(SHAPE, GRAIN);
    let cubes = move |p: [f64; 3]| {
        let off = p.map(|c| (c / pitch - (c / pitch).round()).abs() * pitch - side / 2.0);
        off.into_iter().fold(f64::NEG_INFINITY, f64::max)
    };
    scene.paint(cubes, MATRIX);
    let block = Segmentation { specimen: SpecimenForm::Block, ..Segmentation::default() };
    let found = run(&scene.image(), &block);
    println!("{:?}", found.warnings);
    assert_warned(&found, EXCHANGED);
}

/// Neutrons are scattered by the water in the outer layer of a specimen, which is then bright.
#[test]
fn a_bright_skin_is_reported() {
    let plain = balls(5.0, 0.2, [MATRIX, GRAIN]);
    let mut with_skin = plain.clone();
    let [x0, y0] = pillar().centre;
    with_skin.paint(|p| pillar().distance(p).max(28.0 - (p[0] - x0).hypot(p[1] - y0)), GRAIN);
    let found = run(&with_skin.image(), &Segmentation::default());
    assert_warned(&found, "if the specimen has a skin");
    assert_silent(&run(&plain.image(), &Segmentation::default()), "if the specimen has a skin");
    let region = SpecimenRegion {
        centre_px: Some([x0, y0]),
        radius_px: Some(26.0),
        slices: Some([12, 68]),
        mask: None,
    };
    let found = run(&with_skin.image(), &Segmentation { region, ..Segmentation::default() });
    assert_silent(&found, "if the specimen has a skin");
}

const BEYOND: &str = "the image shows only a part of the specimen";

#[test]
fn a_specimen_beyond_the_image_is_reported() {
    let inner = pillar();
    for (truth, part) in [
        (Pillar { ends: [-6.0, 60.0], ..inner }, "reaches the first slice"),
        (Pillar { ends: [12.0, 90.0], ..inner }, "reaches the last slice"),
        (Pillar { centre: [28.0, 40.0], ..inner }, "extends 4.0 voxels beyond the image along x"),
    ] {
        let found = run(&Scene::specimen(SHAPE, truth, 5.0, 0.1).image(), &Segmentation::default());
        assert_warned(&found, BEYOND);
        assert_warned(&found, part);
    }
    let whole = Scene::specimen(SHAPE, inner, 5.0, 0.1).image();
    assert_silent(&run(&whole, &Segmentation::default()), BEYOND);
}

#[test]
fn an_end_without_grains_is_reported() {
    // a pedestal with the radius and the grey value of the matrix
    let truth = Pillar { ends: [18.0, 72.0], ..pillar() };
    let mut scene = Scene::specimen(SHAPE, truth, 5.0, 0.2);
    let pedestal = Pillar { ends: [8.0, 18.5], ..truth };
    let whole = scene.image();
    assert_silent(&run(&whole, &Segmentation::default()), "contain no grain");
    scene.paint(|p| pedestal.distance(p), MATRIX);
    let found = run(&scene.image(), &Segmentation::default());
    assert_warned(&found, "contain no grain");
    assert_warned(&found, "the lower 1");
}

#[test]
fn a_region_larger_than_the_specimen_is_reported_and_larger_than_the_image_is_refused() {
    let image = Scene::specimen(SHAPE, pillar(), 5.0, 0.2).image();
    let with = |radius: f64, slices: [usize; 2]| Segmentation {
        region: SpecimenRegion {
            centre_px: Some([40.0, 40.0]),
            radius_px: Some(radius),
            slices: Some(slices),
            mask: None,
        },
        ..Segmentation::default()
    };
    let larger = "where [specimen.image.region] is larger than the specimen";
    let found = run(&image, &with(35.0, [12, 68]));
    assert_warned(&found, larger);
    assert_warned(&found, "3.0 voxels beyond the wall");
    assert_warned(&run(&image, &with(30.0, [5, 68])), "4.0 voxels below the specimen");
    assert_silent(&run(&image, &with(32.0, [9, 72])), larger);
    let part = SpecimenRegion { slices: Some([9, 79]), ..SpecimenRegion::default() };
    let found = run(&image, &Segmentation { region: part, ..Segmentation::default() });
    assert_warned(&found, "7.0 voxels above the specimen");
    let error = with(60.0, [12, 68]).run(&image, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("region.radius_px = 60 must be at most half"), "{error}");
}

/// Blur mixes air into the grains beside thin voids.
#[test]
fn thin_voids_are_reported_with_their_effect_on_the_fraction() {
    let mut scene = balls(6.0, 0.2, [MATRIX, GRAIN]);
    let plain = scene.image();
    let truth = scene.fraction(pillar().volume());
    // a crack of 1.5 voxels through the middle of the specimen
    let crack = |[x, y, z]: [f64; 3]| {
        let ball = (x - 40.0).hypot(y - 40.0).hypot(z - 40.0) - 26.0;
        ((0.6 * (x - 40.0) + 0.8 * (z - 40.0)).abs() - 0.75).max(ball)
    };
    scene.paint(crack, AIR);
    let found = run(&scene.image(), &Segmentation::default());
    assert!((0.001..0.02).contains(&found.void_fraction), "{}", found.void_fraction);
    assert!(found.statistics.grain_fraction < 0.99 * truth, "{truth}");
    assert_warned(
        &found,
        "the grain fraction may be too small by several times the share of voids",
    );
    assert_silent(&run(&plain, &Segmentation::default()), "share of voids");
}

/// The measured share of voids of specimens without voids is far below the bound of the warning, which is 0.1 %.
#[test]
fn specimens_without_voids_have_no_voids() {
    for (radius, fraction) in [(3.0, 0.05), (4.0, 0.2), (6.0, 0.3)] {
        for (materials, contrast_of) in
            [([MATRIX, GRAIN], Contrast::Bright), ([GRAIN, MATRIX], Contrast::Dark)]
        {
            let scene = balls(radius, fraction, materials);
            for (blur, noise) in [(0.01, 0.0), (0.7, 1_400.0), (0.7, 6_000.0), (1.5, 1_400.0)] {
                let found = run(&scene.image_with(blur, noise), &contrast(contrast_of));
                let share = found.void_fraction;
                assert!(
                    share < 1e-4,
                    "{radius} {fraction} {contrast_of:?} {blur} {noise}: {share}"
                );
            }
        }
    }
}

#[test]
fn grains_without_a_model_of_the_blur_are_reported() {
    // one ball has fewer voxels than the model needs
    let shape = [56, 56, 60];
    let plain = Pillar::amid(shape, 20.0, 40.0);
    let mut scene = Scene::filled(shape, AIR);
    scene.paint(|p| plain.distance(p), MATRIX);
    scene.add_ball([28.0, 28.0, 30.0], 3.0, GRAIN);
    let settings = Segmentation { min_grain_voxels: 10, ..Segmentation::default() };
    let found = run(&scene.image_with(0.7, 100.0), &settings);
    assert_warned(&found, "no model of the two blurred materials could be fitted");
    let wide = Scene::specimen(SHAPE, pillar(), 4.0, 0.05);
    let found = run(&wide.image(), &Segmentation::default());
    assert_silent(&found, "no model of the two blurred materials");
}
