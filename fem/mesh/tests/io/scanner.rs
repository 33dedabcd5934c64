//! The virtual scanner: its images agree with the grains.

use std::f64::consts::PI;

use fem_mesh::{Grain, GrainList, Scan, Scanner};

const RADIUS: f64 = 0.8;
const HEIGHT: f64 = 0.5;
const VOXEL: f64 = 0.03;

fn grains() -> GrainList {
    let grains =
        vec![Grain::sphere([0.3, 0.1, 0.25], 0.2), Grain::sphere([-0.35, -0.2, 0.25], 0.2)];
    GrainList::new(grains, RADIUS, HEIGHT)
}

fn scan(scanner: Scanner) -> Scan {
    scanner.scan(RADIUS, HEIGHT, &grains()).unwrap()
}

/// Returns the mean grey value of the voxels for whose point in the specimen and label `holds` returns
/// true.
fn mean(scan: &Scan, holds: impl Fn([f64; 3], u32) -> bool) -> f64 {
    let [nx, ny, _] = scan.grey.shape;
    let [cx, cy] = scan.cylinder.centre_mm;
    let (mut sum, mut count) = (0.0, 0.0);
    for (at, (&grey, &label)) in scan.grey.values.iter().zip(&scan.labels.values).enumerate() {
        let place = [at % nx, at / nx % ny, at / nx / ny].map(|k| (k as f64 + 0.5) * VOXEL);
        if holds([place[0] - cx, place[1] - cy, place[2] - scan.cylinder.bottom_mm], label) {
            sum += f64::from(grey);
            count += 1.0;
        }
    }
    sum / count
}

fn clean() -> Scanner {
    let scanner = Scanner::new(VOXEL, 1);
    Scanner { photons: 1e10, rings: 0.0, texture: 0.0, hardening: 0.0, blur: 0.0, ..scanner }
}

#[test]
fn labels_are_the_truth() {
    let scan = scan(Scanner::new(VOXEL, 1));
    for grain in [1, 2] {
        let voxels = scan.labels.values.iter().filter(|&&label| label == grain).count();
        let volume = voxels as f64 * VOXEL.powi(3);
        assert!((volume / (4.0 / 3.0 * PI * 0.2_f64.powi(3)) - 1.0).abs() < 0.03, "{volume}");
    }
    assert!(scan.grey.values.iter().all(|x| x.fract() == 0.0 && (0.0..=65535.0).contains(x)));
}

#[test]
fn a_noise_free_scan_has_the_ratio_of_the_attenuations() {
    let scan = scan(clean());
    let deep = |[x, y, z]: [f64; 3]| x.hypot(y) < RADIUS - 0.1 && (0.1..HEIGHT - 0.1).contains(&z);
    let air = mean(&scan, |[x, y, _], _| (RADIUS + 0.06..RADIUS + 0.15).contains(&x.hypot(y)));
    let far = |p: [f64; 3]| {
        [[0.3, 0.1], [-0.35, -0.2]].iter().all(|c| (p[0] - c[0]).hypot(p[1] - c[1]) > 0.3)
    };
    let matrix = mean(&scan, |p, _| deep(p) && far(p));
    let core = |[x, y, z]: [f64; 3]| (x - 0.3).hypot(y - 0.1).hypot(z - 0.25) < 0.12;
    let grain = mean(&scan, |p, _| core(p));
    let ratio = (grain - air) / (matrix - air);
    assert!((ratio - 1.8).abs() < 0.09, "{ratio}: {air} {matrix} {grain}");
}

#[test]
fn beam_hardening_makes_the_middle_darker() {
    let cupping = |hardening| {
        let none = GrainList::new(Vec::new(), RADIUS, HEIGHT);
        let scan = Scanner { hardening, ..clean() }.scan(RADIUS, HEIGHT, &none).unwrap();
        let inside = |z: f64| (0.1..HEIGHT - 0.1).contains(&z);
        let middle = mean(&scan, |[x, y, z], _| inside(z) && x.hypot(y) < 0.3);
        let rim = mean(&scan, |[x, y, z], _| inside(z) && (0.5..0.7).contains(&x.hypot(y)));
        (rim - middle) / middle
    };
    let (soft, hard) = (cupping(1.0), cupping(0.0));
    assert!(hard.abs() < 0.01 && soft > hard + 0.01, "{soft} {hard}");
}

#[test]
fn noise_decreases_with_the_square_root_of_the_photons() {
    let spread = |photons| {
        let scan = scan(Scanner { photons, ..clean() });
        let reference = scan_values(&clean());
        let squares: f64 =
            scan.grey.values.iter().zip(&reference).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (squares / reference.len() as f64).sqrt()
    };
    let ratio = spread(1e5) / spread(4e5);
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
}

fn scan_values(scanner: &Scanner) -> Vec<f32> {
    scan(*scanner).grey.values
}

#[test]
fn a_seed_gives_one_volume_for_any_number_of_threads() {
    let build = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scan_values(&Scanner::new(VOXEL, seed)))
    };
    assert_eq!(build(1, 7), build(3, 7));
    assert_ne!(build(2, 7), build(2, 8));
}

#[test]
fn impossible_scans_are_refused() {
    let refused = |scanner: Scanner| scanner.scan(RADIUS, HEIGHT, &grains()).unwrap_err().field;
    assert_eq!(refused(Scanner::new(0.0, 1)), "voxel_mm");
    assert_eq!(refused(Scanner::new(1e-5, 1)), "voxel_mm");
    assert_eq!(refused(Scanner::new(2.0, 1)), "radius_mm");
    assert_eq!(refused(Scanner { photons: 0.0, ..clean() }), "photons");
    assert_eq!(refused(Scanner { projections: 1 << 40, ..clean() }), "projections");
}
