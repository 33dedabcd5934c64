//! Quadratic convergence of Newton's method with every law, and its tables of residuals.

use std::fmt::Write;
use std::path::Path;

use crate::support::block::{block, even};
use crate::support::phase_field;
use fem::{
    Axis, Conditions, CrackDensity, Fracture, Hardening, LinearScheme, Material, Order, PhaseField,
    Plasticity, Problem, PronyTerm, Schedule, SolverOptions, Split, Strength, Viscoelasticity,
    YieldCriterion,
};

/// Text file with the residuals of all increments. The test writes the file if it does not exist, or with
/// `BRECCIA_WRITE_SNAPSHOTS=1`.
const SNAPSHOT: &str = "tests/mechanics/snapshots/newton.csv";
/// Residuals are in the quadratic range below this value.
const QUADRATIC: f64 = 1e-3;
/// Residuals below this value contain rounding errors.
const ROUNDED: f64 = 1e-11;

/// Materials with damage. The last number is the strain of the body at the end, positive in tension.
fn laws() -> [(&'static str, Material, PhaseField, f64); 7] {
    let fracture =
        Fracture { toughness_n_per_mm: 0.0025, viscosity_mpa_s: 0.3, residual_stiffness: 0.01 };
    let hencky = || Material::hencky(275.0, 0.25).with_fracture(fracture);
    let terms = [(0.3, 0.1), (0.2, 1.0)];
    let series = terms.map(|(fraction, time_s)| PronyTerm { fraction, time_s });
    let j2 =
        Plasticity { hardening: Hardening::Linear { modulus_mpa: 30.0 }, ..Plasticity::new(3.0) };
    let cone = |dilatancy_deg| Plasticity {
        criterion: YieldCriterion::DruckerPrager { friction_deg: 30.0, dilatancy_deg },
        ..j2.clone()
    };
    // graphite of Larsen, Dolbow & Lopez-Pamies (2024), with viscous damage
    let graphite = Fracture { residual_stiffness: 1e-4, ..Fracture::new(0.091) };
    let graphite = Material::hencky(9800.0, 0.13)
        .with_fracture(Fracture { viscosity_mpa_s: 2.0, ..graphite })
        .with_strength(Strength::new(27.0, 77.0));
    let [none, split] = [Split::None, Split::VolumetricDeviatoric].map(phase_field);
    let at1 = PhaseField { model: CrackDensity::At1, ..PhaseField::new(0.2) };
    [
        ("elastic", hencky(), none, -0.05),
        (
            "viscoelastic",
            hencky().with_viscoelasticity(Viscoelasticity::shear(series)),
            none,
            -0.05,
        ),
        ("j2", hencky().with_plasticity(j2.clone()), none, -0.05),
        ("j2 with a split", hencky().with_plasticity(j2.clone()), split, -0.05),
        ("associated cone", hencky().with_plasticity(cone(30.0)), none, -0.05),
        ("non-associated cone", hencky().with_plasticity(cone(10.0)), none, -0.05),
        ("strength", graphite, at1, 0.0045),
    ]
}

/// Residuals of each increment: at the initial guess, then after each iteration. The ends of the body keep their shape,
/// so that the strains are not uniform.
fn residuals(
    order: Order,
    scheme: LinearScheme,
    material: &Material,
    field: PhaseField,
    strain: f64,
) -> Vec<Vec<f64>> {
    let cells = even(0.0, 1.0, 2);
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .prescribe("top", Axis::ALL, move |_, t| [0.0, 0.0, strain * t])
        .measure("top", [0.0, 0.0, 1.0]);
    let options = SolverOptions {
        linear: scheme,
        tolerance: 1e-10,
        linear_tolerance: 1e-10,
        ..SolverOptions::default()
    };
    let problem = Problem::builder(block([&cells, &cells, &cells]))
        .order(order)
        .materials([material.clone()])
        .phase_field(field)
        .conditions(conditions)
        .options(options)
        .schedule(Schedule::fixed(1.0, 4))
        .build()
        .expect("valid input");
    let mut run = problem.start();
    let mut rows = Vec::new();
    while run.step().is_some() {
        rows.push(run.residuals().to_vec());
    }
    let outcome = run.finish();
    assert_eq!((rows.len(), outcome.effort.fallbacks), (4, 0), "{:?}", outcome.end);
    rows
}

/// Asserts r_(k+1) ≤ 10 r_k^1.7 for all residuals in the quadratic range, except for rounding errors. Returns the number of
/// checked pairs.
#[track_caller]
fn assert_quadratic(residuals: &[f64], context: &str) -> usize {
    let pairs = residuals.windows(2).filter(|pair| (1e-7..QUADRATIC).contains(&pair[0]));
    let mut checked = 0;
    for pair in pairs {
        let most = (10.0 * pair[0].powf(1.7)).max(ROUNDED);
        assert!(pair[1] <= most, "{context}: {:e} after {:e} in {residuals:?}", pair[1], pair[0]);
        checked += 1;
    }
    checked
}

#[test]
fn newton_converges_quadratically_with_every_law() {
    let mut table = String::from("law,order,linear,increment,residuals\n");
    for (name, material, field, strain) in laws() {
        for order in [Order::Linear, Order::Quadratic] {
            for scheme in [LinearScheme::Direct, LinearScheme::Multigrid] {
                let mut checked = 0;
                for (k, row) in
                    residuals(order, scheme, &material, field, strain).iter().enumerate()
                {
                    let context = format!("{name}, {order:?}, {scheme:?}, increment {}", k + 1);
                    checked += assert_quadratic(row, &context);
                    let row: Vec<String> = row.iter().map(|r| format!("{r:.1e}")).collect();
                    writeln!(table, "{name},{order:?},{scheme:?},{},{}", k + 1, row.join(" "))
                        .expect("text");
                }
                assert!(checked >= 3, "{name}, {order:?}, {scheme:?}: {checked} pairs");
            }
        }
    }
    compare(&table);
}

/// Compares the table with the file: the same numbers of iterations, and residuals within a factor of three as long as they
/// are not rounding errors.
fn compare(table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SNAPSHOT);
    if std::env::var_os("BRECCIA_WRITE_SNAPSHOTS").is_some() || !path.exists() {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, table).expect("a file");
    }
    let stored = std::fs::read_to_string(&path).expect("the snapshot exists");
    assert_eq!(table.lines().count(), stored.lines().count(), "{table}");
    for (line, before) in table.lines().zip(stored.lines()).skip(1) {
        let numbers = |line: &str| -> (String, Vec<f64>) {
            let (key, numbers) = line.rsplit_once(',').expect("columns");
            (key.to_owned(), numbers.split(' ').map(|x| x.parse().expect("a number")).collect())
        };
        let ((key, now), (key_before, before)) = (numbers(line), numbers(before));
        assert_eq!(key, key_before);
        assert_eq!(now.len(), before.len(), "{key}: {now:?}, before {before:?}");
        for (a, b) in now.iter().zip(&before) {
            let is_rounded = a.max(*b) < 1e-9;
            assert!(
                is_rounded || (a / b).ln().abs() < 3f64.ln(),
                "{key}: {now:?}, before {before:?}"
            );
        }
    }
}
