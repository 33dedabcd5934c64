//! Tests of blocks and of the walls of cylinders against closed forms.

use std::f64::consts::PI;

use fem_mesh::{Block, BlockError, CylinderLattice, HexSplit, Quality, TetMesh, Wall};

const SPLITS: [HexSplit; 2] = [HexSplit::Six, HexSplit::Twelve];
const LATTICE: CylinderLattice =
    CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.6 };

/// Returns the sum of the area vectors of a surface.
fn area(mesh: &TetMesh, name: &str) -> [f64; 3] {
    let mut sum = nalgebra::Vector3::zeros();
    for triangle in &mesh.surfaces[name] {
        let [a, b, c] = triangle.map(|node| nalgebra::Vector3::from(mesh.nodes[node as usize]));
        sum += (b - a).cross(&(c - a)) / 2.0;
    }
    sum.into()
}

/// Returns the integral of x² + y² over a surface with straight edges in a plane of constant z. The quadrature at the
/// midpoints of the edges is exact.
fn polar_moment(mesh: &TetMesh, name: &str) -> f64 {
    let of_triangle = |triangle: &[u32; 3]| {
        let p = triangle.map(|node| mesh.nodes[node as usize]);
        let [[ax, ay], [bx, by]] = [1, 2].map(|k| [p[k][0] - p[0][0], p[k][1] - p[0][1]]);
        let area = 0.5 * (ax * by - ay * bx).abs();
        let square = |k: usize| {
            let q = p[(k + 1) % 3];
            (0.5 * (p[k][0] + q[0])).powi(2) + (0.5 * (p[k][1] + q[1])).powi(2)
        };
        area * (0..3).map(square).sum::<f64>() / 3.0
    };
    mesh.surfaces[name].iter().map(of_triangle).sum()
}

#[test]
fn a_block_has_the_volume_and_the_faces_of_the_box() {
    let size = [3.0, 1.7, 0.9];
    for split in SPLITS {
        for cells in [[1, 1, 1], [5, 3, 2]] {
            let mesh = Block::new(size, cells).graded(0, 3.0).with_split(split).build().unwrap();
            mesh.validate().unwrap();
            assert!((mesh.volume() / size.iter().product::<f64>() - 1.0).abs() < 1e-13);
            let listed: usize = mesh.surfaces.values().map(Vec::len).sum();
            assert_eq!(listed, mesh.boundary_faces().len());
            for (axis, names) in
                [["left", "right"], ["front", "back"], ["bottom", "top"]].iter().enumerate()
            {
                let face = size[(axis + 1) % 3] * size[(axis + 2) % 3];
                for (name, outward) in names.iter().zip([-1.0, 1.0]) {
                    let area = area(&mesh, name);
                    for k in 0..3 {
                        let exact = if k == axis { outward * face } else { 0.0 };
                        assert!((area[k] - exact).abs() < 1e-12, "{name}: {area:?}");
                    }
                }
            }
        }
    }
    let tets = SPLITS.map(|split| Block::new(size, [5, 3, 2]).with_split(split));
    // with `HexSplit::Twelve`, each boundary face of a hexahedron belongs to four tetrahedra instead of two
    let counts = tets.map(|block| block.build().unwrap().tets.len());
    assert_eq!(counts, [6 * 30, 12 * 30 + 2 * 2 * (15 + 10 + 6)]);
}

#[test]
fn cubes_have_the_stated_quality() {
    let scaled_jacobian = |split| {
        let cube = Block::new([3.0; 3], [3; 3]).with_split(split).build().unwrap();
        Quality::of(&cube).min_scaled_jacobian
    };
    for split in SPLITS {
        assert!((scaled_jacobian(split) - 1.0 / 3.0_f64.sqrt()).abs() < 1e-12);
    }
}

#[test]
fn widths_of_graded_cells_are_a_geometric_sequence() {
    let block = Block::new([7.0, 1.0, 1.0], [3, 1, 1]).graded(0, 4.0).graded(1, 9.0);
    // widths of 1, 2 and 4
    let expected = [0.0, 1.0, 3.0, 7.0];
    for (plane, expected) in block.planes_mm[0].iter().zip(expected) {
        assert!((plane - expected).abs() < 1e-12, "{:?}", block.planes_mm);
    }
    assert_eq!(block.planes_mm[1], [0.0, 1.0]);
}

#[test]
fn regions_and_surfaces_follow_their_functions() {
    for split in SPLITS {
        let mesh = Block::new([4.0, 2.0, 1.0], [8, 4, 2])
            .with_split(split)
            .build()
            .unwrap()
            .with_regions(&["matrix", "grain"], |[x, y, _]| u16::from(x < 1.5 && y > 1.0))
            .with_surfaces(|[x, ..], normal| match normal {
                [_, _, z] if z > 0.5 && x < 1.0 => Some("loaded"),
                [x, ..] if x.abs() > 0.5 => Some("ends"),
                _ => None,
            });
        mesh.validate().unwrap();
        // with `HexSplit::Twelve`, tetrahedra extend across the planes between hexahedra
        let tolerance = if split == HexSplit::Six { 1e-13 } else { 0.3 };
        assert!((mesh.region_volume("grain").unwrap() - 1.5).abs() < tolerance);
        assert!((area(&mesh, "loaded")[2] - 2.0).abs() < 1e-13);
        let closed = area(&mesh, "ends");
        assert!(closed.iter().all(|sum| sum.abs() < 1e-13) && mesh.surfaces.len() == 2);
    }
    // a region without a tetrahedron is reported by the validation
    let empty = Block::new([1.0; 3], [1; 3]).build().unwrap().with_regions(&["a", "b"], |_| 0);
    assert!(empty.validate().is_err());
}

/// The volume of a ring converges with the fourth power of the width of the cells if edges are curved, and with the
/// second power if edges are straight.
#[test]
fn a_bent_block_is_a_ring() {
    let exact = 0.25 * PI * (4.0 - 1.0) * 0.5;
    let errors = [3, 6].map(|n| {
        let ring = Block::new([1.0, 1.0, 0.5], [2, n, 1]).build().unwrap().mapped(|[x, y, z]| {
            let (sin, cos) = (0.5 * PI * y).sin_cos();
            [(1.0 + x) * cos, (1.0 + x) * sin, z]
        });
        ring.validate().unwrap();
        let straight = TetMesh { edge_points: Vec::new(), ..ring.clone() };
        [&ring, &straight].map(|mesh| (mesh.volume() / exact - 1.0).abs())
    });
    for (k, least) in [3.7, 1.9].into_iter().enumerate() {
        let order = (errors[0][k] / errors[1][k]).log2();
        assert!(order > least, "{errors:?}");
    }
    // an affine map bends no edge
    let sheared = Block::new([1.0; 3], [2; 3]).build().unwrap().mapped(|[x, y, z]| [x + z, y, z]);
    assert!(sheared.edge_points.is_empty() && (sheared.volume() - 1.0).abs() < 1e-13);
}

#[test]
fn impossible_blocks_say_what_to_do() {
    let error = |block: Block| block.build().unwrap_err();
    let none = error(Block::new([1.0; 3], [2, 0, 2]));
    assert_eq!(none, BlockError::NoCell { axis: 'y', planes: 0 });
    let flat = error(Block::new([1.0, 1.0, 0.0], [1; 3]));
    assert_eq!(flat.to_string(), "plane 1 along z is at 0 mm; give finite, increasing coordinates");
    let mut undefined = Block::new([1.0; 3], [1; 3]);
    undefined.planes_mm[0][1] = f64::NAN;
    assert!(matches!(error(undefined), BlockError::NotIncreasing { axis: 'x', plane: 1, .. }));
    assert!(matches!(error(Block::new([1.0; 3], [200; 3])), BlockError::TooMany { .. }));
}

#[test]
fn walls_have_the_stated_volumes_areas_and_qualities() {
    let disc = PI * 2.5 * 2.5;
    let volume = |mesh: &TetMesh| mesh.volume() / (4.4 * disc) - 1.0;
    let end = |mesh: &TetMesh| area(mesh, "top")[2] / disc - 1.0;
    let quality = |mesh: &TetMesh| Quality::of(mesh).min_scaled_jacobian;
    let [inscribed, equal, round, curved] =
        [Wall::Inscribed, Wall::EqualArea, Wall::Round, Wall::Curved].map(|wall| {
            let mesh = LATTICE.build_with(wall).unwrap();
            mesh.validate().unwrap();
            mesh
        });
    assert_eq!(inscribed, LATTICE.build().unwrap());
    assert_eq!(round, LATTICE.build_round().unwrap());

    // the cross-section has twenty corners
    let defect = 10.0 / PI * (PI / 10.0).sin() - 1.0;
    assert!(defect < -0.016);
    for mesh in [&inscribed, &round] {
        assert!((end(mesh) - defect).abs() < 1e-13);
    }
    assert!((volume(&inscribed) - defect).abs() < 1e-13);
    assert!((volume(&round) + 0.008_194_295).abs() < 1e-9);
    assert!(volume(&equal).abs() < 1e-12 && end(&equal).abs() < 1e-12);
    let moment = polar_moment(&equal, "top") / (0.5 * PI * 2.5_f64.powi(4)) - 1.0;
    let stated = 4.0 / 45.0 * (PI / 20.0).powi(4);
    assert!((moment / stated - 1.0).abs() < 0.05, "{moment} and {stated}");
    let outside = equal.nodes.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max) / 2.5 - 1.0;
    assert!((outside / ((PI / 20.0).powi(2) / 3.0) - 1.0).abs() < 0.05, "{outside}");

    assert!(volume(&curved).abs() < 1e-4, "{}", volume(&curved));
    for node in curved.surfaces["side"].as_flattened() {
        let [x, y, _] = curved.nodes[*node as usize];
        assert!((x.hypot(y) - 2.5).abs() < 1e-13);
    }
    for (_, [x, y, _]) in &curved.edge_points {
        assert!((x.hypot(*y) - 2.5).abs() < 1e-13);
    }
    // computed independently from the coordinates of the nodes
    for (mesh, least) in [(&inscribed, 0.324_362), (&equal, 0.322_254), (&round, 0.324_362)] {
        assert!((quality(mesh) - least).abs() < 1e-6, "{}", quality(mesh));
    }
    println!("curved {}", quality(&curved));
    assert!(quality(&curved) > 0.2, "{}", quality(&curved));
}
