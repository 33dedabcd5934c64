//! Krylov methods with multigrid, for systems that are too large for a sparse factor.

use std::sync::Arc;

use super::in_memory::{Nodal, NodalVectors, mask, weights};
use super::krylov::{Ending, Preconditioned, Stop, System, solve};
use super::multigrid::{
    ElementTangent, FieldSplitInMemory, MatrixFree, Multigrid, NodalPreconditioner,
};
use super::on_device::OnDevice;
use super::{LinearEffort, LinearSolver, Singular};
use crate::device::DeviceError;
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, Operator, Tangent};
use crate::parallel::Halo;

/// Largest number of Krylov iterations of a solve.
const LIMIT: u32 = 300;
/// The multigrid hierarchy is recomputed if a solve needs more than this multiple of the iterations that the first
/// solve with the hierarchy needed.
const WORN: f64 = 1.6;
/// Largest relative residual of a solution that is accepted at the limit of iterations.
const USELESS: f64 = 0.1;

/// Error: the device that stored the current tangent has failed. The next tangent is computed on the processor.
struct TangentLost;

type MultigridInMemory = Multigrid<NodalVectors, FieldSplitInMemory>;

/// Krylov solver with a multigrid preconditioner, on the processor or on a device.
pub(crate) struct Iterative<'a> {
    operator: &'a dyn Operator,
    /// Vertices of the mesh.
    positions: Arc<Vec<[f64; 3]>>,
    /// Tangent of the linear shape functions.
    tangent: Tangent,
    /// Matrix-free tangent, if the elements are quadratic or a device runs the iterations.
    elements: Option<ElementTangent>,
    /// Device that runs the iterations; `None` if the processor runs them.
    device: Option<OnDevice>,
    /// Error of a device that has failed and is no longer used.
    lost: Option<DeviceError>,
    /// Multigrid hierarchy in the memory of the processor. A device stores a separate hierarchy, in `device`.
    multigrid: Option<MultigridInMemory>,
    /// Whether the multigrid hierarchy was created for the current tangent.
    fresh: bool,
    /// Number of iterations of the first solve with the multigrid hierarchy.
    first: Option<u32>,
    free: Vec<[bool; 4]>,
    weight: Vec<Nodal>,
    coupling: Coupling,
    /// Whether conjugate gradients can be used: no negative curvature has occurred with the current tangent.
    definite: bool,
}

impl<'a> Iterative<'a> {
    pub(super) fn new(
        operator: &'a dyn Operator,
        positions: Arc<Vec<[f64; 3]>>,
        tangent: Tangent,
        elements: Option<ElementTangent>,
    ) -> Self {
        Self {
            operator,
            positions,
            tangent,
            elements,
            device: None,
            lost: None,
            multigrid: None,
            fresh: false,
            first: None,
            free: Vec::new(),
            weight: Vec::new(),
            coupling: Coupling::Full,
            definite: true,
        }
    }

    /// Returns the solver with its iterations on a device, which also computes products with the tangent of quadratic
    /// elements. If the device cannot be used, the processor runs the iterations.
    pub(super) fn on_device(mut self, device: Result<OnDevice, DeviceError>) -> Self {
        match device {
            Ok(device) => self.device = Some(device),
            Err(error) => self.lost = Some(error),
        }
        self
    }

    /// Runs `work` on the device, if a device is used. After an error, the device and its hierarchy are discarded, and
    /// the processor continues.
    fn attempt<T>(
        &mut self,
        work: impl FnOnce(&mut OnDevice, &mut ElementTangent) -> Result<T, DeviceError>,
    ) -> Option<T> {
        let (device, elements) = (self.device.as_mut()?, self.elements.as_mut()?);
        let result = work(device, elements);
        result.map_err(|error| (self.device, self.lost) = (None, Some(error))).ok()
    }

    /// If the device stored the current tangent and has failed, discards the device and returns an error.
    fn check_tangent(&mut self) -> Result<(), TangentLost> {
        match self.elements.as_mut().and_then(ElementTangent::take_lost) {
            None => Ok(()),
            Some(error) => {
                self.device = None;
                self.lost.get_or_insert(error);
                self.discard_hierarchy();
                Err(TangentLost)
            }
        }
    }

    fn has_hierarchy(&self) -> bool {
        self.device.as_ref().map_or(self.multigrid.is_some(), OnDevice::has_hierarchy)
    }

    fn discard_hierarchy(&mut self) {
        self.multigrid = None;
        if let Some(device) = &mut self.device {
            device.discard_hierarchy();
        }
    }

    fn renew(&mut self) -> Result<(), TangentLost> {
        // discard the old multigrid hierarchy first, so that two hierarchies are never in memory
        self.discard_hierarchy();
        if let Some(elements) = &mut self.elements {
            elements.add_linear(&mut self.tangent);
        }
        self.check_tangent()?;
        let free = match &self.elements {
            Some(elements) => elements.free_vertices(),
            None => &self.free[..],
        };
        let halo = &self.operator.part().vertices;
        let below = FieldSplitInMemory::new(&self.tangent, &self.positions, free, halo);
        let weight = std::mem::take(&mut self.weight);
        let sent = self.attempt(|device, elements| device.renew(elements, &weight, &below));
        if sent.is_none() {
            let quadratic = self.elements.as_mut().and_then(|elements| elements.level(&weight));
            self.multigrid = Some(Multigrid { quadratic, below });
        }
        self.weight = weight;
        (self.fresh, self.first) = (true, None);
        self.check_tangent()
    }

    fn krylov(&mut self, right: &[Nodal], step: &mut [Nodal], tolerance: f64) -> Ending {
        if self.device.is_some() {
            let mut definite = self.definite;
            let limits = (tolerance, LIMIT);
            let ending = self.attempt(|device, elements| {
                device.krylov(elements, &mut definite, right, step, limits)
            });
            self.definite = definite;
            // after a failure of the device, `fresh` is false, so that the processor creates a hierarchy and retries
            self.fresh &= ending.is_some();
            let failed = Ending { stop: Stop::Broken, iterations: 0, residual: 1.0 };
            return ending.unwrap_or(failed);
        }
        let mut definite = self.definite;
        let vectors = NodalVectors::new(&self.operator.part().halo);
        let weight = std::mem::take(&mut self.weight);
        let mut matrix = self.matrix();
        let mut system = System { vectors: &vectors, matrix: matrix.as_mut(), weight: &weight };
        let ending = solve(&mut system, &mut definite, right, step, tolerance, LIMIT);
        drop(matrix);
        (self.weight, self.definite) = (weight, definite);
        ending
    }

    /// Computes z ≈ A⁻¹ r for several right-hand sides r, where A is the tangent.
    fn precondition_all(
        &mut self,
        right: &[&[Nodal]],
        out: &mut [&mut [Nodal]],
    ) -> Result<(), TangentLost> {
        if !self.has_hierarchy() {
            self.renew()?;
        }
        let done = self.attempt(|device, elements| {
            let mut pairs = right.iter().zip(out.iter_mut());
            pairs.try_for_each(|(r, z)| device.precondition(elements, r, z))
        });
        if done.is_none() {
            if !self.has_hierarchy() {
                self.renew()?;
            }
            let mut matrix = self.matrix();
            right.iter().zip(out).for_each(|(r, z)| matrix.precondition(r, z));
        }
        self.check_tangent()
    }

    /// Returns the tangent with its preconditioner on the processor. The multigrid hierarchy must exist.
    fn matrix(&mut self) -> Box<dyn Preconditioned<NodalVectors> + '_> {
        let multigrid = self.multigrid.as_mut().expect("the hierarchy is created before its use");
        let halo = &self.operator.part().halo;
        match &mut self.elements {
            Some(tangent) => Box::new(MatrixFree { tangent, multigrid }),
            None => Box::new(AssembledTangent {
                tangent: &self.tangent,
                halo,
                free: &self.free,
                preconditioner: &mut multigrid.below,
            }),
        }
    }
}

/// Rows and columns of the assembled tangent for the free (not constrained) values, distributed over the ranks, with
/// its preconditioner.
struct AssembledTangent<'a> {
    tangent: &'a Tangent,
    halo: &'a Halo,
    free: &'a [[bool; 4]],
    preconditioner: &'a mut FieldSplitInMemory,
}

impl Preconditioned<NodalVectors> for AssembledTangent<'_> {
    fn apply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        multiply(self.tangent, self.halo, x, y);
        mask(self.free, y);
    }

    fn precondition(&mut self, r: &[Nodal], z: &mut [Nodal]) {
        self.preconditioner.apply(r, z);
        mask(self.free, z);
    }
}

/// Computes y = A x for an assembled tangent A that is distributed over the ranks.
fn multiply(tangent: &Tangent, halo: &Halo, x: &[Nodal], y: &mut [Nodal]) {
    tangent.multiply(x, y);
    halo.complete(y);
}

impl LinearSolver for Iterative<'_> {
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        let (diagonal, symmetric) = match &mut self.elements {
            Some(elements) => {
                let diagonal = elements.linearise(self.operator, increment, coupling, free)?;
                (diagonal, elements.symmetric())
            }
            None => {
                self.operator.tangent(increment, coupling, &mut self.tangent)?;
                let mut diagonal = self.tangent.diagonal();
                self.operator.part().halo.complete(&mut diagonal);
                (diagonal, self.tangent.symmetric)
            }
        };
        let ranks = self.operator.part().ranks();
        if coupling != self.coupling || ranks.any(self.free != free) {
            self.discard_hierarchy();
        }
        self.coupling = coupling;
        self.free = free.to_vec();
        self.weight = weights(&diagonal, free, &self.operator.part().halo);
        self.fresh = false;
        self.definite = !ranks.any(!symmetric);
        let weight = std::mem::take(&mut self.weight);
        self.attempt(|device, elements| {
            device.constrain([free, elements.free_vertices()], &weight, elements.contact());
            Ok(())
        });
        self.weight = weight;
        Ok(())
    }

    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular> {
        let mut masked = right.to_vec();
        mask(&self.free, &mut masked);
        let mut effort = LinearEffort::default();
        loop {
            if !self.has_hierarchy() {
                self.renew().map_err(|TangentLost| Singular(effort))?;
                effort.renewals += 1;
            }
            let ending = self.krylov(&masked, step, tolerance);
            effort.iterations += ending.iterations;
            effort.residual = ending.residual;
            self.check_tangent().map_err(|TangentLost| Singular(effort))?;
            if ending.stop == Stop::Converged {
                let first = *self.first.get_or_insert(ending.iterations);
                if !self.fresh && f64::from(ending.iterations) > WORN * f64::from(first) + 3.0 {
                    self.discard_hierarchy();
                }
                return Ok(effort);
            }
            if self.fresh {
                let accepted = ending.residual <= USELESS;
                return if accepted { Ok(effort) } else { Err(Singular(effort)) };
            }
            self.discard_hierarchy();
        }
    }

    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32 {
        let renewals = u32::from(!self.has_hierarchy());
        if self.precondition_all(right, out).is_err() {
            out.iter_mut().for_each(|out| out.fill([f64::NAN; 4]));
        }
        renewals
    }

    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        match &mut self.elements {
            Some(elements) => elements.multiply_whole(x, y),
            None => multiply(&self.tangent, &self.operator.part().halo, x, y),
        }
    }

    fn weight(&self) -> &[Nodal] {
        &self.weight
    }

    fn is_on_device(&self) -> bool {
        self.device.is_some()
    }

    fn machine(&self) -> String {
        match (&self.device, &self.lost) {
            (Some(device), _) => device.name().to_string(),
            (None, Some(error)) => format!("the processor, because the device failed: {error}"),
            (None, None) => "the processor".into(),
        }
    }
}
