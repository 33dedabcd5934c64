//! Checkpoints: a run that is interrupted and resumed gives the same curve, bit for bit.

use std::ops::ControlFlow;

use crate::support::column::snap_back;
use crate::support::{between, grain, loading, matrix, phase_field, prism};
use fem::{
    Checkpoint, CheckpointError, CrackDensity, CurvePoint, End, FemError, Fields, Friction,
    Irreversibility, MaterialParameter, Observer, Order, Outcome, PhaseField, Platens, Problem,
    Split,
};

fn test(field: PhaseField) -> Problem {
    pushed(0.2, field)
}

fn pushed(displacement_mm: f64, field: PhaseField) -> Problem {
    let materials = vec![matrix(), grain()];
    crate::support::test(
        prism(3, true),
        Order::Linear,
        materials,
        Some(field),
        loading(displacement_mm, 1.0, 20),
        1e-8,
    )
}

/// Observer that interrupts a run after `after` steps, and records the length of the curve at a resumption.
struct Kill {
    after: usize,
    steps: usize,
    resumed: usize,
}

impl Observer for Kill {
    fn step(&mut self, _: &CurvePoint, _: &Fields) -> ControlFlow<()> {
        self.steps += 1;
        if self.steps == self.after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn resumed(&mut self, curve: &[CurvePoint]) {
        self.resumed = curve.len();
    }
}

/// Interrupts a run after every 7 steps and resumes it, until it ends. Returns the outcome, and for each part of the run
/// the number of points from which the part resumed.
fn interrupted_and_resumed(test: &Problem, checkpoint: &Checkpoint) -> (Outcome, Vec<usize>) {
    let mut resumed_at = Vec::new();
    loop {
        let mut kill = Kill { after: 7, steps: 0, resumed: 0 };
        let outcome = test.run_resumable(checkpoint, &mut kill).expect("a sound state");
        resumed_at.push(kill.resumed);
        if !matches!(outcome.end, End::Interrupted) {
            return (outcome, resumed_at);
        }
    }
}

#[test]
fn a_resumed_run_equals_the_uninterrupted_run_bit_for_bit() {
    let dir = tempfile::tempdir().expect("a directory");
    let rough =
        Friction { coefficient: 0.1, slip_velocity_mm_per_s: 1e-2, drag_mpa_s_per_mm: 0.01 };
    let ratchet = PhaseField {
        irreversibility: Irreversibility::ActiveSet,
        ..phase_field(Split::VolumetricDeviatoric)
    };
    let history =
        PhaseField { irreversibility: Irreversibility::History, ..phase_field(Split::None) };
    let young = MaterialParameter::new("young", 275.0, |x| {
        let elasticity = fem::Material::hencky(x, 0.25).elasticity;
        vec![fem::Material { elasticity, ..matrix() }, grain()]
    });
    let differentiated = test(ratchet).with_sensitivities(vec![young]).expect("valid");
    let cases = [
        test(phase_field(Split::None)),
        differentiated,
        test(history),
        between(
            &test(phase_field(Split::None)),
            &loading(0.2, 1.0, 20),
            Platens::Unilateral(rough),
        ),
    ];
    for (k, test) in cases.iter().enumerate() {
        let whole = Checkpoint { path: dir.path().join(format!("whole-{k}")), every: 4 };
        let reference = test.run_resumable(&whole, &mut ()).expect("no file is there");
        assert!(matches!(reference.end, End::Displacement), "{:?}", reference.end);
        let interrupted = Checkpoint { path: dir.path().join(format!("parts-{k}")), every: 4 };
        let (outcome, resumed_at) = interrupted_and_resumed(test, &interrupted);
        assert_eq!(resumed_at, [0, 4, 8, 12, 16], "case {k}");
        assert_eq!(outcome.curve, reference.curve, "case {k}");
        assert_eq!(outcome.fields, reference.fields, "case {k}");
        assert_eq!(outcome.reactions, reference.reactions, "case {k}");
        assert_eq!(outcome.effort, reference.effort, "case {k}");
        assert_eq!(outcome.sensitivities, reference.sensitivities, "case {k}");
        let rows = if k == 1 { reference.curve.len() } else { 0 };
        assert_eq!(reference.sensitivities.force_n.len(), rows);
    }
}

/// A run that resumes and takes no step has the contact points of the run that saved the state.
#[test]
fn a_run_that_resumes_without_a_step_has_its_contact_points() {
    let dir = tempfile::tempdir().expect("a directory");
    let rough =
        Friction { coefficient: 0.1, slip_velocity_mm_per_s: 1e-2, drag_mpa_s_per_mm: 0.01 };
    let test = between(
        &test(phase_field(Split::None)),
        &loading(0.2, 1.0, 20),
        Platens::Unilateral(rough),
    );
    let checkpoint = Checkpoint { path: dir.path().join("run.state"), every: 4 };
    let mut kill = Kill { after: 4, steps: 0, resumed: 0 };
    let saved = test.run_resumable(&checkpoint, &mut kill).expect("no file is there");
    let resumed = test.resume(&checkpoint).expect("a sound state").finish();
    assert_eq!(resumed.curve, saved.curve);
    assert_eq!(
        resumed.contact.keys().collect::<Vec<_>>(),
        saved.contact.keys().collect::<Vec<_>>()
    );
    let contact_points =
        |outcome: &Outcome| outcome.contact.values().flatten().cloned().collect::<Vec<_>>();
    let (resumed, saved) = (contact_points(&resumed), contact_points(&saved));
    assert!(saved.iter().any(|point| point.pressure_mpa > 0.0), "{saved:?}");
    assert_eq!(resumed.len(), saved.len());
    for (a, b) in resumed.iter().zip(&saved) {
        assert_eq!((a.node, a.area_mm2), (b.node, b.area_mm2));
        assert!((a.pressure_mpa - b.pressure_mpa).abs() < 1e-9, "{a:?} {b:?}");
        assert!((0..3).all(|k| (a.force_n[k] - b.force_n[k]).abs() < 1e-9), "{a:?} {b:?}");
    }
}

#[test]
fn a_run_by_arc_length_steps_resumes_while_the_platen_moves_back() {
    let dir = tempfile::tempdir().expect("a directory");
    for model in [CrackDensity::At2, CrackDensity::At1] {
        let test = snap_back(model);
        let whole = Checkpoint { path: dir.path().join(format!("whole-{model:?}")), every: 3 };
        let reference = test.run_resumable(&whole, &mut ()).expect("no file is there");
        assert!(matches!(reference.end, End::BelowPeak), "{model:?}: {:?}", reference.end);
        let interrupted =
            Checkpoint { path: dir.path().join(format!("parts-{model:?}")), every: 3 };
        let (outcome, resumed_at) = interrupted_and_resumed(&test, &interrupted);
        let back = |at: usize| {
            at > 0 && reference.curve[at].displacement_mm < reference.curve[at - 1].displacement_mm
        };
        assert!(
            resumed_at.iter().any(|&at| back(at)),
            "{model:?}: no part resumed while the platen moved back: {resumed_at:?}"
        );
        assert_eq!(outcome.curve, reference.curve, "{model:?}");
        assert_eq!(outcome.fields, reference.fields, "{model:?}");
        assert_eq!(outcome.effort, reference.effort, "{model:?}");
    }
}

#[test]
fn an_interruption_at_a_saved_step_loses_no_step() {
    let dir = tempfile::tempdir().expect("a directory");
    let checkpoint = Checkpoint { path: dir.path().join("run.state"), every: 4 };
    let test = test(phase_field(Split::None));
    let mut resumed_at = Vec::new();
    for _ in 0..5 {
        let mut kill = Kill { after: 4, steps: 0, resumed: 0 };
        let outcome = test.run_resumable(&checkpoint, &mut kill).expect("a sound state");
        resumed_at.push((
            kill.resumed,
            outcome.curve.len(),
            matches!(outcome.end, End::Displacement),
        ));
    }
    let stops = [(0, 4, false), (4, 8, false), (8, 12, false), (12, 16, false), (16, 20, true)];
    assert_eq!(resumed_at, stops);
}

#[test]
fn a_state_of_another_problem_or_version_is_rejected() {
    let dir = tempfile::tempdir().expect("a directory");
    let checkpoint = Checkpoint { path: dir.path().join("run.state"), every: 2 };
    let kill = || Kill { after: 3, steps: 0, resumed: 0 };
    let base = test(phase_field(Split::None));
    base.run_resumable(&checkpoint, &mut kill()).expect("a fresh run");
    let refused = |test: &Problem, reason: CheckpointError| {
        let error = test.resume(&checkpoint).expect_err("refused");
        let FemError::Checkpoint { path, source } = &error else { panic!("{error}") };
        assert_eq!((path, *source), (&checkpoint.path, reason), "{error}");
        let message = error.to_string();
        assert!(message.contains("run.state") && message.contains("delete the file"), "{message}");
    };
    let softer =
        fem::Material { elasticity: fem::Material::hencky(274.0, 0.25).elasticity, ..matrix() };
    refused(
        &base.with_materials(vec![softer, grain()]).expect("valid"),
        CheckpointError::OtherProblem,
    );
    refused(&pushed(0.21, phase_field(Split::None)), CheckpointError::OtherProblem);
    let mut bytes = std::fs::read(&checkpoint.path).expect("a state");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&checkpoint.path, &bytes).expect("written");
    refused(&base, CheckpointError::Damaged);
    std::fs::write(&checkpoint.path, "").expect("written");
    refused(&base, CheckpointError::Damaged);
    // write a valid file of an older format, with its checksum, the FNV-1a hash of its content
    let mut old = b"breccia-state 2\n{}\n".to_vec();
    let sum = old.iter().fold(0xcbf2_9ce4_8422_2325_u64, |sum, &byte| {
        (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    old.extend(sum.to_le_bytes());
    std::fs::write(&checkpoint.path, old).expect("written");
    refused(&base, CheckpointError::Version);
    std::fs::remove_file(&checkpoint.path).expect("a file");
    std::fs::create_dir(&checkpoint.path).expect("a directory in its place");
    let unreadable = base.resume(&checkpoint).expect_err("refused");
    let FemError::Io { action: "read", source, .. } = &unreadable else { panic!("{unreadable}") };
    assert!(source.raw_os_error().is_some(), "the system's own error: {source:?}");
    let never = Checkpoint { every: 0, ..checkpoint };
    let message = base.resume(&never).expect_err("refused").to_string();
    assert!(message.contains("checkpoint: every"), "{message}");
}
