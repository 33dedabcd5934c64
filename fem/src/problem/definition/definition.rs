//! Input data of a problem.

use std::sync::Arc;

use super::fingerprint::Fingerprint;
use crate::boundary::Conditions;
use crate::device::ComputeDevice;
use crate::element::Order;
use crate::error::{FemError, Unsupported};
use crate::material::{Elasticity, Homogenisation, Material, PhaseField};
use crate::parallel::Ranks;
use crate::problem::control::{Schedule, check_crack_energy};
use crate::problem::interface::Interface;
use crate::problem::parameter::MaterialParameter;
use crate::solve::{LinearScheme, SolverOptions};
use fem_mesh::TetMesh;

/// Input data of a problem. Large data is reference-counted, so that similar problems share it.
#[derive(Clone, Debug)]
pub(crate) struct Definition {
    pub(crate) mesh: Arc<TetMesh>,
    pub(crate) order: Order,
    pub(crate) materials: Vec<Material>,
    pub(crate) homogenisation: Homogenisation,
    pub(crate) phase_field: Option<PhaseField>,
    /// Interfaces between regions. Each interface has its own toughness.
    pub(crate) interfaces: Arc<[Interface]>,
    pub(crate) conditions: Arc<Conditions>,
    pub(crate) schedule: Schedule,
    pub(crate) options: SolverOptions,
    /// Device for the linear systems, if any. The device is not part of the fingerprint, so that a run can resume on
    /// other hardware.
    pub(crate) device: Option<ComputeDevice>,
    /// Ranks that share the work. The ranks are not part of the fingerprint.
    pub(crate) ranks: Ranks,
    /// Parameters of the sensitivities.
    pub(crate) parameters: Arc<[MaterialParameter]>,
}

impl Definition {
    /// Checks all input data except the mesh and the surfaces that the conditions name.
    pub(crate) fn validate(&self) -> Result<(), FemError> {
        let (mesh, field) = (&self.mesh, self.phase_field.as_ref());
        if self.materials.len() != mesh.regions.len() {
            return Err(FemError::MaterialCount {
                materials: self.materials.len(),
                regions: mesh.regions.len(),
                names: mesh.regions.join(", "),
            });
        }
        for (region, material) in mesh.regions.iter().zip(&self.materials) {
            material.validate(region, field)?;
        }
        if mesh.mixture.is_some() {
            self.validate_mixtures()?;
        }
        field.map_or(Ok(()), PhaseField::validate)?;
        self.interfaces.iter().try_for_each(Interface::validate)?;
        self.validate_strengths_at_interfaces()?;
        self.options.validate()?;
        if self.device.is_some() && self.options.linear == LinearScheme::Direct {
            return Err(FemError::unsupported("device", Unsupported::FactorOnDevice));
        }
        if self.device.is_some() && self.conditions.has_follower() {
            return Err(FemError::unsupported("device", Unsupported::FollowerOnDevice));
        }
        if self.ranks.size() > 1 {
            self.validate_ranks()?;
        }
        self.schedule.validate()?;
        check_crack_energy(&self.schedule, &self.materials, field, &self.conditions)?;
        if self.schedule.force_program.is_some() != self.conditions.is_driven() {
            return Err(FemError::unsupported("load program", Unsupported::ForceWithoutPlaten));
        }
        if self.parameters.is_empty() { Ok(()) } else { self.validate_parameters() }
    }

    /// Rejects options that are not supported with several ranks.
    fn validate_ranks(&self) -> Result<(), FemError> {
        let ranks = self.ranks.size();
        let refused = |reason| Err(FemError::unsupported(format!("{ranks} ranks"), reason));
        if self.options.linear == LinearScheme::Direct {
            return refused(Unsupported::FactorOnRanks);
        }
        if self.device.is_some() {
            return refused(Unsupported::DeviceOnRanks);
        }
        if self.conditions.has_follower() {
            return refused(Unsupported::FollowerOnRanks);
        }
        if !self.parameters.is_empty() {
            return refused(Unsupported::SensitivitiesOnRanks);
        }
        if ranks > self.mesh.tets.len() {
            return refused(Unsupported::FewElements);
        }
        Ok(())
    }

    /// Checks that the derivatives with respect to the requested parameters exist and are implemented.
    fn validate_parameters(&self) -> Result<(), FemError> {
        let refused = |reason| Err(FemError::unsupported("sensitivities", reason));
        if self.schedule.steps.controls_crack_energy() {
            return refused(Unsupported::SensitivitiesOfArcLength);
        }
        if self.conditions.has_follower() {
            return refused(Unsupported::SensitivitiesOfFollower);
        }
        if self.conditions.has_friction() {
            return refused(Unsupported::SensitivitiesOfFriction);
        }
        if self.conditions.is_driven() && self.conditions.has_platens() {
            return refused(Unsupported::SensitivitiesOfForceByContact);
        }
        if !self.conditions.prescribes_measured_displacement() {
            return refused(Unsupported::SensitivitiesOfMeasuredDisplacement);
        }
        for (k, parameter) in self.parameters.iter().enumerate() {
            let field = self.phase_field.as_ref();
            parameter.validate(&self.mesh.regions, &self.materials, &self.interfaces, field)?;
            if self.parameters[..k].iter().any(|other| other.name == parameter.name) {
                return refused(Unsupported::NameTwice(parameter.name.clone()));
            }
        }
        Ok(())
    }

    /// Rejects interfaces of regions with a strength.
    fn validate_strengths_at_interfaces(&self) -> Result<(), FemError> {
        let regions = self.mesh.regions.iter().zip(&self.materials);
        let strong: Vec<_> = regions.filter(|(_, material)| material.strength.is_some()).collect();
        for interface in self.interfaces.iter() {
            if strong.iter().any(|(name, _)| interface.regions.contains(name)) {
                let reason = Unsupported::InterfaceOfStrength;
                return Err(FemError::unsupported(interface.entity(), reason));
            }
        }
        Ok(())
    }

    /// Checks that there are at least two phases, and that their law can be homogenised.
    fn validate_mixtures(&self) -> Result<(), FemError> {
        let refused =
            |reason| Err(FemError::unsupported("mesh with mixtures of matrix and grain", reason));
        if self.materials.len() < 2 {
            return refused(Unsupported::MixtureOfOne);
        }
        let hencky = |m: &Material| matches!(m.elasticity, Elasticity::Hencky { .. });
        if !self.materials.iter().all(hencky) {
            return refused(Unsupported::MixtureLaw);
        }
        if self.materials.iter().any(|m| m.strength.is_some()) {
            return refused(Unsupported::MixtureStrength);
        }
        if !self.materials.iter().all(Material::is_mixable) || self.has_inelastic_grain() {
            return refused(Unsupported::MixtureInelastic);
        }
        let kept = self.phase_field.is_some_and(|field| !field.degrade.viscous);
        let viscous = |m: &Material| m.inelasticity.is_some() && m.fracture.is_some();
        if kept && self.materials.iter().any(viscous) {
            return refused(Unsupported::MixtureInelastic);
        }
        if self.materials.iter().any(|m| m.split.is_some()) {
            return refused(Unsupported::UserSplitOfMixture);
        }
        Ok(())
    }

    /// Returns whether the second phase of a mixture is viscoelastic.
    fn has_inelastic_grain(&self) -> bool {
        let mixtures = self.mesh.mixture.iter().flatten();
        let mut grains = mixtures.filter(|m| m.fraction > 0.0).map(|m| usize::from(m.region));
        grains.any(|region| self.materials.get(region).is_some_and(|m| m.inelasticity.is_some()))
    }

    /// Returns the mean distance of neighbouring nodes on an edge, mm, if a material needs it: for its strength. Otherwise
    /// zero.
    pub(crate) fn strength_spacing_mm(&self) -> f64 {
        if self.materials.iter().all(|material| material.strength.is_none()) {
            return 0.0;
        }
        self.order.node_spacing() * self.mesh.mean_edge()
    }

    /// Marks the regions that can be damaged.
    pub(crate) fn damaged(&self) -> Vec<bool> {
        let breaks = |m: &Material| self.phase_field.is_some() && m.fracture.is_some();
        self.materials.iter().map(breaks).collect()
    }

    /// Returns a hash that identifies the problem. Functions contribute only their description.
    pub(crate) fn fingerprint(&self) -> u64 {
        let Self { mesh, order, materials, homogenisation, phase_field, .. } = self;
        let Self { conditions, schedule, options, parameters, .. } = self;
        let mut words = format!(
            "{order:?} {materials:?} {homogenisation:?} {phase_field:?} {conditions:?} {schedule:?} \
             {options:?} {parameters:?}"
        );
        for interface in self.interfaces.iter() {
            words.push_str(&format!(" {interface:?}"));
        }
        let mut print = Fingerprint::new().add(words.as_bytes());
        for x in mesh.nodes.as_flattened() {
            print = print.add(&x.to_le_bytes());
        }
        for node in mesh.tets.as_flattened() {
            print = print.add(&node.to_le_bytes());
        }
        for region in &mesh.region_of {
            print = print.add(&region.to_le_bytes());
        }
        for ([a, b], point) in &mesh.edge_points {
            print = print.add(&a.to_le_bytes()).add(&b.to_le_bytes());
            print = point.iter().fold(print, |print, x| print.add(&x.to_le_bytes()));
        }
        for mixture in mesh.mixture.iter().flatten() {
            print = print.add(&mixture.fraction.to_le_bytes());
            if mixture.region != fem_mesh::Mixture::default().region {
                print = print.add(&mixture.region.to_le_bytes());
            }
        }
        print.value()
    }
}
