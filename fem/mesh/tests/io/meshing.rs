//! Meshes of specimens: quality, volumes, contacts, mixtures, and different inputs.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use fem_mesh::{
    CylinderLattice, Grain, GrainField, GrainForm, GrainList, GrainMode, MeshReport, Meshed,
    Meshing, MeshingError, Packing, Scanner, SizeClass, TetMesh, VoxelGrains, Wall,
};

const RADIUS: f64 = 1.0;
const HEIGHT: f64 = 1.6;
const CYLINDER: f64 = PI * RADIUS * RADIUS * HEIGHT;

fn packing(form: GrainForm, fraction: f64, median_radius_mm: f64) -> Packing {
    let sizes = vec![SizeClass { median_radius_mm, spread: 0.1, share: 1.0 }];
    Packing { form, sizes, film_mm: 0.05, ..Packing::new(fraction, 3) }
}

fn field(packing: &Packing) -> GrainList {
    GrainList::new(packing.fill(RADIUS, HEIGHT).unwrap(), RADIUS, HEIGHT)
}

fn mesh(meshing: Meshing, field: &dyn GrainField) -> Meshed {
    meshing.build(RADIUS, HEIGHT, field).unwrap()
}

/// Asserts the quality criteria that every conforming mesh must satisfy.
fn assert_bars(report: &MeshReport) {
    assert!(report.quality.min_dihedral_deg >= 12.0, "{report}");
    assert!(report.quality.p01_dihedral_deg >= 20.0, "{report}");
    assert!(report.quality.min_volume_mm3 > 0.0, "{report}");
    assert_eq!(report.euler_characteristic, 1);
    assert!(report.wall_error_mm < 1e-9);
    assert!((report.achieved_fraction / report.asked_fraction - 1.0).abs() < 0.005, "{report}");
    assert!(report.median_volume_error(3.0).unwrap() < 0.03, "{report}");
    assert_eq!(report.lost_grains(), 0);
}

#[test]
fn conforming_grains_keep_volume_and_quality() {
    let spacing = 0.12;
    for form in [GrainForm::Sphere, GrainForm::Polyhedron] {
        for curved in [true, false] {
            let field = field(&packing(form, 0.2, 0.3));
            let mode = GrainMode::Conforming;
            let meshed = mesh(Meshing { mode, curved, ..Meshing::new(spacing) }, &field);
            assert_bars(&meshed.report);
            // tolerance: 0.3 voxels at a spacing of four voxels, and more for polyhedra because of their sharp edges
            let most = if form == GrainForm::Sphere { 0.075 } else { 0.11 };
            assert!(meshed.report.interface_rms_mm < most * spacing, "{}", meshed.report);
            assert_eq!(meshed.mesh.edge_points.is_empty(), !curved);
            // the region of grains in the mesh has the volume fraction that the report states
            let volume = meshed.mesh.region_volume("grain").unwrap() / meshed.mesh.volume();
            assert!((volume - meshed.report.achieved_fraction).abs() < 1e-12);
        }
    }
}

#[test]
fn the_interface_error_is_proportional_to_the_spacing() {
    let field = GrainList::new(vec![Grain::sphere([0.1, 0.0, 0.8], 0.6)], RADIUS, HEIGHT);
    let error = |spacing| mesh(Meshing::new(spacing), &field).report.interface_rms_mm;
    let (coarse, fine) = (error(0.2), error(0.1));
    assert!(fine < 0.65 * coarse && coarse < 0.075 * 0.2, "{coarse} {fine}");
}

#[test]
fn curved_walls_enclose_the_volume_of_the_cylinder() {
    let none = GrainList::new(Vec::new(), RADIUS, HEIGHT);
    let error = |curved| {
        let meshed = mesh(Meshing { curved, ..Meshing::new(0.3) }, &none);
        (meshed.mesh.volume() / CYLINDER - 1.0).abs()
    };
    let (straight, curved) = (error(false), error(true));
    assert!(curved < 2e-3 && curved < 0.1 * straight, "{straight} {curved}");
}

/// Area of the triangles of an end, projected on the end plane.
fn end_area(mesh: &TetMesh, name: &str) -> f64 {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|node| mesh.nodes[node as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
    };
    mesh.surfaces[name].iter().map(area).sum()
}

/// A grain that the wall cuts moves nodes of the wall. These nodes must stay on the wall.
#[test]
fn walls_of_equal_area_and_curved_walls_have_the_cylinders_volume() {
    let none = GrainList::new(Vec::new(), RADIUS, HEIGHT);
    let cut = GrainList::new(vec![Grain::sphere([0.8, 0.1, 0.75], 0.45)], RADIUS, HEIGHT);
    for (field, curved) in [(&none, false), (&cut, false), (&cut, true)] {
        let meshed = |wall| {
            let mode = GrainMode::Conforming;
            let settings = Meshing { curved, mode, wall, ..Meshing::new(0.24) };
            let Meshed { mesh, report } = mesh(settings, field);
            assert!(report.quality.min_dihedral_deg >= 12.0, "{wall:?}: {report}");
            assert!((report.volume_error - (mesh.volume() / CYLINDER - 1.0)).abs() < 1e-12);
            if let Some(grain) = report.grains.first() {
                assert!(grain.volume_error().abs() < 0.01, "{wall:?}: {report}");
            }
            mesh
        };
        let error = |mesh: &TetMesh| (mesh.volume() / CYLINDER - 1.0).abs();
        let equal = meshed(Wall::EqualArea);
        // curved edges of the interface lie within the flat faces of the wall, up to their two iterations
        let most = if curved { 2e-4 } else { 1e-12 };
        assert!(error(&equal) < most, "curved {curved}: {}", error(&equal));
        for end in ["bottom", "top"] {
            let area = end_area(&equal, end) / (PI * RADIUS * RADIUS) - 1.0;
            assert!(area.abs() < 1e-12, "{end}: {area}");
        }
        let round = meshed(Wall::Curved);
        assert!(error(&round) < 1e-3, "curved {curved}: {}", error(&round));
        let inscribed = meshed(Wall::Inscribed);
        assert!(inscribed.volume() < 0.99 * CYLINDER, "{}", error(&inscribed));
        let edges = |mesh: &TetMesh| mesh.edge_points.len();
        assert!(edges(&round) > 100, "{}", edges(&round));
        assert_eq!(edges(&equal) > 0, curved, "straight walls have no curved edges");
    }
}

fn nodes_of(mesh: &TetMesh, grain: u32) -> BTreeSet<u32> {
    let labels = mesh.grain_of.as_ref().unwrap();
    let own = mesh.tets.iter().zip(labels).filter(|&(_, &label)| label == grain);
    own.flat_map(|(tet, _)| *tet).collect()
}

#[test]
fn touching_grains_share_nodes_and_separated_grains_do_not() {
    let shared = |film_mm: f64| {
        let packing = Packing {
            film_mm,
            sizes: vec![SizeClass { median_radius_mm: 0.3, spread: 0.0, share: 1.0 }],
            ..Packing::new(if film_mm > 0.0 { 0.3 } else { 0.5 }, 5)
        };
        let field = field(&packing);
        let mode = GrainMode::Conforming;
        let meshed = mesh(Meshing { mode, ..Meshing::new(0.15) }, &field);
        let nodes: Vec<_> =
            (1..=field.grains() as u32).map(|grain| nodes_of(&meshed.mesh, grain)).collect();
        let pairs = (0..nodes.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        pairs.filter(|&(a, b)| !nodes[a].is_disjoint(&nodes[b])).count()
    };
    assert!(shared(0.0) > 0);
    assert_eq!(shared(0.04), 0);
}

/// A film of matrix between a grain and an end is preserved even if it is thinner than the mesh size; a grain that
/// is cut by the end reaches the end.
#[test]
fn grains_reach_only_the_ends_that_they_touch() {
    let reached = |from_axis_mm: f64, height_mm: f64| -> Vec<String> {
        let grain = Grain::sphere([0.6 * from_axis_mm, 0.8 * from_axis_mm, height_mm], 0.4);
        let field = GrainList::new(vec![grain], RADIUS, HEIGHT);
        let mode = GrainMode::Conforming;
        let meshed = mesh(Meshing { mode, ..Meshing::new(0.2) }, &field);
        let grain = nodes_of(&meshed.mesh, 1);
        assert!(!grain.is_empty());
        let touches = |triangles: &[[u32; 3]]| {
            triangles.as_flattened().iter().any(|node| grain.contains(node))
        };
        let ends = meshed.mesh.surfaces.iter().filter(|(name, _)| *name != "side");
        ends.filter(|(_, at)| touches(at)).map(|(name, _)| name.clone()).collect()
    };
    for film_mm in [0.02, 0.05, 0.1] {
        let (low, high) = (0.4 + film_mm, HEIGHT - 0.4 - film_mm);
        for from_axis_mm in [0.0, 0.3, RADIUS - 0.45] {
            assert!(reached(from_axis_mm, low).is_empty(), "{film_mm} {from_axis_mm}");
            assert!(reached(from_axis_mm, high).is_empty(), "{film_mm} {from_axis_mm}");
        }
    }
    for from_axis_mm in [0.0, 0.3, RADIUS - 0.45] {
        assert_eq!(reached(from_axis_mm, 0.35), ["bottom"]);
        assert_eq!(reached(from_axis_mm, HEIGHT - 0.35), ["top"]);
    }
}

#[test]
fn grains_finer_than_the_mesh_become_mixtures_of_their_volume() {
    let field = field(&packing(GrainForm::Polyhedron, 0.1, 0.08));
    let meshed = mesh(Meshing::new(0.3), &field);
    let report = &meshed.report;
    assert_eq!(report.grains_in(GrainMode::Fraction), field.grains());
    assert!((report.achieved_fraction / report.asked_fraction - 1.0).abs() < 0.005, "{report}");
    for grain in &report.grains {
        assert!(grain.volume_error().abs() < 0.02, "{grain:?}");
    }
    // the volumes computed from the mixtures agree
    let mixture = meshed.mesh.mixture.as_ref().unwrap();
    let volumes = meshed.mesh.volumes();
    let labels = meshed.mesh.grain_of.as_ref().unwrap();
    let grain: f64 = (0..volumes.len())
        .map(|tet| match labels[tet] {
            0 => volumes[tet] * f64::from(mixture[tet].fraction),
            _ => volumes[tet],
        })
        .sum();
    let total: f64 = volumes.iter().sum();
    assert!((grain / total / report.achieved_fraction - 1.0).abs() < 1e-4);
    // with a conforming mesh these grains are missing, and the report warns
    let mode = GrainMode::Conforming;
    let lost = mesh(Meshing { mode, ..Meshing::new(0.3) }, &field).report;
    assert!(
        lost.lost_grains() > 0 && lost.warnings().iter().any(|w| w.contains("omitted")),
        "{lost}"
    );
}

#[test]
fn a_straight_wall_gives_a_warning_about_the_wall_only() {
    let field = field(&packing(GrainForm::Polyhedron, 0.1, 0.08));
    let report = |curved| mesh(Meshing { curved, ..Meshing::new(0.3) }, &field).report;
    let straight = report(false);
    // a wall of n flat faces reduces the cross-section by the fraction (2 π / n)² / 6; n is about 2 π / 0.3
    assert!((straight.volume_error / -0.015 - 1.0).abs() < 0.4, "{}", straight.volume_error);
    let grains: f64 = straight.grains.iter().map(|grain| grain.achieved_mm3).sum();
    let mesh_mm3 = CYLINDER * (1.0 + straight.volume_error);
    assert!((grains / mesh_mm3 / straight.achieved_fraction - 1.0).abs() < 1e-9);
    let told = straight.warnings();
    assert!(told.len() == 1 && told[0].contains("order 2"), "{told:?}");
    let curved = report(true);
    assert!(curved.warnings().is_empty(), "{:?}", curved.warnings());
    assert!((curved.achieved_fraction / curved.asked_fraction - 1.0).abs() < 0.005, "{curved}");
}

#[test]
fn mixtures_store_the_direction_of_the_interface() {
    let centre = [0.0, 0.0, 0.8];
    let field = GrainList::new(vec![Grain::sphere(centre, 0.6)], RADIUS, HEIGHT);
    let mode = GrainMode::Fraction;
    let meshed = mesh(Meshing { mode, ..Meshing::new(0.15) }, &field);
    let mixture = meshed.mesh.mixture.as_ref().unwrap();
    let mut mixed = 0;
    for (tet, mixture) in mixture.iter().enumerate().filter(|(_, m)| m.fraction > 0.0) {
        mixed += 1;
        let corners = meshed.mesh.corners(tet);
        let outward: Vec<f64> =
            (0..3).map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0 - centre[k]).collect();
        let length = outward.iter().map(|x| x * x).sum::<f64>().sqrt();
        let cosine: f64 =
            outward.iter().zip(mixture.normal).map(|(x, n)| x / length * f64::from(n)).sum();
        assert!(cosine > 0.97, "tetrahedron {tet}: {mixture:?}");
    }
    assert_eq!(mixed, meshed.report.mixed_tets);
    assert!(mixed > 100);
}

#[test]
fn mode_whole_does_not_move_the_nodes_of_the_lattice() {
    let spacing_mm = 0.1;
    let field = field(&packing(GrainForm::Sphere, 0.2, 0.3));
    let meshed = mesh(Meshing { mode: GrainMode::Whole, ..Meshing::new(spacing_mm) }, &field);
    let (mesh, report) = (&meshed.mesh, &meshed.report);
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm };
    let lattice = lattice.build_round().unwrap();
    assert_eq!((&mesh.nodes, &mesh.tets), (&lattice.nodes, &lattice.tets));
    assert!(mesh.mixture.is_none() && report.mixed_tets == 0);
    assert_eq!(report.grains_in(GrainMode::Whole), field.grains());
    assert_eq!((report.lost_grains(), report.interface_rms_mm), (0, 0.0));

    // a tetrahedron belongs to the grain that contains its centroid, except for tetrahedra that a surface cuts in
    // half; their centroid is near this surface
    let labels = mesh.grain_of.as_ref().unwrap();
    let (mut others, mut volumes) = (0.0, vec![0.0; field.grains() + 1]);
    for (tet, &label) in labels.iter().enumerate() {
        volumes[label as usize] += mesh.tet_volume(tet);
        let corners = mesh.corners(tet);
        let centre = std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0);
        let there = field.grain_at(centre);
        if there != label {
            others += mesh.tet_volume(tet);
            let off = field.distance(there.max(label), centre).abs();
            assert!(off < 0.25 * spacing_mm, "tetrahedron {tet}: {off} mm");
        }
    }
    assert!(others < 0.02 * mesh.volume(), "{} of the mesh", others / mesh.volume());
    // with one common offset the total volume is preserved, and each grain's volume up to the volume of a few
    // tetrahedra
    assert!((report.achieved_fraction / report.asked_fraction - 1.0).abs() < 0.005, "{report}");
    for (grain, volume) in report.grains.iter().zip(&volumes[1..]) {
        assert!((grain.achieved_mm3 - volume).abs() < 1e-12);
        assert!(grain.volume_error().abs() < 0.05, "{grain:?}");
    }
    let region = mesh.region_volume("grain").unwrap();
    assert!((region / mesh.volume() - report.achieved_fraction).abs() < 1e-12);
}

#[test]
fn labelled_voxels_are_meshed_like_the_exact_grains() {
    let spheres = field(&packing(GrainForm::Sphere, 0.2, 0.35));
    let voxel = 0.03;
    let scanner = Scanner { photons: 1e9, rings: 0.0, texture: 0.0, ..Scanner::new(voxel, 1) };
    let scan = scanner.scan(RADIUS, HEIGHT, &spheres).unwrap();
    let voxels = VoxelGrains::new(&scan.labels, None, &scan.cylinder);
    assert_eq!(voxels.grains(), spheres.grains());
    for grain in 1..=spheres.grains() as u32 {
        let (is, asked) = (voxels.volume_mm3(grain), spheres.volume_mm3(grain));
        assert!((is / asked - 1.0).abs() < 0.02, "grain {grain}: {is} for {asked}");
    }
    let meshed = mesh(Meshing::new(4.0 * voxel), &voxels);
    assert_bars(&meshed.report);
    // compare with the exact spheres, not with the voxels
    let (mut squares, mut count) = (0.0, 0.0);
    let labels = meshed.mesh.grain_of.as_ref().unwrap();
    let matrix: BTreeSet<u32> = nodes_of(&meshed.mesh, 0);
    for (tet, &label) in meshed.mesh.tets.iter().zip(labels).filter(|(_, label)| **label > 0) {
        for node in tet.iter().filter(|node| matrix.contains(node)) {
            squares += spheres.distance(label, meshed.mesh.nodes[*node as usize]).powi(2);
            count += 1.0;
        }
    }
    let rms = (squares / f64::max(count, 1.0)).sqrt();
    assert!(rms < 0.5 * voxel, "{} voxels", rms / voxel);
    assert!(meshed.report.interface_rms_mm < 0.3 * voxel, "{}", meshed.report);
}

#[test]
fn the_mesh_does_not_depend_on_the_number_of_threads() {
    let field = field(&packing(GrainForm::Polyhedron, 0.25, 0.3));
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh(Meshing::new(0.2), &field))
    };
    let (one, three) = (build(1), build(3));
    assert_eq!(one.mesh, three.mesh);
    assert_eq!(one.report, three.report);
}

#[test]
fn errors_name_the_invalid_meshing_setting() {
    let none = GrainList::new(Vec::new(), RADIUS, HEIGHT);
    for (field, meshing) in [
        ("spacing_mm", Meshing::new(f64::NAN)),
        ("spacing_mm", Meshing::new(-1.0)),
        ("elements_across", Meshing { elements_across: -1.0, ..Meshing::new(0.2) }),
        ("min_dihedral_deg", Meshing { min_dihedral_deg: 40.0, ..Meshing::new(0.2) }),
    ] {
        let error = meshing.build(RADIUS, HEIGHT, &none).unwrap_err();
        assert!(matches!(error, MeshingError::Field { field: f, .. } if f == field), "{error}");
    }
    let error = Meshing::new(3.0).build(RADIUS, HEIGHT, &none).unwrap_err();
    assert!(matches!(error, MeshingError::Lattice(_)), "{error}");
    let meshing: Meshing =
        serde_json::from_str(r#"{"spacing_mm": 0.4, "mode": "fraction"}"#).unwrap();
    assert_eq!(meshing, Meshing { mode: GrainMode::Fraction, ..Meshing::new(0.4) });
}
