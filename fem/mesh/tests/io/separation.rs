//! Separation of grains by shrinking, and the smallest cylinder around the grains.

use fem_mesh::{
    GrainField, Packing, Surface, SurfaceGrains, enclosing_cylinder, least_gap_mm, separated,
};

use super::surfaces::sphere;

fn balls(places: &[([f64; 3], f64)], divisions: usize) -> Vec<Surface> {
    places.iter().map(|&(c, r)| Surface::new(&sphere(c, r, divisions))).collect()
}

/// Two balls made from octahedra touch at corners; after scaling by s their distance is 2 R (1 − s).
#[test]
fn two_touching_balls_shrink_as_calculated_by_hand() {
    let surfaces = balls(&[([0.0; 3], 1.0), ([2.0, 0.0, 0.0], 1.0), ([0.0, 5.0, 0.0], 1.0)], 3);
    assert_eq!(least_gap_mm(&surfaces).unwrap(), (0.0, [1, 2]));
    for least_mm in [0.02, 0.1, 0.5] {
        let found = separated(surfaces.clone(), least_mm).unwrap();
        let expected = 1.0 - least_mm / 2.0;
        for factor in &found.factors[..2] {
            assert!((factor - expected).abs() < 1e-6, "{factor}, not {expected}");
        }
        // the third ball is far from the first two balls and does not change
        assert_eq!((found.factors[2], &found.surfaces[2]), (1.0, &surfaces[2]));
        let (gap, pair) = least_gap_mm(&found.surfaces).unwrap();
        assert!(gap >= least_mm * (1.0 - 1e-12) && gap < least_mm * (1.0 + 1e-6), "{gap}");
        assert_eq!(pair, [1, 2]);
        let lost = 1.0 - found.surfaces[0].volume() / surfaces[0].volume();
        assert!((lost - (1.0 - expected.powi(3))).abs() < 1e-6);
    }
    // balls of two sizes get the same factor; their distance is R (1 − s) + r (1 − s)
    let unequal = balls(&[([0.0; 3], 1.0), ([1.4, 0.0, 0.0], 0.4)], 3);
    let found = separated(unequal, 0.07).unwrap();
    assert!((found.factors[0] - 0.95).abs() < 1e-6 && found.factors[0] == found.factors[1]);
}

#[test]
fn a_grain_inside_another_grain_is_an_error() {
    let surfaces = balls(&[([9.0, 0.0, 0.0], 1.0), ([0.0; 3], 1.0), ([0.0, 0.0, 0.01], 0.5)], 2);
    assert_eq!(least_gap_mm(&surfaces).unwrap(), (0.0, [2, 3]));
    let error = separated(surfaces, 0.01).unwrap_err();
    assert_eq!((error.first, error.second), (2, 3));
    assert!(error.to_string().contains("one grain lies inside the other grain"), "{error}");
    assert!(least_gap_mm(&balls(&[([0.0; 3], 1.0)], 1)).is_none());
}

/// The balls of a packing are enlarged until many overlap, and then separated. The distances are checked by brute
/// force, from points of each ball to all other balls.
#[test]
fn separated_grains_keep_the_distance_by_brute_force() {
    let packing =
        Packing { film_mm: 0.02, form: fem_mesh::GrainForm::Sphere, ..Packing::new(0.25, 4) };
    let grains = packing.fill(2.5, 4.4).unwrap();
    let places: Vec<_> = grains.iter().map(|g| (g.centre, 1.06 * g.bounding_radius_mm())).collect();
    let surfaces = balls(&places, 3);
    let before: f64 = surfaces.iter().map(Surface::volume).sum();
    assert_eq!(least_gap_mm(&surfaces).unwrap().0, 0.0);
    let least_mm = 0.03;
    let found = separated(surfaces.clone(), least_mm).unwrap();
    let shrunk = found.factors.iter().filter(|&&factor| factor < 1.0).count();
    assert!(shrunk > 3 && shrunk < grains.len(), "{shrunk} of {}", grains.len());

    // compare points on all triangles of each grain with the exact distance to each other grain
    let field = SurfaceGrains::new(found.surfaces.clone(), 1e3, 1e3).unwrap();
    let mut least = f64::INFINITY;
    for (own, surface) in (1..).zip(&found.surfaces) {
        for triangle in &surface.triangles {
            let corners = triangle.map(|corner| surface.points[corner as usize]);
            for weights in [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.4, 0.3, 0.3], [0.6, 0.2, 0.2]] {
                let x = std::array::from_fn(|k| (0..3).map(|c| weights[c] * corners[c][k]).sum());
                for other in (1..=found.surfaces.len() as u32).filter(|&other| other != own) {
                    if let Some(distance) = field.distance_below(other, x, 0.2) {
                        least = f64::min(least, distance);
                    }
                }
            }
        }
    }
    assert!(least >= least_mm * (1.0 - 1e-9), "{least} mm");
    assert!(least < 1.1 * least_mm, "grains were shrunk more than necessary: {least} mm");
    let gap = least_gap_mm(&found.surfaces).unwrap().0;
    assert!(gap <= least * (1.0 + 1e-9) && gap >= least_mm * (1.0 - 1e-9), "{gap} {least}");
    let after: f64 = found.surfaces.iter().map(Surface::volume).sum();
    assert!(after > 0.7 * before && after < before, "{}", after / before);
}

#[test]
fn the_enclosing_cylinder_agrees_with_closed_forms() {
    // three equal balls: the enclosing circle is computed by hand from the circle through their centres
    let (r, h) = (0.4, 1.7);
    let angle = |k: f64| 2.0 * std::f64::consts::PI * k / 3.0;
    let ring = [0.0, 1.0, 2.0]
        .map(|k| ([7.0 + 2.0 * angle(k).cos(), -3.0 + 2.0 * angle(k).sin(), h + k], r));
    let cylinder = enclosing_cylinder(&balls(&ring, 5), 0.05).unwrap();
    assert!((cylinder.radius_mm - (2.0 + r + 0.05)).abs() < 2e-3, "{cylinder:?}");
    assert!(
        (cylinder.centre_mm[0] - 7.0).abs() < 2e-3 && (cylinder.centre_mm[1] + 3.0).abs() < 2e-3
    );
    assert!((cylinder.bottom_mm - (h - r - 0.05)).abs() < 1e-9);
    assert!((cylinder.top_mm - (h + 2.0 + r + 0.05)).abs() < 1e-9);
    // two balls: the radius is half the distance of their farthest points
    let two = balls(&[([0.0; 3], 1.0), ([4.0, 0.0, 0.0], 0.5)], 4);
    let cylinder = enclosing_cylinder(&two, 0.0).unwrap();
    assert!((cylinder.radius_mm - 2.75).abs() < 1e-9, "{cylinder:?}");
    assert!((cylinder.centre_mm[0] - 1.75).abs() < 1e-9 && cylinder.centre_mm[1].abs() < 1e-9);
    // an obtuse triangle of points: the longest edge is the diameter; the circle does not pass through the third point
    let flat = Surface {
        points: vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.1, 0.2, 1.0]],
        triangles: vec![[0, 1, 2]],
    };
    let cylinder = enclosing_cylinder(&[flat], 0.0).unwrap();
    assert!((cylinder.radius_mm - 1.0).abs() < 1e-12 && cylinder.centre_mm == [0.0; 2]);
    assert!(enclosing_cylinder(&[], 0.1).is_none());
}
