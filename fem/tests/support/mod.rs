//! Materials, meshes and problems that several tests share.

pub(crate) mod block;
pub(crate) mod column;
pub(crate) mod creeping;
pub(crate) mod hertz;
pub(crate) mod manufactured;
pub(crate) mod notched_plate;
pub(crate) mod test_device;

use std::path::PathBuf;

use fem::gmsh::GmshNames;
use fem::{
    CompressionTest, FemError, Fracture, Material, Order, Outcome, PhaseField, Platens, Problem,
    Schedule, SolverOptions, Split, TetMesh, gmsh,
};

pub(crate) const RADIUS: f64 = 2.5;
pub(crate) const HEIGHT: f64 = 4.4;

/// Matrix material of the baseline case.
pub(crate) fn matrix() -> Material {
    Material::hencky(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    })
}

/// Grain material of the baseline case.
pub(crate) fn grain() -> Material {
    Material::hencky(22_000.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 1.83,
        viscosity_mpa_s: 0.1,
        residual_stiffness: 0.01,
    })
}

pub(crate) fn phase_field(split: Split) -> PhaseField {
    PhaseField { split, ..PhaseField::new(0.06) }
}

pub(crate) fn loading(displacement_mm: f64, duration_s: f64, steps: u32) -> CompressionTest {
    CompressionTest::new(displacement_mm, Schedule::fixed(duration_s, steps))
}

/// Mesh of a square prism with the height and the cross-sectional area of the specimen, of n³ cells. Inner nodes are
/// shifted, so that the mesh is unstructured. If `grains` is true, every third cell is a grain.
pub(crate) fn prism(n: usize, grains: bool) -> TetMesh {
    let side = RADIUS * std::f64::consts::PI.sqrt();
    let at = |i: usize, j: usize, k: usize| (i + (n + 1) * (j + (n + 1) * k)) as u32;
    let mut mesh = TetMesh { regions: vec!["matrix".into()], ..TetMesh::default() };
    for k in 0..=n {
        for j in 0..=n {
            for i in 0..=n {
                let inner = [i, j, k].iter().all(|&x| x > 0 && x < n);
                // fractional parts of multiples of an irrational number: a fixed but irregular shift
                let shift = |seed: f64| {
                    if inner { 0.4 * ((at(i, j, k) as f64 * seed).fract() - 0.5) } else { 0.0 }
                };
                let shifted = |x: usize, seed: f64| (x as f64 + shift(seed)) / n as f64;
                mesh.nodes.push([
                    side * shifted(i, 0.754_877),
                    side * shifted(j, 0.569_840),
                    HEIGHT * shifted(k, 0.430_159),
                ]);
            }
        }
    }
    let (mut bottom, mut top) = (Vec::new(), Vec::new());
    for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
        let corner = |c: usize| at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
            mesh.region_of.push(u16::from(grains && (i + 2 * j + k) % 3 == 1));
        }
        if k == 0 {
            bottom.extend([[corner(0), corner(3), corner(1)], [corner(0), corner(2), corner(3)]]);
        }
        if k + 1 == n {
            top.extend([[corner(4), corner(5), corner(7)], [corner(4), corner(7), corner(6)]]);
        }
    }
    if grains {
        mesh.regions.push("grain".into());
    }
    mesh.surfaces.insert("bottom".into(), bottom);
    mesh.surfaces.insert("top".into(), top);
    mesh
}

/// Builds a compression test with this solver tolerance.
pub(crate) fn test(
    mesh: TetMesh,
    order: Order,
    materials: Vec<Material>,
    field: Option<PhaseField>,
    loading: CompressionTest,
    tolerance: f64,
) -> Problem {
    let options = SolverOptions { tolerance, ..SolverOptions::default() };
    with_options(mesh, order, materials, field, loading, options).expect("valid input")
}

/// Builds a compression test, or returns the error of invalid input.
pub(crate) fn with_options(
    mesh: TetMesh,
    order: Order,
    materials: Vec<Material>,
    field: Option<PhaseField>,
    loading: CompressionTest,
    options: SolverOptions,
) -> Result<Problem, FemError> {
    let builder = loading.builder(mesh)?.order(order).materials(materials);
    builder.phase_field(field).options(options).build()
}

/// Returns the test with other platens.
pub(crate) fn between(problem: &Problem, loading: &CompressionTest, platens: Platens) -> Problem {
    let conditions =
        loading.clone().platens(platens).conditions(problem.mesh()).expect("valid platens");
    problem.with_conditions(conditions).expect("valid conditions")
}

/// (Displacement, force) at the largest force: vertex of the parabola through the three points around the maximum.
pub(crate) fn peak(outcome: &Outcome) -> (f64, f64) {
    let curve = &outcome.curve;
    let top = (0..curve.len())
        .max_by(|&a, &b| curve[a].force_n.total_cmp(&curve[b].force_n))
        .expect("a curve");
    assert!(top > 0 && top + 1 < curve.len(), "the peak is at an end of the curve");
    let [a, b, c] = [top - 1, top, top + 1].map(|k| (curve[k].displacement_mm, curve[k].force_n));
    let h = b.0 - a.0;
    let (slope, bend) = ((c.1 - a.1) / (2.0 * h), (c.1 - 2.0 * b.1 + a.1) / (h * h));
    (b.0 - slope / bend, b.1 - 0.5 * slope * slope / bend)
}

/// Reads the mesh of the reference cylinder; prints a note and returns `None` if the shared data are missing.
pub(crate) fn reference_cylinder() -> Option<TetMesh> {
    let root = std::env::var_os("BRECCIA_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let path = root.join("data/fem/cyl_a.msh");
    if !path.exists() {
        eprintln!(
            "SKIPPED: no reference mesh at {}; set BRECCIA_SHARED to the folder that contains data/",
            path.display()
        );
        return None;
    }
    let names =
        GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12), ("side", 13)]);
    Some(gmsh::read(path, &names).expect("a readable reference mesh"))
}

/// Materials in the order of the mesh's regions.
pub(crate) fn by_region(mesh: &TetMesh, matrix: Material, grain: Material) -> Vec<Material> {
    mesh.regions
        .iter()
        .map(|name| if name == "matrix" { matrix.clone() } else { grain.clone() })
        .collect()
}
