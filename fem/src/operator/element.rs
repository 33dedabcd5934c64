//! One element: gathered values, residual and tangent blocks. Nothing is allocated here.

use nalgebra::{Matrix3, Vector3};

use super::residual::Increment;
use crate::element::Space;
use crate::material::{Damage, Inverted, PointMaterial, PointResponse};

/// The 4 × 4 block of nodes a and b: rows u_x, u_y, u_z, φ of a, columns those of b.
pub(crate) type Block = [[f64; 4]; 4];

/// The most elastic or damage points that a rule has.
pub(super) const MOST_POINTS: usize = 14;

/// The values of one element.
pub(crate) struct Element<'a, const N: usize> {
    pub(super) tet: usize,
    pub(super) space: &'a Space<N>,
    pub(super) material: &'a PointMaterial,
    pub(super) volume: f64,
    pub(super) gradients: &'a [[[f64; 3]; N]],
    displacement: [[f64; 3]; N],
    damage: [f64; N],
    before: [f64; N],
    pub(super) duration: f64,
    /// The largest ψ⁺ so far by elastic point, or nothing.
    history: &'a [f64],
}

/// The contributions of one element to the residual.
#[derive(Clone)]
pub(crate) struct ElementResidual<const N: usize> {
    pub(crate) nodal: [[f64; 4]; N],
    pub(crate) drive: [f64; N],
    pub(crate) elastic: f64,
    pub(crate) fracture: f64,
    pub(crate) viscous: f64,
}

impl<const N: usize> ElementResidual<N> {
    pub(super) fn zero() -> Self {
        let nodal = [[0.0; 4]; N];
        Self { nodal, drive: [0.0; N], elastic: 0.0, fracture: 0.0, viscous: 0.0 }
    }
}

impl<'a, const N: usize> Element<'a, N> {
    pub(crate) fn gather(space: &'a Space<N>, tet: usize, increment: &Increment<'a>) -> Self {
        let nodes = &space.tets[tet];
        let value = |field: &[f64], a: usize| field[nodes[a] as usize];
        Self {
            tet,
            space,
            material: &increment.materials[usize::from(space.region[tet])],
            volume: space.volume[tet],
            gradients: space.gradients_of(tet),
            displacement: std::array::from_fn(|a| increment.fields.displacement[nodes[a] as usize]),
            damage: std::array::from_fn(|a| value(&increment.fields.damage, a)),
            before: std::array::from_fn(|a| value(increment.span.damage_before, a)),
            duration: increment.span.duration,
            history: match increment.span.history {
                [] => &[],
                all => {
                    let points = space.rule.points.len();
                    &all[tet * points..(tet + 1) * points]
                }
            },
        }
    }

    /// H = Σ u_a ⊗ ∇N_a.
    pub(super) fn displacement_gradient(&self, shape: &[[f64; 3]; N]) -> Matrix3<f64> {
        let mut h = Matrix3::zeros();
        for (u, g) in self.displacement.iter().zip(shape) {
            for j in 0..3 {
                for i in 0..3 {
                    h[(i, j)] += u[i] * g[j];
                }
            }
        }
        h
    }

    fn at_point(&self, field: &[f64; N], shape: &[f64; N]) -> f64 {
        field.iter().zip(shape).map(|(x, n)| x * n).sum()
    }

    /// φ at the damage points.
    pub(super) fn damage_at_points(&self) -> [f64; MOST_POINTS] {
        let mut values = [0.0; MOST_POINTS];
        for (value, point) in values.iter_mut().zip(&self.space.rule.damage) {
            *value = self.at_point(&self.damage, &point.shape);
        }
        values
    }

    /// g_q = Σ_p C_qp g(φ_p), one in elastic regions.
    pub(super) fn stiffness_at(&self, q: usize, phi: &[f64; MOST_POINTS]) -> f64 {
        let Some(damage) = &self.material.damage else { return 1.0 };
        let row = &self.space.rule.mixing[q];
        row.iter().zip(phi).map(|(c, &x)| c * damage.degradation.value(x)).sum()
    }

    fn damage_gradient(&self, shape: &[[f64; 3]; N]) -> [f64; 3] {
        std::array::from_fn(|k| self.damage.iter().zip(shape).map(|(x, g)| x * g[k]).sum())
    }

    /// What drives damage at elastic point q: ψ⁺, or the largest value that it has had.
    pub(super) fn driving_energy(&self, q: usize, response: &PointResponse) -> f64 {
        let so_far = self.history.get(q).copied().unwrap_or(0.0);
        response.driving_energy().max(so_far)
    }

    /// Writes the driving energy of each elastic point.
    pub(crate) fn driving_energies(&self, out: &mut [f64]) -> Result<(), Inverted> {
        for (q, (value, shape)) in out.iter_mut().zip(self.gradients).enumerate() {
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            *value = self.driving_energy(q, &response);
        }
        Ok(())
    }

    /// R_u and R_φ of the element's nodes, and its energies.
    pub(crate) fn residual(&self) -> Result<ElementResidual<N>, Inverted> {
        let mut out = ElementResidual::zero();
        let phi = self.damage_at_points();
        let mut driving = [0.0; MOST_POINTS];
        for (q, (point, shape)) in self.space.rule.points.iter().zip(self.gradients).enumerate() {
            let weight = self.volume * point.weight;
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            let g = self.stiffness_at(q, &phi);
            out.elastic += weight * response.energy(g);
            let stress = response.piola(g) * weight;
            for (nodal, gradient) in out.nodal.iter_mut().zip(shape) {
                let force = stress * Vector3::from(*gradient);
                for i in 0..3 {
                    nodal[i] += force[i];
                }
            }
            if let Some(damage) = &self.material.damage {
                for (drive, c) in driving.iter_mut().zip(&self.space.rule.mixing[q]) {
                    *drive += weight * c * self.driving_energy(q, &response);
                }
                let slope = self.damage_gradient(shape);
                let stiffness = weight * damage.gradient;
                out.fracture += stiffness * slope.iter().map(|s| s * s).sum::<f64>();
                for (nodal, gradient) in out.nodal.iter_mut().zip(shape) {
                    nodal[3] += 2.0 * stiffness * dot(&slope, gradient);
                }
            }
        }
        if let Some(damage) = &self.material.damage {
            self.add_local_damage(damage, &phi, &driving, &mut out);
        }
        Ok(out)
    }

    fn add_local_damage(
        &self,
        damage: &Damage,
        phi: &[f64; MOST_POINTS],
        driving: &[f64; MOST_POINTS],
        out: &mut ElementResidual<N>,
    ) {
        for (p, point) in self.space.rule.damage.iter().enumerate() {
            let weight = self.volume * point.weight;
            let [alpha, slope, _] = damage.density.local(phi[p]);
            let growth = phi[p] - self.at_point(&self.before, &point.shape);
            let rate = damage.viscosity * growth / self.duration;
            out.fracture += weight * damage.local * alpha;
            out.viscous += weight * rate * growth;
            let drive = damage.degradation.slope(phi[p]) * driving[p];
            let local = drive + weight * (damage.local * slope + rate);
            for a in 0..N {
                out.nodal[a][3] += point.shape[a] * local;
                out.drive[a] += point.shape[a] * drive;
            }
        }
    }

    /// The blocks (a, b ≤ a) of the tangent; `coupled` keeps the terms between u and φ.
    pub(crate) fn tangent(
        &self,
        coupled: bool,
        blocks: &mut [[Block; N]; N],
    ) -> Result<(), Inverted> {
        for a in 0..N {
            blocks[a][..=a].fill([[0.0; 4]; 4]);
        }
        let phi = self.damage_at_points();
        let mut driving = [0.0; MOST_POINTS];
        for (q, (point, shape)) in self.space.rule.points.iter().zip(self.gradients).enumerate() {
            let weight = self.volume * point.weight;
            let response = self.material.respond(&self.displacement_gradient(shape))?;
            let tangent = response.tangent(self.stiffness_at(q, &phi));
            let spatial: [[f64; 3]; N] = std::array::from_fn(|a| response.spatial(&shape[a]));
            for a in 0..N {
                for b in 0..=a {
                    let stiffness = tangent.block(&spatial[a], &spatial[b]);
                    let block = &mut blocks[a][b];
                    for i in 0..3 {
                        for j in 0..3 {
                            block[i][j] += weight * stiffness[(i, j)];
                        }
                    }
                }
            }
            let Some(damage) = &self.material.damage else { continue };
            let row = &self.space.rule.mixing[q];
            for (drive, c) in driving.iter_mut().zip(row) {
                *drive += weight * c * self.driving_energy(q, &response);
            }
            for a in 0..N {
                for b in 0..=a {
                    blocks[a][b][3][3] +=
                        2.0 * weight * damage.gradient * dot(&shape[a], &shape[b]);
                }
            }
            if coupled {
                let stress = response.piola_plus() * weight;
                let forces: [Vector3<f64>; N] =
                    std::array::from_fn(|a| stress * Vector3::from(shape[a]));
                let mut softening = [0.0; N];
                for ((point, c), &x) in self.space.rule.damage.iter().zip(row).zip(&phi) {
                    let slope = c * damage.degradation.slope(x);
                    for b in 0..N {
                        softening[b] += slope * point.shape[b];
                    }
                }
                for a in 0..N {
                    for b in 0..=a {
                        for i in 0..3 {
                            blocks[a][b][i][3] += forces[a][i] * softening[b];
                            blocks[a][b][3][i] += forces[b][i] * softening[a];
                        }
                    }
                }
            }
        }
        let Some(damage) = &self.material.damage else { return Ok(()) };
        for (p, point) in self.space.rule.damage.iter().enumerate() {
            let [.., curvature] = damage.density.local(phi[p]);
            let local = damage.degradation.curvature() * driving[p]
                + self.volume
                    * point.weight
                    * (damage.local * curvature + damage.viscosity / self.duration);
            for a in 0..N {
                for b in 0..=a {
                    blocks[a][b][3][3] += point.shape[a] * point.shape[b] * local;
                }
            }
        }
        Ok(())
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
