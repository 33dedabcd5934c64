//! Tests of fits to cylinders of known position, with ends between voxels and with tilted axes.

use super::*;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Returns an image of a cylinder with soft edges, noise, bright specks in the air and notches in the wall.
fn image(truth: &Fit, shape: [usize; 3]) -> Volume<u16> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let mut image = Volume::new(shape, 1.0, vec![0; shape.iter().product()]).unwrap();
    let middle = (truth.bottom + truth.top) / 2.0;
    for z in 0..shape[2] {
        for y in 0..shape[1] {
            for x in 0..shape[0] {
                // independent of the code: distances from the angle between the axis and the vector from the middle of
                // the axis to the voxel
                let way = [
                    x as f64 + 0.5 - truth.centre[0],
                    y as f64 + 0.5 - truth.centre[1],
                    z as f64 + 0.5 - middle,
                ];
                let axis = nalgebra::Vector3::new(truth.lean[0], truth.lean[1], 1.0);
                let way = nalgebra::Vector3::from(way);
                let (axis, length) = (axis.normalize(), way.norm());
                let angle = axis.angle(&way);
                let half = (truth.top - truth.bottom) / 2.0;
                let outside =
                    (length * angle.sin() - truth.radius).max((length * angle.cos()).abs() - half);
                let share = (0.5 - outside / 3.0).clamp(0.0, 1.0);
                let notch = x < 30 && y.abs_diff(24) < 3 && z % 9 < 4;
                let speck = (x, y) == (2, 40);
                let share = if speck {
                    1.0
                } else if notch {
                    0.0
                } else {
                    share
                };
                let value = 10_000.0 + 20_000.0 * share + rng.random_range(-2000.0..2000.0);
                let at = image.index([x, y, z]);
                image.values[at] = value as u16;
            }
        }
    }
    image
}

#[test]
fn a_cylinder_is_found_between_voxels() {
    let truth = Fit {
        centre: [31.3, 24.8],
        radius: 18.4,
        bottom: 6.3,
        top: 43.6,
        lean: [0.0, 0.0],
        wander: 0.0,
        scatter: 0.0,
    };
    // over the height of 37 voxels, these slopes displace the axis by 0, 1.7, 4.5 and 6.7 voxels
    for lean in [[0.0, 0.0], [0.04, -0.022], [-0.1, 0.07], [0.0, 0.18]] {
        let truth = Fit { lean, ..truth };
        let found = fit(&image(&truth, [60, 50, 48]), 20_000.0, true).unwrap();
        for axis in 0..2 {
            assert!((found.centre[axis] - truth.centre[axis]).abs() < 0.05, "{found:?}");
            assert!((found.lean[axis] - truth.lean[axis]).abs() < 0.004, "{found:?}");
        }
        assert!((found.radius - truth.radius).abs() < 0.05, "{found:?}");
        assert!((found.bottom - truth.bottom).abs() < 0.06, "{found:?}");
        assert!((found.top - truth.top).abs() < 0.06, "{found:?}");
        // without `leans` the cylinder is upright, but the displacement is still reported
        let upright = fit(&image(&truth, [60, 50, 48]), 20_000.0, false).unwrap();
        assert_eq!(upright.lean, [0.0; 2]);
        let wander = lean[0].hypot(lean[1]) * (truth.top - truth.bottom);
        assert!((upright.wander - wander).abs() < 0.2 + 0.1 * wander, "{upright:?}");
    }
}

#[test]
fn an_image_without_a_cylinder_is_refused() {
    let block = Volume::new([20, 20, 20], 1.0, vec![30_000; 8000]).unwrap();
    assert!(matches!(fit(&block, 20_000.0, true), Err(ImageError::NoCylinder { .. })));
    assert!(matches!(fit(&block, 40_000.0, true), Err(ImageError::NoCylinder { .. })));
}
