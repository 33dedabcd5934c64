//! How long the parts of a Newton iteration take.

use std::sync::Arc;

use super::curve::Fields;
use super::test::CompressionTest;
use crate::error::FemError;
use crate::operator::{Coupling, Increment, Layout, MatrixFree, NONE, Residual, Span};

/// Seconds for each part of a Newton iteration, the least of several repetitions.
#[derive(Clone, Copy, Debug)]
pub struct PartTimes {
    /// Residual and energies.
    pub residual_s: f64,
    /// Assembly of the tangent.
    pub tangent_s: f64,
    /// Factorisation, or the hierarchy of the iterative solver.
    pub factorisation_s: f64,
    /// Storing the point data of the matrix-free tangent.
    pub linearise_s: f64,
    /// Product of the matrix-free tangent and a vector.
    pub apply_s: f64,
    /// Solution to a residual of 1e-3 with the factor.
    pub solve_s: f64,
}

impl PartTimes {
    /// A Newton iteration that keeps no factor.
    pub fn newton_iteration_s(&self) -> f64 {
        self.residual_s + self.tangent_s + self.factorisation_s + self.solve_s
    }
}

impl CompressionTest {
    /// Times the parts of a Newton iteration at a uniform small compression, for benches, by a clock
    /// in seconds.
    ///
    /// # Errors
    /// [`FemError::Factorisation`] if memory is short or the tangent is singular.
    pub fn time_parts(
        &self,
        repetitions: u32,
        clock: &dyn Fn() -> f64,
    ) -> Result<PartTimes, FemError> {
        let domain = &self.problem.discretisation;
        let materials: Vec<_> = {
            let field = self.problem.phase_field.as_ref();
            self.problem.materials.iter().map(|m| m.at_point(field)).collect()
        };
        let mut fields = Fields::zero(domain.nodes.len());
        for (u, x) in fields.displacement.iter_mut().zip(&domain.nodes) {
            *u = [1e-3 * x[0], 1e-3 * x[1], -4e-3 * x[2]];
        }
        let increment = Increment {
            materials: &materials,
            fields: &fields,
            span: Span::new(&fields.damage, 0.01),
        };
        let operator = domain.operator.as_ref();
        let mut linear = domain.linear.solver(operator);
        let mut residual = Residual::new(domain.nodes.len());
        let residual_s =
            least(clock, repetitions, || operator.residual(&increment, &mut residual).is_ok());
        let free: Vec<_> = domain.unknowns.equation.iter().map(|e| e.map(|e| e != NONE)).collect();
        let mut step = vec![[0.0; 4]; domain.nodes.len()];
        let failed = |reason: &str| FemError::Factorisation {
            unknowns: domain.unknowns.count,
            reason: reason.into(),
        };
        let tangent_s = least(clock, repetitions, || {
            linear.linearise(&increment, Coupling::Full, &free).is_ok()
        });
        let begin = clock();
        linear
            .solve(&residual.nodal, &mut step, 1e-3)
            .map_err(|_| failed("the tangent is singular"))?;
        let first_s = clock() - begin;
        let solve_s =
            least(clock, repetitions, || linear.solve(&residual.nodal, &mut step, 1e-3).is_ok());
        let factorisation_s = first_s - solve_s;
        let layout = Arc::new(Layout::new(operator, &domain.nodes));
        let mut free_of_matrix = MatrixFree::<f64>::new(layout);
        let linearise_s = least(clock, repetitions, || {
            free_of_matrix.linearise(operator, &increment, Coupling::Full).is_ok()
        });
        let apply_s =
            least(clock, repetitions, || free_of_matrix.multiply(&residual.nodal, &mut step));
        Ok(PartTimes { residual_s, tangent_s, factorisation_s, linearise_s, apply_s, solve_s })
    }
}

/// The least mean of `repetitions` series, each long enough for a coarse clock.
fn least<T>(clock: &dyn Fn() -> f64, repetitions: u32, mut part: impl FnMut() -> T) -> f64 {
    const SERIES_S: f64 = 0.05;
    let mut best = f64::INFINITY;
    for _ in 0..repetitions.max(1) {
        let (begin, mut calls) = (clock(), 0);
        while clock() - begin < SERIES_S {
            std::hint::black_box(part());
            calls += 1;
        }
        best = best.min((clock() - begin) / f64::from(calls));
    }
    best
}
