//! Equations of a mesh on a device. Fields and state are sent to the device, residual and energies are read back, and
//! the stored data of the tangent stay on the device for the product.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::equations_source::{
    GEOMETRY, ROW, SUMS, Setting, block_sum, geometries, residual_kernel, tangent_kernel,
};
use super::product_source::StoredType;
use super::slots::{Kind, Slots, node_sum};
use crate::device::{Argument, Array, ComputeDevice, DeviceError, Program};
use crate::element::{Geometry, Space};
use crate::material::{CrackDensity, Homogenisation, Inverted};

use crate::operator::cpu::{Regions, SINGLE_FROM, Stored};
use crate::operator::increment::{Increment, Residual};
use crate::operator::layout::Layout;

/// Number of slots per block. The device sums the energies of each block, and the processor sums the blocks.
const BLOCK: usize = 256;

/// Residual and tangent of a mesh on a device, until the device fails. Methods return `None` if the processor must
/// compute instead.
#[derive(Debug)]
pub(crate) struct DeviceEquations {
    device: ComputeDevice,
    /// Device data, created on first use. After a failure: the error of the device.
    elements: Mutex<Result<Option<Box<Elements>>, DeviceError>>,
}

/// Data of the elements on the device.
#[derive(Debug)]
struct Elements {
    setting: Setting,
    program: Arc<dyn Program>,
    slots: Slots,
    kinds: Vec<KindInputs>,
    /// Whether each slot has an element: 1 or 0.
    live: Array<u8>,
    /// Nodal values u_x, u_y, u_z, φ.
    fields: Array<f64>,
    /// Nodal damage at the start of the increment.
    before: Array<f64>,
    /// Duration of the increment, s.
    duration: f64,
    /// State at the start of the increment that was last sent to the device; empty if zero.
    state: Vec<f64>,
    /// Contributions of the element in each slot to the residual of its nodes, four values per
    /// node.
    copies: Array<f64>,
    /// Contributions of the element in each slot to the field `drive` of the residual, one value
    /// per node.
    drive_copies: Array<f64>,
    nodal: Array<f64>,
    drive: Array<f64>,
    /// For each slot, three energies, and 1 if the element is not inverted, else 0.
    sums: Array<f64>,
    /// For each block of slots, the sums of the three energies, and the number of inverted
    /// elements.
    blocks: Array<f64>,
}

/// Kernel inputs for one kind of slots.
#[derive(Debug)]
struct KindInputs {
    /// Geometry of the elements: value k of slot s at k · slots + s.
    geometry: Array<f64>,
    /// Row of `table` for each slot.
    rows: Array<u32>,
    /// Rows of material constants, one per distinct combination of region, second region, fraction and interface band.
    table: Array<f64>,
    /// State of the elements: value k of slot s at k · slots + s.
    state: Array<f64>,
    /// Element of each slot.
    tets: Vec<usize>,
    /// For each row of `table`: the region, the region of the second phase, the fraction of the
    /// second phase, and the interface band.
    constants: Vec<(usize, usize, f64, (usize, f64))>,
    /// Current content of `table` on the device.
    sent: Vec<f64>,
}

impl DeviceEquations {
    pub(crate) fn new(device: ComputeDevice) -> Self {
        Self { device, elements: Mutex::new(Ok(None)) }
    }

    /// Computes residual and energies; `homogenisation` is the rule of mixtures.
    pub(crate) fn residual<const N: usize>(
        &self,
        space: &Space<N>,
        homogenisation: Homogenisation,
        increment: &Increment,
        out: &mut Residual,
    ) -> Option<Result<(), Inverted>> {
        self.attempt(space, homogenisation, increment, |elements| elements.residual(out))
    }

    /// Writes the stored data of the tangent into the arrays of a product, one array per kind of slots.
    pub(crate) fn linearise<const N: usize>(
        &self,
        space: &Space<N>,
        homogenisation: Homogenisation,
        increment: &Increment,
        data: &[Argument],
    ) -> Option<Result<(), Inverted>> {
        self.attempt(space, homogenisation, increment, |elements| elements.linearise(data))
    }

    /// Returns the error of the device, if the device has failed and is no longer used.
    pub(crate) fn lost(&self) -> Option<DeviceError> {
        self.state().as_ref().err().cloned()
    }

    fn state(&self) -> MutexGuard<'_, Result<Option<Box<Elements>>, DeviceError>> {
        self.elements.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` on the device data. Returns `None` if the device has failed.
    fn attempt<const N: usize, R>(
        &self,
        space: &Space<N>,
        homogenisation: Homogenisation,
        increment: &Increment,
        work: impl FnOnce(&mut Elements) -> Result<R, DeviceError>,
    ) -> Option<R> {
        let Increment { materials, context, .. } = increment;
        let mut state = self.state();
        let elements = state.as_mut().ok()?;
        let regions = Regions::new(materials, homogenisation, context.duration, context.damping);
        let (laws, degradations) = regions.laws();
        let damage = materials.iter().find_map(|m| m.damage.as_ref());
        let setting = Setting {
            laws: laws.to_vec(),
            degradations: degradations.to_vec(),
            density: damage.map_or(CrackDensity::At2, |d| d.density),
            history: regions.keeps_history(),
            mixed: space.has_mixtures().then_some(homogenisation),
        };
        let device = &self.device;
        let prepared = match elements.take() {
            Some(elements) if elements.setting == setting => Ok(elements),
            _ if space.tets.len() < SINGLE_FROM => {
                Elements::new::<N, f64>(space, setting, device).map(Box::new)
            }
            _ => Elements::new::<N, f32>(space, setting, device).map(Box::new),
        };
        let outcome = prepared.and_then(|mut elements| {
            elements.send(increment, &regions)?;
            let result = work(&mut elements)?;
            Ok((elements, result))
        });
        match outcome {
            Ok((elements, result)) => {
                *state = Ok(Some(elements));
                Some(result)
            }
            Err(error) => {
                *state = Err(error);
                None
            }
        }
    }
}

impl Elements {
    fn new<const N: usize, T: Stored>(
        space: &Space<N>,
        setting: Setting,
        device: &ComputeDevice,
    ) -> Result<Self, DeviceError> {
        let (layout, rule) = (Layout::new(space), &space.rule);
        let slots = Slots::new::<T>(&layout, device)?;
        let plain = || slots.kinds.iter().map(|kind| kind.plain);
        let mut kernels: Vec<_> =
            plain().map(|plain| residual_kernel::<N>(rule, &setting, plain)).collect();
        kernels.extend(
            plain().map(|plain| tangent_kernel::<N>(rule, &setting, plain, StoredType::new::<T>())),
        );
        kernels.extend([node_sum(4), node_sum(1), block_sum(BLOCK)]);
        let (mut kinds, mut live) = (Vec::new(), vec![0; slots.count]);
        for kind in &slots.kinds {
            let elements = Slots::elements::<T>(&layout, kind);
            for (at, (_, has_element)) in elements.iter().enumerate() {
                live[kind.first + at] = u8::from(*has_element);
            }
            kinds.push(KindInputs::new(space, &setting, kind, &elements, device)?);
        }
        let zeros = |len: usize| Array::zeros(device, len);
        let nodes = space.nodes.len();
        Ok(Self {
            setting,
            program: device.compile(&kernels)?,
            kinds,
            live: Array::of(device, &live)?,
            fields: zeros(4 * nodes)?,
            before: zeros(nodes)?,
            duration: 0.0,
            state: Vec::new(),
            copies: zeros(4 * N * slots.count)?,
            drive_copies: zeros(N * slots.count)?,
            nodal: zeros(4 * nodes)?,
            drive: zeros(nodes)?,
            sums: zeros(SUMS * slots.count)?,
            blocks: zeros(SUMS * slots.count.div_ceil(BLOCK))?,
            slots,
        })
    }

    /// Sends fields, state and material constants of an increment to the device.
    fn send(&mut self, increment: &Increment, regions: &Regions) -> Result<(), DeviceError> {
        let fields = increment.fields;
        let nodal = fields.displacement.par_iter().zip(&fields.damage);
        let nodal: Vec<[f64; 4]> = nodal.map(|(u, phi)| [u[0], u[1], u[2], *phi]).collect();
        self.fields.write(0, nodal.as_flattened())?;
        self.before.write(0, increment.context.damage_before)?;
        self.duration = increment.context.duration;
        if self.state != increment.context.state {
            self.state = increment.context.state.to_vec();
            self.kinds.iter_mut().try_for_each(|kind| kind.send_state(&self.state))?;
        }
        self.kinds.iter_mut().try_for_each(|kind| kind.send(regions))
    }

    /// Returns the inputs of the kernels for a kind of slots, in the order of `Inputs::PARAMETERS`.
    fn inputs(&self, kind: usize) -> Vec<Argument<'_>> {
        let (slots, kind) = (&self.slots.kinds[kind], &self.kinds[kind]);
        let slot_indices = [self.slots.count, slots.first, slots.count];
        let mut inputs: Vec<_> = slot_indices.map(|n| Argument::Index(n as u64)).into();
        inputs.extend([self.slots.nodes.argument(), kind.geometry.argument()]);
        inputs.extend([kind.rows.argument(), kind.table.argument()]);
        inputs.extend([self.fields.argument(), self.before.argument()]);
        inputs.extend([kind.state.argument(), Argument::Real(self.duration)]);
        inputs
    }

    fn residual(&self, out: &mut Residual) -> Result<Result<(), Inverted>, DeviceError> {
        let kinds = self.kinds.len();
        for (kind, slots) in self.slots.kinds.iter().enumerate() {
            let outputs = [&self.copies, &self.drive_copies, &self.sums].map(Array::argument);
            let arguments = [self.inputs(kind), outputs.into()].concat();
            self.program.launch(kind, slots.count, &arguments)?;
        }
        let sums = [(&self.copies, &self.nodal), (&self.drive_copies, &self.drive)];
        for (kernel, (copies, y)) in sums.into_iter().enumerate() {
            self.program.launch(
                2 * kinds + kernel,
                y.len(),
                &self.slots.sum_arguments(copies, y),
            )?;
        }
        let [elastic, fracture, viscous, inverted] = self.totals()?;
        if inverted > 0.0 {
            return Ok(Err(Inverted));
        }
        self.nodal.read(out.nodal.as_flattened_mut())?;
        self.drive.read(&mut out.drive)?;
        (out.elastic, out.fracture, out.viscous) = (elastic, fracture, viscous);
        Ok(Ok(()))
    }

    fn linearise(&self, data: &[Argument]) -> Result<Result<(), Inverted>, DeviceError> {
        let kinds = self.kinds.len();
        for (kind, slots) in self.slots.kinds.iter().enumerate() {
            let arguments = [self.inputs(kind), vec![data[kind], self.sums.argument()]].concat();
            self.program.launch(kinds + kind, slots.count, &arguments)?;
        }
        let [.., inverted] = self.totals()?;
        Ok(if inverted > 0.0 { Err(Inverted) } else { Ok(()) })
    }

    /// Returns the energies of the mesh (elastic, crack, viscous; N mm), and the number of inverted elements.
    fn totals(&self) -> Result<[f64; SUMS], DeviceError> {
        let blocks = self.blocks.len() / SUMS;
        let arguments = [
            Argument::Index(self.slots.count as u64),
            self.live.argument(),
            self.sums.argument(),
            self.blocks.argument(),
        ];
        self.program.launch(2 * self.kinds.len() + 2, blocks, &arguments)?;
        let mut sums = vec![[0.0; SUMS]; blocks];
        self.blocks.read(sums.as_flattened_mut())?;
        Ok(sums.iter().fold([0.0; SUMS], |all, block| std::array::from_fn(|k| all[k] + block[k])))
    }
}

impl KindInputs {
    fn new<const N: usize>(
        space: &Space<N>,
        setting: &Setting,
        kind: &Kind,
        elements: &[(usize, bool)],
        device: &ComputeDevice,
    ) -> Result<Self, DeviceError> {
        let geometry_count = geometries(&space.rule, kind.plain);
        let mut geometry = vec![0.0; GEOMETRY * geometry_count * kind.count];
        let mut row_of_constants = HashMap::new();
        let (mut rows, mut constants) = (Vec::with_capacity(kind.count), Vec::new());
        for (at, &(tet, _)) in elements.iter().enumerate() {
            let of_points = space.geometry(tet);
            for q in 0..geometry_count {
                let Geometry { barycentric, volume } =
                    &of_points[if of_points.len() == 1 { 0 } else { q }];
                let entries = barycentric.as_flattened().iter().chain([volume]);
                for (k, number) in entries.enumerate() {
                    geometry[(GEOMETRY * q + k) * kind.count + at] = *number;
                }
            }
            let (region, fraction) = (usize::from(space.region[tet]), space.fraction(tet));
            let (second, band) = (space.second_region(tet), space.band(tet));
            let key = (region, second, fraction.to_bits(), band.0, band.1.to_bits());
            let row = *row_of_constants.entry(key).or_insert_with(|| {
                constants.push((region, second, fraction, band));
                constants.len() as u32 - 1
            });
            rows.push(row);
        }
        // a device may refuse an empty array
        let state = (setting.state_len() * space.rule.elastic_points.len() * kind.count).max(1);
        Ok(Self {
            geometry: Array::of(device, &geometry)?,
            state: Array::zeros(device, state)?,
            tets: elements.iter().map(|(tet, _)| *tet).collect(),
            rows: Array::of(device, &rows)?,
            table: Array::zeros(device, ROW * constants.len())?,
            constants,
            sent: Vec::new(),
        })
    }

    /// Sends the state of the slots. `all` is the state of all elements; an empty slice stands for zero.
    fn send_state(&mut self, all: &[f64]) -> Result<(), DeviceError> {
        let mut state = vec![0.0; self.state.len()];
        let width = self.state.len() / self.tets.len();
        if !all.is_empty() {
            for (slot, tet) in self.tets.iter().enumerate() {
                for k in 0..width {
                    state[k * self.tets.len() + slot] = all[tet * width + k];
                }
            }
        }
        self.state.write(0, &state)
    }

    /// Sends the material constants to the device if they have changed.
    fn send(&mut self, regions: &Regions) -> Result<(), DeviceError> {
        let rows = self
            .constants
            .iter()
            .map(|&(region, second, fraction, band)| regions.row(region, second, fraction, band));
        let table: Vec<f64> = rows.flatten().collect();
        if table != self.sent {
            self.table.write(0, &table)?;
            self.sent = table;
        }
        Ok(())
    }
}
