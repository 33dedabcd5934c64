//! The order of the elements on a device, and the sum of their contributions by node.

use std::ops::Range;

use fem_mesh::Groups;

use crate::device::{Argument, Array, ComputeDevice, DeviceError, Kernel};
use crate::operator::cpu::{Stored, lane_of_row};
use crate::operator::layout::{Layout, VACANT};

/// Slots of the elements on a device, in the order of the processor's batches. Vacant lanes have slots too.
#[derive(Debug)]
pub(crate) struct Slots {
    /// Plain elements, then other elements; the chunks of a kind are consecutive.
    pub kinds: Vec<Kind>,
    /// Total number of slots.
    pub count: usize,
    /// Nodes of the elements: node a of slot s is at index a · count + s.
    pub nodes: Array<u32>,
    /// Copies of each node in CSR format: offsets by node, and indices a · count + s of the copies.
    start: Array<u32>,
    place: Array<u32>,
}

/// Consecutive slots whose elements share a compiled kernel.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    pub plain: bool,
    pub chunks: Range<usize>,
    pub first: usize,
    pub count: usize,
}

impl Slots {
    /// Assigns slots to the elements; `T` is the precision of the stored point data.
    pub(crate) fn new<T: Stored>(
        layout: &Layout,
        device: &ComputeDevice,
    ) -> Result<Self, DeviceError> {
        let (batches, per_element) = (&layout.batches, layout.rule.nodes);
        let (mut kinds, mut count) = (Vec::<Kind>::new(), 0);
        for part in batches.chunks.chunk_by(|a, b| a.plain == b.plain) {
            let begin = kinds.last().map_or(0, |kind| kind.chunks.end);
            let own = part.iter().map(|chunk| chunk.tets.len()).sum();
            let (plain, chunks) = (part[0].plain, begin..begin + part.len());
            kinds.push(Kind { plain, chunks, first: count, count: own });
            count += own;
        }
        if u32::try_from(per_element * count).is_err() {
            return Err(DeviceError(format!("{count} elements are too many for one device")));
        }
        let mut nodes = vec![0u32; per_element * count];
        let mut copies = Vec::new();
        let mut first = 0;
        // the slot within a batch is the element's position in the packs of point data
        let places = lane_of_row::<T>();
        for chunk in &batches.chunks {
            let lanes = places.len();
            for (batch, local) in chunk.local.chunks_exact(per_element).enumerate() {
                for (lane, &place) in places.iter().enumerate() {
                    let slot = first + batch * lanes + place;
                    let vacant = chunk.tets[batch * lanes + lane] == VACANT;
                    for a in 0..per_element {
                        let node = chunk.global[usize::from(local[a][lane])];
                        nodes[a * count + slot] = node;
                        if !vacant {
                            copies.push((node, (a * count + slot) as u32));
                        }
                    }
                }
            }
            first += chunk.tets.len();
        }
        let copies = Groups::new(batches.node_count(), copies.iter().copied());
        Ok(Self {
            kinds,
            count,
            nodes: Array::of(device, &nodes)?,
            start: Array::of(device, &copies.start)?,
            place: Array::of(device, &copies.members)?,
        })
    }

    /// The element of each slot of a kind, and whether the slot has an element of its own. A vacant slot gets
    /// the first element of its batch.
    pub(crate) fn elements<T: Stored>(layout: &Layout, kind: &Kind) -> Vec<(usize, bool)> {
        let places = lane_of_row::<T>();
        let mut elements = vec![(0, false); kind.count];
        let batches = layout.batches.chunks[kind.chunks.clone()].iter();
        let batches = batches.flat_map(|chunk| chunk.tets.chunks_exact(places.len()));
        for (tets, slots) in batches.zip(elements.chunks_exact_mut(places.len())) {
            for (&tet, &place) in tets.iter().zip(&places) {
                let is_one = tet != VACANT;
                slots[place] = (if is_one { tet } else { tets[0] } as usize, is_one);
            }
        }
        elements
    }

    /// The arguments of the kernel [`node_sum`].
    pub(crate) fn sum<'a>(
        &'a self,
        copies: &'a Array<f64>,
        y: &'a Array<f64>,
    ) -> [Argument<'a>; 4] {
        [self.start.argument(), self.place.argument(), copies.argument(), y.argument()]
    }
}

/// The kernel that computes y_n as the sum of the copies of node n, in the order of the elements. `values` is
/// the number of values per node.
pub(crate) fn node_sum(values: usize) -> Kernel {
    let parameters = [
        ("const unsigned *", "start"),
        ("const unsigned *", "place"),
        ("const double *", "copies"),
        ("double *", "y"),
    ];
    let body = format!(
        "    index node = at / {values}, c = at % {values};\n    double sum = 0.0;\n    \
         for (index k = start[node]; k < start[node + 1]; k++) \
         sum += copies[{values} * (index)place[k] + c];\n    y[at] = sum;\n"
    );
    Kernel::new(format!("node_sum_{values}"), &parameters, body)
}
