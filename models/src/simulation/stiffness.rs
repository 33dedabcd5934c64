//! Stiffness ratio of a microstructure: one number per mesh, computed with elastic solves.

use std::collections::BTreeMap;

use fem::{CompressionTest, FemError, Schedule, TetMesh, Unsupported};

use super::setup::{Setup, height_mm};
use crate::case::MaterialCase;

/// Name of the column in `runs.csv` and `experiments.csv`, and of the surrogate's input.
pub(crate) const STIFFNESS_RATIO: &str = "stiffness_ratio";

/// Compression at which the stiffness is computed, as a fraction of the height.
const SMALL: f64 = 1e-4;

/// Returns the stiffness of a mesh between sliding platens with the undamaged materials of the case, divided by the
/// stiffness of the same mesh with the material `matrix` everywhere. The size of the specimen and most of the error
/// of the mesh cancel in the ratio.
///
/// # Errors
/// Fails if the materials do not fit the mesh or if a solve fails.
pub(crate) fn stiffness_ratio(setup: &Setup<'_>, mesh: TetMesh) -> Result<f64, FemError> {
    let names: Vec<&str> = mesh.regions.iter().map(String::as_str).collect();
    let grainless: Vec<&str> = names.iter().map(|_| "matrix").collect();
    let with_grains = stiffness(setup, mesh.clone(), &names)?;
    Ok(with_grains / stiffness(setup, mesh, &grainless)?)
}

/// Force / displacement (N/mm) of a mesh. `materials` are the names of materials of the case for the regions of
/// the mesh, in the order of the regions.
fn stiffness(setup: &Setup<'_>, mesh: TetMesh, materials: &[&str]) -> Result<f64, FemError> {
    let displacement_mm = SMALL * height_mm(&mesh);
    let problem = CompressionTest::new(displacement_mm, Schedule::fixed(1.0, 1))
        .builder(mesh)?
        .order(setup.order)
        .homogenisation(setup.homogenisation)
        .materials(elastic(setup.material, materials)?)
        .options(setup.solver)
        .build()?;
    let outcome = problem.run(&mut ());
    match (outcome.curve.last(), outcome.end) {
        (_, fem::End::Failed(error)) => Err(error),
        (Some(point), _) => Ok(point.force_n / point.displacement_mm),
        (None, _) => Ok(f64::NAN),
    }
}

/// Returns the materials with the given names, without damage and viscosity.
fn elastic(
    materials: &BTreeMap<String, MaterialCase>,
    names: &[&str],
) -> Result<Vec<fem::Material>, FemError> {
    let material = |name: &&str| {
        let material = materials.get(*name).ok_or_else(|| FemError::Unsupported {
            entity: format!("the region {name}"),
            reason: Unsupported::ByCaller {
                message: format!("has no [material.{name}] in the case"),
                help: "its stiffness ratio is over that of the material `matrix`",
            },
        })?;
        let elastic = MaterialCase {
            toughness_n_per_mm: None,
            viscosity_mpa_s: 0.0,
            viscoelastic: None,
            plastic: None,
            strength: None,
            ..material.clone()
        };
        elastic.in_fem()
    };
    names.iter().map(material).collect()
}

#[cfg(test)]
mod tests {
    use fem::{CylinderLattice, Homogenisation, Mixture, Order, SolverOptions};

    use super::*;
    use crate::case::CaseFile;

    /// For a body of a uniform Reuss mixture, the compliance is the volume average of the compliances of the phases.
    #[test]
    fn a_uniform_mixture_has_the_mean_of_the_compliances() {
        let mut file = CaseFile::default_case();
        for (region, young_mpa) in [("matrix", 275.0), ("grain", 22_000.0)] {
            let material = file.case.material.get_mut(region).unwrap();
            (material.young_mpa, material.poisson) = (Some(young_mpa), Some(0.2));
        }
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.0, spacing_mm: 1.0 };
        let mut mesh = lattice.build().unwrap();
        mesh.regions = vec!["matrix".into(), "grain".into()];
        let part = Mixture { fraction: 0.25, normal: [0.0, 0.0, 1.0], region: 1 };
        mesh.mixture = Some(vec![part; mesh.tets.len()]);
        let solver = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
        let homogenisation = Homogenisation::Reuss;
        for order in [Order::Linear, Order::Quadratic] {
            let setup = Setup { order, homogenisation, solver, ..Setup::from(&file) };
            let computed = stiffness_ratio(&setup, mesh.clone()).unwrap();
            let expected = 1.0 / (0.75 + 0.25 * 275.0 / 22_000.0);
            assert!((computed / expected - 1.0).abs() < 1e-6, "{computed} {expected}");
        }
    }
}
