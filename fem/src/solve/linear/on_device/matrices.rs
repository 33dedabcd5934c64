//! Matrices of the multigrid hierarchy on a device, copied from the hierarchy that the processor creates.

use std::sync::Arc;

use super::vectors::{DeviceVectors, Session};
use crate::device::{Argument, Array};
use crate::solve::linear::multigrid::{
    Aggregation, Amg, AmgInMemory, AmgLevel, Assembled, Block, BlockCsr, FieldSplit,
    FieldSplitInMemory, Fields, Grid, Level, Matrix, Preconditioner, Relaxation, Smoother,
    Smoothing,
};

/// Block-sparse matrix on a device, in the format of [`BlockCsr`].
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
        session: &Session,
        matrix: &BlockCsr<f32, R, C>,
    ) -> Self {
        Self {
            shape: [R, C],
            rows: matrix.rows(),
            start: session.array(&matrix.start),
            column: session.array(&matrix.column),
            block: session.array(matrix.block.as_flattened().as_flattened()),
        }
    }

    /// Computes y = A x, y += A x or y −= A x; `kernel` is "set", "add" or "subtract".
    fn apply(&self, session: &Session, kernel: &str, x: &Array<f32>, y: &mut Array<f32>) {
        let [r, c] = self.shape;
        let [start, column] = [&self.start, &self.column].map(Array::argument);
        let arguments = [start, column, self.block.argument(), x.argument(), y.argument()];
        session.launch(&format!("{kernel}_{r}_{c}"), r * self.rows, &arguments);
    }
}

/// Matrix of a level, with the inverses of its diagonal blocks.
#[derive(Debug)]
pub(super) struct DeviceMatrix {
    vectors: DeviceVectors<f32>,
    matrix: Blocks,
    inverse: Array<f32>,
}

impl DeviceMatrix {
    fn new<const R: usize>(vectors: &DeviceVectors<f32>, matrix: &Assembled<R>) -> Self {
        let session = vectors.session();
        Self {
            matrix: Blocks::new(session, &matrix.matrix),
            inverse: session.array(matrix.inverse.as_flattened().as_flattened()),
            vectors: vectors.clone(),
        }
    }

    /// Returns a vector of zeros.
    fn zeros(&self) -> Array<f32> {
        self.vectors.session().zeros(self.matrix.shape[0] * self.matrix.rows)
    }
}

impl Matrix for DeviceMatrix {
    type Space = DeviceVectors<f32>;

    fn subtract(&mut self, x: &Array<f32>, y: &mut Array<f32>) {
        self.matrix.apply(self.vectors.session(), "subtract", x, y);
    }

    fn relax(
        &self,
        Relaxation { momentum, weight }: Relaxation,
        r: &Array<f32>,
        step: &mut Array<f32>,
        x: &mut Array<f32>,
    ) {
        let kernel = format!("smooth_{}", self.matrix.shape[0]);
        let [momentum, weight] = [momentum, weight].map(Argument::Real);
        let [inverse, r, step] = [&self.inverse, r, step].map(Array::argument);
        let arguments = [momentum, weight, inverse, r, step, x.argument()];
        self.vectors.session().launch(&kernel, x.len(), &arguments);
    }
}

/// Matrix of a level, with the transfer to the next coarser level.
#[derive(Debug)]
pub(super) struct DeviceGrid {
    matrix: DeviceMatrix,
    prolong: Blocks,
    restrict: Blocks,
}

impl Grid for DeviceGrid {
    type Matrix = DeviceMatrix;
    type Coarse = DeviceVectors<f32>;

    fn matrix(&mut self) -> &mut DeviceMatrix {
        &mut self.matrix
    }

    fn restrict(&mut self, r: &Array<f32>, b: &mut Array<f32>) {
        self.restrict.apply(self.matrix.vectors.session(), "set", r, b);
    }

    fn add_prolonged(&mut self, c: &Array<f32>, x: &mut Array<f32>) {
        self.prolong.apply(self.matrix.vectors.session(), "add", c, x);
    }
}

/// Dense inverse of the coarsest matrix.
#[derive(Debug)]
pub(super) struct DenseInverse {
    session: Arc<Session>,
    inverse: Array<f64>,
}

impl Preconditioner for DenseInverse {
    type Space = DeviceVectors<f32>;

    fn apply(&mut self, b: &mut Array<f32>, x: &mut Array<f32>) {
        let n = Argument::Index(b.len() as u64);
        let arguments = [n, self.inverse.argument(), b.argument(), x.argument()];
        self.session.launch("dense", x.len(), &arguments);
    }
}

/// Selection of `count` consecutive components of nodal vectors, beginning with component `first`.
#[derive(Debug)]
pub(super) struct DeviceFields {
    session: Arc<Session>,
    first: usize,
    count: usize,
    scale: Array<f64>,
}

impl Fields for DeviceFields {
    type Nodal = DeviceVectors<f64>;
    type Space = DeviceVectors<f32>;

    fn narrow(&mut self, r: &Array<f64>, out: &mut Array<f32>) {
        self.session.scale(r, [self.first, self.count], &mut self.scale);
        let [first, count] = [self.first, self.count].map(|k| Argument::Index(k as u64));
        let arguments = [first, count, r.argument(), self.scale.argument(), out.argument()];
        self.session.launch("narrow", out.len(), &arguments);
    }

    fn widen(&self, x: &Array<f32>, z: &mut Array<f64>) {
        let [first, count] = [self.first, self.count].map(|k| Argument::Index(k as u64));
        let arguments = [first, count, x.argument(), self.scale.argument(), z.argument()];
        self.session.launch("widen", z.len() / 4 * (4 - self.first), &arguments);
    }
}

/// Preconditioner on the vertices of the mesh, in the memory of a device.
pub(super) type FieldSplitOnDevice = FieldSplit<
    Block<DeviceFields, Amg<DeviceGrid, DeviceGrid, DenseInverse>>,
    Block<DeviceFields, Smoothing<DeviceMatrix>>,
>;

/// Copies a preconditioner to the device.
pub(super) fn copy_of(session: &Arc<Session>, split: &FieldSplitInMemory) -> FieldSplitOnDevice {
    let displacement = amg(session, &split.displacement.inverse);
    let work = [(); 2].map(|()| displacement.fine.grid.matrix.zeros());
    FieldSplit {
        displacement: Block::new(fields(session, [0, 3]), displacement, work),
        damage: split.damage.as_ref().map(|damage| {
            let Smoothing { matrix, smoother, .. } = &damage.inverse;
            let vectors = DeviceVectors::new(session);
            let matrix = DeviceMatrix::new(&vectors, matrix);
            let work = [(); 2].map(|()| matrix.zeros());
            let smoother = Smoother::new(smoother.degree, smoother.largest, matrix.zeros());
            Block::new(fields(session, [3, 1]), Smoothing { vectors, matrix, smoother }, work)
        }),
    }
}

fn fields(session: &Arc<Session>, [first, count]: [usize; 2]) -> DeviceFields {
    DeviceFields { first, count, scale: session.zeros(1), session: Arc::clone(session) }
}

fn amg(session: &Arc<Session>, amg: &AmgInMemory) -> Amg<DeviceGrid, DeviceGrid, DenseInverse> {
    let inverse = session.array(amg.last.factor.inverse().as_slice());
    Amg {
        fine: level(session, &amg.fine),
        coarse: amg.coarse.iter().map(|coarse| level(session, coarse)).collect(),
        last: DenseInverse { inverse, session: Arc::clone(session) },
    }
}

fn level<const R: usize>(
    session: &Arc<Session>,
    AmgLevel { grid, level }: &AmgLevel<Aggregation<R>>,
) -> AmgLevel<DeviceGrid> {
    let vectors = DeviceVectors::new(session);
    let [prolong, restrict] =
        [Blocks::new(session, &grid.prolong), Blocks::new(session, &grid.restrict)];
    let right = session.zeros(restrict.shape[0] * restrict.rows);
    let matrix = DeviceMatrix::new(&vectors, &grid.matrix);
    let Smoother { degree, largest, .. } = level.smoother;
    let smoother = Smoother::new(degree, largest, matrix.zeros());
    let level = Level::new(vectors.clone(), &vectors, smoother, matrix.zeros(), right);
    AmgLevel { grid: DeviceGrid { matrix, prolong, restrict }, level }
}
