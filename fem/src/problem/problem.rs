//! A boundary-value problem, ready to run.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::definition::Definition;
use super::discretisation::Discretisation;
use super::parameter::MaterialParameter;
use super::rounding::rounding;
use super::schedule::Schedule;
use crate::boundary::{Conditions, ExternalForces};
use crate::element::{Order, PointValues};
use fem_mesh::MeshError;

use crate::error::FemError;
use crate::fields::Fields;
use crate::material::{Material, PointMaterial};
use crate::operator::{CellStress, Increment, Operator, StepContext};
use crate::solve::{Rounding, Solver};
use fem_mesh::{TetMesh, vtu};

/// Body with materials, boundary conditions and loads, simulated over time.
///
/// Displacement u and damage φ solve, with τ = g(φ) τ⁺ + τ⁻ and the reference body force b, traction t
/// and damage source s,
/// ∫ τ : (∇v F⁻¹) dV = ∫ b·v dV + ∫ t·v dA + contact and
/// ∫ g′(φ) ψ⁺ q + (Gc/(c₀ ℓ₀)) (α′(φ) q + 2 ℓ₀² ∇φ·∇q) + (ξ/Δt)(φ − φ_n) q dV = ∫ s q dV.
///
/// # Example
/// A block pulled by 1 % between planes of symmetry:
/// ```
/// use fem::{Axis, Conditions, CylinderLattice, Material, Problem, Schedule};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let area = mesh.volume() / 4.4;
/// let conditions = Conditions::new()
///     .fix("bottom", [Axis::Z])
///     .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.044 * time_s])
///     .remove_rigid_motions()
///     .measure("top", [0.0, 0.0, 1.0]);
/// let problem = Problem::builder(mesh)
///     .materials([Material::hencky(10.0, 0.4)])
///     .conditions(conditions)
///     .schedule(Schedule::fixed(1.0, 1))
///     .build()?;
/// let outcome = problem.run(&mut ());
/// // F = A₀ λ^(−2ν) E ln λ λ^(2ν) / λ
/// let exact = area * 10.0 * 1.01f64.ln() / 1.01;
/// assert!((outcome.curve[0].force_n - exact).abs() < 1e-6 * exact);
/// assert!((outcome.reactions["bottom"][0][2] + exact).abs() < 1e-6 * exact);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Problem {
    pub(super) parts: Definition,
    pub(crate) discretisation: Arc<Discretisation>,
    /// Materials by region, in their form for quadrature points.
    pub(crate) points: Arc<[PointMaterial]>,
    /// Materials below and above the value of each parameter.
    pub(super) shifts: Arc<[PointShift]>,
    /// Residuals caused by rounding errors.
    rounding: Rounding,
    /// Operator of the whole mesh if this rank has only a part; created on first use.
    whole: OnceLock<Arc<dyn Operator>>,
}

/// Materials below and above the value of a parameter, in their form for quadrature points.
#[derive(Debug)]
pub(super) struct PointShift {
    pub(super) below: Arc<[PointMaterial]>,
    pub(super) above: Arc<[PointMaterial]>,
    pub(super) width: f64,
}

impl Problem {
    /// Checks the input data and prepares the unknowns and the structure of the factor.
    pub(super) fn new(parts: Definition) -> Result<Self, FemError> {
        parts.validate()?;
        let discretisation = Arc::new(Discretisation::new(&parts)?);
        Ok(Self::with(parts, discretisation))
    }

    fn with(parts: Definition, discretisation: Arc<Discretisation>) -> Self {
        let shift = |parameter: &MaterialParameter| PointShift {
            below: parts.points(&parameter.below),
            above: parts.points(&parameter.above),
            width: parameter.width,
        };
        let shifts = parts.parameters.iter().map(shift).collect();
        let points = parts.points(&parts.materials);
        let rounding = rounding(&parts, &points);
        Self { points, shifts, rounding, parts, discretisation, whole: OnceLock::new() }
    }

    /// Returns the same problem with other materials and without sensitivities. Mesh, unknowns and the structure of
    /// the factor are shared unless a region gains or loses its toughness.
    ///
    /// # Errors
    /// As [`ProblemBuilder::build`](crate::ProblemBuilder::build).
    pub fn with_materials(&self, materials: Vec<Material>) -> Result<Self, FemError> {
        let parts = Definition { materials, parameters: Arc::default(), ..self.parts.clone() };
        parts.validate()?;
        let discretisation = if parts.damaged() == self.discretisation.damaged {
            Arc::clone(&self.discretisation)
        } else {
            Arc::new(Discretisation::new(&parts)?)
        };
        Ok(Self::with(parts, discretisation))
    }

    /// Returns the same problem with sensitivities: its runs also compute the derivatives of the force with respect
    /// to material parameters, along the whole curve. All other data is shared.
    ///
    /// Every accepted increment solves one additional linear system per parameter, with the tangent of the
    /// equilibrium. The dependence of damage on earlier increments is included, and a damage value at an active bound
    /// has the rate of its bound. The derivatives are those at fixed steps: the dependence of adaptive step sizes on
    /// the parameters is not included. At a kink of the equations (tr ε = 0 of a split, a node about to leave its
    /// bound) they are one-sided; if the tangent is singular they end, see [`Sensitivities`](crate::Sensitivities).
    ///
    /// # Errors
    /// [`FemError::Unsupported`] for damage that has no energy (a history, a hybrid split), arc-length steps, and
    /// platens with friction or drag; [`FemError::Parameter`] and others as
    /// [`ProblemBuilder::build`](crate::ProblemBuilder::build) for parameters whose two sides do not enclose the
    /// materials of the problem.
    ///
    /// # Example
    /// The force of an elastic body is proportional to its stiffness:
    /// ```
    /// use fem::{CompressionTest, CylinderLattice, Material, MaterialParameter, Schedule};
    ///
    /// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
    /// let young = MaterialParameter::new("young_mpa", 275.0, |x| vec![Material::hencky(x, 0.25)]);
    /// let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 2))
    ///     .builder(mesh)?
    ///     .materials([Material::hencky(275.0, 0.25)])
    ///     .build()?
    ///     .with_sensitivities(vec![young])?;
    /// let outcome = problem.run(&mut ());
    /// let (force, rate) = (outcome.curve[1].force_n, outcome.sensitivities.force_n[1][0]);
    /// assert!((275.0 * rate - force).abs() < 1e-6 * force);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_sensitivities(&self, parameters: Vec<MaterialParameter>) -> Result<Self, FemError> {
        let parts = Definition { parameters: parameters.into(), ..self.parts.clone() };
        parts.validate()?;
        Ok(Self::with(parts, Arc::clone(&self.discretisation)))
    }

    /// Returns the same problem with other conditions. Mesh, space and the order of elimination are shared.
    ///
    /// # Errors
    /// As [`ProblemBuilder::build`](crate::ProblemBuilder::build).
    pub fn with_conditions(&self, conditions: Conditions) -> Result<Self, FemError> {
        let parts = Definition { conditions: Arc::new(conditions), ..self.parts.clone() };
        parts.validate()?;
        let discretisation = Arc::new(self.discretisation.with_conditions(&parts)?);
        Ok(Self::with(parts, discretisation))
    }

    /// Creates a solver without data from earlier steps.
    pub(super) fn solver(&self) -> Solver<'_, ExternalForces> {
        let Discretisation { operator, unknowns, linear, boundary, .. } =
            self.discretisation.as_ref();
        let (operator, options) = (operator.as_ref(), self.parts.options);
        let mut solver = Solver::new(
            operator,
            unknowns,
            &self.points,
            options,
            linear.solver(operator),
            self.rounding,
        );
        solver.external = ExternalForces::none(boundary);
        solver
    }

    /// Imposes the prescribed values at a fraction of the duration.
    pub(super) fn place(&self, fields: &mut Fields, clock: f64) {
        let time_s = clock * self.parts.schedule.duration_s;
        self.discretisation.boundary.impose(self.discretisation.nodes(), time_s, fields);
    }

    /// Returns ∫ f dV of a function of the fields at each quadrature point, by a rule of degree 5.
    pub fn integrate(&self, fields: &Fields, mut f: impl FnMut(&PointValues) -> f64) -> f64 {
        let mut sum = 0.0;
        let domain = self.whole().domain();
        domain.visit(fields, &mut |point, volume| sum += volume * f(point));
        sum
    }

    /// The mesh.
    pub fn mesh(&self) -> &TetMesh {
        &self.parts.mesh
    }

    /// The duration and the steps.
    pub fn schedule(&self) -> &Schedule {
        &self.parts.schedule
    }

    /// The materials, by region.
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// Reference positions of the nodes that [`Fields`] refer to, mm.
    pub fn nodes(&self) -> &[[f64; 3]] {
        self.whole().domain().nodes()
    }

    /// Returns the operator of the whole mesh.
    fn whole(&self) -> &dyn Operator {
        let own = &self.discretisation.operator;
        if own.part().is_whole() {
            return own.as_ref();
        }
        let make = || Discretisation::whole(&self.parts).expect("the parts were checked before");
        self.whole.get_or_init(make).as_ref()
    }

    /// Writes the mesh for ParaView (`.vtu`), with quadratic cells for quadratic elements. Fields at nodes:
    /// `displacement_mm` and `damage`. Fields of elements: the region, the elastic energy per reference volume
    /// `energy_density_mpa` (N mm/mm³), the mean Cauchy stress `stress_mpa` and its von Mises equivalent
    /// `von_mises_mpa`.
    ///
    /// # Errors
    /// [`FemError::Mesh`] if the fields belong to another problem or invert an element, or if the file cannot be
    /// written.
    pub fn write_vtu(&self, path: impl AsRef<Path>, fields: &Fields) -> Result<(), FemError> {
        let points = [
            vtu::Field::vector("displacement_mm", &fields.displacement),
            vtu::Field::scalar("damage", &fields.damage),
        ];
        let path = path.as_ref();
        let stresses = self.stresses(path, fields)?;
        let energy: Vec<f64> = stresses.iter().map(|s| s.energy_density_mpa).collect();
        let stress: Vec<[f64; 6]> = stresses.iter().map(|s| s.stress_mpa).collect();
        let von_mises: Vec<f64> = stresses.iter().map(CellStress::von_mises_mpa).collect();
        let cells = [
            vtu::Field::scalar("energy_density_mpa", &energy),
            vtu::Field::tensor("stress_mpa", &stress),
            vtu::Field::scalar("von_mises_mpa", &von_mises),
        ];
        match self.parts.order {
            Order::Linear => vtu::write_straight(path, self.mesh(), &points, &cells)?,
            Order::Quadratic => {
                let tets = self.quadratic_tets();
                vtu::write_quadratic(path, self.mesh(), self.nodes(), &tets, &points, &cells)?;
            }
        }
        Ok(())
    }

    /// Computes stress and energy of each element for a file.
    fn stresses(&self, path: &Path, fields: &Fields) -> Result<Vec<CellStress>, MeshError> {
        let unfit = |message: &str| MeshError::File {
            path: path.into(),
            place: "fields".into(),
            message: message.into(),
        };
        let nodes = self.nodes().len();
        if fields.displacement.len() != nodes || fields.damage.len() != nodes {
            return Err(unfit(&format!("are not those of this problem, which has {nodes} nodes")));
        }
        let context = StepContext::new(&fields.damage, 1.0);
        let increment = Increment { materials: &self.points, fields, context };
        let stresses = self.whole().stresses(&increment);
        stresses.map_err(|_| unfit("turn an element inside out; a state that was solved does not"))
    }

    fn quadratic_tets(&self) -> Vec<[u32; 10]> {
        let nodes_of = |tet| {
            let nodes = self.whole().domain().nodes_of(tet);
            nodes.try_into().expect("a quadratic tetrahedron has ten nodes")
        };
        (0..self.mesh().tets.len()).map(nodes_of).collect()
    }

    /// Linear tetrahedra on [`nodes`](Self::nodes) that fill the body, for visualisation: those of the mesh, or eight
    /// consecutive ones for each quadratic tetrahedron.
    pub fn linear_tets(&self) -> Vec<[u32; 4]> {
        // corners 0–3, then the midpoints of the edges 01, 12, 20, 03, 13, 23; the inner octahedron is cut along the
        // midpoints of 20 and 13
        const PARTS: [[usize; 4]; 8] = [
            [0, 4, 6, 7],
            [4, 1, 5, 8],
            [6, 5, 2, 9],
            [7, 8, 9, 3],
            [4, 5, 6, 8],
            [5, 9, 6, 8],
            [9, 7, 6, 8],
            [7, 4, 6, 8],
        ];
        match self.parts.order {
            Order::Linear => self.mesh().tets.clone(),
            Order::Quadratic => {
                let parts = |tet: &[u32; 10]| PARTS.map(|part| part.map(|k| tet[k]));
                self.quadratic_tets().iter().flat_map(parts).collect()
            }
        }
    }

    /// Number of equations, of all ranks together.
    pub fn unknowns(&self) -> usize {
        self.discretisation.equations
    }

    /// Number of entries of the sparse factor; zero for an iterative linear solver.
    pub fn factor_entries(&self) -> usize {
        self.discretisation.linear.fill()
    }
}
