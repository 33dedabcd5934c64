//! Each solver against a matrix whose solution is known.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::direct::Direct;
use super::factor::Symbolic;
use super::*;
use crate::element::{DamageRule, Linear, Quadratic, Space, Tetrahedron};
use crate::fields::Fields;
use crate::material::{Fracture, Material, PhaseField, PointMaterial};
use crate::mesh::CylinderLattice;
use crate::operator::{
    Assembly, LANES, Operator, Pattern, Residual, StepContext, Tangent, Unknowns,
};

/// An operator whose tangent is what it was given.
#[derive(Debug)]
struct Given(Tangent);

impl Operator for Given {
    fn residual(&self, _: &Increment, _: &mut Residual) -> Result<(), Inverted> {
        Ok(())
    }

    fn tangent(&self, _: &Increment, _: Coupling, out: &mut Tangent) -> Result<(), Inverted> {
        out.blocks.copy_from_slice(&self.0.blocks);
        out.symmetric = self.0.symmetric;
        Ok(())
    }

    fn driving_energies(&self, _: &Increment, _: &mut [f64]) -> Result<(), Inverted> {
        Ok(())
    }

    fn domain(&self) -> &dyn crate::element::Domain {
        unreachable!("a matrix has no elements")
    }

    fn point_data(
        &self,
        _: &Increment,
        _: Coupling,
        _: &[u32],
        _: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted> {
        Ok(())
    }
}

/// Two tetrahedra that share a face, with random entries.
fn random_tangent(diagonal: f64, skew: f64) -> Tangent {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut tangent = Tangent::new(Arc::new(Pattern::new(&[[0, 1, 2, 3], [1, 2, 3, 4]], 5)));
    tangent.symmetric = skew == 0.0;
    let pattern = Arc::clone(&tangent.pattern);
    for a in 0..5usize {
        for &b in pattern.graph.of(a).iter().filter(|&&b| b as usize <= a) {
            for i in 0..4 {
                for j in 0..4 {
                    let own = a == b as usize && i == j;
                    let (s, t): (f64, f64) =
                        (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                    let (entry, odd) = if own { (diagonal, 0.0) } else { (s, skew * t) };
                    let mut set = |a: usize, b: u32, i: usize, j: usize, x: f64| {
                        tangent.blocks[pattern.graph.place(a, b)][i][j] = x;
                    };
                    set(a, b, i, j, entry + odd);
                    set(b as usize, a as u32, j, i, entry - odd);
                }
            }
        }
    }
    tangent
}

/// Solves for a known solution; its error and the effort.
fn error_of_direct(tangent: &Tangent, free: &[[bool; 4]]) -> Result<(f64, LinearEffort), Singular> {
    let operator = Given(tangent.clone());
    let unknowns = Unknowns::new(&[0, 4, 1, 2, 3], &[true; 5], std::iter::empty());
    let symbolic = Symbolic::new(&tangent.pattern.graph, &unknowns).expect("a structure");
    let mut direct = Direct::new(&operator, Arc::clone(&tangent.pattern), Arc::new(symbolic));
    let fields = Fields::zero(5);
    let context = StepContext::new(&fields.damage, 1.0);
    let increment = Increment { materials: &[], fields: &fields, context };
    direct.linearise(&increment, Coupling::Full, free).expect("never inverted");
    let exact: Vec<Nodal> = (0..5)
        .map(|n| {
            std::array::from_fn(|k| {
                if free[n][k] { ((4 * n + k) as f64 * 0.7).sin() + 0.2 } else { 0.0 }
            })
        })
        .collect();
    let mut right = vec![[0.0; 4]; 5];
    tangent.multiply(&exact, &mut right);
    let mut x = vec![[0.0; 4]; 5];
    let effort = direct.solve(&right, &mut x, 1e-10)?;
    let difference = x.as_flattened().iter().zip(exact.as_flattened()).map(|(x, e)| (x - e).abs());
    Ok((difference.fold(0.0, f64::max), effort))
}

#[test]
fn direct_solves_definite_indefinite_and_unsymmetric_systems() {
    let mut some = [[true; 4]; 5];
    some[1] = [true, false, true, true];
    some[3] = [false; 4];
    for free in [[[true; 4]; 5], some] {
        for (diagonal, skew) in [(12.0, 0.0), (0.3, 0.0), (0.0, 0.0), (12.0, 0.5)] {
            let tangent = random_tangent(diagonal, skew);
            let (error, effort) = error_of_direct(&tangent, &free).expect("a regular matrix");
            assert!(error < 1e-7, "diagonal {diagonal}, skew {skew}: {error}, {effort:?}");
            let definite = diagonal == 12.0 && skew == 0.0;
            assert!(!definite || effort.iterations <= 3, "a factor in f32 is nearly exact");
        }
    }
}

#[test]
fn a_singular_matrix_is_reported() {
    let mut tangent = random_tangent(1.0, 0.0);
    // the first node's equations without its own block, and all of them the same
    for a in 0..5 {
        for block in
            tangent.pattern.clone().graph.of(a).iter().map(|&b| tangent.pattern.graph.place(a, b))
        {
            tangent.blocks[block] = [[1.0; 4]; 4];
        }
    }
    let operator = Given(tangent.clone());
    let unknowns = Unknowns::new(&[0, 4, 1, 2, 3], &[true; 5], std::iter::empty());
    let symbolic = Symbolic::new(&tangent.pattern.graph, &unknowns).expect("a structure");
    let mut direct = Direct::new(&operator, Arc::clone(&tangent.pattern), Arc::new(symbolic));
    let fields = Fields::zero(5);
    let context = StepContext::new(&fields.damage, 1.0);
    let increment = Increment { materials: &[], fields: &fields, context };
    direct.linearise(&increment, Coupling::Full, &[[true; 4]; 5]).expect("never inverted");
    let right: Vec<Nodal> = (0..5).map(|n| [1.0, -2.0, 0.5, n as f64]).collect();
    assert!(direct.solve(&right, &mut [[0.0; 4]; 5], 1e-8).is_err());
}

/// A compressed cylinder with stiff patches and some damage, and its equations.
struct Cylinder<const N: usize> {
    assembly: Assembly<N>,
    materials: Vec<PointMaterial>,
    fields: Fields,
    free: Vec<[bool; 4]>,
    constrained: Vec<(u32, usize)>,
}

impl<const N: usize> Cylinder<N> {
    fn new<T: Tetrahedron<N>>(spacing_mm: f64, damage: f64) -> Self {
        let mut mesh =
            CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm }.build().expect("a mesh");
        mesh.regions.push("stiff".into());
        for tet in 0..mesh.tets.len() {
            let [x, y, z] = mesh.corners(tet)[0];
            mesh.region_of[tet] =
                u16::from((1.9 * x).sin() * (2.1 * y).cos() * (1.7 * z).sin() > 0.4);
        }
        let space = Space::new::<T>(&mesh, DamageRule::Vertex);
        let field = PhaseField::new(0.06);
        let soft = Material::hencky(275.0, 0.25).with_fracture(Fracture {
            toughness_n_per_mm: 0.0025,
            viscosity_mpa_s: 0.3,
            residual_stiffness: 0.01,
        });
        let stiff =
            Material { elasticity: Material::hencky(22_000.0, 0.25).elasticity, ..soft.clone() };
        let materials = [soft, stiff].iter().map(|m| m.at_point(Some(&field))).collect();
        let (mut constrained, mut fields) = (Vec::new(), Fields::zero(space.nodes.len()));
        for (n, x) in space.nodes.iter().enumerate() {
            let end = x[2] < 1e-9 || x[2] > 4.4 - 1e-9;
            constrained
                .extend((0..3).filter(|&k| x[2] < 1e-9 || (end && k == 2)).map(|k| (n as u32, k)));
            fields.displacement[n] = [2e-3 * x[0], 2e-3 * x[1], -8e-3 * x[2]];
            fields.damage[n] = damage * (0.5 + 0.5 * (2.0 * x[0] + x[2]).sin());
        }
        let mut free = vec![[true; 4]; space.nodes.len()];
        constrained.iter().for_each(|&(n, k)| free[n as usize][k] = false);
        Self { assembly: Assembly::new(space), materials, fields, free, constrained }
    }

    fn plan(&self, multigrid: bool) -> LinearPlan {
        let (tets, nodes) = (&self.assembly.space.tets, &self.assembly.space.nodes);
        if multigrid {
            return LinearPlan::multigrid(tets, nodes);
        }
        let damaged = vec![true; nodes.len()];
        LinearPlan::new(
            tets,
            nodes,
            &damaged,
            self.constrained.iter().copied(),
            crate::solve::LinearScheme::Direct,
        )
        .expect("a plan")
        .0
    }

    /// The solution for a load that is not smooth.
    fn solve(&self, multigrid: bool, tolerance: f64) -> (Vec<Nodal>, LinearEffort) {
        let context = StepContext::new(&self.fields.damage, 0.02);
        let increment = Increment { materials: &self.materials, fields: &self.fields, context };
        let plan = self.plan(multigrid);
        let mut solver = plan.solver(&self.assembly);
        solver.linearise(&increment, Coupling::Full, &self.free).expect("no element is inverted");
        let nodes = self.free.len();
        let right: Vec<Nodal> = (0..nodes)
            .map(|n| std::array::from_fn(|k| ((4 * n + k) as f64 * 0.37).sin()))
            .collect();
        let mut step = vec![[0.0; 4]; nodes];
        let effort = solver.solve(&right, &mut step, tolerance).expect("a regular tangent");
        (step, effort)
    }
}

fn largest_difference(a: &[Nodal], b: &[Nodal]) -> f64 {
    let largest = b.as_flattened().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / largest
}

/// Multigrid against the factor, for definite (little damage) and other tangents; iterations.
fn assert_multigrid<const N: usize, T: Tetrahedron<N>>(spacings: [f64; 2], damage: f64, most: u32) {
    let mut iterations = Vec::new();
    for spacing in spacings {
        let cylinder = Cylinder::<N>::new::<T>(spacing, damage);
        let (exact, _) = cylinder.solve(false, 1e-12);
        let (x, _) = cylinder.solve(true, 1e-9);
        let error = largest_difference(&x, &exact);
        assert!(error < 1e-5, "{N} nodes, spacing {spacing}: {error:e}");
        let (_, effort) = cylinder.solve(true, 1e-3);
        iterations.push(effort.iterations);
    }
    assert!(iterations[1] <= iterations[0] + 6, "mesh dependence: {iterations:?}");
    assert!(iterations[1] <= most, "{iterations:?}");
}

#[test]
fn multigrid_agrees_with_the_factor_and_does_not_depend_on_the_mesh() {
    assert_multigrid::<4, Linear>([0.9, 0.55], 0.1, 30);
    assert_multigrid::<10, Quadratic>([1.4, 0.9], 0.1, 30);
}

#[test]
fn threads_change_no_bit_of_a_solution() {
    let cylinder = Cylinder::<4>::new::<Linear>(0.6, 0.2);
    let quadratic = Cylinder::<10>::new::<Quadratic>(1.2, 0.2);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            [
                cylinder.solve(true, 1e-6).0,
                cylinder.solve(false, 1e-6).0,
                quadratic.solve(true, 1e-6).0,
            ]
        })
    };
    assert_eq!(with(1), with(2));
}
