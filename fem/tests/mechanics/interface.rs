//! Interfaces with their own toughness: effective toughness of separated bars, derivatives, devices, and errors of
//! invalid input.

use crate::support::test_device::test_device;
use crate::support::{grain, loading, matrix, phase_field, prism};
use fem::{
    Axis, Block, Conditions, CrackDensity, End, Fracture, Interface, LinearScheme, Material,
    MaterialParameter, Mixture, Order, Outcome, PhaseField, Problem, ProblemWarning, Schedule,
    SolverOptions, Split, TetMesh,
};

/// Toughness of the regions, N/mm.
const BULK: f64 = 0.01;

fn breakable(young_mpa: f64, poisson: f64) -> Material {
    Material::hencky(young_mpa, poisson).with_fracture(Fracture::new(BULK))
}

/// A bar along x with an interface in its middle, which is pulled until the bar is separated into
/// two parts.
struct Bar {
    order: Order,
    field: PhaseField,
    /// Spacing of the elements, mm.
    spacing_mm: f64,
    /// Whether the part beyond the middle can break.
    two_sided: bool,
    interface: Interface,
    mesh: TetMesh,
}

impl Bar {
    const LENGTH: f64 = 1.2;

    fn new(cells: u32, length_mm: f64, interface_n_per_mm: f64, width_mm: f64) -> Self {
        let spacing_mm = Self::LENGTH / f64::from(cells);
        let mesh = Block::new([Self::LENGTH, spacing_mm, spacing_mm], [cells as usize, 1, 1]);
        let mesh = mesh
            .build()
            .expect("a mesh")
            .with_regions(&["matrix", "grain"], |[x, ..]| u16::from(x > 0.5 * Self::LENGTH));
        Self {
            order: Order::Linear,
            field: PhaseField::new(length_mm),
            spacing_mm,
            two_sided: true,
            interface: Interface::new(["matrix", "grain"], interface_n_per_mm, width_mm),
            mesh,
        }
    }

    fn problem(&self) -> Problem {
        let conditions = Conditions::new()
            .fix("left", [Axis::X])
            .prescribe("right", [Axis::X], |_, time_s| [0.03 * time_s.powi(3), 0.0, 0.0])
            .remove_rigid_motions()
            .measure("right", [1.0, 0.0, 0.0]);
        // the stiffnesses differ, so that the crack chooses the elements of one side
        let second =
            if self.two_sided { breakable(1100.0, 0.0) } else { Material::hencky(1100.0, 0.0) };
        Problem::builder(self.mesh.clone())
            .order(self.order)
            .materials([breakable(1000.0, 0.0), second])
            .phase_field(self.field)
            .interfaces([self.interface.clone()])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 30))
            .build()
            .expect("valid input")
    }

    /// Returns the crack energy per area of the separated bar, N/mm; NaN if it does not break.
    fn energy(&self) -> f64 {
        let outcome = self.problem().run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let last = outcome.curve.last().expect("a point");
        let peak = outcome.curve.iter().map(|point| point.force_n.abs()).fold(0.0, f64::max);
        if last.force_n.abs() >= 0.05 * peak {
            return f64::NAN;
        }
        last.fracture_n_mm / self.spacing_mm.powi(2)
    }
}

/// On a mesh, every crack has the factor 1 + h/(c₀ ℓ₀), where h is the size of the broken elements.
fn mesh_factor(field: &PhaseField, broken_mm: f64) -> f64 {
    1.0 + broken_mm / (field.model.normaliser() * field.length_mm)
}

/// Crack energies of separated bars that differ from the effective toughness of their interface.
#[derive(Default)]
struct Deviations(Vec<String>);

impl Deviations {
    /// Compares the crack energy of a bar with the effective toughness of its interface. `broken_mm`
    /// is the thickness of the breakable part of the elements that break.
    fn compare(&mut self, bar: &Bar, broken_mm: f64, tolerance: f64) {
        let exact = bar.interface.toughness_n_per_mm * mesh_factor(&bar.field, broken_mm);
        let ratio = bar.energy() / exact;
        let Bar { order, field, spacing_mm, two_sided, interface, .. } = bar;
        let (model, length, width) = (field.model, field.length_mm, interface.width_mm);
        let what = format!(
            "{order:?} {model:?} ℓ {length} h {spacing_mm:.4} width {width} {two_sided}: {ratio:.4}"
        );
        println!("{what}");
        if ratio.is_nan() || (ratio - 1.0).abs() >= tolerance {
            self.0.push(what);
        }
    }

    fn assert_none(&self) {
        assert!(self.0.is_empty(), "{:#?}", self.0);
    }
}

#[test]
fn a_bar_separates_with_the_toughness_of_its_interface() {
    let mut deviations = Deviations::default();
    for (cells, length_mm) in [(24, 0.1), (48, 0.1), (36, 0.07)] {
        for (width_mm, relative, two_sided) in
            [(0.1, 0.5, true), (0.3, 0.3, true), (0.2, 0.4, false), (0.4, 0.4, false)]
        {
            for model in [CrackDensity::At2, CrackDensity::At1] {
                // a wide, weak band of AT1 has a uniform threshold, so that more than one row of its elements breaks
                if model == CrackDensity::At1 && width_mm == 0.3 {
                    continue;
                }
                let mut bar = Bar::new(cells, length_mm, relative * BULK, width_mm);
                bar.field.model = model;
                bar.two_sided = two_sided;
                deviations.compare(&bar, bar.spacing_mm, 0.05);
            }
        }
    }
    deviations.assert_none();
}

#[test]
fn a_bar_of_quadratic_elements_separates_with_the_toughness_of_its_interface() {
    let mut deviations = Deviations::default();
    for (cells, length_mm) in [(16, 0.1), (24, 0.1), (24, 0.07)] {
        for (width_mm, relative, two_sided) in [(0.3, 0.3, true), (0.3, 0.4, false)] {
            let mut bar = Bar::new(cells, length_mm, relative * BULK, width_mm);
            bar.order = Order::Quadratic;
            bar.two_sided = two_sided;
            // a crack breaks a part of a quadratic element: the energy is up to 12 % too small
            deviations.compare(&bar, bar.spacing_mm, 0.13);
        }
    }
    deviations.assert_none();
}

/// The interface is inside a layer of elements that contain both phases.
#[test]
fn a_bar_of_mixtures_separates_with_the_toughness_of_its_interface() {
    let mut deviations = Deviations::default();
    for (cells, length_mm, fraction) in [(23, 0.1, 0.5f32), (47, 0.1, 0.3)] {
        for (width_mm, relative) in [(0.2, 0.4), (0.3, 0.6)] {
            let mut bar = Bar::new(cells, length_mm, relative * BULK, width_mm);
            bar.two_sided = false;
            let middle = 0.5 * Bar::LENGTH;
            let near = 0.5 * bar.spacing_mm;
            let mesh = &mut bar.mesh;
            let mut mixtures = vec![Mixture::default(); mesh.tets.len()];
            for tet in 0..mesh.tets.len() {
                let centre = mesh.corners(tet).iter().map(|x| x[0]).sum::<f64>() / 4.0;
                if (centre - middle).abs() < near {
                    mesh.region_of[tet] = 0;
                    mixtures[tet] = Mixture { fraction, normal: [-1.0, 0.0, 0.0], region: 1 };
                }
            }
            mesh.mixture = Some(mixtures);
            let broken = (1.0 - f64::from(fraction)) * bar.spacing_mm;
            deviations.compare(&bar, broken, 0.15);
        }
    }
    deviations.assert_none();
}

/// A prism of matrix and grains, whose matrix has little viscosity, with the toughnesses of interface and matrix.
fn grains(order: Order, model: CrackDensity, [interface, bulk]: [f64; 2]) -> Problem {
    let options = SolverOptions { tolerance: 1e-12, ..SolverOptions::default() };
    let materials = of_grains(bulk);
    loading(0.16, 1.0, 8)
        .builder(prism(if order == Order::Linear { 3 } else { 2 }, true))
        .expect("a specimen")
        .order(order)
        .materials(materials)
        .phase_field(PhaseField { model, ..PhaseField::new(1.0) })
        .interfaces(of_interface(interface))
        .options(options)
        .build()
        .expect("valid input")
}

fn of_grains(bulk: f64) -> Vec<Material> {
    let fracture =
        Fracture { toughness_n_per_mm: bulk, viscosity_mpa_s: 0.02, residual_stiffness: 0.01 };
    vec![matrix().with_fracture(fracture), grain()]
}

fn of_interface(toughness_n_per_mm: f64) -> Vec<Interface> {
    vec![Interface::new(["matrix", "grain"], toughness_n_per_mm, 0.4)]
}

/// The derivative with respect to the toughness of an interface includes the change of the toughness of its band. The
/// derivative with respect to the toughness of the matrix includes the change of the band by which the effective
/// toughness stays the same.
#[test]
fn derivatives_agree_with_differences_of_runs() {
    let forces = |problem: &Problem| -> Vec<f64> {
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        outcome.curve.iter().map(|point| point.force_n).collect()
    };
    // so small that the strain exceeds the threshold of AT1 before the end
    let values = [0.1, 0.3];
    for order in [Order::Linear, Order::Quadratic] {
        for model in [CrackDensity::At2, CrackDensity::At1] {
            let problem = grains(order, model, values);
            let parameter = |k: usize| {
                MaterialParameter::try_with_interfaces(["interface", "matrix"][k], values[k], |x| {
                    let mut values = values;
                    values[k] = x;
                    Ok::<_, ()>((of_grains(values[1]), of_interface(values[0])))
                })
            };
            let parameters = [0, 1].map(|k| parameter(k).expect("no error"));
            let with = problem.with_sensitivities(parameters.to_vec()).expect("valid");
            let found = with.run(&mut ()).sensitivities.force_n;
            for k in 0..2 {
                let step = 1e-4 * values[k];
                let [above, below] = [step, -step].map(|step| {
                    let mut values = values;
                    values[k] += step;
                    let other = problem
                        .with_materials(of_grains(values[1]))
                        .and_then(|p| p.with_interfaces(of_interface(values[0])));
                    forces(&other.expect("valid"))
                });
                let exact = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step));
                let exact: Vec<f64> = exact.collect();
                let size = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                let worst = found
                    .iter()
                    .zip(&exact)
                    .fold(0.0f64, |m, (row, exact)| m.max((row[k] - exact).abs()));
                if size * values[k] < 1e-3 {
                    // AT1 without damage: the toughness has no influence
                    continue;
                }
                assert!(worst < 1e-5 * size, "{order:?} {model:?} {k}: {worst:e} of {size:e}");
            }
        }
    }
}

/// Materials and interfaces are exchanged without building the problem again, and the result equals the result of a
/// new problem.
#[test]
fn other_interfaces_give_the_curve_of_a_new_problem() {
    let forces = |problem: &Problem| -> Vec<f64> {
        problem.run(&mut ()).curve.iter().map(|point| point.force_n).collect()
    };
    let [old, new] =
        [[0.3, 0.8], [0.1, 0.8]].map(|values| grains(Order::Linear, CrackDensity::At2, values));
    let exchanged = old.with_interfaces(of_interface(0.1)).expect("valid");
    assert_eq!(forces(&exchanged), forces(&new));
    assert_ne!(forces(&exchanged), forces(&old));
    let wider = vec![Interface { width_mm: 8.0, ..of_interface(0.1).remove(0) }];
    assert_ne!(forces(&old.with_interfaces(wider).expect("valid")), forces(&new));
    let none = old.with_interfaces(Vec::new()).expect("valid");
    assert!(none.interfaces().is_empty() && none.warnings().is_empty());
    // the widened band fills the regions
    let warnings = old.warnings();
    let is_widened = matches!(
        &warnings[0],
        ProblemWarning::WidenedInterface { interface, stated_mm, width_mm }
            if interface == "matrix-grain" && *stated_mm == 0.4 && *width_mm > 0.8
    );
    let is_wide =
        |warning: &ProblemWarning| matches!(warning, ProblemWarning::WideInterface { .. });
    assert!(is_widened && warnings[1..].iter().all(is_wide), "{warnings:?}");
}

#[test]
fn a_device_and_the_processor_compute_the_same_interface() {
    let Some(device) = test_device() else { return };
    for order in [Order::Linear, Order::Quadratic] {
        let run = |device| -> Outcome {
            loading(0.16, 1.0, 8)
                .builder(prism(3, true))
                .expect("a specimen")
                .order(order)
                .materials(of_grains(0.05))
                .phase_field(phase_field(Split::None))
                .interfaces(of_interface(0.005))
                .options(SolverOptions {
                    linear: LinearScheme::Multigrid,
                    ..SolverOptions::default()
                })
                .device(device)
                .build()
                .expect("valid input")
                .run(&mut ())
        };
        let (here, there) = (run(None), run(Some(device.clone())));
        assert_eq!(here.curve.len(), there.curve.len());
        for (a, b) in here.curve.iter().zip(&there.curve) {
            assert!((a.force_n - b.force_n).abs() < 1e-7 * here.curve[7].force_n, "{a:?} {b:?}");
        }
    }
}

/// A mixture with the fraction 1 has one phase: the problem equals the problem on a mesh whose regions are the phases.
#[test]
fn a_mixture_of_one_phase_alone_is_this_phase() {
    let regions = Bar::new(24, 0.1, 0.5 * BULK, 0.2);
    let mut mesh = regions.mesh.clone();
    let whole = |&region: &u16| Mixture {
        fraction: f32::from(region),
        normal: [-1.0, 0.0, 0.0],
        region: 1,
    };
    mesh.mixture = Some(mesh.region_of.iter().map(whole).collect());
    mesh.region_of.fill(0);
    assert_eq!(mesh.clone().with_pure_tetrahedra(), regions.mesh);
    let mixtures = Bar { mesh, ..Bar::new(24, 0.1, 0.5 * BULK, 0.2) };
    let [one, other] = [&regions, &mixtures].map(|bar| bar.problem().run(&mut ()).curve);
    assert_eq!(one, other);
}

/// A band that leaves hardly anything of a region is reported, with its share: 0.5 of 0.6 mm on each side.
#[test]
fn a_wide_band_is_reported_with_its_share() {
    let wide = |width_mm| {
        let mut warnings = Bar::new(24, 0.1, 0.5 * BULK, width_mm).problem().warnings();
        warnings.retain(|warning| matches!(warning, ProblemWarning::WideInterface { .. }));
        warnings
    };
    assert_eq!(wide(0.8), []);
    let wide = wide(1.0);
    assert_eq!(wide.len(), 2, "{wide:?}");
    for (warning, name) in wide.iter().zip(["matrix", "grain"]) {
        let ProblemWarning::WideInterface { interface, region, width_mm, percent } = warning else {
            panic!("{warning}");
        };
        assert_eq!((&interface[..], &region[..], *width_mm), ("matrix-grain", name, 1.0));
        assert!((percent - 100.0 * 0.5 / 0.6).abs() < 1.0, "{percent}");
    }
}

#[test]
fn wrong_interfaces_are_refused() {
    let refused = |interface: Interface, materials: [Material; 2]| {
        let built = loading(0.16, 1.0, 8)
            .builder(prism(3, true))
            .expect("a specimen")
            .materials(materials)
            .phase_field(phase_field(Split::None))
            .interfaces([interface])
            .build();
        built.expect_err("it is invalid").to_string()
    };
    let elastic = || Material::hencky(22_000.0, 0.25);
    let of = |regions: [&str; 2], toughness, width| Interface::new(regions, toughness, width);
    let own = ["matrix", "grain"];
    for (interface, fragments) in [
        (of(own, -0.1, 0.1), ["interface.matrix-grain: toughness_n_per_mm = -0.1", "1e-9 to 1e3"]),
        (of(own, 0.1, 0.0), ["interface.matrix-grain: width_mm = 0", "positive width"]),
        (of(own, 0.1, f64::NAN), ["interface.matrix-grain: width_mm = NaN", "positive width"]),
        (of(["matrix", "matrix"], 0.1, 0.1), ["interface.matrix-matrix", "two different regions"]),
        (of(["matrix", "sand"], 0.1, 0.1), ["no region 'sand'", "matrix, grain"]),
    ] {
        let message = refused(interface, [matrix(), elastic()]);
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
    let message = refused(of(own, 0.1, 20.0), [matrix(), elastic()]);
    for part in ["interface.matrix-grain: width_mm = 20", "extent of the body"] {
        assert!(message.contains(part), "{message}");
    }
    let message = refused(of(own, 0.1, 0.1), [elastic(), elastic()]);
    assert!(message.contains("neither of the two regions can break"), "{message}");
    let problem = grains(Order::Linear, CrackDensity::At2, [0.02, 0.05]);
    let parameter = |interface: fn(f64) -> Vec<Interface>| {
        let constants = |x| Ok::<_, ()>((of_grains(0.05), interface(x)));
        MaterialParameter::try_with_interfaces("interface", 0.02, constants).expect("no error")
    };
    let wider = |x| vec![Interface::new(["matrix", "grain"], x, 0.5)];
    for (parameter, part) in [
        (parameter(wider), "do not have the regions and widths"),
        (parameter(|x| of_interface(2.0 * x)), "do not enclose the value"),
    ] {
        let error = problem.with_sensitivities(vec![parameter]).expect_err("it is invalid");
        assert!(error.to_string().contains(part), "{error}");
    }
}
