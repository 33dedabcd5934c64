//! Tests of labels given by the user: all integer types, phases, instances, background, and invalid input.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use ::tiff::encoder::TiffEncoder;
use ::tiff::encoder::TiffValue;
use ::tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32, Gray32Float, GrayI8, GrayI16, GrayI32,
};
use fem_image::{
    ImageError, LabelPhase, LabelRules, LabelledSpecimen, ReadOptions, SpecimenForm,
    SpecimenRegion, Volume, read_label_values,
};

const SHAPE: [usize; 3] = [5, 4, 3];

fn write<C: ColorType>(path: &Path, value: impl Fn(usize) -> C::Inner)
where
    [C::Inner]: TiffValue,
{
    let mut encoder = TiffEncoder::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    let area = SHAPE[0] * SHAPE[1];
    for z in 0..SHAPE[2] {
        let slice: Vec<C::Inner> = (z * area..(z + 1) * area).map(&value).collect();
        encoder.write_image::<C>(SHAPE[0] as u32, SHAPE[1] as u32, &slice).unwrap();
    }
}

#[test]
fn labels_of_every_integer_type_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("labels.tif");
    let options = ReadOptions { voxel_mm: Some(0.1), ..ReadOptions::default() };
    let read = || read_label_values(&path, &options).unwrap().volume;
    let expected = |value: &dyn Fn(i64) -> i64| -> Vec<i64> { (0..60).map(value).collect() };
    write::<Gray8>(&path, |n| 4 * n as u8);
    assert_eq!(read().values, expected(&|n| 4 * n));
    assert_eq!(read().shape, SHAPE);
    write::<GrayI8>(&path, |n| n as i8 - 30);
    assert_eq!(read().values, expected(&|n| n - 30));
    write::<Gray16>(&path, |n| 65_535 - n as u16);
    assert_eq!(read().values, expected(&|n| 65_535 - n));
    write::<GrayI16>(&path, |n| -32_768 + n as i16);
    assert_eq!(read().values, expected(&|n| -32_768 + n));
    write::<Gray32>(&path, |n| u32::MAX - n as u32);
    assert_eq!(read().values, expected(&|n| i64::from(u32::MAX) - n));
    write::<GrayI32>(&path, |n| i32::MIN + n as i32);
    assert_eq!(read().values, expected(&|n| i64::from(i32::MIN) + n));
    write::<Gray32Float>(&path, |n| n as f32 - 1.0);
    assert_eq!(read().values, expected(&|n| n - 1));
    write::<Gray32Float>(&path, |n| n as f32 + 0.5);
    let error = read_label_values(&path, &options).unwrap_err().to_string();
    assert!(error.contains("page 1") && error.contains("0.5"), "{error}");
}

fn phase(first: i64, last: i64, name: &str) -> LabelPhase {
    LabelPhase { first, last, name: name.into() }
}

fn run(rules: &LabelRules, image: &Volume<i64>) -> Result<LabelledSpecimen, ImageError> {
    rules.run(image, &mut |_| ())
}

/// Returns a cylinder of matrix (label 1) with radius 20 and height 30 in background (label 9), away from the middle of
/// the image. It contains two separate balls of label 4, a ball of label 5, a box of label 7 and a pore of label 2.
fn scene() -> Volume<i64> {
    let shape = [56, 50, 40];
    let values = (0..shape.iter().product()).map(|n| {
        let [x, y, z] = [n % shape[0], n / shape[0] % shape[1], n / (shape[0] * shape[1])]
            .map(|c| c as f64 + 0.5);
        let ball = |at: [f64; 3], r: f64| {
            (x - at[0]).powi(2) + (y - at[1]).powi(2) + (z - at[2]).powi(2) < r * r
        };
        let is_within = |c: f64, low: f64| (low..low + 4.0).contains(&c);
        match () {
            () if (x - 30.0).hypot(y - 25.0) >= 20.0 || !(6.0..36.0).contains(&z) => 9,
            () if ball([24.0, 25.0, 14.0], 6.0) || ball([38.0, 25.0, 14.0], 6.0) => 4,
            () if ball([30.0, 25.0, 27.0], 5.0) => 5,
            () if is_within(x, 28.0) && is_within(y, 12.0) && is_within(z, 20.0) => 7,
            () if ball([30.0, 36.0, 20.0], 3.0) => 2,
            () => 1,
        }
    });
    Volume::new(shape, 0.1, values.collect()).unwrap()
}

#[test]
fn parts_of_phases_become_grains_of_a_cylinder_in_background() {
    let image = scene();
    let count = |label: i64| image.values.iter().filter(|&&value| value == label).count();
    let phases = vec![
        phase(1, 1, "matrix"),
        phase(4, 4, "grain"),
        phase(5, 6, "inclusion"),
        phase(7, 7, "inclusion"),
        phase(2, 2, "void"),
        phase(11, 11, "crust"),
    ];
    let rules = LabelRules { background: Some(9), phases, ..LabelRules::default() };
    let found = run(&rules, &image).unwrap();
    assert_eq!(found.phases, ["grain", "inclusion", "void", "crust"]);
    // grains are ordered by label, then by first voxel
    assert_eq!(found.label_of, [2, 4, 4, 5, 7]);
    assert_eq!(found.phase_of, [2, 0, 0, 1, 1]);
    let voxels: Vec<usize> = found.regions.iter().map(|region| region.voxels).collect();
    assert_eq!((voxels[0], voxels[3], voxels[4]), (count(2), count(5), 64));
    assert_eq!(voxels[1] + voxels[2], count(4));
    assert!((found.regions[1].centroid_mm[0] - 2.4).abs() < 1e-9, "{:?}", found.regions[1]);
    assert_eq!(found.statistics.grains, 4);
    let exact = std::f64::consts::PI * 4.0 * 3.0;
    assert!((found.statistics.volume_mm3 / exact - 1.0).abs() < 0.01, "{:?}", found.statistics);
    let share = |voxels: usize| voxels as f64 * 1e-3 / found.statistics.volume_mm3;
    let of_grains = share(count(4) + count(5) + 64);
    assert!((found.statistics.grain_fraction - of_grains).abs() < 1e-12);
    assert!((found.fraction_of(0) - share(count(4))).abs() < 1e-12);
    let cylinder = found.cylinder;
    assert!(!found.block && (cylinder.radius_mm - 2.0).abs() < 0.02, "{cylinder:?}");
    let [x, y] = cylinder.centre_mm;
    assert!((x - 3.0).abs() < 0.02 && (y - 2.5).abs() < 0.02, "{cylinder:?}");
    let ends = [cylinder.bottom_mm - 0.6, cylinder.top_mm - 3.6];
    assert!(ends.iter().all(|off| off.abs() < 0.02), "{cylinder:?}");
    assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
    assert!(found.warnings[0].contains("no voxel of the phase crust"), "{:?}", found.warnings);
    // the result does not depend on the number of threads
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = pool.install(|| run(&rules, &image)).unwrap();
    assert_eq!((alone.labels, alone.regions), (found.labels, found.regions));
}

#[test]
fn without_phases_each_label_is_a_grain_and_background_in_the_specimen_gives_a_warning() {
    let mut image = scene();
    let mut change = |from: i64, to: i64| {
        image.values.iter_mut().filter(|label| **label == from).for_each(|label| *label = to);
    };
    change(1, 0);
    // the pore has the label of the background, and one label is negative
    change(2, 9);
    change(7, -3);
    let rules = LabelRules { background: Some(9), ..LabelRules::default() };
    let found = run(&rules, &image).unwrap();
    assert_eq!((found.label_of, found.phases), (vec![-3, 4, 5], vec!["grain".to_owned()]));
    let part = "% of the voxels in the specimen have the label of the background";
    assert!(found.warnings.iter().any(|w| w.contains(part)), "{:?}", found.warnings);

    // without background the image is a block
    image.values.iter_mut().filter(|label| **label == 9).for_each(|label| *label = 0);
    let found = run(&LabelRules::default(), &image).unwrap();
    assert!(found.block && found.warnings.is_empty(), "{:?}", found.warnings);
    assert!((found.cylinder.radius_mm - 2.5).abs() < 1e-12);
    assert!((found.statistics.volume_mm3 - 5.6 * 5.0 * 4.0).abs() < 1e-9);
}

/// A region excludes a tube with a separate label, and the slices beyond the specimen.
/// Returns an image of separate cubes in the label 0. The cubes are in a cylinder or in the whole image.
fn cubes(is_cylinder: bool) -> Volume<i64> {
    let values = (0..40_usize.pow(3)).map(|n| {
        let [x, y, z] = [n % 40, n / 40 % 40, n / 1600];
        let cell = [x / 8, y / 8, z / 8];
        let is_cube = [x, y, z].iter().all(|c| (2..6).contains(&(c % 8)));
        let off = [cell[0], cell[1]].map(|c| 8.0 * c as f64 - 16.0);
        let is_out = is_cylinder && off[0].hypot(off[1]) > 15.0;
        if is_cube && !is_out { 1 + (cell[0] + 5 * (cell[1] + 5 * cell[2])) as i64 } else { 0 }
    });
    Volume::new([40; 3], 0.1, values.collect()).unwrap()
}

#[test]
fn corners_without_grains_are_reported_if_no_label_of_the_background_is_given() {
    let reported = |rules: &LabelRules, is_cylinder: bool| {
        let warnings = run(rules, &cubes(is_cylinder)).unwrap().warnings;
        warnings.iter().any(|text| text.contains("label of air as background"))
    };
    let auto = LabelRules { small_grain_voxels: 1, ..LabelRules::default() };
    assert!(reported(&auto, true) && !reported(&auto, false));
    // if the user requests a block, there is no warning
    let block = LabelRules { specimen: SpecimenForm::Block, ..auto };
    assert!(!reported(&block, true));
}

#[test]
fn labels_of_a_cylinder_beyond_the_image_are_reported() {
    let rules = LabelRules { background: Some(9), ..LabelRules::default() };
    let cut = |shift: usize| {
        let whole = scene();
        let [nx, ny, nz] = whole.shape;
        let shape = [nx, ny, nz - shift];
        Volume::new(shape, whole.voxel_mm, whole.values[nx * ny * shift..].to_vec()).unwrap()
    };
    let reported = |shift: usize| {
        let warnings = run(&rules, &cut(shift)).unwrap().warnings;
        warnings.iter().any(|text| text.contains("reaches the first slice"))
    };
    assert!(reported(10) && !reported(0));
}

#[test]
fn a_region_restricts_the_labels_of_the_specimen() {
    let mut image = scene();
    let [nx, ny, _] = image.shape;
    let off = |at: usize| ((at % nx) as f64 - 29.5).hypot((at / nx % ny) as f64 - 24.5);
    for at in (0..image.values.len()).filter(|&at| (22.0..24.0).contains(&off(at))) {
        image.values[at] = 8;
    }
    let phases = vec![
        phase(1, 2, "matrix"),
        phase(4, 4, "grain"),
        phase(5, 5, "inclusion"),
        phase(7, 7, "inclusion"),
    ];
    let rules = LabelRules { background: Some(9), phases, ..LabelRules::default() };
    let error = run(&rules, &image).unwrap_err().to_string();
    assert!(error.contains("labels without a phase: 8 ("), "{error}");
    let region = SpecimenRegion {
        centre_px: Some([30.0, 25.0]),
        radius_px: Some(20.0),
        ..SpecimenRegion::default()
    };
    let within = |region: SpecimenRegion, background: Option<i64>| {
        run(&LabelRules { region, background, ..rules.clone() }, &image)
    };
    let found = within(region.clone(), Some(9)).unwrap();
    assert_eq!(found.label_of, [4, 4, 5, 7]);
    let cylinder = found.cylinder;
    assert_eq!((cylinder.radius_mm, cylinder.lean), (2.0, [0.0; 2]));
    let ends = [cylinder.bottom_mm - 0.6, cylinder.top_mm - 3.6];
    assert!(ends.iter().all(|off| off.abs() < 0.02), "{cylinder:?}");
    // a complete region given by the user, in an image without a background label
    let whole = SpecimenRegion { slices: Some([7, 36]), ..region.clone() };
    let found = within(whole.clone(), None).unwrap();
    assert_eq!(found.label_of, [4, 4, 5, 7]);
    assert!((found.cylinder.bottom_mm - 0.6).abs() < 1e-12 && !found.block);
    // only the lower half of the specimen
    let half = SpecimenRegion { slices: Some([7, 20]), ..whole.clone() };
    assert_eq!(within(half, None).unwrap().label_of, [4, 4]);
    // invalid regions
    let mask = SpecimenRegion { mask: Some("mask.tif".into()), ..whole.clone() };
    let beyond = SpecimenRegion { slices: Some([7, 99]), ..whole.clone() };
    for (region, part) in [(mask, "region.mask is for grey values"), (beyond, "region.slices")] {
        let error = within(region, Some(9)).unwrap_err().to_string();
        assert!(error.contains(part), "{part:?} is not in {error:?}");
    }
    let block = LabelRules { region: whole, specimen: SpecimenForm::Block, ..rules };
    let error = run(&block, &image).unwrap_err().to_string();
    assert!(error.contains("specimen is \"block\""), "{error}");
}

#[test]
fn errors_of_invalid_labels_state_the_remedy() {
    let image = scene();
    let refused = |rules: LabelRules| run(&rules, &image).unwrap_err().to_string();
    let phases = |phases: Vec<LabelPhase>| LabelRules { phases, ..LabelRules::default() };
    let cylinder = LabelRules { specimen: SpecimenForm::Cylinder, ..LabelRules::default() };
    let twice = vec![phase(4, 4, "grain"), phase(1, 5, "crust")];
    let outside = LabelRules { background: Some(4), ..phases(vec![phase(1, 5, "grain")]) };
    for (rules, part) in [
        (phases(vec![phase(4, 4, "grain")]), "labels without a phase: 1 ("),
        (phases(twice), "the label 4 belongs to grain and to crust"),
        (phases(vec![phase(5, 4, "grain")]), "5 to 4"),
        (phases(vec![phase(1, 9, "matrix")]), "all labels are matrix"),
        (outside, "the background is also a label of grain"),
        (cylinder.clone(), "give background"),
        (LabelRules { background: Some(77), ..cylinder }, "no voxel has the label 77"),
    ] {
        let message = refused(rules);
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
    let empty = Volume::new([3, 3, 3], 0.1, vec![0; 27]).unwrap();
    let error = run(&LabelRules::default(), &empty).unwrap_err().to_string();
    assert!(error.contains("no voxel belongs to a grain"), "{error}");
}

#[test]
fn voids_do_not_count_as_neighbours_in_the_statistics() {
    let image = Volume::new([4, 1, 1], 0.1, vec![1, 2, 3, 2]).unwrap();
    let phases = vec![phase(1, 1, "grain"), phase(2, 2, "inclusion"), phase(3, 3, "void")];
    let found = run(&LabelRules { phases, ..LabelRules::default() }, &image).unwrap();
    assert_eq!(found.regions[1].neighbours, [1, 4]);
    // the first two grains touch each other; the third touches only a void
    assert_eq!((found.statistics.grains, found.statistics.coordination), (3, 2.0 / 3.0));
}
