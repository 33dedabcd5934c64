//! Derivatives of the force with respect to every constant of viscoelastic and plastic laws, against differences of whole
//! runs.

use fem::{
    EnergySet, Hardening, HardeningPoint, Material, MaterialParameter, Order, PhaseField,
    PlasticRate, Plasticity, PronyModuli, PronyTerm, Split, TimeShift, Viscoelasticity,
    YieldCriterion,
};

use super::inelastic::{POISSON, YOUNG, fracture, pressed, run};
use crate::support::phase_field;

/// Material as a function of one constant.
type Law = fn(f64) -> Material;

fn terms(pairs: [[f64; 2]; 2]) -> Vec<PronyTerm> {
    pairs.map(|[fraction, time_s]| PronyTerm { fraction, time_s }).into()
}

fn series() -> Viscoelasticity {
    let (shear, bulk) = (terms([[0.3, 0.1], [0.2, 1.0]]), terms([[0.25, 0.2], [0.15, 0.7]]));
    Viscoelasticity { shear, bulk, ..Viscoelasticity::default() }
}

fn relaxing(series: Viscoelasticity) -> Material {
    Material::hencky(YOUNG, POISSON).with_viscoelasticity(series)
}

/// A series whose first constants are given: fractions and times of the first shear term and of the second bulk term.
fn changed(change: impl FnOnce(&mut Viscoelasticity)) -> Material {
    let mut series = series();
    change(&mut series);
    relaxing(series)
}

fn shifted(shift: TimeShift) -> Material {
    relaxing(Viscoelasticity { shift: Some(shift), ..series() }).at_temperature(52.0)
}

fn wlf(c1: f64, c2_kelvin: f64, reference_celsius: f64) -> Material {
    shifted(TimeShift::Wlf { c1, c2_kelvin, reference_celsius })
}

fn arrhenius(energy_kj_per_mol: f64, reference_celsius: f64) -> Material {
    shifted(TimeShift::Arrhenius { energy_kj_per_mol, reference_celsius })
}

fn plastic(law: Plasticity) -> Material {
    Material::hencky(YOUNG, POISSON).with_plasticity(law)
}

fn hardened(hardening: Hardening) -> Material {
    plastic(Plasticity { hardening, ..Plasticity::new(3.0) })
}

/// Voce hardening with Johnson–Cook rate dependence: yield stress, saturation, rate of saturation, C, reference rate.
fn voce([yield_mpa, saturation_mpa, rate, c, reference_per_s]: [f64; 5]) -> Material {
    let hardening = Hardening::Voce { saturation_mpa, rate };
    let rate = Some(PlasticRate::JohnsonCook { c, reference_per_s });
    plastic(Plasticity { hardening, rate, ..Plasticity::new(yield_mpa) })
}

fn swift(factor_mpa: f64, offset: f64, exponent: f64) -> Material {
    hardened(Hardening::Swift { factor_mpa, offset, exponent })
}

fn cone(yield_mpa: f64, friction_deg: f64, dilatancy_deg: f64) -> Material {
    let criterion = YieldCriterion::DruckerPrager { friction_deg, dilatancy_deg };
    let hardening = Hardening::Linear { modulus_mpa: 20.0 };
    plastic(Plasticity { criterion, hardening, ..Plasticity::new(yield_mpa) })
}

const VISCOELASTIC: [(&str, f64, Law); 11] = [
    ("shear fraction", 0.3, |x| changed(|s| s.shear[0].fraction = x)),
    ("shear time", 1.0, |x| changed(|s| s.shear[1].time_s = x)),
    ("bulk fraction", 0.25, |x| changed(|s| s.bulk[0].fraction = x)),
    ("bulk time", 0.7, |x| changed(|s| s.bulk[1].time_s = x)),
    ("long-term shear fraction", 0.3, |x| {
        changed(|s| (s.moduli, s.shear[0].fraction) = (PronyModuli::LongTerm, x))
    }),
    ("long-term bulk fraction", 0.15, |x| {
        changed(|s| (s.moduli, s.bulk[1].fraction) = (PronyModuli::LongTerm, x))
    }),
    ("wlf c1", 17.44, |x| wlf(x, 51.6, 50.0)),
    ("wlf c2", 51.6, |x| wlf(17.44, x, 50.0)),
    ("wlf reference", 50.0, |x| wlf(17.44, 51.6, x)),
    ("arrhenius energy", 80.0, |x| arrhenius(x, 50.0)),
    ("arrhenius reference", 50.0, |x| arrhenius(80.0, x)),
];

const VOCE: [f64; 5] = [3.0, 20.0, 5.0, 0.05, 1e-3];

const PLASTIC: [(&str, f64, Law); 13] = [
    ("yield", VOCE[0], |x| voce([x, VOCE[1], VOCE[2], VOCE[3], VOCE[4]])),
    ("voce saturation", VOCE[1], |x| voce([VOCE[0], x, VOCE[2], VOCE[3], VOCE[4]])),
    ("voce rate", VOCE[2], |x| voce([VOCE[0], VOCE[1], x, VOCE[3], VOCE[4]])),
    ("johnson-cook c", VOCE[3], |x| voce([VOCE[0], VOCE[1], VOCE[2], x, VOCE[4]])),
    ("johnson-cook reference", VOCE[4], |x| voce([VOCE[0], VOCE[1], VOCE[2], VOCE[3], x])),
    ("linear modulus", 30.0, |x| hardened(Hardening::Linear { modulus_mpa: x })),
    ("swift factor", 20.0, |x| swift(x, 0.01, 0.4)),
    ("swift offset", 0.01, |x| swift(20.0, x, 0.4)),
    ("swift exponent", 0.4, |x| swift(20.0, 0.01, x)),
    ("table", 2.0, |x| {
        let points = [[0.0, 0.0], [0.02, x], [0.2, 5.0]];
        let point = |[plastic_strain, hardening_mpa]: [f64; 2]| HardeningPoint {
            plastic_strain,
            hardening_mpa,
        };
        hardened(Hardening::Table(points.map(point).into()))
    }),
    ("cohesion", 3.0, |x| cone(x, 30.0, 10.0)),
    ("friction angle", 30.0, |x| cone(3.0, x, 10.0)),
    ("dilatancy angle", 10.0, |x| cone(3.0, 30.0, x)),
];

/// Distance of the runs, relative to the value of the constant.
const REACH: f64 = 1e-3;

/// Compares the derivatives of a run that compresses a block and unloads it with differences of fourth order of whole runs.
fn assert_derivatives((name, value, law): (&str, f64, Law), field: Option<PhaseField>) {
    let travel = |t: f64| -0.06 * (3.0 * t).sin();
    let made = move |x: f64| {
        let material = law(x);
        if field.is_some() { material.with_fracture(fracture()) } else { material }
    };
    let at = |x: f64| pressed(Order::Linear, &made(x), field, false, 8, travel);
    let parameter = MaterialParameter::new(name, value, move |x| vec![made(x)]);
    let outcome = run(&at(value).with_sensitivities(vec![parameter]).expect("valid"));
    let rows = &outcome.sensitivities.force_n;
    assert_eq!(rows.len(), 8, "{name}: {:?}", outcome.sensitivities.lost);
    let reach = REACH * value;
    let runs = [2.0, 1.0, -1.0, -2.0].map(|k| run(&at(value + k * reach)).curve);
    let exact: Vec<f64> = (0..8)
        .map(|step| {
            let [far, near, below, farthest] = [0, 1, 2, 3].map(|k| runs[k][step].force_n);
            (8.0 * (near - below) - (far - farthest)) / (12.0 * reach)
        })
        .collect();
    let size = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let largest = runs[1].iter().fold(0.0f64, |most, point| most.max(point.force_n.abs()));
    assert!(size * value > 1e-4 * largest, "the force hardly depends on {name}: {exact:?}");
    let errors = rows.iter().zip(&exact).map(|(row, exact)| (row[0] - exact).abs() / size);
    let error = errors.fold(0.0, f64::max);
    println!("{name}, damage {}: {error:.1e}", field.is_some());
    assert!(error < 1e-5, "{name}, {field:?}: {rows:?} and {exact:?}");
}

#[test]
fn derivatives_by_every_constant_of_a_prony_series_agree_with_differences_of_runs() {
    for constant in VISCOELASTIC {
        for field in [None, Some(phase_field(Split::None))] {
            assert_derivatives(constant, field);
        }
    }
}

#[test]
fn derivatives_by_every_constant_of_plasticity_agree_with_differences_of_runs() {
    for constant in PLASTIC {
        for field in [None, Some(phase_field(Split::None))] {
            assert_derivatives(constant, field);
        }
    }
}

/// The plastic work above a threshold drives damage.
#[test]
fn derivatives_with_a_threshold_of_plastic_work_agree_with_differences_of_runs() {
    let drive = EnergySet { plastic: true, viscous: false };
    let field = PhaseField { drive, plastic_threshold_mpa: 0.05, ..phase_field(Split::None) };
    let free = PhaseField { plastic_threshold_mpa: 0.0, ..field };
    let damage = |field| {
        let material = voce(VOCE).with_fracture(fracture());
        let travel = |t: f64| -0.06 * (3.0 * t).sin();
        run(&pressed(Order::Linear, &material, Some(field), false, 8, travel)).curve[7].phi_max
    };
    assert!(damage(field) < 0.99 * damage(free), "the threshold has no effect");
    for constant in &PLASTIC[..4] {
        assert_derivatives(*constant, Some(field));
    }
}
