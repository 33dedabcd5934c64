//! Closed surfaces: STL files of other programs, smoothing, and meshes of grains given by surfaces.

use fem_mesh::stl::{self, Triangle};
use fem_mesh::{
    CylinderLattice, Grain, GrainField, GrainList, GrainMode, Meshing, Surface, SurfaceError,
    SurfaceGrains,
};

/// Returns a sphere: an octahedron with repeatedly divided triangles.
pub(crate) fn sphere(centre: [f64; 3], radius: f64, divisions: usize) -> Vec<Triangle> {
    let unit = |p: [f64; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.map(|x| x / length)
    };
    let mut triangles = Vec::new();
    for signs in 0..8 {
        let sign = |k: usize| if signs >> k & 1 == 0 { 1.0 } else { -1.0 };
        let corners = [[sign(0), 0.0, 0.0], [0.0, sign(1), 0.0], [0.0, 0.0, sign(2)]];
        let is_even = sign(0) * sign(1) * sign(2) > 0.0;
        let [a, b, c] = corners;
        triangles.push(if is_even { [a, b, c] } else { [a, c, b] });
    }
    for _ in 0..divisions {
        let four = |[a, b, c]: Triangle| {
            let middle = |p: [f64; 3], q: [f64; 3]| unit(std::array::from_fn(|k| p[k] + q[k]));
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(four).collect();
    }
    let place = |p: [f64; 3]| std::array::from_fn(|k| centre[k] + radius * p[k]);
    triangles.into_iter().map(|triangle| triangle.map(place)).collect()
}

const SPHERES: [([f64; 3], f64); 3] =
    [([0.5, 0.25, 1.5], 0.7), ([-0.9, -0.3, 2.9], 0.8), ([1.9, 0.3, 3.2], 0.9)];

#[test]
fn files_of_one_and_of_several_grains_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.stl");
    let all: Vec<Triangle> = SPHERES.iter().flat_map(|&(c, r)| sphere(c, r, 2)).collect();
    stl::write(&path, "grains", &all).unwrap();
    let surface = Surface::new(&stl::read(&path).unwrap());
    let components = surface.parts();
    assert_eq!(components.len(), 3);
    for (part, (centre, _)) in components.iter().zip(SPHERES) {
        assert_eq!((part.triangles.len(), part.open_edges()), (128, 0));
        let found = part.centroid();
        assert!((0..3).all(|k| (found[k] - centre[k]).abs() < 1e-6), "{found:?}");
    }
    // the same surface as an ASCII file
    let mut text = String::from("solid grains\n");
    for triangle in &all {
        text += " facet normal 0 0 0\n  outer loop\n";
        triangle.iter().for_each(|[x, y, z]| text += &format!("   vertex {x:e} {y:e} {z:e}\n"));
        text += "  endloop\n endfacet\n";
    }
    text += "endsolid grains\n";
    std::fs::write(&path, &text).unwrap();
    assert_eq!(stl::read(&path).unwrap(), all);

    let fault = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        stl::read(&path).unwrap_err().to_string()
    };
    for (bytes, part) in [
        (&b"ply\nformat ascii 1.0\n"[..], "not an STL file"),
        (text.trim_end().trim_end_matches("endsolid grains").as_bytes(), "endsolid"),
        (text.replacen("vertex", "vertex x", 1).as_bytes(), "line 4: `x`"),
        (text.replacen("  endloop", "   vertex 1 2 3\n  endloop", 1).as_bytes(), "4 corners"),
        (b"solid a\nendsolid a\n", "no triangle"),
    ] {
        let message = fault(bytes);
        assert!(message.contains(part) && message.contains("a.stl"), "{message}");
    }
    stl::write(&path, "a", &[[[f64::NAN; 3]; 3]]).unwrap();
    assert!(stl::read(&path).unwrap_err().to_string().contains("not finite"));
    let absent = stl::read("nowhere/a.stl").unwrap_err().to_string();
    assert!(absent.contains("cannot read"), "{absent}");
}

#[test]
fn distances_agree_with_exact_spheres_and_polyhedra() {
    let surfaces = |divisions| -> Vec<Surface> {
        SPHERES.iter().map(|&(c, r)| Surface::new(&sphere(c, r, divisions))).collect()
    };
    let field = SurfaceGrains::new(surfaces(5), 2.5, 4.4).unwrap();
    let exact =
        GrainList::new(SPHERES.iter().map(|&(c, r)| Grain::sphere(c, r)).collect(), 2.5, 4.4);
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..3000 {
        let x = [5.0 * random() - 2.5, 5.0 * random() - 2.5, 4.4 * random()];
        for grain in 1..=3 {
            let (found, gradient) = field.distance_and_gradient(grain, x, 1e-6);
            let expected = exact.distance(grain, x);
            assert!((found - expected).abs() < 2e-3, "{x:?}: {found}, not {expected} mm");
            let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-9);
            assert_eq!(field.distance_below(grain, x, 0.3).is_some(), found < 0.3);
        }
        if (1..=3).all(|grain| exact.distance(grain, x).abs() > 2e-3) {
            assert_eq!(field.grain_at(x), exact.grain_at(x), "{x:?}");
        }
    }
    // the third grain is cut by the wall
    for grain in 1..=3 {
        let ratio = field.volume_mm3(grain) / exact.volume_mm3(grain);
        assert!((ratio - 1.0).abs() < 0.01, "{grain}: {ratio}");
    }

    // at sharp edges and corners, the normal of the nearest triangle does not determine the sign of the distance
    let cylinder =
        CylinderLattice { radius_mm: 1.0, height_mm: 2.0, spacing_mm: 0.5 }.build().unwrap();
    let sharp =
        SurfaceGrains::new(vec![Surface::new(&stl::specimen(&cylinder))], 2.5, 4.4).unwrap();
    for _ in 0..3000 {
        let x = [3.0 * random() - 1.5, 3.0 * random() - 1.5, 3.0 * random() - 0.5];
        let is_outside = x[0].hypot(x[1]) > 1.0 || !(0.0..2.0).contains(&x[2]);
        let is_inside = x[0].hypot(x[1]) < 0.9 && (0.0..2.0).contains(&x[2]);
        let distance = sharp.distance(1, x);
        assert!(!is_outside || distance > 0.0, "{x:?}: {distance}");
        assert!(!is_inside || distance < 0.0, "{x:?}: {distance}");
    }
}

#[test]
fn errors_of_invalid_surfaces_state_the_number_of_the_grain() {
    let good = sphere([0.0, 0.0, 2.0], 0.5, 1);
    let open = Surface::new(&good[1..]);
    let error = SurfaceGrains::new(vec![Surface::new(&good), open], 2.5, 4.4).unwrap_err();
    assert_eq!(error, SurfaceError::Open { grain: 2, triangles: 31, open: 3 });
    let flat: Vec<Triangle> = {
        let [a, b, c] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        vec![[a, b, c], [a, c, b]]
    };
    let error = SurfaceGrains::new(vec![Surface::new(&flat)], 2.5, 4.4).unwrap_err();
    assert!(matches!(error, SurfaceError::Flat { grain: 1, .. }));
    // a surface with reversed triangles gives the same grain
    let turned: Vec<Triangle> = good.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let field = SurfaceGrains::new(vec![Surface::new(&turned)], 2.5, 4.4).unwrap();
    assert_eq!(field.grain_at([0.0, 0.0, 2.1]), 1);
}

#[test]
fn a_mesh_of_surfaces_has_their_volumes() {
    let spheres = &SPHERES[..2];
    let surfaces: Vec<Surface> =
        spheres.iter().map(|&(c, r)| Surface::new(&sphere(c, r, 4))).collect();
    let asked: f64 = surfaces.iter().map(Surface::volume).sum();
    let grains = SurfaceGrains::new(surfaces, 2.5, 4.4).unwrap();
    let meshing = Meshing { mode: GrainMode::Conforming, ..Meshing::new(0.4) };
    let mesh = meshing.build(2.5, 4.4, &grains).unwrap().mesh;
    mesh.validate().unwrap();
    let ratio = mesh.region_volume("grain").unwrap() / asked;
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn smoothing_removes_noise_and_preserves_the_volume() {
    let clean = Surface::new(&sphere([0.2, 0.1, 0.3], 1.0, 4));
    let mut rough = clean.clone();
    for (k, point) in rough.points.iter_mut().enumerate() {
        let factor = 1.0 + 0.04 * (((k * 7919) % 101) as f64 / 50.0 - 1.0);
        let centre = [0.2, 0.1, 0.3];
        *point = std::array::from_fn(|axis| centre[axis] + factor * (point[axis] - centre[axis]));
    }
    let roughness = |surface: &Surface| {
        let centre = surface.centroid();
        let radius = |p: &[f64; 3]| (0..3).map(|k| (p[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
        let radii: Vec<f64> = surface.points.iter().map(radius).collect();
        let mean = radii.iter().sum::<f64>() / radii.len() as f64;
        (radii.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / radii.len() as f64).sqrt()
    };
    let smooth = rough.smoothed(10);
    assert!(roughness(&smooth) < 0.5 * roughness(&rough), "{}", roughness(&smooth));
    assert!((smooth.volume() / rough.volume() - 1.0).abs() < 1e-9);
    let shrunk = clean.scaled(0.9);
    assert!((shrunk.volume() / clean.volume() - 0.729).abs() < 1e-9);
}
