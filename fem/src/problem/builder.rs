//! A problem, part by part.

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

/// The parts of a [`Problem`] before they are checked.
///
/// Materials and a schedule are needed; without more, elements are linear on the vertices of the mesh,
/// nothing breaks, no condition acts and the solver has its default settings.
#[derive(Clone, Debug)]
pub struct ProblemBuilder {
    parts: Definition,
    scheduled: bool,
}

impl Problem {
    /// Begins a problem on a mesh.
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
    /// The order of the elements.
    pub fn order(mut self, order: Order) -> Self {
        self.parts.order = order;
        self
    }

    /// One material for each of `mesh.regions`, in their order.
    pub fn materials(mut self, materials: impl Into<Vec<Material>>) -> Self {
        self.parts.materials = materials.into();
        self
    }

    /// How the moduli of tetrahedra that are partly grain follow from those of matrix and grain.
    pub fn homogenisation(mut self, rule: Homogenisation) -> Self {
        self.parts.homogenisation = rule;
        self
    }

    /// How damage spreads. Without it the body is elastic and toughnesses are not used; with it,
    /// regions without toughness are elastic.
    pub fn phase_field(mut self, field: impl Into<Option<PhaseField>>) -> Self {
        self.parts.phase_field = field.into();
        self
    }

    /// What acts on the body.
    pub fn conditions(mut self, conditions: Conditions) -> Self {
        self.parts.conditions = Arc::new(conditions);
        self
    }

    /// The time and the steps through it.
    pub fn schedule(mut self, schedule: Schedule) -> Self {
        (self.parts.schedule, self.scheduled) = (schedule, true);
        self
    }

    /// How increments are solved.
    pub fn options(mut self, options: SolverOptions) -> Self {
        self.parts.options = options;
        self
    }

    /// Solves linear systems on a device where they are solved by multigrid; a sparse factor, which
    /// [`LinearScheme::Auto`](crate::LinearScheme) takes where it is small, is the processor's. The result is
    /// the same to the solver's tolerance. Where a device fails, the processor goes on, and
    /// [`LoadStepper::machine`](crate::LoadStepper::machine) says so.
    pub fn device(mut self, device: impl Into<Option<ComputeDevice>>) -> Self {
        self.parts.device = device.into();
        self
    }

    /// Shares the work among ranks, each of which makes this problem and does the same with it. Curve and
    /// fields are those of the whole body on each of them, the same to the solver's tolerance whatever their
    /// number; checkpoints are written by the first, and any number goes on with them. Systems are
    /// solved by multigrid; a sparse factor, devices and sensitivities are refused.
    pub fn ranks(mut self, ranks: Ranks) -> Self {
        self.parts.ranks = ranks;
        self
    }

    /// Checks the parts and prepares the unknowns and the structure of the factor.
    ///
    /// # Errors
    /// A [`FemError`] that names what is wrong and what helps, before any step is taken.
    pub fn build(mut self) -> Result<Problem, FemError> {
        if !self.scheduled {
            return Err(FemError::unsupported(
                "problem",
                "it has no schedule",
                "give the time and the steps by schedule(…)",
            ));
        }
        if self.parts.phase_field.as_ref().is_some_and(|field| !field.is_variational()) {
            // nothing is stationary that Newton's method on both fields could find
            self.parts.options.scheme = Scheme::Alternate;
        }
        Problem::new(self.parts)
    }
}
