//! Product with the tangent on a device. If the device also evaluates the equations, it computes the stored data of
//! the tangent. Otherwise the processor linearises, and the data are sent to the device before a product.

use std::sync::Arc;

use super::equations_source::diagonal_kernel;
use super::product_source::{StoredType, product_kernel};
use super::slots::{Kind, Slots, node_sum};
use crate::device::{Argument, Array, ComputeDevice, DeviceError, Program};
use crate::material::Inverted;
use crate::operator::cpu::Stored;
use crate::operator::cpu::{MatrixFree, SINGLE_FROM};
use crate::operator::equations::{AppliedOnDevice, Coupling, Operator, Product};
use crate::operator::increment::Increment;
use crate::operator::kernel::DataLayout;
use crate::operator::layout::Layout;
use crate::operator::pattern::Tangent;

/// Creates a matrix-free product on a device. The number of elements `tets` determines the precision of the stored
/// data.
pub fn device_product(
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

/// Location of the stored data of the current tangent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Location {
    Processor,
    Device,
    Both,
}

/// [`MatrixFree`] product with a copy of its stored data on a device.
#[derive(Debug)]
pub(crate) struct DeviceProduct<T: Stored> {
    host: MatrixFree<T>,
    location: Location,
    /// Whether the device has failed, so that the processor linearises.
    device_failed: bool,
    program: Arc<dyn Program>,
    slots: Slots,
    /// Stored data of the tangents, one array per kind of slots.
    data: Vec<Array<T>>,
    /// For each kind of slots, the indices of the stored data of vacant slots. The processor stores zeros at
    /// these indices.
    vacant: Vec<Vec<usize>>,
    copies: Array<f64>,
    diagonal: Array<f64>,
}

impl<T: Stored> DeviceProduct<T> {
    pub(crate) fn new(layout: Arc<Layout>, device: &ComputeDevice) -> Result<Self, DeviceError> {
        let slots = Slots::new::<T>(&layout, device)?;
        let rule = &layout.rule;
        let width = |plain: bool| DataLayout::new(rule, plain).width();
        let data = slots.kinds.iter().map(|k| Array::zeros(device, k.count * width(k.plain)));
        let data = data.collect::<Result<Vec<_>, _>>()?;
        let vacant = |kind: &Kind| {
            let (width, elements) = (width(kind.plain), Slots::elements::<T>(&layout, kind));
            let slots = elements.iter().enumerate().filter(|(_, (_, has_element))| !has_element);
            let indices = |slot: usize| {
                let first = slot / T::WIDTH * width * T::WIDTH + slot % T::WIDTH;
                (0..width).map(move |k| first + k * T::WIDTH)
            };
            slots.flat_map(|(slot, _)| indices(slot)).collect()
        };
        let vacant = slots.kinds.iter().map(vacant).collect();
        let kinds = slots.kinds.iter().map(|kind| kind.plain);
        let stored = StoredType::new::<T>();
        let mut kernels: Vec<_> =
            kinds.clone().map(|plain| product_kernel(&layout, plain, stored)).collect();
        kernels.extend(kinds.map(|plain| diagonal_kernel(rule, plain, stored)));
        kernels.push(node_sum(4));
        Ok(Self {
            location: Location::Processor,
            device_failed: false,
            program: device.compile(&kernels)?,
            copies: Array::zeros(device, 4 * rule.nodes * slots.count)?,
            diagonal: Array::zeros(device, 4 * layout.batches.node_count())?,
            slots,
            data,
            vacant,
            host: MatrixFree::new(layout),
        })
    }

    /// Sends the stored data to the device.
    fn send(&mut self) -> Result<(), DeviceError> {
        for (kind, data) in self.slots.kinds.iter().zip(&mut self.data) {
            let mut at = 0;
            for packs in &self.host.data()[kind.chunks.clone()] {
                let entries: Vec<T> = packs.iter().flat_map(AsRef::as_ref).copied().collect();
                data.write(at, &entries)?;
                at += entries.len();
            }
        }
        self.location = Location::Both;
        Ok(())
    }

    /// Copies the stored data from the device to the processor, unless the processor already has the data.
    fn read_back(&mut self) -> Result<(), DeviceError> {
        if self.location != Location::Device {
            return Ok(());
        }
        for ((kind, data), vacant) in self.slots.kinds.iter().zip(&self.data).zip(&self.vacant) {
            let mut entries = vec![T::default(); data.len()];
            data.read(&mut entries)?;
            vacant.iter().for_each(|&index| entries[index] = T::default());
            let mut rest = entries.as_slice();
            for packs in &mut self.host.data_mut()[kind.chunks.clone()] {
                for pack in packs {
                    let (first, others) = rest.split_at(T::WIDTH);
                    pack.as_mut().copy_from_slice(first);
                    rest = others;
                }
            }
        }
        self.location = Location::Both;
        Ok(())
    }

    /// Sums the contributions of all elements to each node into `y`.
    fn sum(&self, y: &Array<f64>) -> Result<(), DeviceError> {
        let kernel = 2 * self.slots.kinds.len();
        self.program.launch(kernel, y.len(), &self.slots.sum_arguments(&self.copies, y))
    }

    /// Computes the diagonal on the device.
    fn diagonal_on_device(&self) -> Result<Vec<[f64; 4]>, DeviceError> {
        let kinds = self.slots.kinds.len();
        for (k, (kind, data)) in self.slots.kinds.iter().zip(&self.data).enumerate() {
            let arguments = [
                Argument::Index(self.slots.count as u64),
                Argument::Index(kind.first as u64),
                data.argument(),
                self.copies.argument(),
            ];
            self.program.launch(kinds + k, kind.count, &arguments)?;
        }
        self.sum(&self.diagonal)?;
        let mut out = vec![[0.0; 4]; self.diagonal.len() / 4];
        self.diagonal.read(out.as_flattened_mut())?;
        Ok(out)
    }
}

impl<T: Stored> AppliedOnDevice for DeviceProduct<T> {
    fn apply(&mut self, x: &Array<f64>, y: &mut Array<f64>) -> Result<(), DeviceError> {
        if self.location == Location::Processor {
            self.send()?;
        }
        for (kernel, (kind, data)) in self.slots.kinds.iter().zip(&self.data).enumerate() {
            let arguments = [
                Argument::Index(self.slots.count as u64),
                Argument::Index(kind.first as u64),
                self.slots.nodes.argument(),
                data.argument(),
                x.argument(),
                self.copies.argument(),
            ];
            self.program.launch(kernel, kind.count, &arguments)?;
        }
        self.sum(y)
    }
}

impl<T: Stored> Product for DeviceProduct<T> {
    fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted> {
        let data: Vec<Argument> = self.data.iter().map(Array::argument).collect();
        let on_device =
            operator.on_device().filter(|_| !self.device_failed && coupling == Coupling::Full);
        let linearised = on_device.and_then(|equations| equations.linearise(increment, &data));
        if let Some(result) = linearised {
            self.location = Location::Device;
            return result;
        }
        self.location = Location::Processor;
        self.host.linearise(operator, increment, coupling)
    }

    fn apply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]) -> Result<(), DeviceError> {
        self.read_back()?;
        self.host.apply(x, y)
    }

    fn diagonal(&mut self) -> Result<Vec<[f64; 4]>, DeviceError> {
        match self.location {
            Location::Device => self.diagonal_on_device(),
            Location::Processor | Location::Both => self.host.diagonal(),
        }
    }

    fn add_linear(&mut self, out: &mut Tangent) -> Result<(), DeviceError> {
        self.read_back()?;
        self.host.add_linear(out)
    }

    fn leave_device(&mut self) {
        self.device_failed = true;
    }

    fn on_device(&mut self) -> Option<&mut dyn AppliedOnDevice> {
        Some(self)
    }

    #[cfg(feature = "bench-internals")]
    fn bytes(&self) -> usize {
        self.host.bytes()
    }
}
