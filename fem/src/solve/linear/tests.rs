//! Each solver against a matrix whose solution is known.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::direct::{Direct, Symbolic};
use super::*;
use crate::compression::Fields;
use crate::operator::{Operator, Pattern, ReferenceRule, Residual, Span, Tangent, Unknowns};

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

    fn points(&self) -> usize {
        0
    }

    fn domain(&self) -> &dyn crate::boundary::Domain {
        unreachable!("a linear solver takes no integrals")
    }

    fn reference_rule(&self) -> ReferenceRule {
        unreachable!("a matrix has no elements")
    }

    fn reduced_tangent(
        &self,
        _: &Increment,
        _: Coupling,
        _: usize,
        _: &mut [f64],
    ) -> Result<(), Inverted> {
        Ok(())
    }

    fn tets(&self) -> usize {
        0
    }

    fn nodes_of(&self, _: usize) -> &[u32] {
        &[]
    }

    fn mean(&self, _: &[f64], _: &[bool]) -> f64 {
        0.0
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
    let span = Span::new(&fields.damage, 1.0);
    let increment = Increment { materials: &[], fields: &fields, span };
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
    let span = Span::new(&fields.damage, 1.0);
    let increment = Increment { materials: &[], fields: &fields, span };
    direct.linearise(&increment, Coupling::Full, &[[true; 4]; 5]).expect("never inverted");
    let right: Vec<Nodal> = (0..5).map(|n| [1.0, -2.0, 0.5, n as f64]).collect();
    assert!(direct.solve(&right, &mut [[0.0; 4]; 5], 1e-8).is_err());
}
