//! Norms of the residual, scaled for convergence tests.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::linear::CHUNK;
use crate::fields::Fields;
use crate::operator::Residual;
use crate::parallel::Halo;

/// Equations that an iteration solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Equations {
    Both,
    Displacement,
    Damage,
}

impl Equations {
    pub(super) fn holds(self, component: usize) -> bool {
        match self {
            Equations::Both => true,
            Equations::Displacement => component < 3,
            Equations::Damage => component == 3,
        }
    }
}

/// Reference values (*scales*) by which residuals are divided.
///
/// At an equilibrium without load, e.g. after unloading, reactions vanish. Therefore, the scales are at least the largest
/// scales of earlier equilibria.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Scales {
    /// Norm of the reactions, N.
    pub(crate) force: f64,
    /// Norm of the driving force of damage, N mm.
    pub(crate) damage: f64,
}

/// Size of the residuals that rounding errors cause.
///
/// A strain is a difference of displacements and contains the rounding errors of the displacements: the nodal forces of
/// an element with modulus M and volume V have the error ε M V^(1/3) |u|, with the machine precision ε.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rounding {
    /// Rounding error of forces, per mm of displacement, N/mm.
    pub(crate) force_per_mm: f64,
    /// Rounding error of forces that does not depend on displacement, N.
    pub(crate) force: f64,
    /// Rounding error of the damage equation, N mm.
    pub(crate) damage: f64,
}

/// Norm of the force residual and norm of the damage residual, each with its scale and its rounding error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Norms {
    force: f64,
    damage: f64,
    scales: Scales,
    rounding: Scales,
}

impl Norms {
    /// Computes the norms of the residual at `fields`. The norms are sums over the `free` values. The residual of an
    /// `unknown` value at a bound is a reaction, and contributes to the scales.
    pub(super) fn at(
        residual: &Residual,
        fields: &Fields,
        unknown: &[[bool; 4]],
        free: &[[bool; 4]],
        rounding: &Rounding,
        halo: &Halo,
    ) -> Self {
        let part = |nodes: Range<usize>| {
            let [mut force, mut reaction, mut damage, mut drive] = [0.0; 4];
            let mut largest = 0.0f64;
            for n in nodes {
                let (nodal, d, unknown, free) =
                    (&residual.nodal[n], residual.drive[n], &unknown[n], &free[n]);
                for k in 0..3 {
                    let square = nodal[k] * nodal[k];
                    if free[k] {
                        force += square
                    } else {
                        reaction += square
                    }
                    largest = largest.max(fields.displacement[n][k].abs());
                }
                let square = nodal[3] * nodal[3];
                if free[3] {
                    damage += square
                } else {
                    drive += square
                }
                if unknown[3] {
                    drive += d * d;
                }
            }
            ([force, reaction, damage, drive], largest)
        };
        let nodes = residual.nodal.len();
        let owned = match halo.ranks().is_alone() {
            true => [0..nodes, 0..0],
            false => halo.owned_ranges(nodes),
        };
        let pieces = owned.into_iter().flat_map(|nodes| {
            nodes.clone().step_by(CHUNK).map(move |first| first..nodes.end.min(first + CHUNK))
        });
        let pieces: Vec<Range<usize>> = pieces.collect();
        let piece_norms: Vec<([f64; 4], f64)> = pieces.into_par_iter().map(part).collect();
        let [reaction, drive] = residual.external;
        let mut squares = [0.0, reaction, 0.0, drive];
        piece_norms.iter().for_each(|(part, _)| (0..4).for_each(|k| squares[k] += part[k]));
        let mut largest = [piece_norms.iter().map(|(_, largest)| *largest).fold(0.0, f64::max)];
        halo.ranks().sum(&mut squares);
        halo.ranks().max(&mut largest);
        let [force, reaction, damage, drive] = squares.map(f64::sqrt);
        Self {
            force,
            damage,
            scales: Scales { force: reaction, damage: drive },
            rounding: Scales {
                force: rounding.force_per_mm * largest[0] + rounding.force,
                damage: rounding.damage,
            },
        }
    }

    /// Adds the equation for the force of a platen: the squares of the force difference and of the prescribed force, N².
    pub(super) fn add_force(&mut self, difference_square: f64, prescribed_square: f64) {
        self.force = self.force.hypot(difference_square.sqrt());
        self.scales.force = self.scales.force.hypot(prescribed_square.sqrt());
    }

    /// Returns the scales at the evaluated fields: norm of the reactions and norm of the driving force.
    pub(super) fn scales(&self) -> Scales {
        self.scales
    }

    /// Returns the norms with increased scales. The scales are at least `largest`, and so large that a residual of the
    /// size of the rounding errors, divided by its scale, is at most `tolerance`.
    pub(super) fn beside(mut self, largest: &Scales, tolerance: f64) -> Self {
        let at_least =
            |scale: f64, largest: f64, rounding: f64| scale.max(largest).max(rounding / tolerance);
        let Scales { force, damage } = self.scales;
        self.scales = Scales {
            force: at_least(force, largest.force, self.rounding.force),
            damage: at_least(damage, largest.damage, self.rounding.damage),
        };
        self
    }

    /// Whether all norms are finite numbers.
    pub(super) fn is_finite(&self) -> bool {
        let Scales { force, damage } = self.scales;
        [self.force, self.damage, force, damage].iter().all(|x| x.is_finite())
    }

    pub(super) fn converged(&self, field: Equations, tolerance: f64) -> bool {
        let force = self.force <= (tolerance * self.scales.force).max(self.rounding.force);
        let damage = self.damage <= (tolerance * self.scales.damage).max(self.rounding.damage);
        match field {
            Equations::Both => force && damage,
            Equations::Displacement => force,
            Equations::Damage => damage,
        }
    }

    /// Returns the larger of the scaled residuals of displacement and damage.
    pub(super) fn largest(&self) -> f64 {
        self.merit(Equations::Displacement, self).max(self.merit(Equations::Damage, self))
    }

    /// Returns the residual divided by the scales of `reference`. The residuals of several iterates can be compared if
    /// all are divided by the scales of the same `reference`.
    pub(super) fn merit(&self, field: Equations, reference: &Norms) -> f64 {
        let tiny = f64::MIN_POSITIVE;
        let force = self.force / reference.scales.force.max(tiny);
        let damage = self.damage / reference.scales.damage.max(tiny);
        match field {
            Equations::Both => force.hypot(damage),
            Equations::Displacement => force,
            Equations::Damage => damage,
        }
    }
}
