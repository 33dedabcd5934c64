//! Tests of images that show neither a complete cylinder in air nor a block, or that show other bodies as well.

use fem_image::{ImageError, Segmentation, Segmented, SpecimenForm, Volume};

use crate::phantom::{Imaged, Phantom};

fn phantom() -> Imaged {
    Phantom::new(96, 0.3, 9.0, 1.5).take()
}

fn segment(image: &Volume<f32>) -> Result<Segmented, ImageError> {
    Segmentation::default().run(image, &mut |_| {})
}

/// Returns an image of a new shape whose grey values are computed by `change` from the voxel index.
fn changed(
    image: &Volume<f32>,
    shape: [usize; 3],
    change: impl Fn([usize; 3]) -> f32,
) -> Volume<f32> {
    let [nx, ny, nz] = shape;
    let voxels = (0..nx * ny * nz).map(|n| [n % nx, n / nx % ny, n / (nx * ny)]);
    Volume::new(shape, image.voxel_mm, voxels.map(change).collect()).unwrap()
}

/// Returns a grey value of air, with its noise, from a corner of the image.
fn air(image: &Volume<f32>, [x, y, z]: [usize; 3]) -> f32 {
    *image.at([x % 6, y % 6, z % image.shape[2]])
}

fn refusal(image: &Volume<f32>, fragments: &[&str]) {
    let message = match segment(image) {
        Ok(found) => panic!("taken as a block: {}, warnings {:?}", found.block, found.warnings),
        Err(error) => error.to_string(),
    };
    for fragment in fragments {
        assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
    }
}

#[test]
fn a_half_cylinder_is_refused_and_not_taken_as_a_block() {
    let taken = phantom();
    let image = &taken.image;
    for half in [[48, 0], [0, 44]] {
        let cut = changed(image, image.shape, |at| match at[0] < half[0] || at[1] < half[1] {
            true => air(image, at),
            false => *image.at(at),
        });
        refusal(&cut, &["no cylinder in air fits", "specimen = \"block\""]);
    }
}

#[test]
fn inverted_grey_values_are_refused_with_a_remedy() {
    let taken = phantom();
    let most = taken.image.values.iter().copied().fold(0.0, f32::max);
    let inverted = changed(&taken.image, taken.image.shape, |at| most - *taken.image.at(at));
    refusal(&inverted, &["brighter than the specimen", "invert the image"]);
}

/// Platens as bright as metal or as the matrix; they fill the slice or are discs.
#[test]
fn platens_in_the_image_are_reported_with_their_slices() {
    let taken = phantom();
    let image = &taken.image;
    let [nx, ny, nz] = image.shape;
    let middle = image.values[nx / 2 + nx * (ny / 2 + ny * (nz / 2))];
    for grey in [60_000.0, middle] {
        for radius in [200.0, 1.15 * 0.45 * nx as f64] {
            let with_platens = changed(image, image.shape, |[x, y, z]| {
                let off = (x as f64 - 47.5).hypot(y as f64 - 47.5);
                match (z < 5 || z >= nz - 5) && off < radius {
                    true => grey + 100.0 * ((x * 7 + y * 13 + z * 5) % 11) as f32,
                    false => *image.at([x, y, z]),
                }
            });
            refusal(&with_platens, &["slices 1 to 5 and 92 to 96", "remove these slices"]);
        }
    }
}

#[test]
fn a_specimen_off_centre_is_recognised_as_a_cylinder() {
    let taken = phantom();
    let image = &taken.image;
    let wide = changed(image, [230, 210, 96], |[x, y, z]| match x < 96 && y < 96 {
        true => *image.at([x, y, z]),
        false => air(image, [x, y, z]),
    });
    let found = segment(&wide).unwrap();
    assert!(!found.block && found.warnings.is_empty(), "{:?}", found.warnings);
    assert!((found.cylinder.radius_mm - taken.radius_mm).abs() < 0.2 * image.voxel_mm);
    assert!((found.cylinder.centre_mm[0] - taken.centre_mm[0]).abs() < 0.2 * image.voxel_mm);
}

/// Blocks with few or many grains are recognised as blocks; if the user requests a cylinder, there is a warning.
#[test]
fn blocks_are_recognised_and_a_requested_cylinder_gives_a_warning() {
    for (fraction, radius) in [(0.1, 9.0), (0.3, 9.0), (0.35, 5.0)] {
        let taken = Phantom::new(96, fraction, radius, 1.5).take();
        let block = changed(&taken.image, [56, 52, 60], |[x, y, z]| {
            *taken.image.at([x + 20, y + 22, z + 18])
        });
        let found = segment(&block).unwrap();
        assert!(found.block, "{fraction}");
    }
    let taken = phantom();
    let image = &taken.image;
    let cut = changed(image, image.shape, |at| match at[0] < 24 {
        true => air(image, at),
        false => *image.at(at),
    });
    let settings = Segmentation { specimen: SpecimenForm::Cylinder, ..Segmentation::default() };
    if let Ok(found) = settings.run(&cut, &mut |_| {}) {
        assert!(
            found.warnings.iter().any(|warning| warning.contains("cut or broken")),
            "{found:?}"
        );
    }
}
