//! How far an iterate is from equilibrium.

use crate::operator::Residual;
use crate::parallel::Halo;

/// Which equations an iteration acts on.
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

/// Residual norms: of the unknowns, and the scales to compare them with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Norms {
    force: f64,
    reaction: f64,
    damage: f64,
    drive: f64,
}

impl Norms {
    /// What a bound holds is a reaction: of the `unknown` values it leaves the `free` ones.
    pub(super) fn of(
        residual: &Residual,
        unknown: &[[bool; 4]],
        free: &[[bool; 4]],
        halo: &Halo,
    ) -> Self {
        let [mut force, mut damage] = [0.0; 2];
        let [mut reaction, mut drive] = residual.external;
        let values = halo.own_of(&residual.nodal).zip(halo.own_of(&residual.drive));
        let masks = halo.own_of(unknown).zip(halo.own_of(free));
        for ((nodal, d), (unknown, free)) in values.zip(masks) {
            for k in 0..3 {
                let square = nodal[k] * nodal[k];
                if free[k] { force += square } else { reaction += square }
            }
            if free[3] {
                damage += nodal[3] * nodal[3]
            } else {
                drive += nodal[3] * nodal[3]
            }
            if unknown[3] {
                drive += d * d;
            }
        }
        let mut squares = [force, reaction, damage, drive];
        halo.ranks().sum(&mut squares);
        let [force, reaction, damage, drive] = squares;
        Self {
            force: force.sqrt(),
            reaction: reaction.sqrt(),
            damage: damage.sqrt(),
            drive: drive.sqrt(),
        }
    }

    pub(super) fn converged(&self, field: Equations, tolerance: f64) -> bool {
        let force = self.force <= tolerance * self.reaction;
        let damage = self.damage <= tolerance * self.drive;
        match field {
            Equations::Both => force && damage,
            Equations::Displacement => force,
            Equations::Damage => damage,
        }
    }

    /// The larger of the two scaled residuals.
    pub(super) fn largest(&self) -> f64 {
        self.merit(Equations::Displacement, self).max(self.merit(Equations::Damage, self))
    }

    /// The scaled residual, in the scales of `reference` so that iterates can be compared.
    pub(super) fn merit(&self, field: Equations, reference: &Norms) -> f64 {
        let tiny = f64::MIN_POSITIVE;
        let force = self.force / reference.reaction.max(tiny);
        let damage = self.damage / reference.drive.max(tiny);
        match field {
            Equations::Both => force.hypot(damage),
            Equations::Displacement => force,
            Equations::Damage => damage,
        }
    }
}
