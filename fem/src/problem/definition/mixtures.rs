//! Checks of the materials of a mesh with mixtures of matrix and grain.

use fem_mesh::TetMesh;

use crate::error::{FemError, Unsupported};
use crate::material::{Elasticity, Inelasticity, Material, PhaseField, YieldCriterion};

/// Checks that there are at least two phases, and that their laws are defined in mixtures.
pub(super) fn validate_mixtures(
    mesh: &TetMesh,
    materials: &[Material],
    field: Option<&PhaseField>,
) -> Result<(), FemError> {
    if materials.len() < 2 {
        let entity = "mesh with mixtures of matrix and grain";
        return Err(FemError::unsupported(entity, Unsupported::MixtureOfOne));
    }
    let mixtures = mesh.mixture.iter().flatten().filter(|mixture| mixture.fraction > 0.0);
    let mut is_grain = vec![false; materials.len()];
    for mixture in mixtures {
        if let Some(is_grain) = is_grain.get_mut(usize::from(mixture.region)) {
            *is_grain = true;
        }
    }
    for ((region, material), is_grain) in mesh.regions.iter().zip(materials).zip(is_grain) {
        if let Some(reason) = refusal(material, is_grain, field) {
            return Err(FemError::unsupported(format!("material.{region}"), reason));
        }
    }
    Ok(())
}

/// Returns the reason why a material is not defined in mixtures; `None` if the material is defined there.
fn refusal(material: &Material, is_grain: bool, field: Option<&PhaseField>) -> Option<Unsupported> {
    if !matches!(material.elasticity, Elasticity::Hencky { .. }) {
        return Some(Unsupported::MixtureLaw { law: material.elasticity.name() });
    }
    if material.strength.is_some() {
        return Some(Unsupported::MixtureStrength);
    }
    if material.split.is_some() {
        return Some(Unsupported::UserSplitOfMixture);
    }
    let inelastic = |law, key, reason| Some(Unsupported::MixtureInelastic { law, key, reason });
    let (law, key) = match material.inelasticity.as_ref()? {
        Inelasticity::Viscoelastic(_) => ("a Prony series", "viscoelastic"),
        Inelasticity::Plastic(law) => match law.criterion {
            YieldCriterion::J2 => ("J2 plasticity", "plastic"),
            YieldCriterion::DruckerPrager { .. } => ("Drucker-Prager plasticity", "plastic"),
        },
    };
    let strain = "the inelastic strain of one phase does not follow from the strain of the mixture";
    let Some(Inelasticity::Viscoelastic(series)) = &material.inelasticity else {
        return inelastic(law, key, strain);
    };
    if is_grain {
        return inelastic(law, key, "the grain of a mixture must be elastic");
    }
    if !series.bulk.is_empty() {
        let reason = "the bulk modulus of a mixture does not relax";
        return inelastic("a Prony series of the bulk modulus", "viscoelastic.bulk", reason);
    }
    let keeps_viscous_stress = field.is_some_and(|field| !field.degrade.viscous);
    if keeps_viscous_stress && material.fracture.is_some() {
        let reason = "phase_field.degrade lacks \"viscous\", but damage degrades the whole stress of the matrix";
        return inelastic(law, key, reason);
    }
    None
}
