//! Round tension bars against closed forms.

use std::f64::consts::PI;

use fem_mesh::{LatticeError, Quality, RoundBar, TetMesh};

/// A bar of ASTM E8, with a taper that is larger than usual.
const BAR: RoundBar = RoundBar {
    radius_mm: 3.175,
    taper_mm: 0.1,
    length_mm: 31.75,
    necking_mm: 7.0,
    spacing_mm: 0.8,
};

/// Volume of an eighth of the bar: a frustum of a cone.
fn eighth_of_frustum(bar: &RoundBar) -> f64 {
    let (middle, end) = (bar.radius_mm, bar.radius_mm + bar.taper_mm);
    PI / 24.0 * bar.length_mm * (middle * middle + middle * end + end * end)
}

fn meshed(bar: RoundBar) -> TetMesh {
    let mesh = bar.eighth().unwrap();
    mesh.validate().unwrap();
    mesh
}

/// With curved edges the error of the volume decreases with about the third power of the spacing.
#[test]
fn the_volume_converges_to_the_frustum() {
    let errors = [0.8, 0.4].map(|spacing_mm| {
        let bar = RoundBar { spacing_mm, ..BAR };
        (meshed(bar).volume() / eighth_of_frustum(&bar) - 1.0).abs()
    });
    println!("relative errors {errors:?}");
    assert!(errors[0] < 1e-3 && errors[1] < errors[0] / 6.0, "{errors:?}");
}

#[test]
fn surfaces_are_planes_of_symmetry_wall_and_end() {
    let mesh = meshed(BAR);
    let names: Vec<&str> = mesh.surfaces.keys().map(String::as_str).collect();
    assert_eq!(names, ["bottom", "front", "left", "side", "top"]);
    let listed: usize = mesh.surfaces.values().map(Vec::len).sum();
    assert_eq!(listed, mesh.boundary_faces().len());
    let half = 0.5 * BAR.length_mm;
    for (name, axis, value) in
        [("bottom", 2, 0.0), ("top", 2, half), ("left", 0, 0.0), ("front", 1, 0.0)]
    {
        for &node in mesh.surfaces[name].as_flattened() {
            assert_eq!(mesh.nodes[node as usize][axis], value, "{name}");
        }
    }
    let distance = |[x, y, z]: [f64; 3]| (x.hypot(y) - BAR.radius_at(z)).abs();
    let wall = mesh.surfaces["side"].as_flattened().iter().map(|&n| mesh.nodes[n as usize]);
    for point in wall.chain(mesh.edge_points.iter().map(|(_, point)| *point)) {
        assert!(distance(point) < 1e-12, "{point:?}");
    }
}

/// Cells within the necking region are as high as they are wide; outside they are at most three times as high.
#[test]
fn cells_are_small_in_the_necking_region_only() {
    let mesh = meshed(BAR);
    let mut heights: Vec<f64> = mesh.nodes.iter().map(|node| node[2]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    for pair in heights.windows(2) {
        let height = pair[1] - pair[0];
        let limit = if pair[0] < 0.5 * BAR.necking_mm - 1e-9 { 1.0 } else { 3.0 };
        assert!(height <= limit * BAR.spacing_mm + 1e-9, "{pair:?}");
    }
    assert!(heights.contains(&(0.5 * BAR.necking_mm)));
    for (spacing_mm, least) in [(1.9, 0.03), (0.8, 0.03), (0.4, 0.03)] {
        let quality = Quality::of(&meshed(RoundBar { spacing_mm, taper_mm: 0.0, ..BAR }));
        println!("{spacing_mm} mm: scaled Jacobian {}", quality.min_scaled_jacobian);
        assert!(quality.min_scaled_jacobian > least);
    }
}

#[test]
fn impossible_bars_are_refused_with_their_field() {
    let error = |bar: RoundBar| bar.eighth().unwrap_err();
    let negative = error(RoundBar { radius_mm: -1.0, ..BAR });
    assert_eq!(negative.to_string(), "radius_mm = -1 mm; give a positive length");
    let long = error(RoundBar { necking_mm: 40.0, ..BAR });
    assert_eq!(long.to_string(), "necking_mm = 40 mm is outside 0 … 31.75 mm");
    assert!(matches!(
        error(RoundBar { taper_mm: -0.1, ..BAR }),
        LatticeError::OutOfRange { field: "taper_mm", .. }
    ));
    assert!(matches!(
        error(RoundBar { taper_mm: f64::NAN, ..BAR }),
        LatticeError::OutOfRange { .. }
    ));
    assert!(matches!(error(RoundBar { spacing_mm: 2.0, ..BAR }), LatticeError::TooCoarse { .. }));
    assert!(matches!(error(RoundBar { spacing_mm: 1e-3, ..BAR }), LatticeError::TooFine { .. }));
}
