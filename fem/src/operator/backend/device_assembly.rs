//! The equations of a whole mesh on a device: fields are sent, residual and energies come back, and the numbers of
//! the tangent stay where the product reads them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::assembly::Assembly;
use super::equations_source::{
    GEOMETRY, ROW, SUMS, Setting, block_sum, geometries, residual_kernel, tangent_kernel,
};
use super::lanes::Stored;
use super::matrix_free::SINGLE_FROM;
use super::regions::Regions;
use super::slots::{Kind, Slots, node_sum};
use crate::device::{Argument, Array, ComputeDevice, DeviceError, Program};
use crate::element::{Domain, Geometry, Space};
use crate::material::{CrackDensity, Inverted};
use crate::operator::cell_stress::CellStress;
use crate::operator::equations::{Coupling, EquationsOnDevice, Operator};
use crate::operator::layout::{LANES, Layout};
use crate::operator::pattern::Tangent;
use crate::operator::residual::{Increment, Residual, Shift};
use crate::parallel::Part;

/// Slots whose energies are summed on the device.
const BLOCK: usize = 256;

/// An [`Assembly`] whose residuals and tangents a device computes, as long as it can: laws with a formula, without
/// a history. All else, and all after a failure, the processor does.
#[derive(Debug)]
pub(crate) struct DeviceAssembly<const N: usize> {
    host: Assembly<N>,
    /// Whether there are mixtures.
    mixed: bool,
    device: ComputeDevice,
    /// Made when they are asked for first; or why they no longer are.
    elements: Mutex<Result<Option<Box<Elements>>, DeviceError>>,
}

/// The elements on the device.
#[derive(Debug)]
struct Elements {
    setting: Setting,
    program: Arc<dyn Program>,
    slots: Slots,
    kinds: Vec<OfKind>,
    /// Whether a slot has an element of its own.
    live: Array<u8>,
    fields: Array<f64>,
    before: Array<f64>,
    copies: Array<f64>,
    drive_copies: Array<f64>,
    nodal: Array<f64>,
    drive: Array<f64>,
    sums: Array<f64>,
    blocks: Array<f64>,
}

/// What the kernels of a kind of slots read.
#[derive(Debug)]
struct OfKind {
    geometry: Array<f64>,
    /// The row of constants of each slot.
    rows: Array<u32>,
    table: Array<f64>,
    /// Region and fraction of grain of each row.
    constants: Vec<(usize, f64)>,
    /// What the table has.
    sent: Vec<f64>,
}

impl<const N: usize> DeviceAssembly<N> {
    pub(crate) fn new(host: Assembly<N>, device: ComputeDevice) -> Self {
        let space = &host.space;
        let mixed = (0..space.tets.len()).any(|tet| space.fraction(tet) > 0.0);
        Self { host, mixed, device, elements: Mutex::new(Ok(None)) }
    }

    fn state(&self) -> MutexGuard<'_, Result<Option<Box<Elements>>, DeviceError>> {
        self.elements.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does something with the elements on the device, if they can be there.
    fn attempt<R>(
        &self,
        increment: &Increment,
        work: impl FnOnce(&mut Elements) -> Result<R, DeviceError>,
    ) -> Option<R> {
        let Self { host, mixed, device, .. } = self;
        let Increment { materials, context, .. } = increment;
        let mut state = self.state();
        let kept = state.as_mut().ok()?;
        let regions = Regions::new(materials, host.rule, context.duration);
        let (formula, degraded, rule) = regions.setting();
        let damage = materials.iter().find_map(|m| m.damage.as_ref());
        let setting = Setting {
            formula: formula.filter(|_| context.history.is_empty())?,
            degraded,
            density: damage.map_or(CrackDensity::At2, |d| d.density),
            mixed: mixed.then_some(rule),
        };
        let made = match kept.take() {
            Some(elements) if elements.setting == setting => Ok(elements),
            _ if host.space.tets.len() < SINGLE_FROM => {
                Elements::new::<N, f64>(&host.space, setting, device).map(Box::new)
            }
            _ => Elements::new::<N, f32>(&host.space, setting, device).map(Box::new),
        };
        let done = made.and_then(|mut elements| {
            elements.send(increment, &regions)?;
            let result = work(&mut elements)?;
            Ok((elements, result))
        });
        match done {
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
        kernels.extend(plain().map(|plain| tangent_kernel::<N, T>(rule, &setting, plain)));
        kernels.extend([node_sum(4), node_sum(1), block_sum(BLOCK)]);
        let (mut kinds, mut live) = (Vec::new(), vec![0; slots.count]);
        for kind in &slots.kinds {
            let elements = Slots::elements::<T>(&layout, kind);
            for (at, (_, is_one)) in elements.iter().enumerate() {
                live[kind.first + at] = u8::from(*is_one);
            }
            kinds.push(OfKind::new(space, kind, &elements, device)?);
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
            copies: zeros(4 * N * slots.count)?,
            drive_copies: zeros(N * slots.count)?,
            nodal: zeros(4 * nodes)?,
            drive: zeros(nodes)?,
            sums: zeros(SUMS * slots.count)?,
            blocks: zeros(SUMS * slots.count.div_ceil(BLOCK))?,
            slots,
        })
    }

    /// Takes over an increment.
    fn send(&mut self, increment: &Increment, regions: &Regions) -> Result<(), DeviceError> {
        let fields = increment.fields;
        let nodal = fields.displacement.par_iter().zip(&fields.damage);
        let nodal: Vec<[f64; 4]> = nodal.map(|(u, phi)| [u[0], u[1], u[2], *phi]).collect();
        self.fields.write(0, nodal.as_flattened())?;
        self.before.write(0, increment.context.damage_before)?;
        self.kinds.iter_mut().try_for_each(|kind| kind.send(regions))
    }

    /// What the kernel of a kind reads.
    fn inputs(&self, kind: usize) -> Vec<Argument<'_>> {
        let (slots, own) = (&self.slots.kinds[kind], &self.kinds[kind]);
        let numbers = [self.slots.count, slots.first, slots.count];
        let mut inputs: Vec<_> = numbers.map(|n| Argument::Index(n as u64)).into();
        inputs.extend([self.slots.nodes.argument(), own.geometry.argument()]);
        inputs.extend([own.rows.argument(), own.table.argument()]);
        inputs.extend([self.fields.argument(), self.before.argument()]);
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
            self.program.launch(2 * kinds + kernel, y.len(), &self.slots.sum(copies, y))?;
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

    /// Energies, and how many elements are turned inside out.
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
        Ok(sums.iter().fold([0.0; SUMS], |all, own| std::array::from_fn(|k| all[k] + own[k])))
    }
}

impl OfKind {
    fn new<const N: usize>(
        space: &Space<N>,
        kind: &Kind,
        elements: &[(usize, bool)],
        device: &ComputeDevice,
    ) -> Result<Self, DeviceError> {
        let points = geometries(&space.rule, kind.plain);
        let mut geometry = vec![0.0; GEOMETRY * points * kind.count];
        let mut known = HashMap::new();
        let (mut rows, mut constants) = (Vec::with_capacity(kind.count), Vec::new());
        for (at, &(tet, _)) in elements.iter().enumerate() {
            let own = space.geometry(tet);
            for q in 0..points {
                let Geometry { barycentric, volume } = &own[if own.len() == 1 { 0 } else { q }];
                let numbers = barycentric.as_flattened().iter().chain([volume]);
                for (k, number) in numbers.enumerate() {
                    geometry[(GEOMETRY * q + k) * kind.count + at] = *number;
                }
            }
            let (region, fraction) = (usize::from(space.region[tet]), space.fraction(tet));
            let row = *known.entry((region, fraction.to_bits())).or_insert_with(|| {
                constants.push((region, fraction));
                constants.len() as u32 - 1
            });
            rows.push(row);
        }
        Ok(Self {
            geometry: Array::of(device, &geometry)?,
            rows: Array::of(device, &rows)?,
            table: Array::zeros(device, ROW * constants.len())?,
            constants,
            sent: Vec::new(),
        })
    }

    /// Sends the constants of the materials where they have changed.
    fn send(&mut self, regions: &Regions) -> Result<(), DeviceError> {
        let rows = self.constants.iter().map(|&(region, fraction)| regions.row(region, fraction));
        let table: Vec<f64> = rows.flatten().collect();
        if table != self.sent {
            self.table.write(0, &table)?;
            self.sent = table;
        }
        Ok(())
    }
}

impl<const N: usize> Operator for DeviceAssembly<N> {
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted> {
        match self.attempt(increment, |elements| elements.residual(out)) {
            Some(result) => result,
            None => self.host.residual(increment, out),
        }
    }

    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted> {
        self.host.tangent(increment, coupling, out)
    }

    fn driving_energies(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted> {
        self.host.driving_energies(increment, out)
    }

    fn stresses(&self, increment: &Increment) -> Result<Vec<CellStress>, Inverted> {
        self.host.stresses(increment)
    }

    fn point_data(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted> {
        self.host.point_data(increment, coupling, tets, write)
    }

    fn rates(
        &self,
        increment: &Increment,
        shifts: &[Shift],
        out: &mut [Vec<[f64; 4]>],
    ) -> Result<(), Inverted> {
        self.host.rates(increment, shifts, out)
    }

    fn domain(&self) -> &dyn Domain {
        self.host.domain()
    }

    fn part(&self) -> &Arc<Part> {
        self.host.part()
    }

    fn on_device(&self) -> Option<&dyn EquationsOnDevice> {
        Some(self)
    }
}

impl<const N: usize> EquationsOnDevice for DeviceAssembly<N> {
    fn linearise(&self, increment: &Increment, data: &[Argument]) -> Option<Result<(), Inverted>> {
        self.attempt(increment, |elements| elements.linearise(data))
    }

    fn lost(&self) -> Option<DeviceError> {
        self.state().as_ref().err().cloned()
    }
}
