//! The tangent applied on a device: the processor linearises, and the numbers are sent when they are needed.

use std::sync::Arc;

use super::lanes::Stored;
use super::matrix_free::{MatrixFree, SINGLE_FROM};
use super::product_source::product_kernel;
use crate::device::{Argument, Array, ComputeDevice, DeviceError, Kernel, Program};
use crate::material::Inverted;
use crate::operator::equations::{AppliedOnDevice, Coupling, Operator, Product};
use crate::operator::layout::{Layout, VACANT};
use crate::operator::pattern::Tangent;
use crate::operator::point_data::PointData;
use crate::operator::residual::Increment;

/// A product as [`product`](super::product) makes it, on a device.
pub(crate) fn device_product(
    layout: Arc<Layout>,
    tets: usize,
    device: &ComputeDevice,
) -> Result<Box<dyn Product>, DeviceError> {
    Ok(if tets < SINGLE_FROM {
        Box::new(DeviceProduct::<f64>::new(layout, device)?)
    } else {
        Box::new(DeviceProduct::<f32>::new(layout, device)?)
    })
}

/// A [`MatrixFree`] with a copy of its numbers on a device.
#[derive(Debug)]
pub(super) struct DeviceProduct<T: Stored> {
    host: MatrixFree<T>,
    /// Whether the device has the numbers of the current tangent.
    sent: bool,
    program: Arc<dyn Program>,
    kinds: Vec<Kind<T>>,
    /// Places of elements in all, those of the last batches that no element takes too.
    slots: usize,
    /// Node a of slot s, at a · slots + s.
    nodes: Array<u32>,
    /// The copies of each node, as (start, place).
    start: Array<u32>,
    place: Array<u32>,
    copies: Array<f64>,
}

/// Plain elements or the others: their chunks follow each other.
#[derive(Debug)]
struct Kind<T> {
    chunks: std::ops::Range<usize>,
    first: usize,
    slots: usize,
    data: Array<T>,
}

/// y_n = the sum of the copies of node n, in the order of the elements.
fn node_sum() -> Kernel {
    let parameters = [
        ("const unsigned *", "start"),
        ("const unsigned *", "place"),
        ("const double *", "copies"),
        ("double *", "y"),
    ];
    let body = "    index node = at / 4, c = at % 4;\n    double sum = 0.0;\n    \
                for (index k = start[node]; k < start[node + 1]; k++) \
                sum += copies[4 * (index)place[k] + c];\n    y[at] = sum;\n";
    Kernel::new("node_sum", &parameters, body)
}

impl<T: Stored> DeviceProduct<T> {
    pub(super) fn new(layout: Arc<Layout>, device: &ComputeDevice) -> Result<Self, DeviceError> {
        let (batches, per_element) = (&layout.batches, layout.rule.nodes);
        let mut kernels = Vec::new();
        let (mut kinds, mut slots) = (Vec::new(), 0);
        for part in batches.chunks.chunk_by(|a, b| a.plain == b.plain) {
            let plain = part[0].plain;
            let width = PointData::of(&layout.rule, plain).width();
            let begin = kinds.last().map_or(0, |kind: &Kind<T>| kind.chunks.end);
            let count: usize = part.iter().map(|chunk| chunk.tets.len()).sum();
            let data = Array::zeros(device, count * width)?;
            kernels.push(product_kernel::<T>(&layout, plain));
            kinds.push(Kind {
                chunks: begin..begin + part.len(),
                first: slots,
                slots: count,
                data,
            });
            slots += count;
        }
        if u32::try_from(per_element * slots).is_err() {
            return Err(DeviceError(format!("{slots} elements are too many for one device")));
        }
        kernels.push(node_sum());
        let mut nodes = vec![0u32; per_element * slots];
        let mut of_node = vec![Vec::new(); batches.node_count()];
        let mut first = 0;
        // the numbers of an element stand where its place in the pack is
        let places = super::lanes::places::<T>();
        for chunk in &batches.chunks {
            let lanes = places.len();
            for (batch, local) in chunk.local.chunks_exact(per_element).enumerate() {
                for (lane, &place) in places.iter().enumerate() {
                    let slot = first + batch * lanes + place;
                    let vacant = chunk.tets[batch * lanes + lane] == VACANT;
                    for a in 0..per_element {
                        let node = chunk.global[usize::from(local[a][lane])];
                        nodes[a * slots + slot] = node;
                        if !vacant {
                            of_node[node as usize].push((a * slots + slot) as u32);
                        }
                    }
                }
            }
            first += chunk.tets.len();
        }
        let ends = of_node.iter().scan(0, |end, copies| {
            *end += copies.len() as u32;
            Some(*end)
        });
        let start: Vec<u32> = std::iter::once(0).chain(ends).collect();
        let place: Vec<u32> = of_node.concat();
        Ok(Self {
            sent: false,
            program: device.compile(&kernels)?,
            slots,
            nodes: Array::of(device, &nodes)?,
            start: Array::of(device, &start)?,
            place: Array::of(device, &place)?,
            copies: Array::zeros(device, 4 * per_element * slots)?,
            host: MatrixFree::new(layout),
            kinds,
        })
    }
}

impl<T: Stored> AppliedOnDevice for DeviceProduct<T> {
    fn apply(&mut self, x: &Array<f64>, y: &mut Array<f64>) -> Result<(), DeviceError> {
        if !self.sent {
            for kind in &mut self.kinds {
                let mut at = 0;
                for packs in &self.host.data()[kind.chunks.clone()] {
                    let numbers: Vec<T> = packs.iter().flat_map(AsRef::as_ref).copied().collect();
                    kind.data.write(at, &numbers)?;
                    at += numbers.len();
                }
            }
            self.sent = true;
        }
        for (kernel, kind) in self.kinds.iter().enumerate() {
            let arguments = [
                Argument::Index(self.slots as u64),
                Argument::Index(kind.first as u64),
                self.nodes.argument(),
                kind.data.argument(),
                x.argument(),
                self.copies.argument(),
            ];
            self.program.launch(kernel, kind.slots, &arguments)?;
        }
        let arguments =
            [self.start.argument(), self.place.argument(), self.copies.argument(), y.argument()];
        self.program.launch(self.kinds.len(), y.len(), &arguments)
    }
}

impl<T: Stored> Product for DeviceProduct<T> {
    fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted> {
        self.sent = false;
        self.host.linearise(operator, increment, coupling)
    }

    fn apply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]) {
        self.host.apply(x, y);
    }

    fn diagonal(&mut self) -> Vec<[f64; 4]> {
        self.host.diagonal()
    }

    fn add_linear(&self, out: &mut Tangent) {
        self.host.add_linear(out);
    }

    fn on_device(&mut self) -> Option<&mut dyn AppliedOnDevice> {
        Some(self)
    }

    #[cfg(feature = "bench-internals")]
    fn bytes(&self) -> usize {
        self.host.bytes()
    }
}
