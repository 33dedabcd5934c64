//! Measured displacement and force, and their linearisation.

use std::collections::BTreeMap;

use super::compiled::Boundary;
use super::conditions::Travel;
use super::reaction::{self, Support};
use crate::fields::Fields;

impl Boundary {
    /// Returns the displacement (mm) and the force (N) of the measured surface. The force is computed from the
    /// reactions.
    pub(crate) fn measure(
        &self,
        time_s: f64,
        fields: &Fields,
        reactions: &BTreeMap<String, [f64; 3]>,
    ) -> [f64; 2] {
        let Some(probe) = &self.probe else { return [0.0; 2] };
        let along = |v: [f64; 3]| (0..3).map(|k| v[k] * probe.direction[k]).sum::<f64>();
        let travel = match &probe.travel {
            Travel::Gauge(_) => {
                let moved =
                    |&(n, weight): &(u32, f64)| weight * along(fields.displacement[n as usize]);
                let mut sum = [self.gauge.iter().map(moved).sum()];
                self.part.ranks().sum(&mut sum);
                sum[0]
            }
            Travel::Known(f) => f.at([0.0; 3], time_s),
            Travel::Platen => fields.platen_mm,
            Travel::Mean => {
                let nodes = &self.surfaces[&probe.surface];
                let moved = |&n: &u32| along(fields.displacement[n as usize]);
                let sum: f64 = nodes.iter().map(moved).sum();
                let mut sums = [sum, nodes.len() as f64];
                self.part.ranks().sum(&mut sums);
                sums[0] / sums[1]
            }
        };
        [travel, along(reactions[&probe.surface])]
    }

    /// Returns the vector c by which the residual R at all `nodes` nodes is multiplied to obtain the measured force
    /// c·R. Returns `None` if no force is measured, if the measured surface has no prescribed values, or if there
    /// is contact, because contact forces are not part of c·R.
    pub(crate) fn measured(&self, nodes: usize) -> Option<Vec<[f64; 4]>> {
        let probe = self.probe.as_ref().filter(|_| self.contacts.is_empty())?;
        let mut out = vec![[0.0; 4]; nodes];
        for &Support { node, component, share } in self.supports.get(&probe.surface)? {
            out[node as usize][component] = share * probe.direction[component];
        }
        Some(out)
    }

    /// Returns the derivative of the measured force with respect to a parameter. `residual` contains the derivatives of
    /// the residual, and `contact` the derivatives of the contact forces of all platens, one platen after the other.
    pub(crate) fn force_rate(&self, residual: &[[f64; 4]], contact: &[(u32, [f64; 3])]) -> f64 {
        let Some(probe) = &self.probe else { return 0.0 };
        let along = |v: &[f64]| -> f64 { (0..3).map(|k| v[k] * probe.direction[k]).sum() };
        let supports = self.supports.get(&probe.surface);
        let mut rate = supports.map_or(0.0, |list| along(&reaction::sum(list, residual)));
        let mut first = 0;
        for platen in &self.contacts {
            let forces = contact.iter().skip(first).take(platen.count());
            if platen.surface == probe.surface {
                rate += forces.map(|(_, force)| along(force)).sum::<f64>();
            }
            first += platen.count();
        }
        rate
    }
}
