//! Double cantilever with an interface: the energy release rate during growth of the crack, from measured compliances.

use crate::support::block::{block, even, graded};
use fem::{
    Axis, Conditions, End, Fracture, Interface, Material, NodeSet, PhaseField, Problem, Schedule,
    SolverOptions, TetMesh,
};

/// Height of each arm, length of the slit, length of the beam, and growth of the crack, mm.
const ARM: f64 = 8.0;
const SLIT: f64 = 8.0;
const LENGTH: f64 = 20.0;
const GROWTH: f64 = 1.6;
const STEPS: u32 = 8;
/// Toughness of the regions and of the interface, N/mm.
const BULK: f64 = 0.01;
const INTERFACE: f64 = 0.005;

/// A beam whose upper arm is the matrix. The slit is a row of fully damaged elements in the matrix, at the interface.
/// The same row of elements breaks when the crack grows, because the matrix is softer.
#[derive(Clone, Copy, Debug)]
struct Beam {
    length_mm: f64,
    spacing_mm: f64,
    /// Whether the lower arm can break.
    two_sided: bool,
}

impl Beam {
    fn mesh(&self) -> TetMesh {
        let h = self.spacing_mm;
        // fine cells around the path of the crack; the spacing grows outwards
        let outwards = |from: f64, to: f64| {
            let cells = graded(h, 0, 1.5, (to - from).abs());
            cells.into_iter().skip(1).map(move |x| from + (to - from).signum() * x)
        };
        let (first, last) = (SLIT - 1.0, SLIT + GROWTH + 1.0);
        let mut along: Vec<f64> = outwards(first, 0.0).collect();
        along.reverse();
        along.extend(even(first, last, ((last - first) / h).round() as usize));
        along.extend(outwards(last, LENGTH));
        let rows = (2.0 * self.length_mm / h).ceil();
        let mut up = even(0.0, rows * h, rows as usize);
        up.extend(outwards(rows * h, ARM));
        let mut across: Vec<f64> = up.iter().skip(1).rev().map(|z| -z).collect();
        across.extend(up);
        block([&along, &[0.0, h], &across])
            .with_regions(&["matrix", "grain"], |[.., z]| u16::from(z < 0.0))
    }

    /// The beam with a slit of this length. Its ends are opened by `opening(t)` mm in total.
    fn problem(
        &self,
        slit_mm: f64,
        steps: u32,
        opening: impl Fn(f64) -> f64 + Clone + Send + Sync + 'static,
    ) -> Problem {
        let h = self.spacing_mm;
        let end = |z: f64| NodeSet::matching(move |x| x[0] < 1e-9 && (x[2] - z).abs() < 1e-9);
        let is_slit = move |x: [f64; 3]| x[0] < slit_mm + 1e-9 && x[2] > -1e-9 && x[2] < h + 1e-9;
        let half = move |sign: f64| {
            let opening = opening.clone();
            move |_: [f64; 3], time_s: f64| [0.0, 0.0, sign * 0.5 * opening(time_s)]
        };
        let conditions = Conditions::new()
            .node_set("upper", end(ARM))
            .node_set("lower", end(-ARM))
            .node_set("slit", NodeSet::matching(is_slit))
            .fix("front", [Axis::Y])
            .fix("back", [Axis::Y])
            .fix("right", [Axis::X, Axis::Z])
            .prescribe("upper", [Axis::Z], half(1.0))
            .prescribe("lower", [Axis::Z], half(-1.0))
            .prescribe_damage("slit", |_, _| 1.0)
            .measure("upper", [0.0, 0.0, 1.0]);
        let fracture = Fracture { residual_stiffness: 1e-6, ..Fracture::new(BULK) };
        let breakable = |young_mpa| Material::hencky(young_mpa, 0.2).with_fracture(fracture);
        let grain = if self.two_sided { breakable(1100.0) } else { Material::hencky(1100.0, 0.2) };
        Problem::builder(self.mesh())
            .materials([breakable(1000.0), grain])
            .phase_field(PhaseField::new(self.length_mm))
            .interfaces([Interface::new(["matrix", "grain"], INTERFACE, 2.0 * self.length_mm)])
            .conditions(conditions)
            .options(SolverOptions { tolerance: 1e-6, ..SolverOptions::default() })
            .schedule(Schedule::fixed(1.0, steps))
            .build()
            .expect("valid input")
    }

    /// Opening per force of a beam with a slit, per mm of thickness, to the power 1/3: a slender cantilever has a
    /// compliance proportional to a³.
    fn root_of_compliance(&self, slit_mm: f64) -> f64 {
        let opening = 1e-7;
        let outcome = self.problem(slit_mm, 1, move |_| opening).run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        (opening / outcome.curve[0].force_n * self.spacing_mm).cbrt()
    }

    /// Released energy per area of the crack, and mean energy release rate, both divided by the toughness of the
    /// interface on this mesh, in the second half of the steps.
    fn measured_toughness(&self) -> [f64; 2] {
        let lengths = [SLIT, SLIT + 0.5 * GROWTH, SLIT + GROWTH];
        let roots = lengths.map(|a| self.root_of_compliance(a));
        // the root of the compliance is nearly linear: slope at its middle, and change of the slope
        let [low, high] = [0, 1].map(|k| (roots[k + 1] - roots[k]) / (0.5 * GROWTH));
        let slope = |root: f64| {
            let share = (root - roots[0]) / (roots[2] - roots[0]);
            low + (high - low) * (2.0 * share - 0.5)
        };
        // F²/2 dC/da per mm of thickness
        let release = |force: f64, root: f64| 1.5 * force.powi(2) * root.powi(2) * slope(root);
        let toughness = INTERFACE * (1.0 + self.spacing_mm / (2.0 * self.length_mm));
        // opening at which a crack of each length grows
        let critical = roots.map(|root| root.powi(3) * (toughness / release(1.0, root)).sqrt());
        let (first, last) = (0.97 * critical[0], critical[2]);
        let opening = move |time_s: f64| first + (last - first) * time_s;
        let outcome = self.problem(SLIT, STEPS, opening).run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        // energy that leaves load and body, N per mm of thickness
        let released = |k: usize| {
            let point = &outcome.curve[k];
            (point.work_n_mm - point.elastic_n_mm) / self.spacing_mm
        };
        let row = |k: usize| {
            let point = &outcome.curve[k];
            let force = point.force_n / self.spacing_mm;
            let root = (opening(point.time_s) / force).cbrt();
            let growth = (root - roots[0]) / (roots[2] - roots[0]) * GROWTH;
            [growth, release(force, root) / toughness]
        };
        let [start, end] = [STEPS as usize / 2, STEPS as usize - 1];
        let grown = row(end)[0] - row(start)[0];
        let energy = (released(end) - released(start)) / (grown * toughness);
        let rates: Vec<f64> = (start..=end).map(|k| row(k)[1]).collect();
        let rate = rates.iter().sum::<f64>() / rates.len() as f64;
        println!(
            "{self:?}: growth {grown:.3} mm, energy {energy:.4}, release rate {rate:.4}; all {:.4?}; {} iterations",
            (0..=end).map(row).collect::<Vec<_>>(),
            outcome.effort.iterations
        );
        [energy, rate]
    }
}

/// The crack is found by its compliance alone: beams with slits of known length give the compliance as a function of the
/// length. Two measures of the toughness result: the energy that is released while the crack grows, per area; and the
/// energy release rate F²/2 dC/da. The damage has no viscosity: a viscosity ξ would add of the order of ξ v to the
/// toughness at the speed v of the crack.
fn assert_toughness(beam: Beam) {
    let [energy, rate] = beam.measured_toughness();
    assert!((energy - 1.0).abs() < 0.05, "{beam:?}: {energy}");
    assert!((rate - 1.0).abs() < 0.05, "{beam:?}: {rate}");
}

#[test]
fn a_crack_along_an_interface_grows_at_its_toughness() {
    for (length_mm, two_sided) in [(0.3, true), (0.2, true), (0.2, false)] {
        assert_toughness(Beam { length_mm, spacing_mm: 0.1, two_sided });
    }
}

#[test]
fn a_crack_along_an_interface_grows_at_its_toughness_on_a_finer_mesh() {
    for length_mm in [0.3, 0.2] {
        assert_toughness(Beam { length_mm, spacing_mm: 0.1 / 1.5, two_sided: true });
    }
}
