use std::path::Path;

use fem::Outcome;
use nalgebra::{DMatrix, DVector};

use super::super::{ExtensometerCase, Similarity};
use super::brazilian_disc::BrazilianDisc;
use super::definition::TestKind;
use crate::case::CaseFile;
use crate::simulation::setup::Setup;
use crate::simulation::simulator::Simulator;
use crate::specimen::build::mesh_of;

const E: f64 = 1000.0;

fn material(poisson: f64) -> String {
    format!("[material.matrix]\nyoung_mpa = {E}\npoisson = {poisson}\n")
}

fn parse(text: &str) -> CaseFile {
    CaseFile::parse(text, Path::new("case.toml")).unwrap()
}

fn run(file: &CaseFile) -> (Simulator, Outcome) {
    let simulator = Simulator::new(&Setup::from(file), mesh_of(file).unwrap(), Vec::new()).unwrap();
    let outcome = simulator.run(&[], &mut ()).unwrap();
    (simulator, outcome)
}

/// Stiffness of the last point of a curve, N/mm.
fn stiffness(outcome: &Outcome) -> f64 {
    let last = outcome.curve.last().unwrap();
    last.force_n / last.displacement_mm
}

/// A bar without lateral contraction has the slope E A/L. The grips prevent the contraction near the ends, so that the
/// slope increases with Poisson's ratio, but remains below the modulus of confined tension.
#[test]
fn a_tension_bar_has_its_slope() {
    let bar = |poisson: f64| {
        let text = format!(
            "[specimen]\nradius_mm = 1.0\nheight_mm = 8.0\nspacing_mm = 0.5\n{}[test]\nkind = \"tension-bar\"\n\
             displacement_mm = 1e-4\nsteps = 1\n",
            material(poisson)
        );
        stiffness(&run(&parse(&text)).1)
    };
    let exact = E * std::f64::consts::PI / 8.0;
    assert!((bar(0.0) / exact - 1.0).abs() < 1e-3, "{}", bar(0.0) / exact);
    let gripped = bar(0.3) / exact;
    assert!(gripped > 1.002 && gripped < 1.03, "{gripped}");
}

/// Stress at the centre of a disc between smooth rigid jaws. Two opposite forces along a chord at the angle θ to the loaded
/// diameter cause the stresses 2P/(π D t) cos 3θ across this diameter and −2P/(π D t) (2 cos θ + cos 3θ) along it (Michell;
/// Timoshenko and Goodier, *Theory of Elasticity*, article 41). The pressure of a rigid jaw on the arc −α < θ < α is
/// proportional to 1/√(α² − θ²), and the mean of cos kθ with this weight is the Bessel function J₀(kα).
#[test]
fn a_brazilian_disc_has_the_stresses_of_rigid_jaws() {
    let (radius, thickness, contact_deg, poisson) = (10.0, 3.0, 15.0, 0.2);
    let text = format!(
        "[specimen]\nradius_mm = {radius}\nheight_mm = {thickness}\nspacing_mm = 0.9\n{}[test]\n\
         kind = {{ brazilian-disc = {{ contact_deg = {contact_deg} }} }}\ndisplacement_mm = 1e-3\nsteps = 1\n",
        material(poisson)
    );
    let file = parse(&text);
    let (simulator, outcome) = run(&file);
    // the gradient of the displacement at the centre, from a polynomial through the nodes around it, which is of third order
    // in the plane because the stress varies quadratically
    let nodes = simulator.problem().nodes();
    let near: Vec<usize> =
        (0..nodes.len()).filter(|&n| nodes[n][0].hypot(nodes[n][1]) < 0.2 * radius).collect();
    let terms = |n: usize| {
        let [x, y, z] = [nodes[n][0], nodes[n][1], nodes[n][2] - 0.5 * thickness];
        [
            [1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x],
            [x * x * x, x * x * y, x * y * y, y * y * y, x * z * z, y * z * z, 0.0, 0.0, 0.0, 0.0],
        ]
        .concat()
    };
    let matrix = DMatrix::from_fn(near.len(), 16, |row, column| terms(near[row])[column]);
    let decomposed = matrix.svd(true, true);
    let strain = [0, 1, 2].map(|axis| {
        let values = near.iter().map(|&n| outcome.fields.displacement[n][axis]);
        let values = DVector::from_iterator(near.len(), values);
        decomposed.solve(&values, 1e-12).unwrap()[1 + axis]
    });
    let (shear, trace) = (E / (1.0 + poisson), strain.iter().sum::<f64>());
    let stress = strain.map(|e| shear * (e + poisson / (1.0 - 2.0 * poisson) * trace));
    let force = outcome.curve[0].force_n;
    let nominal = 2.0 * force / (std::f64::consts::PI * 2.0 * radius * thickness);
    // the faces under a jaw cover a larger arc than the stated one
    let mut mesh = mesh_of(&file).unwrap();
    BrazilianDisc { contact_deg }.add_surfaces(&mut mesh).unwrap();
    let under_jaw = mesh.surfaces["jaw-right"].iter().flatten().map(|&n| mesh.nodes[n as usize]);
    let alpha = under_jaw.map(|[x, y, _]| y.atan2(x).abs()).fold(0.0, f64::max);
    assert!((1.0..2.0).contains(&(2.0 * alpha.to_degrees() / contact_deg)), "{alpha}");
    // J₀ by its series
    let bessel = |x: f64| 1.0 - x.powi(2) / 4.0 + x.powi(4) / 64.0 - x.powi(6) / 2304.0;
    let across = nominal * bessel(3.0 * alpha);
    let along = -nominal * (2.0 * bessel(alpha) + bessel(3.0 * alpha));
    assert!(force > 0.0);
    assert!((stress[1] / across - 1.0).abs() < 0.02, "{stress:?}, {across}");
    assert!((stress[0] / along - 1.0).abs() < 0.02, "{stress:?}, {along}");
}

/// Length, width and depth of the beam, and its span: four times its depth.
const BEAM: ([f64; 3], f64) = ([44.0, 5.0, 10.0], 40.0);

fn beam(further: &str, spacing: f64, test: &str) -> CaseFile {
    let ([length, width, depth], span) = BEAM;
    parse(&format!(
        "[specimen]\nblock_mm = [{length}, {width}, {depth}]\nnotch = {{ depth_mm = 3.0, width_mm = 0.2 }}\n\
         spacing_mm = {spacing}\n{}{further}[test]\nkind = {{ notched-beam = {{ span_mm = {span:?} }} }}\n{test}\n",
        material(0.3)
    ))
}

/// Deflection of the centre line of a notched beam against published formulas: the beam without notch (Timoshenko and
/// Goodier, Theory of Elasticity, art. 40: P L³/(48 E I) (1 + 2.85 (h/L)² − 0.84 (h/L)³) for Poisson's ratio 0.3), and the
/// crack (Tada, Paris and Irwin, The Stress Analysis of Cracks Handbook: 6 M/(b h²) L/E V(a/h) for L = 4 h).
#[test]
fn a_notched_beam_has_its_published_compliance() {
    let ([_, width, depth], span) = BEAM;
    let mut file = beam("", 1.7, "displacement_mm = 1e-3\nsteps = 1");
    let at_load_line = 1.0 / stiffness(&run(&file).1);
    let middle = 0.5 * depth;
    let gauge = ExtensometerCase { from_mm: [-0.5 * span, 0.0, middle], to_mm: [0.0, 0.0, middle] };
    file.case.conditions.as_mut().unwrap().extensometer = Some(gauge);
    let measured = 1.0 / stiffness(&run(&file).1);
    let ratio = depth / span;
    let bending =
        0.25 / (E * width * ratio.powi(3)) * (1.0 + 2.85 * ratio.powi(2) - 0.84 * ratio.powi(3));
    let a = 3.0 / depth;
    let v = (a / (1.0 - a)).powi(2)
        * (5.58 - 19.57 * a + 36.82 * a.powi(2) - 34.94 * a.powi(3) + 12.77 * a.powi(4));
    let crack = 1.5 * span / (width * depth.powi(2)) * span / E * v;
    let exact = bending + crack;
    assert!((measured / exact - 1.0).abs() < 0.03, "{} of {bending} + {crack}", measured / exact);
    // the lines of supports and load sink into the beam
    assert!(at_load_line > 1.01 * measured && at_load_line < 1.2 * measured, "{at_load_line}");
}

/// The crack of a notched beam starts at the notch and grows towards the load.
#[test]
fn the_crack_of_a_notched_beam_starts_at_the_notch() {
    let damage = "toughness_n_per_mm = 0.05\nviscosity_mpa_s = 0.01\n[phase_field]\nmodel = \"at1\"\n\
                  length_mm = 0.8\nsplit = \"spectral\"\n";
    let test = "displacement_mm = 0.8\nsteps = 40\nstop_below_peak = 0.1";
    let mut file = beam(damage, 1.2, test);
    file.case.specimen.order = fem::Order::Linear;
    let (simulator, outcome) = run(&file);
    let damage = &outcome.fields.damage;
    let most = (0..damage.len()).max_by(|&a, &b| damage[a].total_cmp(&damage[b])).unwrap();
    let [x, _, z] = simulator.problem().nodes()[most];
    assert!(damage[most] > 0.9, "{}", damage[most]);
    assert!(x.abs() < 1.3 && (3.0 - 1e-9..6.0).contains(&z), "({x}, {z})");
    // nothing breaks at the lines of supports and load
    let far = |n: &usize| {
        let [x, _, z] = simulator.problem().nodes()[*n];
        x.abs() > 4.0 || z > 9.0
    };
    let elsewhere = (0..damage.len()).filter(far).map(|n| damage[n]).fold(0.0, f64::max);
    assert!(elsewhere < 0.3, "{elsewhere}");
}

/// A confined cylinder without damage: the pressure p acts first, and the force on the top is A (E ε − 2 ν (−p)) = A (E ε +
/// 2 ν p) for a compression ε, at small strain.
#[test]
fn a_confined_cylinder_carries_the_force_of_hooke() {
    let (pressure, poisson) = (0.5, 0.25);
    let text = format!(
        "[specimen]\nradius_mm = 2.0\nheight_mm = 4.0\nspacing_mm = 1.2\n{}[test]\n\
         kind = {{ confined-compression = {{ pressure_mpa = {pressure:?}, confinement_s = 1.0 }} }}\n\
         displacement_mm = 4e-3\nduration_s = 2.0\nsteps = 4\n",
        material(poisson)
    );
    let file = parse(&text);
    let conditions = file.case.conditions.as_ref().unwrap();
    assert_eq!(conditions.confined_s(2.0), Some(1.0));
    let curve = run(&file).1.curve;
    let area = std::f64::consts::PI * 4.0;
    let [confined, last] = [&curve[1], &curve[3]];
    assert_eq!([confined.time_s, last.time_s], [1.0, 2.0]);
    let exact = |strain: f64| area * (E * strain + 2.0 * poisson * pressure);
    assert!((confined.force_n / exact(0.0) - 1.0).abs() < 0.01, "{}", confined.force_n);
    assert!((last.force_n / exact(1e-3) - 1.0).abs() < 0.01, "{}", last.force_n);
}

/// The conditions of a kind are no part of the case file: the effective case reads as the case itself, and another kind
/// replaces the conditions.
#[test]
fn a_kind_replaces_conditions_and_is_written_alone() {
    let file = beam("", 1.7, "displacement_mm = 0.1\nsteps = 1");
    let text = file.case.to_toml();
    assert!(!text.contains("[conditions]") && text.contains("notched-beam"), "{text}");
    assert_eq!(parse(&text), file);
    let conditions = file.case.conditions.unwrap();
    assert_eq!(conditions.similarity, Some(Similarity::Equal));
    assert_eq!(conditions.lines.len(), 3);
}

#[test]
fn wrong_keys_of_a_kind_are_refused() {
    let cylinder = "radius_mm = 10.0\nheight_mm = 5.0\nspacing_mm = 2.0\n";
    let block = "block_mm = [44.0, 5.0, 10.0]\nspacing_mm = 2.0\n";
    let notch = "notch = { depth_mm = 3.0, width_mm = 0.5 }\n";
    let notched = format!("{block}{notch}");
    let disc = "kind = { brazilian-disc = { contact_deg = 10.0 } }\n";
    let beam = "kind = { notched-beam = { span_mm = 40.0 } }\n";
    let confined =
        "kind = { confined-compression = { pressure_mpa = 0.5, confinement_s = 0.5 } }\n";
    let moved = "displacement_mm = 0.1\n";
    let mistake = |specimen: &str, test: &str| {
        let text = format!("[specimen]\n{specimen}{}[test]\n{test}steps = 4\n", material(0.3));
        CaseFile::parse(&text, Path::new("case.toml")).map(drop).map_err(|e| e.to_string())
    };
    for (specimen, kind) in [(cylinder, disc), (&*notched, beam), (cylinder, confined)] {
        assert_eq!(mistake(specimen, &format!("{kind}{moved}")), Ok(()));
        assert_eq!(mistake(specimen, &format!("kind = \"tension-bar\"\n{moved}")), Ok(()));
    }
    let other = |kind: &str, from: &str, to: &str| {
        assert!(kind.contains(from));
        format!("{}{moved}", kind.replacen(from, to, 1))
    };
    for (specimen, test, parts) in [
        (cylinder, disc.to_owned(), ["test.displacement_mm", "brazilian-disc needs it"]),
        (block, format!("{disc}{moved}"), ["test.kind", "\"side\""]),
        (cylinder, other(disc, "10.0", "0.0"), ["contact_deg = 0", "at most 90 degrees"]),
        (cylinder, other(disc, "10.0", "91.0"), ["contact_deg = 91", "at most 90 degrees"]),
        (cylinder, other(disc, "brazilian", "brasilian"), ["brasilian-disc", "brazilian-disc"]),
        (cylinder, format!("{beam}{moved}"), ["specimen.block_mm", "is missing"]),
        (block, format!("{beam}{moved}"), ["specimen.notch", "is missing"]),
        (&*notched, other(beam, "40.0", "45.0"), ["span_mm = 45", "44 mm"]),
        (&*notched, other(beam, "40.0", "0.4"), ["span_mm = 0.4", "0.5 mm"]),
        (cylinder, other(confined, "0.5,", "-0.5,"), ["pressure_mpa = -0.5", "0 and"]),
        (
            cylinder,
            other(confined, "confinement_s = 0.5", "confinement_s = 1.0"),
            ["confinement_s = 1", "test.duration_s = 1 s"],
        ),
        (
            cylinder,
            format!("{disc}{moved}platens = \"unilateral\"\n"),
            ["test.platens", "brazilian-disc"],
        ),
        (
            cylinder,
            format!("{disc}program = [{{ time_s = 1.0, displacement_mm = 0.1 }}]\n"),
            ["test.program", "brazilian-disc"],
        ),
        (
            cylinder,
            format!(
                "{disc}{moved}steps = 4\n[conditions]\nmeasure = {{ surface = \"top\", direction = [1, 0, 0] }}\n# "
            ),
            ["conditions", "remove one of the two"],
        ),
        (notch, String::new(), ["specimen.spacing_mm", "is missing"]),
        (&*format!("{cylinder}{notch}"), moved.to_owned(), ["specimen.notch", "block_mm"]),
        (
            &*format!("{block}radius_mm = 1.0\n"),
            moved.to_owned(),
            ["specimen.radius_mm", "block_mm"],
        ),
        (
            &*notched.replacen("3.0", "10.0", 1),
            format!("{beam}{moved}"),
            ["specimen.notch.depth_mm = 10", "depth of the block"],
        ),
        (
            &*notched.replacen("spacing_mm = 2.0", "spacing_mm = 6.0", 1),
            format!("{beam}{moved}"),
            ["specimen.spacing_mm = 6", "between"],
        ),
        (
            &*notched.replacen("spacing_mm = 2.0", "spacing_mm = 0.001", 1),
            format!("{beam}{moved}"),
            ["specimen.spacing_mm = 0.001", "tetrahedra"],
        ),
    ] {
        let message = mistake(specimen, &test).unwrap_err();
        for part in parts {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
    }
}

/// A jaw on a mesh whose elements are wider than the arc is an error with the remedy.
#[test]
fn a_jaw_narrower_than_an_element_is_refused() {
    let text = format!(
        "[specimen]\nradius_mm = 10.0\nheight_mm = 5.0\nspacing_mm = 4.0\n{}[test]\n\
         kind = {{ brazilian-disc = {{ contact_deg = 0.5 }} }}\ndisplacement_mm = 0.1\nsteps = 1\n",
        material(0.3)
    );
    let file = parse(&text);
    let error = Simulator::new(&Setup::from(&file), mesh_of(&file).unwrap(), Vec::new());
    let error = error.unwrap_err().to_string();
    for part in ["jaw-left", "contact_deg = 0.5", "specimen.spacing_mm"] {
        assert!(error.contains(part), "{error}");
    }
}
