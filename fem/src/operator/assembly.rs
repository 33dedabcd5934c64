//! Residual and tangent of a whole mesh.

use rayon::prelude::*;

use super::batched::Batched;
use super::batches::VACANT;
use super::element::{Block, Element, ElementResidual};
use super::in_order::in_order;
use super::lanes::LANES;
use super::pattern::Tangent;
use super::reduced::ReferenceRule;
use super::residual::{Increment, Residual};
use crate::element::Domain;
use crate::element::{Space, Tetrahedron, mean_values};
use crate::material::Inverted;

/// Elements that are worth a thread.
const LEAST: usize = 4096;

/// Whether the tangent keeps the terms between displacement and damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coupling {
    /// The consistent tangent.
    Full,
    /// Block diagonal: each field with the other held, for alternate minimisation.
    Separate,
}

/// What a solver needs from the equations, whatever the element.
pub(crate) trait Operator: std::fmt::Debug + Send + Sync {
    /// Residual and energies; fails where an element is turned inside out.
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted>;

    /// The consistent tangent.
    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted>;

    /// ψ⁺ at each elastic point, element after element, or the largest value so far.
    fn driving_energies(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted>;

    /// Number of elastic points.
    fn points(&self) -> usize;

    /// The space, for loads and for integrals of the fields.
    fn domain(&self) -> &dyn Domain;

    /// The points of the integration rule.
    fn reference_rule(&self) -> ReferenceRule;

    /// The tangents of elements in their barycentric axes, in the form of the operator's rule:
    /// `write` gets the number of a batch of [`LANES`] elements and its tangents, number by number.
    fn reduced_tangents(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        form: &ReferenceRule,
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted>;

    /// Number of elements.
    fn tets(&self) -> usize;

    /// The nodes of one element: its vertices, then the midpoints of its edges.
    fn nodes_of(&self, tet: usize) -> &[u32];

    /// Volume-weighted mean of a nodal field over the elements whose region is marked.
    fn mean(&self, field: &[f64], regions: &[bool]) -> f64;
}

/// The operator on a space of `N`-node elements.
#[derive(Debug)]
pub(crate) struct Assembly<const N: usize> {
    pub(crate) space: Space<N>,
    /// ∫ N_a dV / V of an element.
    node_share: [f64; N],
}

impl<const N: usize> Assembly<N> {
    pub(crate) fn new<T: Tetrahedron<N>>(space: Space<N>) -> Self {
        Self { space, node_share: mean_values::<N, T>() }
    }
}

impl<const N: usize> Operator for Assembly<N> {
    fn residual(&self, increment: &Increment, out: &mut Residual) -> Result<(), Inverted> {
        out.clear();
        let batched = Batched::new(&self.space, increment);
        let compute = |first: usize, to: &mut [ElementResidual<N>]| match &batched {
            Some(batched) => batched.residuals(first, to),
            None => to.iter_mut().enumerate().try_for_each(|(e, to)| {
                *to = Element::gather(&self.space, first + e, increment).residual()?;
                Ok(())
            }),
        };
        let add = |first: usize, elements: &[ElementResidual<N>]| {
            for (element, nodes) in elements.iter().zip(&self.space.tets[first..]) {
                out.elastic += element.elastic;
                out.fracture += element.fracture;
                out.viscous += element.viscous;
                for (a, &node) in nodes.iter().enumerate() {
                    let nodal = &mut out.nodal[node as usize];
                    for k in 0..4 {
                        nodal[k] += element.nodal[a][k];
                    }
                    out.drive[node as usize] += element.drive[a];
                }
            }
        };
        in_order::<N, _>(self.space.tets.len(), ElementResidual::zero(), compute, add)
    }

    fn tangent(
        &self,
        increment: &Increment,
        coupling: Coupling,
        out: &mut Tangent,
    ) -> Result<(), Inverted> {
        out.clear();
        let coupled = coupling == Coupling::Full;
        let batched = Batched::new(&self.space, increment);
        let compute = |first: usize, to: &mut [[[Block; N]; N]]| match &batched {
            Some(batched) => batched.tangents(first, coupled, to),
            None => to.iter_mut().enumerate().try_for_each(|(e, to)| {
                Element::gather(&self.space, first + e, increment).tangent(coupled, to)
            }),
        };
        let add = |first: usize, elements: &[_]| out.add_elements(first, elements);
        let blank = [[[[0.0; 4]; 4]; N]; N];
        in_order::<N, _>(self.space.tets.len(), blank, compute, add)?;
        increment.span.contact.iter().for_each(|(node, block)| out.add_node(*node, block));
        Ok(())
    }

    fn driving_energies(&self, increment: &Increment, out: &mut [f64]) -> Result<(), Inverted> {
        let points = self.space.rule.points.len();
        out.par_chunks_mut(points).enumerate().with_min_len(LEAST).try_for_each(|(tet, values)| {
            Element::gather(&self.space, tet, increment).driving_energies(values)
        })
    }

    fn points(&self) -> usize {
        self.space.tets.len() * self.space.rule.points.len()
    }

    fn domain(&self) -> &dyn Domain {
        &self.space
    }

    fn reference_rule(&self) -> ReferenceRule {
        ReferenceRule::new(&self.space.rule)
    }

    fn reduced_tangents(
        &self,
        increment: &Increment,
        coupling: Coupling,
        tets: &[u32],
        form: &ReferenceRule,
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted> {
        let coupled = coupling == Coupling::Full;
        let batched = Batched::new(&self.space, increment);
        let mut numbers = vec![[0.0; LANES]; form.width()];
        let mut one = vec![0.0; form.width()];
        for (batch, tets) in tets.chunks(LANES).enumerate() {
            // a vacant place has the first element again
            let tet = |lane: usize| match tets.get(lane) {
                None | Some(&VACANT) => tets[0] as usize,
                Some(&tet) => tet as usize,
            };
            let tets: [usize; LANES] = std::array::from_fn(tet);
            if let Some(batched) = &batched {
                batched.reduced(tets, coupled, form, &mut numbers)?;
            } else {
                for (lane, &tet) in tets.iter().enumerate() {
                    let element = Element::gather(&self.space, tet, increment);
                    element.reduced_tangent(form, coupled, &mut one)?;
                    numbers.iter_mut().zip(&one).for_each(|(lanes, &x)| lanes[lane] = x);
                }
            }
            write(batch, &numbers);
        }
        Ok(())
    }

    fn tets(&self) -> usize {
        self.space.tets.len()
    }

    fn nodes_of(&self, tet: usize) -> &[u32] {
        &self.space.tets[tet]
    }

    fn mean(&self, field: &[f64], regions: &[bool]) -> f64 {
        let (mut integral, mut volume) = (0.0, 0.0);
        for (tet, nodes) in self.space.tets.iter().enumerate() {
            if regions[usize::from(self.space.region[tet])] {
                let mean: f64 = nodes
                    .iter()
                    .zip(self.node_share)
                    .map(|(&n, share)| share * field[n as usize])
                    .sum();
                integral += self.space.volume[tet] * mean;
                volume += self.space.volume[tet];
            }
        }
        if volume > 0.0 { integral / volume } else { 0.0 }
    }
}
