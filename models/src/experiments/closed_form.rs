//! Plausibility of measured curves for the materials of the case: comparison with the closed form of a homogeneous
//! cylinder, before any simulation.

use fem::CrackDensity;

use super::mesh_scale::MeshSize;
use super::specimen_quantities::{SpecimenNames, compared};
use crate::case::{BoundsCase, MaterialCase, Parameter, Property};
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable};
use crate::pipeline::gate::{Range, unit_rank};
use crate::pipeline::inputs::Inputs;
use crate::prior::PriorBounds;
use crate::qoi::{HomogeneousCylinder, Qoi};
use crate::simulation::setup::Setup;

/// Largest plausible ratio of a quantity of the composite to the closed form of its softest phase, in either direction.
/// The factor covers stiff grains, friction and other forms of damage, but not a wrong unit.
const GENEROUS: f64 = 30.0;

/// Returns the first specimen whose curve is implausible for the materials, with an error that names the curve, the
/// quantity and the likely cause. Each quantity is compared with its range over the prior box in the closed form of a
/// homogeneous cylinder of the softest phase.
pub(crate) fn far_from_closed_form(
    inputs: &Inputs<'_>,
    table: &SpecimenTable,
    mesh: MeshSize,
    names: &SpecimenNames<'_>,
) -> Option<(String, InputError)> {
    let (setup, qoi) = (inputs.setup(), inputs.qoi());
    let bounds = inputs.whole_prior().map(|prior| prior.bounds()).unwrap_or_default();
    let form = ClosedForm::of(&setup, &bounds)?;
    let mut quantities = qoi.quantities.clone();
    quantities.sort_by_key(|quantity| unit_rank(quantity.unit()));
    let distance = |specimen: &Specimen| {
        let values = compared(specimen, Some(mesh), qoi, &quantities).values;
        quantities.iter().zip(values).filter(|(_, value)| !value.is_nan()).find_map(
            |(quantity, value)| {
                let [low, high] = form.range(&**quantity, mesh.height_mm, mesh.radius_mm)?;
                let name = quantity.column().into_owned();
                let range = Range { name, value, reached: [low / GENEROUS, high * GENEROUS] };
                (!range.is_inside()).then_some(range)
            },
        )
    };
    let far = |specimen| Some((specimen, distance(specimen)?));
    let mut all = table.specimens.iter().filter_map(far);
    let (specimen, range) = all.next()?;
    let others = match all.count() {
        0 => String::new(),
        1 => ", and so is another specimen".to_owned(),
        others => format!(", and so are {others} other specimens"),
    };
    let [low, high] = range.reached;
    let problem = format!(
        "is far from the range of a cylinder of this material, {low:.4} to {high:.4}{others}"
    );
    let cause = range.cause().unwrap_or("Check the units of curve, sizes and [material].");
    let help = format!("{cause} With --accept-out-of-range the program continues.");
    let (value, curve) = (format!("{:.6}", range.value), (names.curve)(&specimen.id));
    Some((specimen.id.clone(), InputError::new(&curve, range.name, value, problem, help)))
}

/// Bounds of the constants of the softest phase, for closed forms of a homogeneous cylinder between
/// sliding platens.
#[derive(Clone, Debug)]
pub(crate) struct ClosedForm {
    /// Bounds of Young's modulus in MPa.
    young: [f64; 2],
    damage: Option<Damage>,
}

#[derive(Clone, Debug)]
struct Damage {
    /// Crack density function, and crack width in mm.
    field: (CrackDensity, f64),
    /// Bounds of the toughness in N/mm.
    toughness: [f64; 2],
    /// Bounds of the viscosity in MPa s.
    viscosity: [f64; 2],
    /// Velocity of the platen in mm/s.
    velocity: f64,
}

impl ClosedForm {
    /// Creates the closed form of the softest phase of a case, with the bounds of the calibrated parameters; `None` if
    /// the test has no platens.
    pub(crate) fn of(setup: &Setup<'_>, bounds: &BoundsCase) -> Option<Self> {
        if setup.conditions.is_some() {
            // the body is no cylinder between platens
            return None;
        }
        let speed = setup.test.first_speed_mm_per_s()?;
        let phase = |(region, material): (&String, &MaterialCase)| {
            let young = material.in_fem().ok()?.elasticity.young_mpa();
            let bounds = |property: Property, case_value: f64| {
                let parameter = format!("{region}.{}", property.key()).parse::<Parameter>().ok();
                let bounds = parameter.and_then(|parameter| bounds.get(&parameter));
                // the validation of the case reports reversed bounds
                bounds.map_or([case_value; 2], |&PriorBounds([a, b])| [a.min(b), a.max(b)])
            };
            let damage = setup.phase_field.zip(material.toughness_n_per_mm).map(
                |(field, toughness_of_phase)| Damage {
                    field: (field.model, field.length_mm),
                    toughness: bounds(Property::Toughness, toughness_of_phase),
                    viscosity: bounds(Property::Viscosity, material.viscosity_mpa_s),
                    velocity: speed,
                },
            );
            Some(Self { young: bounds(Property::Young, young), damage })
        };
        let phases = setup.material.iter().filter_map(phase);
        phases.min_by(|a, b| a.young[0].total_cmp(&b.young[0]))
    }

    /// Range of the quantity over the corners of the prior box; `None` for a quantity without a closed form.
    pub(crate) fn range(
        &self,
        quantity: &dyn Qoi,
        height_mm: f64,
        radius_mm: f64,
    ) -> Option<[f64; 2]> {
        let area_mm2 = std::f64::consts::PI * radius_mm * radius_mm;
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for young_mpa in self.young {
            for end in 0..2 {
                let peak = self.damage.as_ref().map(|d| d.peak(young_mpa, end, height_mm));
                let cylinder = HomogeneousCylinder { height_mm, area_mm2, young_mpa, peak };
                let value = quantity.of_cylinder(&cylinder)?;
                (low, high) = (low.min(value), high.max(value));
            }
        }
        Some([low, high])
    }
}

impl Damage {
    /// Strain ε and stress σ (MPa) at the peak, for Young's modulus E = `young` (MPa). `end` selects the lower (0) or
    /// upper (1) bounds of the toughness Gc and the viscosity ξ. The result is the larger of the values for viscous and
    /// for rate-independent damage. l₀ is the crack width and ε̇ the strain rate.
    ///
    /// Viscous: ε = (ε̇ ξ/(2E))^(1/3), σ = E ε e^(−1/3).
    /// Rate independent, AT2: ε = √(Gc/(3 l₀ E)), σ = (9/16) E ε.
    /// Rate independent, AT1: ε = √(3 Gc/(8 l₀ E)), σ = E ε.
    fn peak(&self, young: f64, end: usize, height_mm: f64) -> [f64; 2] {
        let (toughness, viscosity) = (self.toughness[end], self.viscosity[end]);
        let rate = self.velocity / height_mm;
        let viscous = (rate * viscosity / (2.0 * young)).cbrt();
        let (model, length) = self.field;
        let (brittle, part) = match model {
            CrackDensity::At2 => ((toughness / (3.0 * length * young)).sqrt(), 9.0 / 16.0),
            CrackDensity::At1 => ((3.0 * toughness / (8.0 * length * young)).sqrt(), 1.0),
        };
        let stress = young * (viscous * (-1.0_f64 / 3.0).exp()).max(brittle * part);
        [viscous.max(brittle), stress]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qoi::{DisplacementAtPeak, PeakForce, Slope};

    /// Exact solution of a homogeneous cylinder: the matrix of the paper, η = 0.01, peaks at 122.855 N and 0.13559 mm in 1 s, and
    /// without viscosity at ε = 7.1067e-3 and 1.09932 MPa.
    #[test]
    fn the_closed_form_is_near_the_exact_peaks_of_a_homogeneous_cylinder() {
        let at_viscosity = |viscosity: f64| ClosedForm {
            young: [275.0; 2],
            damage: Some(Damage {
                field: (CrackDensity::At2, 0.06),
                toughness: [0.0025; 2],
                viscosity: [viscosity; 2],
                velocity: 0.22,
            }),
        };
        let near = |computed: Option<[f64; 2]>, exact: f64, within: f64| {
            let [low, high] = computed.unwrap();
            assert!(low == high && (low / exact - 1.0).abs() < within, "{low}, not {exact}");
        };
        near(at_viscosity(0.3).range(&PeakForce, 4.4, 2.5), 122.855, 0.06);
        near(at_viscosity(0.3).range(&DisplacementAtPeak, 4.4, 2.5), 0.135_59, 0.06);
        let area = std::f64::consts::PI * 6.25;
        near(at_viscosity(0.0).range(&PeakForce, 4.4, 2.5), 1.099_32 * area, 1e-4);
        near(at_viscosity(0.0).range(&DisplacementAtPeak, 4.4, 2.5), 7.1067e-3 * 4.4, 1e-4);
        near(at_viscosity(0.0).range(&Slope, 4.4, 2.5), 275.0 * area / 4.4, 1e-12);
    }
}
