//! Properties of a problem that do not stop a run but make its result inaccurate.

use super::definition::Definition;
use super::setup::Setup;
use crate::element::Order;
use crate::material::{Inelasticity, Material};
use crate::problem::interface::Interface;

/// Property of a problem that makes its results inaccurate without causing an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemWarning {
    /// Volumetric locking: linear elements cannot change their shape at constant volume.
    #[error(
        "forces may be too large: linear tetrahedra lock in nearly incompressible materials, and region '{region}' \
         has a Poisson's ratio of {poisson} (a block with fixed ends, six elements high, is too stiff by 12 % at 0.45, \
         45 % at 0.49 and 240 % at 0.499); use quadratic elements"
    )]
    VolumetricLocking {
        /// Name of the region.
        region: String,
        /// Poisson's ratio of the region at small strain.
        poisson: f64,
    },
    /// Volumetric locking beyond yield: plastic flow keeps the volume, and linear elements cannot change their shape at
    /// constant volume.
    #[error(
        "forces beyond yield may be too large: linear tetrahedra lock in plastic flow, and region '{region}' is plastic \
         (the collapse pressure of a thick sphere with four cells across its wall is 12 % too large); use quadratic \
         elements"
    )]
    PlasticLocking {
        /// Name of the region.
        region: String,
    },
    /// Shear locking: linear elements are too stiff in bending.
    #[error(
        "the bending stiffness may be many times too large: linear tetrahedra lock in slender bodies, and this body \
         ({thickness_mm:.3} mm thick, {size_mm:.3} mm long) has only {across:.1} element edges across its thickness; \
         use quadratic elements, or edges of at most a quarter of the thickness"
    )]
    BendingLocking {
        /// Mean thickness of the body, mm.
        thickness_mm: f64,
        /// Largest extent of the body, mm.
        size_mm: f64,
        /// Number of element edges across the thickness: thickness divided by the mean edge length.
        across: f64,
    },
    /// The mesh consists of several parts that have common nodes or edges but no common face.
    #[error(
        "parts of the body rotate freely about each other: the mesh consists of {parts} parts that are joined only by \
         an edge or a node, as by a hinge (tetrahedron {tet} is in one of these parts); connect the parts by faces, or \
         remove the small parts"
    )]
    Hinges {
        /// The number of parts.
        parts: usize,
        /// The first tetrahedron that is not in the part of tetrahedron 0.
        tet: usize,
    },
    /// An interface band is narrower than the elements.
    #[error(
        "the path of a crack along interface '{interface}' depends on the mesh: the band of width_mm = {stated_mm} is \
         narrower than the elements, and was widened to {width_mm:.3} mm; use width_mm = {width_mm:.3} or more, or a \
         finer mesh"
    )]
    WidenedInterface {
        /// Names of the two regions, joined by a hyphen.
        interface: String,
        /// Width that the interface specifies, mm.
        stated_mm: f64,
        /// Width of the band in this mesh, mm.
        width_mm: f64,
    },
    /// An interface band fills most of its region.
    #[error(
        "the toughness of region '{region}' has hardly any effect: the band of interface '{interface}', {width_mm:.3} mm \
         wide, has {percent:.0} % of the volume of the region; use a width_mm that is small against the grains and the gaps \
         between the grains"
    )]
    WideInterface {
        /// Names of the two regions, joined by a hyphen.
        interface: String,
        /// Name of the region.
        region: String,
        /// Width of the band in this mesh, mm.
        width_mm: f64,
        /// Share of the region's volume in the band, %.
        percent: f64,
    },
    /// The regularisation length is too large for the compressive strength of a material.
    #[error(
        "region '{region}' {} instead of strength.compressive_mpa = {stated_mpa}: the strength surface is exact in tension, \
         and in compression only for a small length_mm (now {length_mm}); use a smaller length_mm with a finer mesh, or \
         calibrate strength.compressive_mpa as a parameter of this length_mm",
        strength_in_words(*realised_mpa)
    )]
    CompressiveStrength {
        /// Name of the region.
        region: String,
        /// Compressive strength that the material specifies, MPa.
        stated_mpa: f64,
        /// Compressive strength of the model, MPa; infinite if the model does not fail in compression.
        realised_mpa: f64,
        /// Regularisation length, mm.
        length_mm: f64,
    },
}

/// Smallest Poisson's ratio that causes a warning about volumetric locking.
const INCOMPRESSIBLE: f64 = 0.45;
/// Smallest ratio of extent to mean thickness for which a body counts as slender.
const SLENDER: f64 = 15.0;
/// A slender body of linear elements is too stiff if its thickness is less than this number of element edges.
///
/// The deflection of a square bar is 3 % too small with ten cubes (3.8 edges) across the thickness, and 17 % too small
/// with four cubes (1.5 edges).
const ACROSS: f64 = 3.5;
/// Largest relative error of a compressive strength without a warning.
const STRENGTH_ERROR: f64 = 0.05;

/// Returns the properties of a problem that make its results inaccurate without causing an error.
pub(crate) fn warnings(setup: &Setup) -> Vec<ProblemWarning> {
    let definition = &setup.definition;
    let mut warnings = Vec::new();
    if definition.order == Order::Linear {
        warnings.extend(volumetric_locking(definition));
        warnings.extend(plastic_locking(definition));
        warnings.extend(bending_locking(definition));
    }
    warnings.extend(hinges(definition));
    warnings.extend(widened_interfaces(setup));
    warnings.extend(wide_interfaces(setup));
    warnings.extend(compressive_strengths(definition));
    warnings
}

/// Warns about the region with the largest Poisson's ratio, if it is nearly incompressible.
fn volumetric_locking(definition: &Definition) -> Option<ProblemWarning> {
    let poisson = |k: usize| definition.materials[k].elasticity.poisson();
    let region =
        (0..definition.materials.len()).max_by(|&a, &b| poisson(a).total_cmp(&poisson(b)))?;
    (poisson(region) >= INCOMPRESSIBLE).then(|| ProblemWarning::VolumetricLocking {
        region: definition.mesh.regions[region].clone(),
        poisson: poisson(region),
    })
}

/// Warns about the first region that is plastic.
fn plastic_locking(definition: &Definition) -> Option<ProblemWarning> {
    let is_plastic =
        |material: &Material| matches!(material.inelasticity, Some(Inelasticity::Plastic(_)));
    let region = definition.materials.iter().position(is_plastic)?;
    Some(ProblemWarning::PlasticLocking { region: definition.mesh.regions[region].clone() })
}

/// Warns about a slender body. The thickness is estimated as twice the volume divided by the surface area; this is exact
/// for a plate, and half the thickness of a square bar.
fn bending_locking(definition: &Definition) -> Option<ProblemWarning> {
    let mesh = &definition.mesh;
    let thickness_mm = 2.0 * mesh.volume() / mesh.boundary_area();
    let size_mm = mesh.largest_extent();
    let across = thickness_mm / mesh.mean_edge();
    (size_mm > SLENDER * thickness_mm && across < ACROSS)
        .then_some(ProblemWarning::BendingLocking { thickness_mm, size_mm, across })
}

/// Warns about interface bands that are narrower than the elements.
fn widened_interfaces(setup: &Setup) -> Vec<ProblemWarning> {
    let interfaces = &setup.definition.interfaces;
    let widened = setup.discretisation.bands.widened(interfaces).into_iter();
    let warning = |(interface, stated_mm, width_mm)| ProblemWarning::WidenedInterface {
        interface,
        stated_mm,
        width_mm,
    };
    widened.map(warning).collect()
}

/// Warns about interface bands that fill most of their region.
fn wide_interfaces(setup: &Setup) -> Vec<ProblemWarning> {
    let definition = &setup.definition;
    let warning = |(interface, region, share, width_mm): (&Interface, usize, f64, f64)| {
        ProblemWarning::WideInterface {
            interface: interface.regions.join("-"),
            region: definition.mesh.regions[region].clone(),
            width_mm,
            percent: 100.0 * share,
        }
    };
    setup.discretisation.bands.large(&definition.interfaces).map(warning).collect()
}

/// Returns a clause about the compressive strength of the model, in MPa.
fn strength_in_words(mpa: f64) -> String {
    if mpa.is_finite() {
        format!("fails in uniaxial compression at {mpa:.1} MPa")
    } else {
        "never fails in uniaxial compression,".into()
    }
}

/// Warns about regions whose compressive strength differs from the specified compressive strength.
fn compressive_strengths(definition: &Definition) -> Vec<ProblemWarning> {
    let Some(field) = &definition.phase_field else { return Vec::new() };
    let spacing_mm = definition.strength_spacing_mm();
    let warning = |(region, material): (&String, &Material)| {
        let strength = material.strength?;
        let context = material.strength_context(field, spacing_mm);
        let (stated_mpa, length_mm) = (strength.compressive_mpa, field.length_mm);
        let realised_mpa = strength.realised_compressive_mpa(&context);
        let error = (realised_mpa - stated_mpa).abs();
        let region = region.clone();
        (error > STRENGTH_ERROR * stated_mpa).then_some(ProblemWarning::CompressiveStrength {
            region,
            stated_mpa,
            realised_mpa,
            length_mm,
        })
    };
    definition.mesh.regions.iter().zip(&definition.materials).filter_map(warning).collect()
}

fn hinges(definition: &Definition) -> Option<ProblemWarning> {
    let part_of = definition.mesh.parts_by_faces();
    let tet = part_of.iter().position(|&part| part != 0)?;
    let mut roots = part_of;
    roots.sort_unstable();
    roots.dedup();
    Some(ProblemWarning::Hinges { parts: roots.len(), tet })
}
