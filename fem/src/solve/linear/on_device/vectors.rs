//! Vectors in the memory of a device.

use std::marker::PhantomData;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytemuck::{Pod, Zeroable};

use super::kernels::{DeviceReal, Kernels, LAST_PARTS, PARTS};
use crate::device::{Argument, Array, ComputeDevice, DeviceError};
use crate::solve::linear::vectors::{KrylovVectors, LanczosVectors, Precision, Vectors};

/// Device with the compiled kernels of this module.
///
/// The first error is stored. After an error no operation runs, and sums are NaN, so that a Krylov method ends.
#[derive(Debug)]
pub(super) struct Session {
    device: ComputeDevice,
    kernels: Kernels,
    sums: Mutex<Sums>,
    failed: Mutex<Option<DeviceError>>,
}

/// Work arrays for sums over vectors. The device computes a sum in two stages of partial sums.
#[derive(Debug)]
struct Sums {
    /// Partial sums that the first stage computes.
    partial: Array<f64>,
    /// Partial sums that the second stage computes and the host adds.
    last: Array<f64>,
}

impl Session {
    pub(super) fn new(device: ComputeDevice) -> Result<Self, DeviceError> {
        let sums = Sums {
            partial: Array::zeros(&device, PARTS)?,
            last: Array::zeros(&device, LAST_PARTS)?,
        };
        Ok(Self {
            kernels: Kernels::new(&device)?,
            sums: Mutex::new(sums),
            failed: Mutex::default(),
            device,
        })
    }

    /// Returns the first error since the last call, and clears the error.
    pub(super) fn check(&self) -> Result<(), DeviceError> {
        lock(&self.failed).take().map_or(Ok(()), Err)
    }

    /// Runs `work` if no earlier operation has failed.
    pub(super) fn attempt<T>(
        &self,
        work: impl FnOnce(&ComputeDevice) -> Result<T, DeviceError>,
    ) -> Option<T> {
        let mut failed = lock(&self.failed);
        if failed.is_some() {
            return None;
        }
        work(&self.device).map_err(|error| *failed = Some(error)).ok()
    }

    pub(super) fn launch(&self, name: &str, items: usize, arguments: &[Argument]) {
        self.attempt(|_| self.kernels.launch(name, items, arguments));
    }

    /// Allocates an array of zeros; returns an unusable placeholder after an error.
    pub(super) fn zeros<T: Pod + Zeroable>(&self, len: usize) -> Array<T> {
        self.attempt(|device| Array::zeros(device, len)).unwrap_or_else(|| Array::lost(len))
    }

    pub(super) fn array<T: Pod + Zeroable>(&self, values: &[T]) -> Array<T> {
        let sent = self.attempt(|device| Array::of(device, values));
        sent.unwrap_or_else(|| Array::lost(values.len()))
    }

    /// Computes the scale of the components `first` to `first + fields − 1` of a nodal vector: the largest absolute
    /// value, or 1 if all values are zero.
    pub(super) fn scale(
        &self,
        r: &Array<f64>,
        [first, fields]: [usize; 2],
        scale: &mut Array<f64>,
    ) {
        let sums = lock(&self.sums);
        let [partial, last] = [&sums.partial, &sums.last].map(Array::argument);
        let used = PARTS.min(r.len() / 4);
        let [nodes, first, fields, count] =
            [r.len() / 4, first, fields, used].map(|n| Argument::Index(n as u64));
        self.launch("largest", used, &[nodes, first, fields, r.argument(), partial]);
        self.launch("largest_of_parts", LAST_PARTS, &[count, partial, last]);
        self.launch("scale_of_last_parts", 1, &[last, scale.argument()]);
    }

    /// Returns the sum over `len` values, computed by the kernel with the name `kernel` from the vectors `x`.
    fn sum(&self, kernel: &str, len: usize, x: &[Argument]) -> f64 {
        let sums = lock(&self.sums);
        let [partial, last] = [&sums.partial, &sums.last].map(Array::argument);
        // for a vector with few values, each partial sum has one value
        let used = PARTS.min(len);
        let [len, count] = [len, used].map(|n| Argument::Index(n as u64));
        self.launch(kernel, used, &[&[len], x, &[partial]].concat());
        self.launch("sum_of_parts", LAST_PARTS, &[count, partial, last]);
        let mut last = [0.0; LAST_PARTS];
        match self.attempt(|_| sums.last.read(&mut last)) {
            Some(()) => last.iter().sum(),
            None => f64::NAN,
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Vectors with entries of type `T` on a device.
#[derive(Clone, Debug)]
pub(super) struct DeviceVectors<T> {
    session: Arc<Session>,
    number: PhantomData<T>,
}

impl<T: DeviceReal> DeviceVectors<T> {
    pub(super) fn new(session: &Arc<Session>) -> Self {
        Self { session: Arc::clone(session), number: PhantomData }
    }

    pub(super) fn session(&self) -> &Arc<Session> {
        &self.session
    }
}

impl<T: DeviceReal> Vectors for DeviceVectors<T> {
    type Vector = Array<T>;
    type Owned = Array<T>;

    fn zero(&self, like: &Array<T>) -> Array<T> {
        self.session.zeros(like.len())
    }

    fn clear(&self, x: &mut Array<T>) {
        self.session.launch(T::CLEAR, x.len(), &[x.argument()]);
    }

    fn copy(&self, x: &Array<T>, y: &mut Array<T>) {
        self.session.launch(T::COPY, x.len(), &[x.argument(), y.argument()]);
    }
}

impl LanczosVectors for DeviceVectors<f64> {
    fn fill(&self, x: &mut Array<f64>, value: impl Fn(usize) -> f64 + Sync) {
        let values: Vec<f64> = (0..x.len()).map(value).collect();
        self.session.attempt(|_| x.write(0, &values));
    }

    fn scale(&self, x: &mut Array<f64>, a: f64) {
        self.session.launch("scale", x.len(), &[Argument::Real(a), x.argument()]);
    }

    fn dot(&self, a: &Array<f64>, b: &Array<f64>) -> f64 {
        self.session.sum("dot", a.len(), &[a.argument(), b.argument()])
    }

    fn recur(&self, y: &mut Array<f64>, w: &Array<f64>, a: f64, d: &Array<f64>, b: f64) {
        let [a, b] = [a, b].map(Argument::Real);
        let arguments = [a, b, w.argument(), d.argument(), y.argument()];
        self.session.launch("recur", y.len(), &arguments);
    }
}

impl KrylovVectors for DeviceVectors<f64> {
    type Stored = Array<f64>;

    fn weighted_dot(&self, w: &Array<f64>, a: &Array<f64>, b: &Array<f64>) -> f64 {
        let vectors = [w, a, b].map(Array::argument);
        self.session.sum("weighted_dot", a.len(), &vectors)
    }

    fn add_scaled(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        let arguments = [Argument::Real(a), x.argument(), y.argument()];
        self.session.launch("add_scaled", x.len(), &arguments);
    }

    fn scale_and_add(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        let arguments = [Argument::Real(a), x.argument(), y.argument()];
        self.session.launch("scale_and_add", x.len(), &arguments);
    }

    fn store(&self, x: &Array<f64>, _: Precision) -> Array<f64> {
        let mut stored = self.zero(x);
        self.copy(x, &mut stored);
        stored
    }

    fn weighted_dot_stored(&self, w: &Array<f64>, a: &Array<f64>, b: &Array<f64>) -> f64 {
        self.weighted_dot(w, a, b)
    }

    fn add_stored(&self, y: &mut Array<f64>, a: f64, x: &Array<f64>) {
        self.add_scaled(y, a, x);
    }
}
