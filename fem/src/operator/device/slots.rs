//! Order of the elements on a device, and sum of their contributions by node.

use std::ops::Range;

use fem_mesh::Groups;

use crate::device::{Argument, Array, ComputeDevice, DeviceError, Kernel};
use crate::operator::cpu::{Stored, lane_of_row};
use crate::operator::layout::{LANES, Layout, VACANT};

/// Slots: indices of the elements in the arrays of a device. Every lane of the processor's batches has a slot, also a
/// lane without an element; the slots are in the order of the batches.
#[derive(Debug)]
pub(crate) struct Slots {
    /// Plain elements (straight, no mixtures), then other elements. The chunks of a kind are consecutive.
    pub kinds: Vec<Kind>,
    /// Total number of slots.
    pub count: usize,
    /// Nodes of the elements: node a of slot s is at index a · count + s.
    pub nodes: Array<u32>,
    /// CSR offsets of the nodes into `copies`.
    copy_start: Array<u32>,
    /// For each node, the indices a · count + s of its values in the contributions of the elements.
    copies: Array<u32>,
}

/// Consecutive slots whose elements share a compiled kernel.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    pub plain: bool,
    /// Chunks of the processor's layout.
    pub chunks: Range<usize>,
    /// First slot.
    pub first: usize,
    pub count: usize,
}

impl Slots {
    /// Assigns slots to the elements; `T` is the precision of the stored data.
    pub(crate) fn new<T: Stored>(
        layout: &Layout,
        device: &ComputeDevice,
    ) -> Result<Self, DeviceError> {
        let (batches, per_element) = (&layout.batches, layout.rule.nodes);
        let (mut kinds, mut count) = (Vec::<Kind>::new(), 0);
        for part in batches.chunks.chunk_by(|a, b| a.plain == b.plain) {
            let begin = kinds.last().map_or(0, |kind| kind.chunks.end);
            let slots = part.iter().map(|chunk| chunk.tets.len()).sum();
            let (plain, chunks) = (part[0].plain, begin..begin + part.len());
            kinds.push(Kind { plain, chunks, first: count, count: slots });
            count += slots;
        }
        if u32::try_from(per_element * count).is_err() {
            return Err(DeviceError(format!(
                "{count} elements are too many for one device: use a coarser mesh or the processor"
            )));
        }
        let mut nodes = vec![0u32; per_element * count];
        let mut copies = Vec::new();
        let mut first = 0;
        // within a batch, the slot of an element equals the position of the element in the packs of stored data
        let lane_of_row = lane_of_row::<T>();
        for chunk in &batches.chunks {
            for (batch, local) in chunk.local.chunks_exact(per_element).enumerate() {
                for (row, &lane) in lane_of_row.iter().enumerate() {
                    let slot = first + batch * LANES + lane;
                    let vacant = chunk.tets[batch * LANES + row] == VACANT;
                    for a in 0..per_element {
                        let node = chunk.global[usize::from(local[a][row])];
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
            copy_start: Array::of(device, &copies.start)?,
            copies: Array::of(device, &copies.members)?,
        })
    }

    /// Returns the element of each slot of a kind, and whether the slot has an element. A vacant slot gets the first
    /// element of its batch.
    pub(crate) fn elements<T: Stored>(layout: &Layout, kind: &Kind) -> Vec<(usize, bool)> {
        let lane_of_row = lane_of_row::<T>();
        let mut elements = vec![(0, false); kind.count];
        let batches = layout.batches.chunks[kind.chunks.clone()].iter();
        let batches = batches.flat_map(|chunk| chunk.tets.chunks_exact(LANES));
        for (tets, slots) in batches.zip(elements.chunks_exact_mut(LANES)) {
            for (&tet, &lane) in tets.iter().zip(&lane_of_row) {
                let has_element = tet != VACANT;
                slots[lane] = (if has_element { tet } else { tets[0] } as usize, has_element);
            }
        }
        elements
    }

    /// Returns the arguments of the kernel [`node_sum`].
    pub(crate) fn sum_arguments<'a>(
        &'a self,
        copies: &'a Array<f64>,
        y: &'a Array<f64>,
    ) -> [Argument<'a>; 4] {
        [self.copy_start.argument(), self.copies.argument(), copies.argument(), y.argument()]
    }
}

/// Creates the kernel that computes y_n as the sum of the copies of node n, in the order of the elements. `values` is
/// the number of values per node.
pub(crate) fn node_sum(values: usize) -> Kernel {
    let parameters = [
        ("const unsigned *", "start"),
        ("const unsigned *", "copy"),
        ("const double *", "copies"),
        ("double *", "y"),
    ];
    let body = format!(
        "    index node = at / {values}, c = at % {values};\n    double sum = 0.0;\n    \
         for (index k = start[node]; k < start[node + 1]; k++) \
         sum += copies[{values} * (index)copy[k] + c];\n    y[at] = sum;\n"
    );
    Kernel::new(format!("node_sum_{values}"), &parameters, body)
}
