//! Device copy of the multigrid hierarchy of the linear shape functions, which the processor creates.

use super::vectors::DeviceVectors;
use crate::device::{Argument, Array};
use crate::solve::linear::amg::{Amg, DEGREE, Level};
use crate::solve::linear::block_csr::BlockCsr;
use crate::solve::linear::chebyshev::{Chebyshev, coefficients};
use crate::solve::linear::field_split::{self, FieldSplit};

/// Block-sparse matrix on a device.
#[derive(Debug)]
struct Blocks {
    shape: [usize; 2],
    rows: usize,
    start: Array<u32>,
    column: Array<u32>,
    block: Array<f32>,
}

impl Blocks {
    fn new<const R: usize, const C: usize>(
        vectors: &DeviceVectors,
        matrix: &BlockCsr<f32, R, C>,
    ) -> Self {
        Self {
            shape: [R, C],
            rows: matrix.rows(),
            start: vectors.array(&matrix.start),
            column: vectors.array(&matrix.column),
            block: vectors.array(matrix.block.as_flattened().as_flattened()),
        }
    }

    /// y = A x, y += A x or y −= A x.
    fn apply(&self, vectors: &DeviceVectors, how: &str, x: &Array<f32>, y: &mut Array<f32>) {
        let [r, c] = self.shape;
        let [start, column] = [&self.start, &self.column].map(Array::argument);
        let arguments = [start, column, self.block.argument(), x.argument(), y.argument()];
        vectors.launch(&format!("{how}_{r}_{c}"), r * self.rows, &arguments);
    }
}

/// Matrix with the data of its smoother.
#[derive(Debug)]
struct Smoother {
    matrix: Blocks,
    inverse: Array<f32>,
    largest: f64,
    step: Array<f32>,
}

impl Smoother {
    fn new<const R: usize>(vectors: &DeviceVectors, of: &Chebyshev<R>) -> Self {
        Self {
            matrix: Blocks::new(vectors, &of.matrix),
            inverse: vectors.array(of.inverse.as_flattened().as_flattened()),
            largest: of.largest,
            step: vectors.zeros(R * of.matrix.rows()),
        }
    }

    fn smooth(
        &mut self,
        vectors: &DeviceVectors,
        degree: usize,
        residual: &mut Array<f32>,
        x: &mut Array<f32>,
    ) {
        let name = format!("smooth_{}", self.matrix.shape[0]);
        for (k, (momentum, share)) in coefficients(self.largest, degree).enumerate() {
            if k > 0 {
                self.matrix.apply(vectors, "subtract", &self.step, residual);
            }
            let numbers = [Argument::Real(momentum), Argument::Real(share)];
            let [inverse, r] = [&self.inverse, &*residual].map(Array::argument);
            let arguments =
                [numbers[0], numbers[1], inverse, r, self.step.argument(), x.argument()];
            vectors.launch(&name, x.len(), &arguments);
        }
    }
}

/// One level, with the transfer to the next coarser level.
#[derive(Debug)]
struct DeviceLevel {
    smoother: Smoother,
    prolong: Blocks,
    restrict: Blocks,
    residual: Array<f32>,
    /// Right-hand side and solution of the next coarser level.
    right: Array<f32>,
    correction: Array<f32>,
}

impl DeviceLevel {
    fn new<const R: usize>(vectors: &DeviceVectors, level: &Level<R>) -> Self {
        let restrict = Blocks::new(vectors, &level.restrict);
        let coarse = restrict.shape[0] * restrict.rows;
        Self {
            residual: vectors.zeros(R * level.smoother.matrix.rows()),
            smoother: Smoother::new(vectors, &level.smoother),
            prolong: Blocks::new(vectors, &level.prolong),
            right: vectors.zeros(coarse),
            correction: vectors.zeros(coarse),
            restrict,
        }
    }
}

/// Hierarchy of the displacement, from the finest level to the coarsest.
#[derive(Debug)]
struct DeviceAmg {
    levels: Vec<DeviceLevel>,
    inverse: Array<f64>,
}

impl DeviceAmg {
    fn new(vectors: &DeviceVectors, amg: &Amg) -> Self {
        let fine = DeviceLevel::new(vectors, &amg.fine);
        let coarse = amg.coarse.iter().map(|level| DeviceLevel::new(vectors, level));
        let inverse = vectors.array(amg.last.inverse().as_slice());
        Self { levels: std::iter::once(fine).chain(coarse).collect(), inverse }
    }

    /// x ≈ A⁻¹ b by one V-cycle, as on the processor.
    fn cycle(&mut self, vectors: &DeviceVectors, b: &Array<f32>, x: &mut Array<f32>) {
        cycle(&mut self.levels, &self.inverse, vectors, b, x);
    }
}

fn cycle(
    levels: &mut [DeviceLevel],
    inverse: &Array<f64>,
    vectors: &DeviceVectors,
    b: &Array<f32>,
    x: &mut Array<f32>,
) {
    let Some((level, below)) = levels.split_first_mut() else {
        let n = Argument::Index(b.len() as u64);
        return vectors.launch(
            "dense",
            b.len(),
            &[n, inverse.argument(), b.argument(), x.argument()],
        );
    };
    let DeviceLevel { smoother, prolong, restrict, residual, right, correction } = level;
    let copy = |to: &Array<f32>| {
        vectors.launch("copy_single", b.len(), &[b.argument(), to.argument()]);
    };
    vectors.launch("clear_single", x.len(), &[x.argument()]);
    copy(residual);
    smoother.smooth(vectors, DEGREE, residual, x);
    copy(residual);
    smoother.matrix.apply(vectors, "subtract", x, residual);
    restrict.apply(vectors, "set", residual, right);
    cycle(below, inverse, vectors, right, correction);
    prolong.apply(vectors, "add", correction, x);
    copy(residual);
    smoother.matrix.apply(vectors, "subtract", x, residual);
    smoother.smooth(vectors, DEGREE, residual, x);
}

/// A [`FieldSplit`] on a device.
#[derive(Debug)]
pub(super) struct DeviceSplit {
    displacement: DeviceAmg,
    damage: Option<Smoother>,
    scale: Array<f64>,
    right: [Array<f32>; 2],
    x: [Array<f32>; 2],
}

impl DeviceSplit {
    pub(super) fn new(vectors: &DeviceVectors, split: &FieldSplit) -> Self {
        let vertices = split.displacement.fine.smoother.matrix.rows();
        let damaged = if split.damage.is_some() { vertices } else { 0 };
        Self {
            displacement: DeviceAmg::new(vectors, &split.displacement),
            damage: split.damage.as_ref().map(|damage| Smoother::new(vectors, damage)),
            scale: vectors.zeros(1),
            right: [3 * vertices, damaged].map(|n| vectors.zeros(n)),
            x: [3 * vertices, damaged].map(|n| vectors.zeros(n)),
        }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn apply(&mut self, vectors: &DeviceVectors, r: &Array<f64>, z: &mut Array<f64>) {
        let Self { displacement, damage, scale, right: [b, s], x: [u, phi] } = self;
        vectors.launch("clear", z.len(), &[z.argument()]);
        narrow(vectors, r, [0, 3], scale, b);
        displacement.cycle(vectors, b, u);
        widen(vectors, u, [0, 3], scale, z);
        if let Some(damage) = damage {
            narrow(vectors, r, [3, 1], scale, s);
            vectors.launch("clear_single", phi.len(), &[phi.argument()]);
            damage.smooth(vectors, field_split::DEGREE, s, phi);
            widen(vectors, phi, [3, 1], scale, z);
        }
    }
}

/// Computes the components from `first` to `first + fields − 1` in single precision, divided by their largest
/// absolute value, and this value.
fn narrow(
    vectors: &DeviceVectors,
    r: &Array<f64>,
    [first, fields]: [usize; 2],
    scale: &mut Array<f64>,
    out: &mut Array<f32>,
) {
    vectors.scale(r, first, fields, scale);
    let part = [first, fields].map(|k| Argument::Index(k as u64));
    let arguments = [part[0], part[1], r.argument(), scale.argument(), out.argument()];
    vectors.launch("narrow", out.len(), &arguments);
}

fn widen(
    vectors: &DeviceVectors,
    x: &Array<f32>,
    [first, fields]: [usize; 2],
    scale: &Array<f64>,
    z: &mut Array<f64>,
) {
    let part = [first, fields].map(|k| Argument::Index(k as u64));
    let arguments = [part[0], part[1], x.argument(), scale.argument(), z.argument()];
    vectors.launch("widen", x.len(), &arguments);
}
