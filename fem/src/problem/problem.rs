//! A boundary-value problem in time: its builder and its runs.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::control::Schedule;
use super::curve::Outcome;
use super::definition::{Definition, ProblemWarning, Setup, warnings};
use super::evaluation::{self, Evaluation};
use super::interface::Interface;
use super::parameter::MaterialParameter;
use super::state::Checkpoint;
use super::stepping::{LoadStepper, Observer, follow};
use crate::boundary::Conditions;
use crate::device::ComputeDevice;
use crate::element::{Order, PointValues};
use crate::error::{FemError, Unsupported};
use crate::fields::Fields;
use crate::material::{Homogenisation, Material, PhaseField};
use crate::operator::Operator;
use crate::parallel::Ranks;
use crate::solve::{Scheme, SolverOptions};
use fem_mesh::TetMesh;

/// Builder of a [`Problem`]: its input data before the checks.
///
/// Materials and a schedule are required. Defaults: linear elements on the vertices of the mesh, no damage, no
/// boundary conditions, and the default settings of the solver.
#[derive(Clone, Debug)]
pub struct ProblemBuilder {
    definition: Definition,
    scheduled: bool,
}

impl ProblemBuilder {
    /// Sets the order of the elements.
    pub fn order(mut self, order: Order) -> Self {
        self.definition.order = order;
        self
    }

    /// Sets one material for each of `mesh.regions`, in the same order.
    pub fn materials(mut self, materials: impl Into<Vec<Material>>) -> Self {
        self.definition.materials = materials.into();
        self
    }

    /// Sets the rule that computes the moduli of a tetrahedron that contains matrix and grain from the moduli of both
    /// materials.
    pub fn homogenisation(mut self, rule: Homogenisation) -> Self {
        self.definition.homogenisation = rule;
        self
    }

    /// Sets the phase field of damage. Without a phase field the body is elastic and toughnesses are not used; with a
    /// phase field, regions without toughness are elastic.
    pub fn phase_field(mut self, field: impl Into<Option<PhaseField>>) -> Self {
        self.definition.phase_field = field.into();
        self
    }

    /// Sets interfaces between regions with their own toughness. Without a phase field, they are not used.
    pub fn interfaces(mut self, interfaces: impl Into<Vec<Interface>>) -> Self {
        self.definition.interfaces = interfaces.into().into();
        self
    }

    /// Sets boundary conditions and loads.
    pub fn conditions(mut self, conditions: Conditions) -> Self {
        self.definition.conditions = Arc::new(conditions);
        self
    }

    /// Sets the duration and the load steps.
    pub fn schedule(mut self, schedule: Schedule) -> Self {
        (self.definition.schedule, self.scheduled) = (schedule, true);
        self
    }

    /// Sets the options of the solver.
    pub fn options(mut self, options: SolverOptions) -> Self {
        self.definition.options = options;
        self
    }

    /// Solves linear systems on a device if they are solved by multigrid. A sparse factor, which
    /// [`LinearScheme::Auto`](crate::LinearScheme) selects for small systems, always runs on the processor. The results
    /// on the device and on the processor agree within the solver's tolerance. If a device fails, the processor
    /// continues, and [`LoadStepper::machine`](crate::LoadStepper::machine) reports the failure.
    pub fn device(mut self, device: impl Into<Option<ComputeDevice>>) -> Self {
        self.definition.device = device.into();
        self
    }

    /// Distributes the work over ranks. Each rank must create the same problem and call the same methods.
    ///
    /// Every rank gets the curve and the fields of the whole body. Up to the solver's tolerance, the results do not
    /// depend on the number of ranks. The first rank writes checkpoints; a run can be resumed with any number of ranks.
    /// Systems are solved by multigrid. Sparse factorisation, devices and sensitivities are not supported with several
    /// ranks, and [`build`](Self::build) rejects them.
    pub fn ranks(mut self, ranks: Ranks) -> Self {
        self.definition.ranks = ranks;
        self
    }

    /// Checks the input data and prepares the unknowns and the structure of the sparse factor.
    ///
    /// # Errors
    /// A [`FemError`] with the cause and the remedy.
    pub fn build(mut self) -> Result<Problem, FemError> {
        if !self.scheduled {
            return Err(FemError::unsupported("problem", Unsupported::NoSchedule));
        }
        if self.definition.phase_field.as_ref().is_some_and(|field| !field.is_variational()) {
            // Newton's method on both fields seeks a stationary point of an energy, but this problem has no energy
            self.definition.options.scheme = Scheme::Alternate;
        }
        Setup::new(self.definition).map(Problem::from_setup)
    }
}

/// Body with materials, boundary conditions and loads, simulated over time.
///
/// The displacement u and the damage φ solve, for all test functions v and q (symbols as in
/// [`equations`](crate::equations)),
/// ∫ τ : (∇v F⁻¹) dV = ∫ b·v dV + ∫ t·v dA + contact and
/// ∫ g′(φ) ψ⁺ q + (Gc/(c₀ ℓ₀)) (α′(φ) q + 2 ℓ₀² ∇φ·∇q) + (ξ/Δt)(φ − φ_n) q dV = ∫ s q dV.
/// The stress is τ = g(φ) τ⁺ + τ⁻; b, t and s are the body force, the traction and the damage source in the reference
/// configuration.
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
    pub(crate) setup: Setup,
    /// Operator of the whole mesh, if this rank has only a part of the mesh; created on first use.
    whole: OnceLock<Arc<dyn Operator>>,
}

impl Problem {
    /// Creates a builder for a problem on a mesh.
    pub fn builder(mesh: TetMesh) -> ProblemBuilder {
        let definition = Definition {
            mesh: Arc::new(mesh.with_pure_tetrahedra()),
            order: Order::Linear,
            materials: Vec::new(),
            homogenisation: Homogenisation::default(),
            phase_field: None,
            interfaces: Arc::default(),
            conditions: Arc::default(),
            schedule: Schedule::adaptive(1.0),
            options: SolverOptions::default(),
            device: None,
            ranks: Ranks::default(),
            parameters: Arc::default(),
        };
        ProblemBuilder { definition, scheduled: false }
    }

    fn from_setup(setup: Setup) -> Self {
        Self { setup, whole: OnceLock::new() }
    }

    /// Returns this problem with other materials and without sensitivities. Mesh, unknowns and the structure of the
    /// sparse factor are shared unless a region gains or loses its toughness.
    ///
    /// # Errors
    /// The errors of [`ProblemBuilder::build`].
    pub fn with_materials(&self, materials: Vec<Material>) -> Result<Self, FemError> {
        let parameters = Arc::default();
        let definition = Definition { materials, parameters, ..self.setup.definition.clone() };
        self.setup.with_definition(definition).map(Self::from_setup)
    }

    /// Returns this problem with other interfaces and without sensitivities. Mesh, unknowns and the structure of the
    /// sparse factor are shared unless the regions or the width of an interface change.
    ///
    /// # Errors
    /// The errors of [`ProblemBuilder::build`].
    pub fn with_interfaces(&self, interfaces: Vec<Interface>) -> Result<Self, FemError> {
        let (interfaces, parameters) = (interfaces.into(), Arc::default());
        let definition = Definition { interfaces, parameters, ..self.setup.definition.clone() };
        self.setup.with_definition(definition).map(Self::from_setup)
    }

    /// Returns this problem with sensitivities: its runs also compute the derivatives of the force with respect to
    /// material parameters, along the whole curve. All other data is shared.
    ///
    /// Every accepted increment solves one additional linear system per parameter, with the tangent of the
    /// equilibrium. The dependence of damage and of the state of the laws on earlier increments is included, and a
    /// damage value at an active bound has the rate of its bound. The step sizes count as fixed: the dependence of
    /// adaptive step sizes on the parameters is not included. At a kink of the equations (tr ε = 0 of a split, a node
    /// about to leave its bound) the derivatives are one-sided. If the tangent is singular, there are no derivatives from
    /// this point of the curve on, see [`Sensitivities`](crate::Sensitivities).
    ///
    /// # Errors
    /// [`FemError::Unsupported`] for arc-length steps, platens with friction or drag, several ranks, and parameters whose
    /// materials below and above do not enclose the materials of the problem; [`FemError::OutOfRange`] and others as
    /// [`ProblemBuilder::build`](crate::ProblemBuilder::build) for an invalid width or invalid materials of a parameter.
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
        let definition =
            Definition { parameters: parameters.into(), ..self.setup.definition.clone() };
        self.setup.with_definition(definition).map(Self::from_setup)
    }

    /// Returns this problem with other boundary conditions. The mesh, the function space and the elimination order of
    /// the sparse factor are shared.
    ///
    /// # Errors
    /// The errors of [`ProblemBuilder::build`].
    pub fn with_conditions(&self, conditions: Conditions) -> Result<Self, FemError> {
        let definition =
            Definition { conditions: Arc::new(conditions), ..self.setup.definition.clone() };
        self.setup.with_conditions(definition).map(Self::from_setup)
    }

    /// Returns the properties of this problem that make its results inaccurate without causing an error: elements that
    /// lock, parts of the body that are joined only by an edge or a node, and interface bands narrower than the elements.
    ///
    /// # Example
    /// ```
    /// use fem::{CompressionTest, CylinderLattice, Material, Order, ProblemWarning, Schedule};
    ///
    /// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
    /// let rubber = |order| {
    ///     CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
    ///         .builder(mesh.clone())?
    ///         .order(order)
    ///         .materials([Material::hencky(1.0, 0.4999)])
    ///         .build()
    /// };
    /// let warnings = rubber(Order::Linear)?.warnings();
    /// assert!(matches!(warnings[..], [ProblemWarning::VolumetricLocking { .. }]));
    /// assert!(rubber(Order::Quadratic)?.warnings().is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn warnings(&self) -> Vec<ProblemWarning> {
        warnings(&self.setup)
    }

    /// Starts a run that the caller advances step by step on the calling thread.
    pub fn start(&self) -> LoadStepper<'_> {
        LoadStepper::new(&self.setup)
    }

    /// Starts a run like [`start`](Self::start), and saves its state every `checkpoint.every` load steps. If a saved
    /// state exists, the run resumes from this state, and its result is bitwise equal to the result of an uninterrupted
    /// run.
    ///
    /// The curve depends on `checkpoint.every` within the solver's tolerance, but not on the step at which the run was
    /// interrupted. The file is not deleted when the run ends.
    ///
    /// # Errors
    /// [`FemError::Checkpoint`] for a file that is damaged or belongs to another problem (the functions of the
    /// [`Conditions`](crate::Conditions) are compared by their description only); [`FemError::Io`] for a file that
    /// cannot be read.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<LoadStepper<'_>, FemError> {
        LoadStepper::resume(&self.setup, checkpoint)
    }

    /// Runs the problem to its end, or until the observer returns `Break`.
    pub fn run(&self, observer: &mut dyn Observer) -> Outcome {
        follow(self.start(), observer)
    }

    /// Runs the problem like [`run`](Self::run), and saves its state like [`resume`](Self::resume).
    ///
    /// # Errors
    /// The errors of [`resume`](Self::resume).
    pub fn run_resumable(
        &self,
        checkpoint: &Checkpoint,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, FemError> {
        Ok(follow(self.resume(checkpoint)?, observer))
    }

    /// Returns the stresses, energies and forces of fields, such as [`Outcome::fields`].
    ///
    /// # Errors
    /// [`FemError::OtherFields`] or [`FemError::OtherState`] if the fields belong to another problem.
    pub fn evaluate<'a>(&'a self, fields: &'a Fields) -> Result<Evaluation<'a>, FemError> {
        Evaluation::new(&self.setup, self.whole(), fields)
    }

    /// Returns ∫ f dV of a function of the fields at each quadrature point, by a rule of degree 5.
    ///
    /// # Errors
    /// The errors of [`evaluate`](Self::evaluate).
    pub fn integrate(
        &self,
        fields: &Fields,
        f: impl FnMut(&PointValues) -> f64,
    ) -> Result<f64, FemError> {
        Ok(self.evaluate(fields)?.integral(f))
    }

    /// Writes the mesh for ParaView (`.vtu`), see [`Evaluation::write_vtu`].
    ///
    /// # Errors
    /// The errors of [`evaluate`](Self::evaluate) and of [`Evaluation::write_vtu`].
    pub fn write_vtu(&self, path: impl AsRef<Path>, fields: &Fields) -> Result<(), FemError> {
        self.evaluate(fields)?.write_vtu(path)
    }

    /// The mesh.
    pub fn mesh(&self) -> &TetMesh {
        &self.setup.definition.mesh
    }

    /// Returns the schedule: the duration and the load steps.
    pub fn schedule(&self) -> &Schedule {
        &self.setup.definition.schedule
    }

    /// The materials, by region.
    pub fn materials(&self) -> &[Material] {
        &self.setup.definition.materials
    }

    /// Returns the interfaces between regions.
    pub fn interfaces(&self) -> &[Interface] {
        &self.setup.definition.interfaces
    }

    /// Returns the reference positions (mm) of the nodes to which [`Fields`] refer.
    pub fn nodes(&self) -> &[[f64; 3]] {
        self.whole().domain().nodes()
    }

    /// Returns linear tetrahedra on [`nodes`](Self::nodes) that fill the body, for visualisation: the linear
    /// elements, or eight consecutive tetrahedra for each quadratic element.
    pub fn linear_tets(&self) -> Vec<[u32; 4]> {
        evaluation::linear_tets(self.whole().domain())
    }

    /// Returns the number of equations, including the equations of all ranks.
    pub fn unknowns(&self) -> usize {
        self.setup.discretisation.equations
    }

    /// Returns the number of entries of the sparse factor; zero for an iterative linear solver.
    pub fn factor_entries(&self) -> usize {
        self.setup.discretisation.linear.fill()
    }

    /// Returns the operator of the whole mesh.
    fn whole(&self) -> &dyn Operator {
        let operator = &self.setup.discretisation.operator;
        if operator.part().is_whole() {
            return operator.as_ref();
        }
        let make = || self.setup.discretisation.whole(&self.setup.definition);
        self.whole.get_or_init(make).as_ref()
    }
}
