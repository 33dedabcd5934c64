//! Labelled voxels with solid fractions: volumes, distances and meshes, compared with the exact balls.

use std::collections::BTreeSet;

use fem_image::{Cylinder, Volume};

use fem_mesh::{Grain, GrainField, GrainList, GrainMode, Meshing, VoxelGrains};

const RADIUS: f64 = 1.0;
const HEIGHT: f64 = 1.6;
const VOXEL: f64 = 0.04;
/// Width of the air around the cylinder (voxels).
const AIR: usize = 4;

/// Returns balls that are separated by at least 0.1 mm of matrix, except for two touching balls.
fn balls() -> Vec<Grain> {
    let at = [
        ([0.02, 0.41, 0.44], 0.37),
        ([-0.43, -0.31, 0.42], 0.35),
        ([0.44, -0.36, 0.47], 0.33),
        ([0.38, 0.05, 1.13], 0.34),
        ([-0.30, 0.05, 1.13], 0.34),
    ];
    at.into_iter().map(|(centre, radius)| Grain::sphere(centre, radius)).collect()
}

/// Voxelises balls in the cylinder: returns the ball that contains the centre of each voxel (or 0), and the fraction
/// of the voxel inside any ball, by 10³ samples at surfaces.
fn voxels(balls: &[Grain]) -> (Volume<u32>, Volume<f32>, Cylinder) {
    let sides = [2.0 * RADIUS, 2.0 * RADIUS, HEIGHT];
    let shape = sides.map(|side| (side / VOXEL).round() as usize + 2 * AIR);
    let air = AIR as f64 * VOXEL;
    let cylinder = Cylinder {
        centre_mm: [RADIUS + air; 2],
        radius_mm: RADIUS,
        bottom_mm: air,
        top_mm: HEIGHT + air,
        lean: [0.0; 2],
    };
    let origin = [RADIUS + air, RADIUS + air, air];
    let distance = |x: [f64; 3]| {
        let distances = balls.iter().map(|ball| ball.signed_distance_mm(x)).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    };
    let (mut labels, mut solid) = (Vec::new(), Vec::new());
    for n in 0..shape.iter().product() {
        let voxel = [n % shape[0], n / shape[0] % shape[1], n / (shape[0] * shape[1])];
        let at = |within: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| (voxel[k] as f64 + within[k]) * VOXEL - origin[k])
        };
        let (nearest, off) = distance(at([0.5; 3]));
        labels.push(if off < 0.0 { nearest as u32 + 1 } else { 0 });
        let share = if off.abs() > VOXEL {
            f64::from(u8::from(off < 0.0))
        } else {
            let samples = (0..1000).map(|s| [s % 10, s / 10 % 10, s / 100]);
            let inside =
                samples.filter(|s| distance(at(s.map(|s| (s as f64 + 0.5) / 10.0))).1 < 0.0);
            inside.count() as f64 / 1000.0
        };
        solid.push(share as f32);
    }
    let labels = Volume::new(shape, VOXEL, labels).unwrap();
    (labels, Volume::new(shape, VOXEL, solid).unwrap(), cylinder)
}

/// Returns the root mean square error of the distances at points on the surface of a ball.
fn surface_error(field: &dyn GrainField, ball: &Grain, number: u32) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for n in 0..400 {
        // points that represent equal areas
        let z = (f64::from(n) + 0.5) / 200.0 - 1.0;
        let angle = f64::from(n) * 2.399_963_229_728_653;
        let r = (1.0 - z * z).sqrt();
        let along = [r * angle.cos(), r * angle.sin(), z];
        let radius = ball.bounding_radius_mm();
        let x = std::array::from_fn(|k| ball.centre[k] + radius * along[k]);
        squares += field.distance(number, x).powi(2);
        count += 1.0;
    }
    f64::sqrt(squares / count)
}

#[test]
fn solid_fractions_give_the_volumes_and_surfaces_of_balls() {
    let balls = balls();
    let (labels, solid, cylinder) = voxels(&balls);
    let shared = VoxelGrains::new(&labels, Some(&solid), &cylinder);
    let whole = VoxelGrains::new(&labels, None, &cylinder);
    assert_eq!(shared.grains(), balls.len());
    let mut worst = [0.0_f64; 2];
    for (ball, number) in balls.iter().zip(1..) {
        let exact = ball.volume_mm3();
        let error = |field: &VoxelGrains<'_>| (field.volume_mm3(number) / exact - 1.0).abs();
        // 10³ samples in each of the thousand voxels at a surface give an error of 1e-4; where two balls touch, a
        // common voxel is divided according to the number of adjacent voxels of each ball
        let most = if number < 4 { 5e-4 } else { 5e-3 };
        assert!(error(&shared) < most, "ball {number}: {}", error(&shared));
        worst[0] = worst[0].max(error(&whole));
        worst[1] = worst[1].max(surface_error(&shared, ball, number));
        if number < 4 {
            // without solid fractions, only changes of the label locate the surface
            let without = surface_error(&whole, ball, number);
            assert!(surface_error(&shared, ball, number) < without, "ball {number}");
        }
    }
    let sum = |field: &VoxelGrains<'_>| (1..=5).map(|k| field.volume_mm3(k)).sum::<f64>();
    let exact: f64 = balls.iter().map(Grain::volume_mm3).sum();
    assert!((sum(&shared) / exact - 1.0).abs() < 3e-4, "{}", sum(&shared) / exact);
    assert!(worst[0] > 0.01, "whole voxels are as accurate, so the test checks nothing");
    // the smoothing, whose variance is σ² = ½ voxel², shrinks a ball of radius R by σ² / R = 0.06 voxels; the
    // correction of the volume removes this error, but not the error of the linear interpolation
    println!("{} voxels", worst[1] / VOXEL);
    assert!(worst[1] < 0.08 * VOXEL, "{} voxels", worst[1] / VOXEL);
}

#[test]
fn given_volumes_count_only_inside_the_cylinder() {
    let balls = balls();
    let (labels, solid, cylinder) = voxels(&balls);
    // the end cuts the second ball between two layers of voxels, half a voxel below its centre
    let cut = Cylinder { bottom_mm: cylinder.bottom_mm + 10.0 * VOXEL, ..cylinder };
    let known = [(2, 0.2), (7, 1.0), (0, 1.0)];
    let field = VoxelGrains::new(&labels, Some(&solid), &cut).with_volumes(known);
    let a = (balls[1].centre[2] - 10.0 * VOXEL) / balls[1].bounding_radius_mm();
    let part = 0.5 + 0.75 * a - 0.25 * a.powi(3);
    assert!((field.volume_mm3(2) / (0.2 * part) - 1.0).abs() < 1e-3, "{}", field.volume_mm3(2));
    let own = VoxelGrains::new(&labels, Some(&solid), &cut);
    for number in [1, 3, 4, 5] {
        assert_eq!(field.volume_mm3(number), own.volume_mm3(number));
    }
}

#[test]
fn voxels_with_solid_fractions_are_meshed_like_the_exact_balls() {
    let balls = balls();
    let (labels, solid, cylinder) = voxels(&balls);
    let field = VoxelGrains::new(&labels, Some(&solid), &cylinder);
    let mode = GrainMode::Conforming;
    let meshing = Meshing { mode, ..Meshing::new(3.0 * VOXEL) };
    let meshed = meshing.build(RADIUS, HEIGHT, &field).unwrap();
    let report = &meshed.report;
    assert!(report.quality.min_dihedral_deg >= 12.0, "{report}");
    assert_eq!(report.euler_characteristic, 1);
    for (ball, grain) in balls.iter().zip(&report.grains) {
        // tolerance: half a percent for the secant steps, half a percent for voxels divided between touching balls
        let error = grain.achieved_mm3 / ball.volume_mm3() - 1.0;
        assert!(error.abs() < 0.01, "{error}: {grain:?}");
    }
    let exact = GrainList::new(balls, RADIUS, HEIGHT);
    let of_grain = meshed.mesh.grain_of.as_ref().unwrap();
    let nodes = |label: u32| -> BTreeSet<u32> {
        let own = meshed.mesh.tets.iter().zip(of_grain).filter(|(_, of)| **of == label);
        own.flat_map(|(tet, _)| *tet).collect()
    };
    let matrix = nodes(0);
    let (mut squares, mut count) = (0.0, 0.0);
    for number in 1..=5 {
        for &node in nodes(number).intersection(&matrix) {
            squares += exact.distance(number, meshed.mesh.nodes[node as usize]).powi(2);
            count += 1.0;
        }
    }
    let rms = f64::sqrt(squares / count) / VOXEL;
    assert!(count > 1000.0 && rms < 0.3, "{rms} voxels");
    // the two touching balls share nodes
    assert!(!nodes(4).is_disjoint(&nodes(5)), "a contact is lost");
}
