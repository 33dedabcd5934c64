//! Time increment, and residual at the end of the increment.

use super::bounds::Bounds;
use crate::fields::Fields;
use crate::material::PointMaterial;

/// Time increment with the current fields.
#[derive(Clone, Copy)]
pub struct Increment<'a> {
    /// Materials by region.
    pub materials: &'a [PointMaterial],
    /// The current fields.
    pub fields: &'a Fields,
    /// Start, duration, bounds and contact of the increment.
    pub context: StepContext<'a>,
}

/// Node, and the block −∂force/∂u of the contact force at this node, N/mm.
pub type NodeBlock = (u32, [[f64; 3]; 3]);

/// Two nodes a and b, and the block −∂f_a/∂u_b of the force at a, N/mm.
pub type PairBlock = (u32, u32, [[f64; 3]; 3]);

/// Adds the products of the blocks with the displacements of `x` to `y`.
pub fn add_pair_products(pairs: &[PairBlock], x: &[[f64; 4]], y: &mut [[f64; 4]]) {
    for (row, column, block) in pairs {
        let (x, y) = (&x[*column as usize], &mut y[*row as usize]);
        for i in 0..3 {
            y[i] += (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
        }
    }
}

/// Data of a time increment except the current fields: start, duration, bounds and contact.
#[derive(Clone, Copy)]
pub struct StepContext<'a> {
    /// φ at the start of the increment.
    pub damage_before: &'a [f64],
    /// Duration Δt of the increment, s.
    pub duration: f64,
    /// Resistance to the growth of damage in addition to ξ/Δt, MPa.
    pub damping: f64,
    /// State of the laws at the start of the increment, in the order of [`Operator::state`](super::Operator::state).
    /// Empty if the state is zero at all points.
    pub state: &'a [f64],
    /// Bounds of nodal values; `None` without bounds.
    pub bounds: Option<&'a Bounds>,
    /// Contributions of contact to the tangent. The residual does not contain contact forces from
    /// this field.
    pub contact: &'a [NodeBlock],
    /// Contributions of forces that depend on the displacement of several nodes (follower pressure) to the tangent. The
    /// residual does not contain these forces.
    pub pairs: &'a [PairBlock],
}

impl<'a> StepContext<'a> {
    /// Creates an increment without state, damping, bounds and contact.
    pub fn new(damage_before: &'a [f64], duration: f64) -> Self {
        Self {
            damage_before,
            duration,
            damping: 0.0,
            state: &[],
            bounds: None,
            contact: &[],
            pairs: &[],
        }
    }
}

/// Residual and energies at the current fields.
#[derive(Clone, Debug, Default)]
pub struct Residual {
    /// R_u (N) and R_φ (N mm) of every node, including the components with prescribed values.
    pub nodal: Vec<[f64; 4]>,
    /// The part ∫ g′ ψ⁺ N_a dV of R_φ, N mm; its norm scales R_φ.
    pub drive: Vec<f64>,
    /// Elastic energy ∫ g ψ⁺ + ψ⁻ dV, N mm.
    pub elastic: f64,
    /// Two sums over the nodes that this rank owns: the squares of loads and contact forces (N²), and the
    /// squares of damage sources (N² mm²).
    pub external: [f64; 2],
    /// Crack energy ∫ Gc/(c₀ ℓ₀) [α + ℓ₀² |∇φ|²] dV, N mm.
    pub fracture: f64,
    /// Viscous dissipation of the increment: ∫ ξ (φ − φ_n)²/Δt dV, N mm.
    pub viscous: f64,
}

impl Residual {
    /// Creates a zero residual for `nodes` nodes.
    pub fn new(nodes: usize) -> Self {
        Self { nodal: vec![[0.0; 4]; nodes], drive: vec![0.0; nodes], ..Self::default() }
    }

    pub fn clear(&mut self) {
        self.nodal.fill([0.0; 4]);
        self.drive.fill(0.0);
        (self.elastic, self.fracture, self.viscous) = (0.0, 0.0, 0.0);
    }

    /// Returns the incremental potential, which the solution makes stationary: E_el + E_frac + ½ ∫ ξ (φ − φ_n)²/Δt
    /// dV, N mm.
    pub fn potential(&self) -> f64 {
        self.elastic + self.fracture + 0.5 * self.viscous
    }
}
