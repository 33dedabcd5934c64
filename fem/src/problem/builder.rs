//! Builder of a problem.

use std::sync::Arc;

use super::definition::Definition;
use super::problem::Problem;
use super::schedule::Schedule;
use crate::boundary::Conditions;
use crate::device::ComputeDevice;
use crate::element::Order;
use crate::error::FemError;
use crate::material::{Homogenisation, Material, PhaseField};
use crate::parallel::Ranks;
use crate::solve::{Scheme, SolverOptions};
use fem_mesh::TetMesh;

/// Parts of a [`Problem`] before they are checked.
///
/// Materials and a schedule are required. Defaults: linear elements on the vertices of the mesh, no damage, no
/// boundary conditions, and the default settings of the solver.
#[derive(Clone, Debug)]
pub struct ProblemBuilder {
    parts: Definition,
    scheduled: bool,
}

impl Problem {
    /// Creates a builder for a problem on a mesh.
    pub fn builder(mesh: TetMesh) -> ProblemBuilder {
        let parts = Definition {
            mesh: Arc::new(mesh),
            order: Order::Linear,
            materials: Vec::new(),
            homogenisation: Homogenisation::default(),
            phase_field: None,
            conditions: Arc::default(),
            schedule: Schedule::adaptive(1.0),
            options: SolverOptions::default(),
            device: None,
            ranks: Ranks::default(),
            parameters: Arc::default(),
        };
        ProblemBuilder { parts, scheduled: false }
    }
}

impl ProblemBuilder {
    /// Sets the order of the elements.
    pub fn order(mut self, order: Order) -> Self {
        self.parts.order = order;
        self
    }

    /// Sets one material for each of `mesh.regions`, in the same order.
    pub fn materials(mut self, materials: impl Into<Vec<Material>>) -> Self {
        self.parts.materials = materials.into();
        self
    }

    /// Sets the rule that computes the moduli of tetrahedra that are partly grain from the moduli of matrix and
    /// grain.
    pub fn homogenisation(mut self, rule: Homogenisation) -> Self {
        self.parts.homogenisation = rule;
        self
    }

    /// Sets the phase field of damage. Without a phase field the body is elastic and toughnesses are not used; with a
    /// phase field, regions without toughness are elastic.
    pub fn phase_field(mut self, field: impl Into<Option<PhaseField>>) -> Self {
        self.parts.phase_field = field.into();
        self
    }

    /// Sets boundary conditions and loads.
    pub fn conditions(mut self, conditions: Conditions) -> Self {
        self.parts.conditions = Arc::new(conditions);
        self
    }

    /// Sets the duration and the steps.
    pub fn schedule(mut self, schedule: Schedule) -> Self {
        (self.parts.schedule, self.scheduled) = (schedule, true);
        self
    }

    /// Sets the options of the solver.
    pub fn options(mut self, options: SolverOptions) -> Self {
        self.parts.options = options;
        self
    }

    /// Solves linear systems on a device if they are solved by multigrid. A sparse factor, which
    /// [`LinearScheme::Auto`](crate::LinearScheme) selects for small systems, always runs on the processor. The
    /// result is the same up to the solver's tolerance. If a device fails, the processor continues, and
    /// [`LoadStepper::machine`](crate::LoadStepper::machine) reports the failure.
    pub fn device(mut self, device: impl Into<Option<ComputeDevice>>) -> Self {
        self.parts.device = device.into();
        self
    }

    /// Distributes the work over ranks. Each rank must create the same problem and call the same methods. Curve and
    /// fields are those of the whole body on every rank, and do not depend on the number of ranks up to the solver's
    /// tolerance. The first rank writes checkpoints; a run can be resumed with any number of ranks. Systems are
    /// solved by multigrid; a sparse factor, devices and sensitivities are rejected.
    pub fn ranks(mut self, ranks: Ranks) -> Self {
        self.parts.ranks = ranks;
        self
    }

    /// Checks the parts and prepares the unknowns and the structure of the factor.
    ///
    /// # Errors
    /// A [`FemError`] with the cause and a fix, before any step is taken.
    pub fn build(mut self) -> Result<Problem, FemError> {
        if !self.scheduled {
            return Err(FemError::unsupported(
                "problem",
                "it has no schedule",
                "give the time and the steps by schedule(…)",
            ));
        }
        if self.parts.phase_field.as_ref().is_some_and(|field| !field.is_variational()) {
            // without a common energy, Newton's method on both fields has no stationary point to find
            self.parts.options.scheme = Scheme::Alternate;
        }
        Problem::new(self.parts)
    }
}
