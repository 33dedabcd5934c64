//! Domain J-integral: the energy release rate of cracks, and the resistance that a phase field offers.
//!
//! A virtual extension q moves the crack tip and its surroundings by q, and leaves the rest of the body in place. J is the
//! elastic energy that is released per unit of extension,
//! J = ∫ (Hᵀ P − ψ I) : ∇q dV,
//! with the displacement gradient H, the nominal stress P and the elastic energy density ψ (Eshelby's energy–momentum
//! tensor in the reference configuration; domain form of Li, Shih & Needleman). In a run with a phase field, ψ and P are the
//! degraded energy and its stress. q is interpolated by the elements' shape functions: J is therefore the derivative
//! of the discrete energy with respect to nodal positions (Parks' virtual crack extension).
//!
//! The damage equation relates J to the resistance of the phase field. Without an active bound of the damage and without a
//! strength, the equation multiplied by −∇φ·q and integrated gives
//! J = ∫ Σ_c : ∇q dV + ∫ ξ φ̇ (−∇φ·q) dV, where Σ_c = w I − 2 (Gc ℓ₀/c₀) ∇φ ⊗ ∇φ and
//! w = Gc/(c₀ ℓ₀) (α(φ) + ℓ₀² |∇φ|²).
//! The first integral is the crack energy per length of a crack that crosses the domain, the second integral the viscous
//! resistance.
//!
//! References: Eshelby, J. Elasticity 5 (1975) 321; Li, Shih & Needleman, Engng Fract. Mech. 21 (1985) 405; Parks, Int. J.
//! Fract. 10 (1974) 487.

use nalgebra::{Matrix3, Vector3};

use super::Evaluation;
use crate::error::{FemError, Unsupported};
use crate::fields::{Fields, LawState};

/// Virtual extension of a straight crack front: the vector q of [`Evaluation::energy_release_n`] as a function of the
/// position. q is the direction of growth inside a cylinder around the front, zero outside a larger cylinder, and falls
/// linearly between both cylinders.
///
/// The inner cylinder contains the damaged zone at the crack tip; the outer cylinder contains no other crack tip, no load
/// and no support that prevents or prescribes motion with a gradient along q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrackExtension {
    /// Point on the crack front, mm.
    pub tip_mm: [f64; 3],
    /// Direction of the front, of any length.
    pub front: [f64; 3],
    /// Direction of growth, of any length.
    pub growth: [f64; 3],
    /// Radii of the inner and of the outer cylinder, mm.
    pub radii_mm: [f64; 2],
}

impl CrackExtension {
    /// Returns q at a reference position (mm).
    pub fn at(&self, position_mm: [f64; 3]) -> [f64; 3] {
        let front = Vector3::from(self.front).normalize();
        let offset = Vector3::from(position_mm) - Vector3::from(self.tip_mm);
        let distance = (offset - front * offset.dot(&front)).norm();
        let [inner, outer] = self.radii_mm;
        let share = ((outer - distance) / (outer - inner)).clamp(0.0, 1.0);
        (Vector3::from(self.growth).normalize() * share).into()
    }
}

/// q and its gradient at a quadrature point.
struct Extension {
    q: Vector3<f64>,
    gradient: Matrix3<f64>,
}

impl Evaluation<'_> {
    /// Returns the elastic energy that a virtual extension of a crack releases per unit of extension, N: the integral
    /// J = ∫ (Hᵀ P − ψ I) : ∇q dV with the displacement gradient H, the nominal stress P and the elastic energy density
    /// ψ. `extension` is the dimensionless vector q at a reference position (mm), such as [`CrackExtension::at`]. For
    /// q of length 1 along a front of length L, the energy release rate is J/L, N/mm.
    ///
    /// The result does not depend on q outside the crack tip if the material is homogeneous, and if q is zero, or
    /// tangential to the surface, on loaded surfaces, supports and curved surfaces. With a phase field, energy and stress are
    /// degraded by the damage, and q must be constant in the damaged zone around the crack tip; the damaged band behind
    /// the crack tip may leave the domain, up to the energy of the residual stiffness. The crack energy and the
    /// viscous resistance are not part of J: see [`crack_resistance_n`](Self::crack_resistance_n) and
    /// [`viscous_resistance_n`](Self::viscous_resistance_n).
    ///
    /// # Errors
    /// [`FemError::Unsupported`] for laws with a state, whose stress does not follow from a stored energy alone; otherwise
    /// the errors of [`elements`](Self::elements).
    ///
    /// # Example
    /// The clamped strip of Rivlin and Thomas: far ahead of the crack, the energy per length is H ψ, and far behind it is zero.
    /// ```
    /// use fem::{Axis, Block, Conditions, Material, NodeSet, Problem, Schedule};
    ///
    /// // the upper half of a strip of height 2 mm; the crack ends at x = 4 mm
    /// let mesh = Block::new([8.0, 0.5, 1.0], [32, 2, 8]).build()?;
    /// let conditions = Conditions::new()
    ///     .node_set("ligament", NodeSet::matching(|[x, _, z]| x > 3.99 && z < 1e-9))
    ///     .fix("ligament", [Axis::Z])
    ///     .fix("front", [Axis::Y])
    ///     .fix("back", [Axis::Y])
    ///     .prescribe("top", [Axis::X, Axis::Z], |_, time_s| [0.0, 0.0, 0.01 * time_s]);
    /// let problem = Problem::builder(mesh)
    ///     .materials([Material::hencky(100.0, 0.25)])
    ///     .conditions(conditions)
    ///     .schedule(Schedule::fixed(1.0, 1))
    ///     .build()?;
    /// let outcome = problem.run(&mut ());
    /// let state = problem.evaluate(&outcome.fields)?;
    /// // q = 1 in the middle, zero at both ends
    /// let q = |[x, ..]: [f64; 3]| [(2.0 - (x - 4.0).abs()).clamp(0.0, 1.0), 0.0, 0.0];
    /// let released = 2.0 * state.energy_release_n(q)? / 0.5;
    /// // uniaxial strain with the modulus E (1 − ν)/((1 + ν)(1 − 2ν)) = 120 MPa
    /// let exact = 2.0 * 0.5 * 120.0 * 1.01f64.ln().powi(2);
    /// assert!((released - exact).abs() < 0.05 * exact, "{released} {exact}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn energy_release_n(
        &self,
        extension: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<f64, FemError> {
        if let Some(k) = self.setup.definition.materials.iter().position(|m| m.state_len() > 0) {
            let region = &self.setup.definition.mesh.regions[k];
            let entity = format!("J-integral in region '{region}'");
            return Err(FemError::unsupported(entity, Unsupported::EnergyReleaseWithState));
        }
        let forces = self
            .operator
            .configurational(&self.increment())
            .map_err(|_| FemError::InvertedFields)?;
        let work = |(&x, force): (&[f64; 3], &[f64; 3])| {
            Vector3::from(extension(x)).dot(&Vector3::from(*force))
        };
        Ok(-self.operator.domain().nodes().iter().zip(&forces).map(work).sum::<f64>())
    }

    /// Returns the crack energy that a virtual extension needs per unit of extension, N: ∫ (w I − 2 (Gc ℓ₀/c₀) ∇φ ⊗ ∇φ)
    /// : ∇q dV with the crack energy density w = Gc/(c₀ ℓ₀) (α(φ) + ℓ₀² |∇φ|²). For a straight crack that enters the
    /// domain behind its tip, the integral is the crack energy per length. On a mesh, this energy exceeds Gc by the
    /// factor of the effective toughness, see [`equations`](crate::equations). `extension` is q as in
    /// [`energy_release_n`](Self::energy_release_n). The result is zero without a phase field. Interface bands and the
    /// factor of the toughness of a [`Strength`](crate::Strength) are not included.
    pub fn crack_resistance_n(&self, extension: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
        let Some(field) = self.setup.definition.phase_field else { return 0.0 };
        let (length, normalisation) = (field.length_mm, field.model.normaliser());
        let mut extensions = self.extensions(extension).into_iter();
        self.integral(|point| {
            let Extension { gradient: q, .. } = extensions.next().expect("an entry of each point");
            let material = &self.setup.definition.materials[point.region];
            let toughness = material.fracture.map_or(0.0, |f| f.toughness_n_per_mm);
            let slope = Vector3::from(point.damage_gradient_per_mm);
            let [alpha, ..] = field.model.local(point.damage);
            let density = alpha / length + length * slope.norm_squared();
            let along = 2.0 * length * slope.dot(&(q * slope));
            toughness / normalisation * (density * q.trace() - along)
        })
    }

    /// Returns the resistance of the damage viscosity to a virtual extension, N: ∫ ξ φ̇ (−∇φ·q) dV with
    /// φ̇ = (φ − φ_n)/Δt. `before` are the fields with the damage φ_n at the start of the last increment, and
    /// `duration_s` is its duration Δt. `extension` is q as in [`energy_release_n`](Self::energy_release_n).
    ///
    /// # Errors
    /// [`FemError::OtherFields`] if `before` belongs to another problem; [`FemError::OutOfRange`] if the duration is not
    /// positive.
    pub fn viscous_resistance_n(
        &self,
        before: &Fields,
        duration_s: f64,
        extension: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<f64, FemError> {
        let (nodes, expected) = (before.damage.len(), self.fields.damage.len());
        if nodes != expected || before.displacement.len() != expected {
            return Err(FemError::OtherFields { nodes, expected });
        }
        if !(duration_s > 0.0 && duration_s.is_finite()) {
            let requirement = "a positive time in s";
            return Err(FemError::parameter("J-integral", "duration_s", duration_s, requirement));
        }
        let mut start = Vec::new();
        self.operator.domain().visit(before, &mut |point, _| start.push(point.damage));
        let mut extensions = self.extensions(extension).into_iter().zip(start);
        Ok(self.integral(|point| {
            let (Extension { q, .. }, start) = extensions.next().expect("an entry of each point");
            let material = &self.setup.definition.materials[point.region];
            let viscosity = material.fracture.map_or(0.0, |f| f.viscosity_mpa_s);
            let slope = Vector3::from(point.damage_gradient_per_mm);
            -viscosity * (point.damage - start) / duration_s * slope.dot(&q)
        }))
    }

    /// Interpolates q by the shape functions, and returns q and its gradient at the points of
    /// [`integral`](Self::integral).
    fn extensions(&self, extension: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<Extension> {
        let domain = self.operator.domain();
        let displacement: Vec<_> = domain.nodes().iter().map(|&x| extension(x)).collect();
        let damage = vec![0.0; displacement.len()];
        let fields = Fields { displacement, damage, platen_mm: 0.0, state: LawState::default() };
        let mut extensions = Vec::new();
        domain.visit(&fields, &mut |point, _| {
            let rows = point.displacement_gradient;
            let gradient = Matrix3::from_fn(|i, j| rows[i][j]);
            extensions.push(Extension { q: point.displacement_mm.into(), gradient });
        });
        extensions
    }
}
