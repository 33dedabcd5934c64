//! Equations of a mesh on the processor, or on a device if the device supports them.

use std::sync::Arc;

use rayon::prelude::*;

use super::cell_stress::CellStress;
use super::cpu::{
    ConfigurationalOf, Gather, PointDataOf, ResidualsOf, Selection, StatesOf, StressesOf,
    TangentsOf, each_register,
};
use super::deterministic_reduce::deterministic_reduce;
use super::device::DeviceEquations;
use super::equations::{Coupling, EquationsOnDevice, Operator};
use super::increment::{Increment, Residual};
use super::kernel::ElementResidual;
use super::layout::{LANES, VACANT};
use super::pattern::Tangent;
use crate::device::{Argument, ComputeDevice, DeviceError};
use crate::element::{Domain, Space};
use crate::material::{Homogenisation, Inverted};
use crate::parallel::Part;

/// Smallest number of element batches that one task of the thread pool processes.
const LEAST: usize = 512;

/// Operator on a mesh of `N`-node elements.
#[derive(Debug)]
pub struct Assembly<const N: usize> {
    pub space: Space<N>,
    /// Homogenisation rule for the moduli of mixtures.
    pub homogenisation: Homogenisation,
    /// The elements and nodes of this rank.
    part: Arc<Part>,
    /// Equations on a device, if a device solves the linear systems.
    device: Option<DeviceEquations>,
}

impl<const N: usize> Assembly<N> {
    /// Creates the operator of a whole mesh on the processor.
    pub fn new(space: Space<N>) -> Self {
        Self {
            space,
            homogenisation: Homogenisation::default(),
            part: Arc::default(),
            device: None,
        }
    }

    /// Sets the homogenisation rule for mixtures.
    pub fn homogenised(self, homogenisation: Homogenisation) -> Self {
        Self { homogenisation, ..self }
    }

    /// Restricts the operator to a part of a mesh.
    pub fn of_part(self, part: Arc<Part>) -> Self {
        Self { part, ..self }
    }

    /// Evaluates the equations on a device if the device supports them.
    pub fn on_device(self, device: Option<ComputeDevice>) -> Self {
        Self { device: device.map(DeviceEquations::new), ..self }
    }

    /// Returns success if all ranks succeeded, else an error on all ranks.
    fn agreed(&self, result: Result<(), Inverted>) -> Result<(), Inverted> {
        if self.part.ranks().any(result.is_err()) { Err(Inverted) } else { Ok(()) }
    }

    fn gather<'a>(&'a self, increment: &'a Increment<'a>) -> Gather<'a, N> {
        Gather::new(&self.space, self.homogenisation, increment)
    }
}

/// Creates the operator of linear elements. This function and [`quadratic`] have no type parameters. The element
/// kernels are therefore compiled with this crate, and not again in each crate that uses these functions.
#[inline(never)]
pub fn linear(assembly: Assembly<4>) -> Arc<dyn Operator> {
    Arc::new(assembly)
}

/// Creates the operator of quadratic elements.
#[inline(never)]
pub fn quadratic(assembly: Assembly<10>) -> Arc<dyn Operator> {
    Arc::new(assembly)
}

impl<const N: usize> Operator for Assembly<N> {
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted> {
        let device = self.device.as_ref();
        if let Some(result) = device
            .and_then(|device| device.residual(&self.space, self.homogenisation, increment, out))
        {
            return result;
        }
        out.clear();
        let gather = self.gather(increment);
        let add = |first: usize, elements: &[ElementResidual<f64, N>]| {
            for (element, nodes) in elements.iter().zip(&self.space.tets[first..]) {
                let [elastic, fracture, viscous] = element.energies;
                out.elastic += elastic;
                out.fracture += fracture;
                out.viscous += viscous;
                for (a, &node) in nodes.iter().enumerate() {
                    let nodal = &mut out.nodal[node as usize];
                    for k in 0..4 {
                        nodal[k] += element.nodal[a][k];
                    }
                    out.drive[node as usize] += element.drive[a];
                }
            }
        };
        let blank = ElementResidual {
            nodal: [[0.0; 4]; N],
            drive: [0.0; N],
            energies: [0.0; 3],
            sound: 1.0,
        };
        let compute = |first: usize, to: &mut [_]| {
            let selection = Selection::Consecutive { first, count: to.len() };
            each_register(&gather, selection, ResidualsOf(to))
        };
        let sound = deterministic_reduce::<N, _>(self.space.tets.len(), blank, compute, add);
        self.agreed(sound)?;
        self.part.halo.complete(&mut out.nodal);
        self.part.halo.complete(bytemuck::cast_slice_mut::<f64, [f64; 1]>(&mut out.drive));
        let mut energies = [out.elastic, out.fracture, out.viscous];
        self.part.ranks().sum(&mut energies);
        [out.elastic, out.fracture, out.viscous] = energies;
        Ok(())
    }

    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted> {
        out.clear();
        let gather = self.gather(increment);
        let coupled = coupling == Coupling::Full;
        let compute = |first: usize, to: &mut [_]| {
            let selection = Selection::Consecutive { first, count: to.len() };
            let work = TangentsOf { rule: &self.space.rule, coupled, out: to };
            each_register(&gather, selection, work)
        };
        let unsymmetric = self.space.rule.extra.unsymmetric;
        let add = |first: usize, elements: &[_]| out.add_elements(first, elements, unsymmetric);
        let blank = [[[[0.0; 4]; 4]; N]; N];
        let sound = deterministic_reduce::<N, _>(self.space.tets.len(), blank, compute, add);
        self.agreed(sound)?;
        // only the rank that owns a node adds the contact at this node
        let contact = increment.context.contact.iter();
        let owned = contact.filter(|(node, _)| self.part.halo.owns(*node));
        owned.for_each(|(node, block)| out.add_node(*node, block));
        increment.context.pairs.iter().for_each(|pair| out.add_pair(pair));
        Ok(())
    }

    fn state(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted> {
        let gather = self.gather(increment);
        let width = gather.element_state_len();
        if width == 0 {
            return Ok(());
        }
        let batches = out.par_chunks_mut(LANES * width).enumerate().with_min_len(LEAST);
        let sound = batches.try_for_each(|(batch, out)| {
            let (first, count) = (batch * LANES, out.len() / width);
            each_register(&gather, Selection::Consecutive { first, count }, StatesOf(out))
        });
        self.agreed(sound)
    }

    fn stresses(&self, increment: &Increment) -> Result<Vec<CellStress>, Inverted> {
        let gather = self.gather(increment);
        let mut out = vec![CellStress::default(); self.space.tets.len()];
        let batches = out.par_chunks_mut(LANES).enumerate().with_min_len(LEAST);
        batches.try_for_each(|(batch, out)| {
            let selection = Selection::Consecutive { first: batch * LANES, count: out.len() };
            each_register(&gather, selection, StressesOf(out))
        })?;
        Ok(out)
    }

    fn configurational(&self, increment: &Increment) -> Result<Vec<[f64; 3]>, Inverted> {
        let gather = self.gather(increment);
        let mut forces = vec![[0.0; 3]; self.space.nodes.len()];
        let add = |first: usize, elements: &[[[f64; 4]; N]]| {
            for (element, nodes) in elements.iter().zip(&self.space.tets[first..]) {
                for (force, &node) in element.iter().zip(nodes) {
                    (0..3).for_each(|k| forces[node as usize][k] += force[k]);
                }
            }
        };
        let compute = |first: usize, to: &mut [_]| {
            let selection = Selection::Consecutive { first, count: to.len() };
            each_register(&gather, selection, ConfigurationalOf(to))
        };
        let blank = [[0.0; 4]; N];
        deterministic_reduce::<N, _>(self.space.tets.len(), blank, compute, add)?;
        Ok(forces)
    }

    fn point_data(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted> {
        let coupled = coupling == Coupling::Full;
        let plain = tets.iter().all(|&tet| tet == VACANT || self.space.is_plain(tet as usize));
        let rule = &self.space.rule;
        let work = PointDataOf { rule, plain, coupled, count: tets.len(), write };
        each_register(&self.gather(increment), Selection::Listed(tets), work)
    }

    fn domain(&self) -> &dyn Domain {
        &self.space
    }

    fn part(&self) -> &Arc<Part> {
        &self.part
    }

    fn on_device(&self) -> Option<&dyn EquationsOnDevice> {
        self.device.as_ref().map(|_| self as &dyn EquationsOnDevice)
    }
}

impl<const N: usize> EquationsOnDevice for Assembly<N> {
    fn linearise(&self, increment: &Increment, data: &[Argument]) -> Option<Result<(), Inverted>> {
        self.device.as_ref()?.linearise(&self.space, self.homogenisation, increment, data)
    }

    fn lost(&self) -> Option<DeviceError> {
        self.device.as_ref()?.lost()
    }
}
