//! The residual of an increment, and the energies that come with it.

use super::bounds::Bounds;
use crate::fields::Fields;
use crate::material::PointMaterial;

/// One time increment: where it starts, where it stands.
#[derive(Clone, Copy)]
pub struct Increment<'a> {
    /// By region.
    pub materials: &'a [PointMaterial],
    /// The current fields.
    pub fields: &'a Fields,
    /// What it started from.
    pub context: StepContext<'a>,
}

/// A node and the block −∂force/∂u of what touches it there, N/mm.
pub type NodeBlock = (u32, [[f64; 3]; 3]);

/// A time increment: its start, its length, and what acts and holds meanwhile.
#[derive(Clone, Copy)]
pub struct StepContext<'a> {
    /// φ at the start.
    pub damage_before: &'a [f64],
    /// Δt, s.
    pub duration: f64,
    /// What resists the growth of damage beside ξ/Δt, MPa.
    pub damping: f64,
    /// The largest ψ⁺ so far at each elastic point, element after element; empty: the current one
    /// drives damage.
    pub history: &'a [f64],
    /// Limits of nodal values; `None`: there are none.
    pub bounds: Option<&'a Bounds>,
    /// What contact adds to the tangent; the residual does not read it.
    pub contact: &'a [NodeBlock],
}

impl<'a> StepContext<'a> {
    /// An increment without history and bounds.
    pub fn new(damage_before: &'a [f64], duration: f64) -> Self {
        Self { damage_before, duration, damping: 0.0, history: &[], bounds: None, contact: &[] }
    }
}

/// A parameter of the materials, by those on either side of its value.
#[derive(Clone, Copy)]
pub struct Shift<'a> {
    /// By region.
    pub below: &'a [PointMaterial],
    pub above: &'a [PointMaterial],
    /// The difference of the parameter between them.
    pub width: f64,
    /// The rates of the nodal values u_x, u_y, u_z, φ with the parameter where the increment began.
    pub before: &'a [[f64; 4]],
}

/// Residual and energies at the current fields.
#[derive(Clone, Debug, Default)]
pub struct Residual {
    /// R_u (N) and R_φ (N mm) of every node, prescribed values included.
    pub nodal: Vec<[f64; 4]>,
    /// ∫ g′ ψ⁺ N_a dV alone, N mm: the scale of R_φ.
    pub drive: Vec<f64>,
    /// ∫ g ψ⁺ + ψ⁻ dV, N mm.
    pub elastic: f64,
    /// Squares of what acts from outside, loads and contact, at the nodes that belong to this rank: of forces
    /// (N²) and of damage sources.
    pub external: [f64; 2],
    /// ∫ Gc/(c₀ ℓ₀) [α + ℓ₀² |∇φ|²] dV, N mm.
    pub fracture: f64,
    /// ∫ ξ (φ − φ_n)²/Δt dV, N mm: dissipated in this increment.
    pub viscous: f64,
}

impl Residual {
    pub fn new(nodes: usize) -> Self {
        Self { nodal: vec![[0.0; 4]; nodes], drive: vec![0.0; nodes], ..Self::default() }
    }

    pub fn clear(&mut self) {
        self.nodal.fill([0.0; 4]);
        self.drive.fill(0.0);
        (self.elastic, self.fracture, self.viscous) = (0.0, 0.0, 0.0);
    }

    /// What the incremental problem makes stationary: E_el + E_frac + ½ ∫ ξ (φ − φ_n)²/Δt dV.
    pub fn potential(&self) -> f64 {
        self.elastic + self.fracture + 0.5 * self.viscous
    }
}
