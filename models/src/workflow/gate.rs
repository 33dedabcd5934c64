//! Whether specimens can come from what is simulated: compared with the closed form before the ensemble,
//! and with the ensemble before the calibration.

use fem::CrackDensity;
use surrogate::Dataset;

use super::WorkflowError;
use super::files::SPECIMENS;
use super::simulator::Setup;
use super::task::Task;
use crate::case::{MaterialCase, MaterialParameter, PriorBounds, PriorCase, Property};
use crate::error::InputError;
use crate::experiment::SpecimenTable;
use crate::fracture::column_means;
use crate::qoi::{Qois, Quantity};

/// How far a composite may be from its softest phase by itself: stiff grains, friction and damage of
/// other forms are within it, a slip of a unit is not.
const GENEROUS: f64 = 30.0;

/// Stops a calibration against specimens whose mean quantities no simulation of the ensemble reaches.
///
/// Writes `range.csv`. Where the person goes on nevertheless, what to say of it is returned, one line a
/// quantity; nothing where all lie inside.
///
/// # Errors
/// Names the specimens' table, the mean, the range and the likely cause.
pub(super) fn check_range(
    task: &Task<'_>,
    specimens: &[Vec<f64>],
) -> Result<Vec<String>, WorkflowError> {
    let data = Dataset::read_csv(task.inputs.file("runs.csv")?)?;
    let means = column_means(specimens);
    let reached = |m: usize| {
        let values = data.rows().map(|(_, qois)| qois[m]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], q| [a.min(q), b.max(q)])
    };
    let ranges: Vec<Range> = data
        .outputs()
        .iter()
        .zip(means)
        .enumerate()
        .map(|(m, (name, mean))| Range { name: name.clone(), value: mean, reached: reached(m) })
        .collect();
    let rows = ranges.iter().map(|range| {
        let [low, high] = range.reached.map(|x| x.to_string());
        [range.name.clone(), range.value.to_string(), low, high, range.is_inside().to_string()]
    });
    task.write_csv("range.csv", ["qoi", "experiment_mean", "low", "high", "inside"], rows)?;
    let mut outside: Vec<&Range> = ranges.iter().filter(|range| !range.is_inside()).collect();
    outside.sort_by_key(|range| Quantity::of_column(&range.name).map(telling));
    if let ([first, rest @ ..], false) = (&outside[..], task.accept_out_of_range) {
        let others: Vec<String> = rest.iter().map(|range| format!("; {}", range.words())).collect();
        let cause = outside.iter().find_map(|range| range.cause()).unwrap_or(
            "If units are right, widen the box of [prior], or look for what the model leaves out.",
        );
        let [low, high] = first.reached;
        return Err(InputError::new(
            &task.path(SPECIMENS),
            format!("mean of {} over {} specimens", first.name, specimens.len()),
            format!("{:.4}", first.value),
            format!(
                "lies outside what the ensemble reaches, {low:.4} to {high:.4}{}",
                others.concat()
            ),
            format!(
                "{cause} --accept-out-of-range goes on, and then nothing is called identified."
            ),
        )
        .into());
    }
    Ok(outside.iter().map(|range| format!("Data out of range: {}", range.warning())).collect())
}

/// Whether the means of specimens lie within what runs reach.
pub(super) fn is_in_range(runs: &Dataset, means: &[f64]) -> bool {
    means.iter().enumerate().all(|(m, mean)| {
        let values = || runs.rows().map(|(_, qois)| qois[m]);
        values().any(|q| q <= *mean) && values().any(|q| q >= *mean)
    })
}

/// Refuses curves that no specimen of these materials can have, before hundreds of simulations: each is
/// compared with the closed form of a homogeneous cylinder of the softest phase over the prior's box.
///
/// # Errors
/// Names the curve, the quantity and the likely cause.
pub(super) fn check_closed_form(
    task: &Task<'_>,
    table: &SpecimenTable,
    [height_mm, radius_mm]: [f64; 2],
) -> Result<(), WorkflowError> {
    let inputs = &task.inputs;
    if inputs.are_specimens_virtual()? {
        return Ok(());
    }
    let (setup, qoi) = (inputs.setup(), inputs.qoi());
    let Some(form) = ClosedForm::of(&setup, inputs.whole_prior().as_ref()) else { return Ok(()) };
    let mut quantities = qoi.quantities.clone();
    quantities.sort_by_key(|&quantity| telling(quantity));
    for specimen in &table.specimens {
        let curve = specimen.curve.scale_displacement(height_mm / specimen.height_mm);
        let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
        // curves without quantities are refused elsewhere
        let Ok(values) = Qois::values_of(&curve, fraction, &quantities) else { continue };
        for (&quantity, value) in quantities.iter().zip(values) {
            let Some([low, high]) = form.range(quantity, height_mm, radius_mm) else { continue };
            let range = Range {
                name: quantity.column().into_owned(),
                value,
                reached: [low / GENEROUS, high * GENEROUS],
            };
            if range.is_inside() {
                continue;
            }
            let cause = range.cause().unwrap_or("Check the units of curve, sizes and [material].");
            if task.accept_out_of_range {
                task.warn(&format!("{}: {}. {cause}", specimen.id, range.words()));
                continue;
            }
            let curve = task.path("experiments/curves").join(format!("{}.csv", specimen.id));
            let problem = format!(
                "is far from what a cylinder of this material can have, {low:.4} to {high:.4}"
            );
            let help = format!("{cause} --accept-out-of-range goes on nevertheless.");
            let value = format!("{:.6}", range.value);
            return Err(InputError::new(&curve, range.name, value, problem, help).into());
        }
    }
    Ok(())
}

/// How well a quantity tells what is wrong, best first: a slope mixes two units.
fn telling(quantity: Quantity) -> usize {
    match quantity {
        Quantity::PeakForce => 0,
        Quantity::DisplacementAtPeak => 1,
        Quantity::ForceAt(_) => 2,
        Quantity::EnergyToPeak => 3,
        Quantity::Slope => 4,
        Quantity::PostPeakSlope => 5,
        Quantity::RelativeForce(_) => 6,
    }
}

/// A measured quantity and what simulations reach.
struct Range {
    name: String,
    value: f64,
    reached: [f64; 2],
}

impl Range {
    fn is_inside(&self) -> bool {
        (self.reached[0]..=self.reached[1]).contains(&self.value)
    }

    fn words(&self) -> String {
        let [low, high] = self.reached;
        format!("{} = {:.4}, outside {low:.4} to {high:.4}", self.name, self.value)
    }

    fn warning(&self) -> String {
        let [low, high] = self.reached;
        format!(
            "the experimental mean of {} is {:.4}, outside what the ensemble reaches ({low:.4} to \
             {high:.4}). Nothing here is identified: widen the prior, or look for what the model \
             leaves out.",
            self.name, self.value
        )
    }

    /// The slip of a unit that explains the distance, where it is about a thousand.
    fn cause(&self) -> Option<&'static str> {
        let ratio = self.value.abs() / (self.reached[0] * self.reached[1]).sqrt();
        let thousands = ratio.log10() / 3.0;
        let sign = [-1.0, 1.0].into_iter().find(|sign| (thousands - sign).abs() < 0.25)?;
        Some(match (Quantity::of_column(&self.name)?, sign < 0.0) {
            (Quantity::PeakForce | Quantity::ForceAt(_), true) => {
                "Is force_kN meant? The column force_N is read as N."
            }
            (Quantity::PeakForce | Quantity::ForceAt(_), false) => {
                "Is force_mN meant? The column force_N is read as N."
            }
            (Quantity::DisplacementAtPeak, true) => {
                "Is displacement in m? The column displacement_mm is read as mm."
            }
            (Quantity::DisplacementAtPeak, false) => {
                "Is displacement in µm? The column displacement_mm is read as mm."
            }
            (Quantity::Slope | Quantity::PostPeakSlope | Quantity::EnergyToPeak, true) => {
                "Is force_kN meant? A column of this name is read as kN; the column force_N is read as N, \
                 displacement_mm as mm."
            }
            (Quantity::Slope | Quantity::PostPeakSlope | Quantity::EnergyToPeak, false) => {
                "Is displacement in m, or force in mN? The columns are read as mm and N."
            }
            // units do not change the shape
            (Quantity::RelativeForce(_), _) => return None,
        })
    }
}

/// Bounds of the constants of the softest phase, for closed forms of a homogeneous cylinder between
/// sliding platens.
#[derive(Clone, Debug)]
struct ClosedForm {
    /// Young's modulus in MPa.
    young: [f64; 2],
    damage: Option<Damage>,
}

#[derive(Clone, Debug)]
struct Damage {
    /// Crack density and its width in mm.
    field: (CrackDensity, f64),
    /// Toughness in N/mm.
    toughness: [f64; 2],
    /// Viscosity in MPa s.
    viscosity: [f64; 2],
    /// Velocity of the platen in mm/s.
    velocity: f64,
}

impl ClosedForm {
    /// Nothing where there are no platens.
    fn of(setup: &Setup<'_>, prior: Option<&PriorCase>) -> Option<Self> {
        let displacement_mm = setup.test.displacement_mm?;
        let phase = |(region, material): (&String, &MaterialCase)| {
            let own = material.in_fem().ok()?.elasticity.young_mpa();
            let bounds = |property, own: f64| {
                let parameter = MaterialParameter { region: region.clone(), property };
                let calibrated = prior.and_then(|prior| prior.get(&parameter));
                calibrated.map_or([own; 2], |PriorBounds(bounds)| *bounds)
            };
            let damage =
                setup.phase_field.zip(material.toughness_n_per_mm).map(|(field, own)| Damage {
                    field: (field.model, field.length_mm),
                    toughness: bounds(Property::Toughness, own),
                    viscosity: bounds(Property::Viscosity, material.viscosity_mpa_s),
                    velocity: displacement_mm / setup.test.duration_s,
                });
            Some(Self { young: bounds(Property::Young, own), damage })
        };
        let phases = setup.material.iter().filter_map(phase);
        phases.min_by(|a, b| a.young[0].total_cmp(&b.young[0]))
    }

    /// What the quantity can be over the box; nothing for one without a closed form.
    fn range(&self, quantity: Quantity, height_mm: f64, radius_mm: f64) -> Option<[f64; 2]> {
        let area = std::f64::consts::PI * radius_mm * radius_mm;
        let [soft, stiff] = self.young;
        let peak = |young: f64, end: usize| Some(self.damage.as_ref()?.peak(young, end, height_mm));
        match quantity {
            Quantity::Slope => Some(self.young.map(|young| young * area / height_mm)),
            Quantity::PeakForce => Some([peak(soft, 0)?[1] * area, peak(stiff, 1)?[1] * area]),
            Quantity::DisplacementAtPeak => {
                Some([peak(stiff, 0)?[0] * height_mm, peak(soft, 1)?[0] * height_mm])
            }
            Quantity::EnergyToPeak
            | Quantity::PostPeakSlope
            | Quantity::RelativeForce(_)
            | Quantity::ForceAt(_) => None,
        }
    }
}

impl Damage {
    /// Strain and stress (MPa) at the peak, at one end of the bounds: the larger of those of viscous and
    /// of rate-independent damage.
    ///
    /// Viscous: ε = (ε̇ ξ/(2E))^(1/3), σ = E ε e^(−1/3). Rate independent: AT2 ε = √(Gc/(3 l₀ E)),
    /// σ = (9/16) E ε; AT1 ε = √(3 Gc/(8 l₀ E)), σ = E ε.
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

    /// Definitions 3.4: the matrix of the paper, η = 0.01, peaks at 122.855 N and 0.13559 mm in 1 s, and
    /// without viscosity at ε = 7.1067e-3 and 1.09932 MPa.
    #[test]
    fn the_closed_form_is_near_the_exact_peaks_of_a_homogeneous_cylinder() {
        let of = |viscosity: f64| ClosedForm {
            young: [275.0; 2],
            damage: Some(Damage {
                field: (CrackDensity::At2, 0.06),
                toughness: [0.0025; 2],
                viscosity: [viscosity; 2],
                velocity: 0.22,
            }),
        };
        let near = |found: Option<[f64; 2]>, exact: f64, within: f64| {
            let [low, high] = found.unwrap();
            assert!(low == high && (low / exact - 1.0).abs() < within, "{low}, not {exact}");
        };
        near(of(0.3).range(Quantity::PeakForce, 4.4, 2.5), 122.855, 0.06);
        near(of(0.3).range(Quantity::DisplacementAtPeak, 4.4, 2.5), 0.135_59, 0.06);
        let area = std::f64::consts::PI * 6.25;
        near(of(0.0).range(Quantity::PeakForce, 4.4, 2.5), 1.099_32 * area, 1e-4);
        near(of(0.0).range(Quantity::DisplacementAtPeak, 4.4, 2.5), 7.1067e-3 * 4.4, 1e-4);
        near(of(0.0).range(Quantity::Slope, 4.4, 2.5), 275.0 * area / 4.4, 1e-12);
    }

    #[test]
    fn a_slip_of_a_thousand_is_recognised_and_another_distance_is_not() {
        let cause = |quantity: Quantity, value: f64| {
            let name = quantity.column().into_owned();
            Range { name, value, reached: [120.0, 180.0] }.cause()
        };
        assert!(cause(Quantity::PeakForce, 0.147).unwrap().contains("force_kN"));
        assert!(cause(Quantity::DisplacementAtPeak, 0.147).unwrap().contains("in m?"));
        assert!(cause(Quantity::DisplacementAtPeak, 147e3).unwrap().contains("µm"));
        assert_eq!(cause(Quantity::PeakForce, 250.0), None);
        assert_eq!(cause(Quantity::PeakForce, 14.7), None);
    }
}
