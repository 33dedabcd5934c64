//! How long the parts of a Newton iteration take: for the bench of the engine, behind the feature
//! `bench-internals`.

use std::sync::Arc;

use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Coupling, Increment, Layout, NONE, Residual, StepContext, product};
use crate::problem::Problem;

/// Seconds for each part of a Newton iteration, the least of several repetitions.
#[derive(Clone, Copy, Debug)]
pub struct PartTimes {
    /// Residual and energies.
    pub residual_s: f64,
    /// Assembly of the tangent.
    pub tangent_s: f64,
    /// Factorisation, or the hierarchy of the iterative solver.
    pub factorisation_s: f64,
    /// Solution to a residual of 1e-3 with the factor.
    pub solve_s: f64,
}

/// What the matrix-free tangent costs, the least of several repetitions.
#[derive(Clone, Copy, Debug)]
pub struct ProductTimes {
    /// Seconds for storing the point data.
    pub linearise_s: f64,
    /// Seconds for a product with a vector.
    pub apply_s: f64,
    /// Point data, which a product reads once.
    pub bytes: usize,
}

impl PartTimes {
    /// A Newton iteration that keeps no factor.
    pub fn newton_iteration_s(&self) -> f64 {
        self.residual_s + self.tangent_s + self.factorisation_s + self.solve_s
    }
}

/// Times the parts of a Newton iteration at a small compression, for benches, by a clock
/// in seconds.
///
/// # Errors
/// [`StepFailure::Singular`] if the tangent cannot be factorised.
pub fn time_parts(
    problem: &Problem,
    repetitions: u32,
    clock: &dyn Fn() -> f64,
) -> Result<PartTimes, StepFailure> {
    let domain = &problem.discretisation;
    let fields = compressed(problem.nodes());
    let increment = Increment {
        materials: &problem.points,
        fields: &fields,
        context: StepContext::new(&fields.damage, 0.01),
    };
    let operator = domain.operator.as_ref();
    let mut linear = domain.linear.solver(operator);
    let mut residual = Residual::new(domain.nodes().len());
    let residual_s =
        least(clock, repetitions, || operator.residual(&increment, &mut residual).is_ok());
    let free: Vec<_> = domain.unknowns.equation.iter().map(|e| e.map(|e| e != NONE)).collect();
    let mut step = vec![[0.0; 4]; domain.nodes().len()];
    let tangent_s =
        least(clock, repetitions, || linear.linearise(&increment, Coupling::Full, &free).is_ok());
    let begin = clock();
    linear.solve(&residual.nodal, &mut step, 1e-3).map_err(|_| StepFailure::Singular)?;
    let first_s = clock() - begin;
    let solve_s =
        least(clock, repetitions, || linear.solve(&residual.nodal, &mut step, 1e-3).is_ok());
    let factorisation_s = first_s - solve_s;
    Ok(PartTimes { residual_s, tangent_s, factorisation_s, solve_s })
}

/// Times the matrix-free tangent at the same compression, by a clock in seconds.
///
/// # Errors
/// [`StepFailure::Inverted`] if an element is turned inside out.
pub fn time_product(
    problem: &Problem,
    repetitions: u32,
    clock: &dyn Fn() -> f64,
) -> Result<ProductTimes, StepFailure> {
    let domain = &problem.discretisation;
    let fields = compressed(problem.nodes());
    let context = StepContext::new(&fields.damage, 0.01);
    let increment = Increment { materials: &problem.points, fields: &fields, context };
    let operator = domain.operator.as_ref();
    let geometry = operator.domain();
    let mut tangent = product(Arc::new(Layout::new(geometry)), geometry.tets());
    tangent.linearise(operator, &increment, Coupling::Full)?;
    let linearise_s = least(clock, repetitions.min(3), || {
        tangent.linearise(operator, &increment, Coupling::Full).is_ok()
    });
    let x: Vec<_> =
        domain.nodes().iter().map(|x| [x[0] * x[1], x[1] * x[2], x[2] * x[0], x[2]]).collect();
    let mut y = vec![[0.0; 4]; domain.nodes().len()];
    let apply_s = least(clock, repetitions, || tangent.apply(&x, &mut y));
    Ok(ProductTimes { linearise_s, apply_s, bytes: tangent.bytes() })
}

/// A small compression, sheared from place to place: no axis is a principal one.
fn compressed(nodes: &[[f64; 3]]) -> Fields {
    let mut fields = Fields::zero(nodes.len());
    for (u, x) in fields.displacement.iter_mut().zip(nodes) {
        let [across, along, up] = *x;
        *u = [1e-3 * across + 2e-4 * along * up, 1e-3 * along, -4e-3 * up + 3e-4 * across * up];
    }
    fields
}

/// The least mean of `repetitions` series, which are no longer than the clock needs: so one of them
/// is undisturbed even on a machine that has other work.
fn least<T>(clock: &dyn Fn() -> f64, repetitions: u32, mut part: impl FnMut() -> T) -> f64 {
    const SERIES_S: f64 = 0.01;
    let mut series = |calls: u32| {
        let begin = clock();
        for _ in 0..calls {
            std::hint::black_box(part());
        }
        clock() - begin
    };
    let mut calls = 1;
    let mut best = series(calls);
    while best < SERIES_S && calls < 1 << 20 {
        calls *= 2;
        best = series(calls);
    }
    for _ in 1..repetitions {
        best = best.min(series(calls));
    }
    best / f64::from(calls)
}
