//! Krylov methods with multigrid, for systems whose factor would be too large.
//!
//! Linear elements use the assembled tangent, preconditioned field by field. Quadratic elements use the matrix-free
//! tangent; the assembled tangent of the linear shape functions is the next coarser level.

use std::sync::Arc;

use super::field_split::FieldSplit;
use super::krylov::{Ending, Stop, System, solve};
use super::on_device::OnDevice;
use super::quadratic::QuadraticLevel;
use super::vector::{InMemory, Nodal, mask, weights};
use super::{LinearEffort, LinearSolver, Singular};
use crate::device::DeviceError;
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, Operator, Tangent};
use crate::parallel::Halo;

const LIMIT: u32 = 300;
/// The hierarchy is recomputed if a solution takes this multiple of the iterations of the first solution.
const WORN: f64 = 1.6;
/// Largest relative residual of a solution that is accepted at the limit of iterations.
const USELESS: f64 = 0.1;

pub(crate) struct Iterative<'a> {
    operator: &'a dyn Operator,
    /// Vertices of the mesh.
    points: Arc<Vec<[f64; 3]>>,
    /// Tangent of the linear shape functions.
    tangent: Tangent,
    quadratic: Option<QuadraticLevel>,
    /// Device that runs the iterations; `None`: the processor.
    device: Option<OnDevice>,
    /// Error because of which the device is no longer used.
    lost: Option<DeviceError>,
    split: Option<FieldSplit>,
    /// Whether the hierarchy belongs to the current tangent.
    fresh: bool,
    /// Number of iterations of the first solution with the hierarchy.
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
        points: Arc<Vec<[f64; 3]>>,
        tangent: Tangent,
        quadratic: Option<QuadraticLevel>,
    ) -> Self {
        Self {
            operator,
            points,
            tangent,
            quadratic,
            device: None,
            lost: None,
            split: None,
            fresh: false,
            first: None,
            free: Vec::new(),
            weight: Vec::new(),
            coupling: Coupling::Full,
            definite: true,
        }
    }

    /// Moves the iterations to a device, which also applies the product of the quadratic level. If the device cannot
    /// be used, the processor runs the iterations.
    pub(super) fn on_device(mut self, device: Result<OnDevice, DeviceError>) -> Self {
        match device {
            Ok(device) => self.device = Some(device),
            Err(error) => self.lost = Some(error),
        }
        self
    }

    /// Runs `work` on the device, if there is one. After an error, the device and its hierarchy are discarded, and
    /// the processor continues.
    fn attempt<T>(
        &mut self,
        work: impl FnOnce(&mut OnDevice, &mut QuadraticLevel) -> Result<T, DeviceError>,
    ) -> Option<T> {
        let (device, level) = (self.device.as_mut()?, self.quadratic.as_mut()?);
        match work(device, level) {
            Ok(value) => Some(value),
            Err(error) => {
                (self.device, self.split) = (None, None);
                self.lost = Some(error);
                None
            }
        }
    }

    fn renew(&mut self) {
        // drop the old hierarchy first, so that two hierarchies are never in memory
        self.split = None;
        if let Some(quadratic) = &mut self.quadratic {
            quadratic.add_linear(&mut self.tangent);
        }
        let vertices = self.points.len();
        let vertex_halo = &self.operator.part().vertices;
        let free = &self.free[..vertices];
        let split = FieldSplit::new(&self.tangent, &self.points, free, vertex_halo);
        let weight = std::mem::take(&mut self.weight);
        let sent = self.attempt(|device, level| device.renew(level, &weight, &split));
        self.weight = weight;
        if let (None, Some(quadratic)) = (sent, &mut self.quadratic) {
            quadratic.renew(&self.weight);
        }
        self.split = Some(split);
        self.fresh = true;
        self.first = None;
    }

    fn krylov(&mut self, right: &[Nodal], step: &mut [Nodal], tolerance: f64) -> Ending {
        if self.device.is_some() {
            let mut definite = self.definite;
            let limits = (tolerance, LIMIT);
            let ending = self
                .attempt(|device, level| device.krylov(level, &mut definite, right, step, limits));
            self.definite = definite;
            // after a failure of the device, the processor computes its own hierarchy
            self.fresh &= ending.is_some();
            let failed = Ending { stop: Stop::Broken, iterations: 0, residual: 1.0 };
            return ending.unwrap_or(failed);
        }
        let Self { operator, tangent, quadratic, split, free, weight, definite, .. } = self;
        let part = operator.part();
        let split = split.as_ref().expect("the hierarchy is made before it is used");
        let quadratic = std::cell::RefCell::new(quadratic.as_mut());
        let mut apply = |x: &[Nodal], y: &mut [Nodal]| match quadratic.borrow_mut().as_mut() {
            Some(quadratic) => quadratic.multiply(x, y),
            None => {
                multiply(tangent, &part.halo, x, y);
                mask(free, y);
            }
        };
        let mut precondition = |r: &[Nodal], z: &mut [Nodal]| {
            cycle(quadratic.borrow_mut().as_deref_mut(), split, free, r, z);
        };
        let mut system = System {
            vectors: &InMemory { halo: Arc::clone(&part.halo) },
            apply: &mut apply,
            precondition: &mut precondition,
            weight,
        };
        solve(&mut system, definite, right, step, tolerance, LIMIT)
    }
}

/// y = A x for an assembled tangent that is distributed over the ranks.
fn multiply(tangent: &Tangent, halo: &Halo, x: &[Nodal], y: &mut [Nodal]) {
    tangent.multiply(x, y);
    halo.complete(y);
}

/// z ≈ A⁻¹ r by one cycle through all levels.
fn cycle(
    quadratic: Option<&mut QuadraticLevel>,
    split: &FieldSplit,
    free: &[[bool; 4]],
    r: &[Nodal],
    z: &mut [Nodal],
) {
    match quadratic {
        Some(quadratic) => quadratic.precondition(r, z, |r, z| split.apply(r, z)),
        None => split.apply(r, z),
    }
    mask(free, z);
}

impl LinearSolver for Iterative<'_> {
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        let (diagonal, symmetric) = match &mut self.quadratic {
            Some(quadratic) => {
                quadratic.linearise(self.operator, increment, coupling, free)?;
                (quadratic.diagonal(), quadratic.symmetric())
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
            self.split = None;
        }
        self.coupling = coupling;
        self.free = free.to_vec();
        self.weight = weights(&diagonal, free, &self.operator.part().halo);
        self.fresh = false;
        self.definite = !ranks.any(!symmetric);
        let weight = std::mem::take(&mut self.weight);
        self.attempt(|device, level| {
            device.constrain(free, &weight, level.contact());
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
            if self.split.is_none() {
                self.renew();
                effort.renewals += 1;
            }
            let ending = self.krylov(&masked, step, tolerance);
            effort.iterations += ending.iterations;
            effort.residual = ending.residual;
            if ending.stop == Stop::Converged {
                let first = *self.first.get_or_insert(ending.iterations);
                if !self.fresh && f64::from(ending.iterations) > WORN * f64::from(first) + 3.0 {
                    self.split = None;
                }
                return Ok(effort);
            }
            if self.fresh {
                let accepted = ending.residual <= USELESS;
                return if accepted { Ok(effort) } else { Err(Singular(effort)) };
            }
            self.split = None;
        }
    }

    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32 {
        let renewals = u32::from(self.split.is_none());
        if self.split.is_none() {
            self.renew();
        }
        if self.device.is_some() {
            let done = self.attempt(|device, level| {
                let mut pairs = right.iter().zip(out.iter_mut());
                pairs.try_for_each(|(r, z)| device.precondition(level, r, z))
            });
            match done {
                Some(()) => return renewals,
                None => self.renew(),
            }
        }
        let Self { quadratic, split, free, .. } = self;
        let split = split.as_ref().expect("the hierarchy is made before it is used");
        for (r, z) in right.iter().zip(out) {
            cycle(quadratic.as_mut(), split, free, r, z);
        }
        renewals
    }

    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        match &mut self.quadratic {
            Some(quadratic) => quadratic.multiply_whole(x, y),
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
            (None, Some(error)) => format!("the processor, since the device failed: {error}"),
            (None, None) => "the processor".into(),
        }
    }
}
