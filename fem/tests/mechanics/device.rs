//! Runs whose linear systems are solved on a device. By default, the device is this machine instead of a graphics card.

use crate::support::test_device::test_device;
use crate::support::{grain, loading, matrix, peak, phase_field, prism};
use fem::{
    Checkpoint, CompressionTest, ComputeDevice, Effort, End, Fracture, Friction, LinearScheme,
    Material, MaterialParameter, Order, Outcome, Platens, Problem, SolverOptions, Split, TetMesh,
};

fn problem(
    mesh: TetMesh,
    order: Order,
    loading: CompressionTest,
    device: Option<ComputeDevice>,
) -> Problem {
    let options = SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() };
    loading
        .builder(mesh)
        .expect("a specimen")
        .order(order)
        .materials([matrix(), grain()])
        .phase_field(phase_field(Split::None))
        .options(options)
        .device(device)
        .build()
        .expect("valid input")
}

fn assert_same(here: &Outcome, there: &Outcome) {
    let (_, highest) = peak(here);
    assert_eq!(here.curve.len(), there.curve.len());
    for (a, b) in here.curve.iter().zip(&there.curve) {
        assert!((a.force_n - b.force_n).abs() < 1e-7 * highest, "{a:?} {b:?}");
    }
}

#[test]
fn a_device_and_the_processor_take_the_same_steps_beyond_the_peak() {
    let Some(device) = test_device() else { return };
    for (order, platens) in [
        (Order::Linear, Platens::Sliding),
        (Order::Quadratic, Platens::Sliding),
        (Order::Quadratic, Platens::Unilateral(Friction::none())),
    ] {
        let loading = loading(0.3, 1.0, 30).platens(platens);
        let run = |device: Option<ComputeDevice>| {
            let problem = problem(prism(3, true), order, loading.clone(), device);
            let mut run = problem.start();
            while run.step().is_some() {}
            (run.machine(), run.effort(), run.finish())
        };
        let (_, here_effort, here) = run(None);
        let (machine, there_effort, there) = run(Some(device.clone()));
        assert_eq!(machine, device.name());
        assert!(matches!(there.end, End::Displacement), "{order:?}: {:?}", there.end);
        assert!(
            there.curve.last().expect("a point").force_n < 0.8 * peak(&there).1,
            "past the peak"
        );
        assert_same(&here, &there);
        // device and processor use the same algorithm, but sums have different rounding errors, and only the processor
        // stores the GMRES basis in single precision; therefore the numbers of iterations differ by up to a tenth where
        // platens lift off and tangents are indefinite
        assert_eq!(here_effort.iterations, there_effort.iterations, "{order:?}");
        for count in [|e: Effort| e.linear, |e: Effort| e.factorisations] {
            let [a, b] = [here_effort, there_effort].map(|e| f64::from(count(e)));
            assert!((a - b).abs() <= 0.15 * a, "{order:?}: {here_effort:?} and {there_effort:?}");
        }
    }
}

#[test]
fn a_run_on_a_device_resumes_on_the_processor() {
    let Some(device) = test_device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let checkpoint = Checkpoint { path: folder.path().join("state"), every: 5 };
    let loading = loading(0.2, 1.0, 20);
    let there = problem(prism(2, true), Order::Quadratic, loading.clone(), Some(device));
    let mut run = there.resume(&checkpoint).expect("nothing is there yet");
    for _ in 0..10 {
        run.step().expect("it converges");
    }
    drop(run);
    let here = problem(prism(2, true), Order::Quadratic, loading, None);
    let mut run = here.resume(&checkpoint).expect("a state of the same problem");
    assert_eq!((run.curve().len(), run.machine().as_str()), (10, "the processor"));
    while run.step().is_some() {}
    assert_same(&here.run(&mut ()), &run.finish());
}

#[test]
fn sensitivities_are_computed_on_a_device() {
    let Some(device) = test_device() else { return };
    let rates = |device: Option<ComputeDevice>| {
        let problem = problem(prism(2, true), Order::Quadratic, loading(0.2, 1.0, 12), device);
        let fracture = matrix().fracture.expect("the matrix breaks");
        let stiffer = |young| vec![Material::hencky(young, 0.25).with_fracture(fracture), grain()];
        let slower = |viscosity_mpa_s| {
            vec![matrix().with_fracture(Fracture { viscosity_mpa_s, ..fracture }), grain()]
        };
        let young = matrix().elasticity.young_mpa();
        let parameters = vec![
            MaterialParameter::new("young", young, stiffer),
            MaterialParameter::new("viscosity", fracture.viscosity_mpa_s, slower),
        ];
        let problem = problem.with_sensitivities(parameters).expect("they are there");
        problem.run(&mut ()).sensitivities.force_n
    };
    let (here, there) = (rates(None), rates(Some(device)));
    for k in 0..2 {
        let largest = here.iter().map(|r| r[k].abs()).fold(0.0, f64::max);
        let error = here.iter().zip(&there).map(|(a, b)| (a[k] - b[k]).abs()).fold(0.0, f64::max);
        assert!(largest > 0.0 && error < 1e-5 * largest, "parameter {k}: {error} of {largest}");
    }
}

#[test]
fn a_sparse_factor_on_a_device_is_rejected() {
    let Some(device) = test_device() else { return };
    let options = SolverOptions { linear: LinearScheme::Direct, ..SolverOptions::default() };
    let builder = loading(0.2, 1.0, 2).builder(prism(2, false)).expect("a specimen");
    let refused = builder.materials([matrix()]).options(options).device(device).build();
    let message = refused.expect_err("it cannot be").to_string();
    assert!(message.contains("device") && message.contains("multigrid"), "{message}");
}
