//! Nodal vectors in the memory of a device, four numbers per node.

use std::cell::RefCell;

use bytemuck::{Pod, Zeroable};

use super::kernels::{Kernels, LAST_PARTS, PARTS};
use crate::device::{Argument, Array, ComputeDevice, DeviceError};
use crate::solve::linear::vector::Vectors;

/// Vector operations on a device. After the first error, which is stored, no further operation runs; sums are then
/// NaN, so that a Krylov method ends.
#[derive(Debug)]
pub(super) struct DeviceVectors {
    device: ComputeDevice,
    kernels: Kernels,
    parts: Array<f64>,
    last: Array<f64>,
    failed: RefCell<Option<DeviceError>>,
}

impl DeviceVectors {
    pub(super) fn new(device: ComputeDevice) -> Result<Self, DeviceError> {
        Ok(Self {
            kernels: Kernels::new(&device)?,
            parts: Array::zeros(&device, PARTS)?,
            last: Array::zeros(&device, LAST_PARTS)?,
            failed: RefCell::new(None),
            device,
        })
    }

    /// Returns and clears the first error, if there was one.
    pub(super) fn take_failure(&self) -> Option<DeviceError> {
        self.failed.take()
    }

    /// Runs `work` unless an operation has failed before.
    pub(super) fn attempt<T>(
        &self,
        work: impl FnOnce(&ComputeDevice) -> Result<T, DeviceError>,
    ) -> Option<T> {
        if self.failed.borrow().is_some() {
            return None;
        }
        work(&self.device).map_err(|error| self.failed.replace(Some(error))).ok()
    }

    pub(super) fn launch(&self, name: &str, items: usize, arguments: &[Argument]) {
        self.attempt(|_| self.kernels.launch(name, items, arguments));
    }

    /// Allocates an array of zeros; returns an unusable placeholder after an error.
    pub(super) fn zeros<T: Pod + Zeroable>(&self, len: usize) -> Array<T> {
        self.attempt(|device| Array::zeros(device, len)).unwrap_or_else(|| Array::lost(len))
    }

    pub(super) fn array<T: Pod + Zeroable>(&self, numbers: &[T]) -> Array<T> {
        let sent = self.attempt(|device| Array::of(device, numbers));
        sent.unwrap_or_else(|| Array::lost(numbers.len()))
    }

    /// Computes the scale of some components of a vector: their largest absolute value, or 1 if all are zero.
    pub(super) fn scale(
        &self,
        r: &Array<f64>,
        first: usize,
        fields: usize,
        scale: &mut Array<f64>,
    ) {
        let parts = self.parts.argument();
        let fields = [Argument::Index(first as u64), Argument::Index(fields as u64)];
        let nodes = Argument::Index(r.len() as u64 / 4);
        self.launch("largest", PARTS, &[nodes, fields[0], fields[1], r.argument(), parts]);
        self.launch("scale_of_parts", 1, &[parts, scale.argument()]);
    }

    /// Returns the sum of the partial sums.
    fn sum(&self) -> f64 {
        self.launch("sum_of_parts", LAST_PARTS, &[self.parts.argument(), self.last.argument()]);
        let mut last = [0.0; LAST_PARTS];
        match self.attempt(|_| self.last.read(&mut last)) {
            Some(()) => last.iter().sum(),
            None => f64::NAN,
        }
    }
}

impl Vectors for DeviceVectors {
    type Vector = Array<f64>;
    type Owned = Array<f64>;
    type Kept = Array<f64>;

    fn zero(&self, like: &Array<f64>) -> Array<f64> {
        self.zeros(like.len())
    }

    fn clear(&self, x: &mut Array<f64>) {
        self.launch("clear", x.len(), &[x.argument()]);
    }

    fn scaled(&self, x: &Array<f64>, a: f64) -> Array<f64> {
        let y = self.zeros(x.len());
        self.launch("scaled", x.len(), &[Argument::Real(a), x.argument(), y.argument()]);
        y
    }

    fn dot(&self, a: &Array<f64>, b: &Array<f64>) -> f64 {
        let n = Argument::Index(a.len() as u64);
        self.launch("dot", PARTS, &[n, a.argument(), b.argument(), self.parts.argument()]);
        self.sum()
    }

    fn weighted_dot(&self, w: &Array<f64>, a: &Array<f64>, b: &Array<f64>) -> f64 {
        let n = Argument::Index(a.len() as u64);
        let arguments = [n, w.argument(), a.argument(), b.argument(), self.parts.argument()];
        self.launch("weighted_dot", PARTS, &arguments);
        self.sum()
    }

    fn add_scaled(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        self.launch("add_scaled", x.len(), &[Argument::Real(a), x.argument(), y.argument()]);
    }

    fn scale_and_add(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        self.launch("scale_and_add", x.len(), &[Argument::Real(a), x.argument(), y.argument()]);
    }

    fn keep(&self, x: &Array<f64>, a: f64, _: bool) -> Array<f64> {
        self.scaled(x, a)
    }

    fn weighted_dot_kept(&self, w: &Array<f64>, a: &Array<f64>, b: &Array<f64>) -> f64 {
        self.weighted_dot(w, a, b)
    }

    fn add_kept(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        self.add_scaled(y, a, x);
    }
}
