//! How long the parts of a Newton iteration take.

use std::sync::Arc;
use std::time::Instant;

use super::curve::Fields;
use super::test::CompressionTest;
use crate::error::FemError;
use crate::operator::{Coupling, Increment, Residual, Span};
use crate::solve::Direct;

/// Seconds for each part of a Newton iteration, the least of several repetitions.
#[derive(Clone, Copy, Debug)]
pub struct PartTimes {
    /// Residual and energies.
    pub residual_s: f64,
    /// Assembly of the tangent.
    pub tangent_s: f64,
    /// Factorisation.
    pub factorisation_s: f64,
    /// Solution with the factor, checked and refined.
    pub solve_s: f64,
}

impl PartTimes {
    /// A Newton iteration that keeps no factor.
    pub fn newton_iteration_s(&self) -> f64 {
        self.residual_s + self.tangent_s + self.factorisation_s + self.solve_s
    }
}

impl CompressionTest {
    /// Times the parts of a Newton iteration at a uniform small compression, for benches.
    ///
    /// # Errors
    /// [`FemError::Factorisation`] if memory is short or the tangent is singular.
    pub fn time_parts(&self, repetitions: u32) -> Result<PartTimes, FemError> {
        let domain = &self.discretisation;
        let materials: Vec<_> =
            self.materials.iter().map(|m| m.at_point(self.phase_field.as_ref())).collect();
        let mut fields = Fields::zero(domain.nodes.len());
        for (u, x) in fields.displacement.iter_mut().zip(&domain.nodes) {
            *u = [1e-3 * x[0], 1e-3 * x[1], -4e-3 * x[2]];
        }
        let increment = Increment {
            materials: &materials,
            fields: &fields,
            span: Span { damage_before: &fields.damage, duration: 0.01 },
        };
        let mut direct = Direct::new(Arc::clone(&domain.symbolic))?;
        let mut residual = Residual::new(domain.nodes.len());
        let mut values = std::mem::take(&mut direct.values);
        let pattern = &domain.symbolic.pattern;
        let residual_s =
            least(repetitions, || domain.operator.residual(&increment, &mut residual).is_ok());
        let tangent_s = least(repetitions, || {
            domain.operator.tangent(&increment, Coupling::Full, pattern, &mut values).is_ok()
        });
        direct.values = values;
        let factorisation_s = least(repetitions, || direct.factorise());
        let mut step = vec![0.0; domain.unknowns.count];
        let mut solved = Ok(());
        let solve_s = least(repetitions, || {
            domain.unknowns.gather(&residual.nodal, &mut step);
            solved = direct.solve(&mut step);
        });
        solved.map_err(|_| FemError::Factorisation {
            unknowns: domain.unknowns.count,
            reason: "the tangent is singular".into(),
        })?;
        Ok(PartTimes { residual_s, tangent_s, factorisation_s, solve_s })
    }
}

fn least<T>(repetitions: u32, mut part: impl FnMut() -> T) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..repetitions.max(1) {
        let begin = Instant::now();
        std::hint::black_box(part());
        best = best.min(begin.elapsed().as_secs_f64());
    }
    best
}
