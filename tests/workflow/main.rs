//! The whole workflow on a tiny case: it writes every documented file, skips finished stages, and resumes after a kill.

#[path = "../program/accepted.rs"]
mod accepted;
mod browser;
mod conditions;
mod creep;
mod curve;
mod derivatives;
mod discrepancy;
mod fidelity;
mod further_tests;
mod images;
mod labels;
mod load_program;
mod own_data;
mod quadrature;
mod quantities;
mod relaxing;
mod sequential;
mod several_tests;
mod sharing;
mod simulator;
mod stages;
mod study;
mod validation;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Some hundred tetrahedra, 12 runs, three virtual specimens, two short chains.
const TINY: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
grains = { fraction = 0.05, seed = 1, film_mm = 0.5, form = "sphere" }
[specimen.scan]
voxel_mm = 0.125
[specimen.image]
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[material.grain]
young_mpa = 22000.0
poisson = 0.25
toughness_n_per_mm = 1.83
viscosity_mpa_s = 0.1
[phase_field]
length_mm = 0.06
[test]
displacement_mm = 0.22
steps = 44
stop_below_peak = 0.1
[prior]
matrix.young_mpa = [250.0, 300.0]
matrix.toughness_n_per_mm = [0.00001, 0.005]
matrix.viscosity_mpa_s = [0.05, 0.55]
[design]
runs = 12
[surrogate]
max_order = 2
[experiments.virtual]
specimens = 3
seed = 11
spacing_mm = 1.25
truth = { matrix.young_mpa = 275.0, matrix.toughness_n_per_mm = 0.0025, matrix.viscosity_mpa_s = 0.3 }
[calibration]
chains = 2
warmup = 150
draws = 150
[confirm]
draws = 1
"#;

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("cargo has built the program")
}

/// Runs the program to its end and returns exit code, stdout and stderr.
fn breccia(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = start(folder, arguments).wait_with_output().unwrap();
    accepted::check_cases(folder, arguments, output.status.success());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn case_folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("tiny.toml"), TINY).unwrap();
    dir
}

/// The tiny case and all its results in `results`, made once for all tests that only read them.
struct Finished {
    dir: tempfile::TempDir,
    /// Standard output of `breccia run`.
    printed: String,
    /// Standard error of `breccia run`.
    progress: String,
}

fn finished_tiny() -> &'static Finished {
    static ONCE: OnceLock<Finished> = OnceLock::new();
    ONCE.get_or_init(|| {
        let dir = case_folder();
        let run = ["run", "tiny.toml", "--out", "results", "--threads", "2"];
        let (code, printed, err) = breccia(dir.path(), &run);
        assert_eq!(code, Some(0), "{err}");
        Finished { dir, printed, progress: err }
    })
}

/// The tiny case without a scan: the grains of the packing are meshed directly.
fn without_image() -> String {
    let text = TINY.replace("[specimen.scan]\nvoxel_mm = 0.125\n[specimen.image]\n", "");
    assert_ne!(text, TINY);
    text
}

/// A copy of the finished tiny case, for a test that changes the results.
fn copy_of_tiny() -> tempfile::TempDir {
    copy_with_results(finished_tiny().dir.path(), "results")
}

/// A copy of a folder that has a case and its results in `out`.
fn copy_with_results(whole: &Path, out: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    copy(whole, dir.path());
    // the results contain the path of their case, which the copy has to change
    let [old, new] = [whole, dir.path()].map(|d| d.canonicalize().unwrap().display().to_string());
    let out = dir.path().join(out);
    edit(&out.join("origin.toml"), |text| text.replace(&old, &new));
    record(&out, "origin.toml");
    dir
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(std::fs::copy(entry.path(), target).unwrap()),
        }
    }
}

/// Checksum of a file as in `written.csv`: FNV-1a of its bytes, and its length.
fn content(path: &Path) -> String {
    let text = std::fs::read(path).unwrap();
    let bytes = text.iter().copied().chain((text.len() as u64).to_le_bytes());
    let sum = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{sum:016x}")
}

/// Registers a file of the results as written by the program.
fn record(out: &Path, name: &str) {
    let line = format!("{},{name}\n", content(&out.join(name)));
    edit(&out.join("written.csv"), |text| format!("{text}{line}"));
}

fn edit(path: &Path, change: impl Fn(&str) -> String) {
    let text = std::fs::read_to_string(path).unwrap();
    let changed = change(&text);
    assert_ne!(changed, text, "{}", path.display());
    std::fs::write(path, changed).unwrap();
}

/// Cells by column name, one map per row.
fn table(path: &Path) -> Vec<BTreeMap<String, String>> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|line| {
            header.iter().map(|h| h.to_string()).zip(line.split(',').map(str::to_owned)).collect()
        })
        .collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} = {:?}", row[column]))
}

/// A table without the column of run times.
fn without_seconds(path: &Path) -> Vec<BTreeMap<String, String>> {
    let mut rows = table(path);
    rows.iter_mut().for_each(|row| drop(row.remove("seconds")));
    rows
}

/// The output names the simulated objects, the counted items of each percentage, and both kinds of time.
#[test]
fn progress_has_labels_and_named_times() {
    let progress = &finished_tiny().progress;
    assert_eq!(progress.matches("3 virtual specimens are simulated").count(), 1, "{progress}");
    for part in ["virtual specimens: ", "runs: ", "runs at the mode and at draws: ", "draws: "] {
        let is_of_bar = |line: &str| line.contains(" %  ") && line.contains(part);
        assert!(progress.lines().any(is_of_bar), "{part} is not in {progress}");
    }
    let ensemble = progress.lines().find(|line| line.contains("runs usable")).unwrap();
    for part in ["processor time ", " s per run; elapsed time "] {
        assert!(ensemble.contains(part), "{part} is not in {ensemble}");
    }
}

#[test]
fn from_an_empty_directory_to_every_documented_file() {
    let dir = copy_of_tiny();
    let out = &finished_tiny().printed;
    let results = dir.path().join("results");

    let headers = [
        ("segment.csv", "quantity,value"),
        ("mesh.csv", "quantity,value"),
        ("grains.csv", "id,volume_mm3,x_mm,y_mm,z_mm"),
        ("runs.csv", "# provenance: breccia ensemble\n# input,matrix.young_mpa,250.0,300.0\n"),
        (
            "failed_runs.csv",
            "run,matrix.young_mpa,matrix.toughness_n_per_mm,matrix.viscosity_mpa_s,seconds,reason",
        ),
        (
            "experiments.csv",
            "id,group,height_mm,radius_mm,displacement_factor,force_factor,slope_fraction,slope_N_per_mm,peak_force_N,displacement_at_peak_mm",
        ),
        ("curve_checks.csv", "id,finding,value,help"),
        ("range.csv", "qoi,experiment_mean,low,high,inside"),
        ("experiments/specimens.csv", "id,height_mm,radius_mm,group"),
        ("experiments/curves/V-01.csv", "displacement_mm,force_N"),
        ("experiments/bias.csv", "quantity,surrogate_mesh,experiments_mesh,percent_bias"),
        ("predictive.csv", "chain,draw,slope_N_per_mm,peak_force_N,displacement_at_peak_mm"),
        (
            "predictive_curves.csv",
            "displacement_mm,force_N_q05,force_N_q25,force_N_q50,force_N_q75,force_N_q95",
        ),
        ("fields/map.csv", "state,time_s,displacement_mm,force_N,picture"),
        ("curves/baseline.csv", "time_s,displacement_mm,force_N"),
        ("summary.csv", "parameter,mean,sd,q05,q50,q95,rhat,ess_bulk,ess_tail,contraction"),
        ("map.csv", "parameter,map,truth"),
        ("loo.csv", "specimen,elpd,pareto_k\nV-01,"),
        ("influence.csv", "specimen,parameter,shift_sd,method\nV-01,matrix.young_mpa,"),
        (
            "fit.csv",
            "qoi,experiment_mean,map_surrogate,percent_error,sd_percent,simulation_sd_percent,sample_bound_percent\nslope_N_per_mm,",
        ),
        ("verdict.csv", "parameter,contraction,verdict\nmatrix.young_mpa,"),
        (
            "sobol.csv",
            "qoi,input,first,first_q05,first_q95,total,total_q05,total_q95\nslope_N_per_mm,",
        ),
        ("confirm.csv", "qoi,experiment_mean,map_simulation,percent_error"),
        (
            "next-test.csv",
            "candidate,parameter,specimens,contraction,contraction_q05,contraction_q95,width90\nmore specimens,",
        ),
        ("next-test-specimens.csv", "candidate,parameter,goal,value,specimens,limit"),
        (
            "curves/run-001.csv",
            "time_s,displacement_mm,force_N,elastic_N_mm,fracture_N_mm,viscous_N_mm,phi_mean,phi_max",
        ),
        ("curves/map.csv", "time_s,displacement_mm,force_N"),
    ];
    for (name, header) in headers {
        let text =
            std::fs::read_to_string(results.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(text.starts_with(header), "{name}: {}", text.lines().next().unwrap_or(""));
    }
    for name in [
        "case.toml",
        "labels.tif",
        "grains.csv",
        "segment.csv",
        "slices.png",
        "mesh.png",
        "mesh.vtu",
        "mesh.msh",
        "surrogate.json",
        "surrogate_uncertainty.json",
        "posterior.zarr/zarr.json",
        "posterior.csv",
        "posterior.txt",
        "summary.txt",
        "warnings.txt",
        "fields/map.pvd",
        "fields/map-rising.vtu",
        "fields/map-peak.vtu",
        "fields/map-peak.png",
        "report.html",
    ] {
        assert!(results.join(name).is_file(), "{name}");
    }
    for part in ["young_mpa", "parameter,map,truth", "percent_error", "report.html"] {
        assert!(out.contains(part), "{part} is not printed: {out}");
    }

    // every run has parameters inside the prior box
    let runs = table(&results.join("runs.csv"));
    assert_eq!(runs.len(), 12);
    for run in &runs {
        assert!((250.0..=300.0).contains(&number(run, "matrix.young_mpa")));
        assert!(number(run, "seconds") >= 0.0);
    }
    // viscous limit: the slope is proportional to E, the displacement at peak to (ξ/E)^(1/3)
    let correlation = |x: &dyn Fn(&BTreeMap<String, String>) -> f64, y: &str| {
        let pairs: Vec<(f64, f64)> = runs.iter().map(|r| (x(r), number(r, y))).collect();
        let n = pairs.len() as f64;
        let mean = pairs.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
        let sum = |f: &dyn Fn(f64, f64) -> f64| {
            pairs.iter().map(|p| f(p.0 - mean.0, p.1 - mean.1)).sum::<f64>()
        };
        sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
    };
    assert!(correlation(&|r| number(r, "matrix.young_mpa"), "slope_N_per_mm") > 0.8);
    let law = |r: &BTreeMap<String, String>| {
        (number(r, "matrix.viscosity_mpa_s") / number(r, "matrix.young_mpa")).cbrt()
    };
    assert!(correlation(&law, "displacement_at_peak_mm") > 0.9);

    // the mode is inside the prior box, the truth equals the case's values, and the simulation at the mode agrees with
    // the experiments
    let map = table(&results.join("map.csv"));
    let names: Vec<&str> = map.iter().map(|row| row["parameter"].as_str()).collect();
    assert_eq!(names, ["matrix.young_mpa", "matrix.toughness_n_per_mm", "matrix.viscosity_mpa_s"]);
    let data = surrogate::Dataset::read_csv(results.join("runs.csv")).unwrap();
    assert_eq!((data.len(), data.inputs().len(), data.notes().len()), (12, 3, 4));
    assert!((250.0..=300.0).contains(&number(&map[0], "map")));
    assert_eq!(number(&map[2], "truth"), 0.3);
    for row in table(&results.join("confirm.csv")) {
        let error =
            100.0 * (number(&row, "map_simulation") / number(&row, "experiment_mean") - 1.0).abs();
        assert!((error - number(&row, "percent_error")).abs() < 1e-9);
        assert!(error < 10.0, "{row:?}");
    }

    // the fields come from the confirming simulation and include its peak
    let curve = table(&results.join("curves/map.csv"));
    let states = table(&results.join("fields/map.csv"));
    let of = |rows: &[BTreeMap<String, String>]| -> Vec<[f64; 2]> {
        rows.iter().map(|r| ["displacement_mm", "force_N"].map(|c| number(r, c))).collect()
    };
    let (curve, states) = (of(&curve), of(&states));
    assert!(states.iter().all(|state| curve.contains(state)), "{states:?}");
    let highest = curve.iter().map(|point| point[1]).fold(0.0, f64::max);
    assert_eq!(states[1][1], highest);
    let fields = std::fs::read_to_string(results.join("fields/map-peak.vtu")).unwrap();
    for name in ["displacement_mm", "damage", "energy_density_mpa", "stress_mpa", "von_mises_mpa"] {
        assert!(fields.contains(&format!("Name=\"{name}\"")), "{name}");
    }

    // on this mesh the quadrature affects the result, and the report contains the comparison
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("the result depends on the quadrature of the damage terms"));

    // tables for users have names, and the units of the experiments
    let summary = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    assert!(summary.contains("correlation[peak-force,slope]") && !summary.contains("corr["));
    let slopes = |rows: &[BTreeMap<String, String>]| {
        rows.iter().map(|row| number(row, "slope_N_per_mm")).sum::<f64>() / rows.len() as f64
    };
    let measured = slopes(&table(&results.join("experiments.csv")));
    let predicted = slopes(&table(&results.join("predictive.csv")));
    assert!((predicted / measured - 1.0).abs() < 0.05, "{predicted} {measured}");
    let store = results.join("posterior.zarr");
    let text = |path: &str| {
        let bytes = std::fs::read(store.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
        String::from_utf8_lossy(&bytes).into_owned()
    };
    assert!(text("observed_data/qois/zarr.json").contains("\"specimen\""));
    let units = |array: &str| -> serde_json::Value {
        let array: serde_json::Value =
            serde_json::from_str(&text(&format!("{array}/zarr.json"))).unwrap();
        array["attributes"]["units"].clone()
    };
    let of_quantities = serde_json::json!(["N/mm", "N", "mm"]);
    for array in ["posterior/mean", "posterior_predictive/new_specimen", "observed_data/qois"] {
        assert_eq!(units(array), of_quantities, "{array}");
    }
    assert_eq!(units("posterior/theta"), serde_json::json!(["MPa", "N/mm", "MPa s"]));
    assert_eq!(units("posterior/sd"), "1");
    // the stored data are the measured quantities, not the contrasts of the likelihood
    let qois: Vec<f64> = std::fs::read(store.join("observed_data/qois/c/0/0"))
        .unwrap()
        .chunks(8)
        .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    let experiments = table(&results.join("experiments.csv"));
    for (row, qois) in experiments.iter().zip(qois.chunks(3)) {
        assert_eq!([number(row, "slope_N_per_mm"), number(row, "peak_force_N")], qois[..2]);
    }
    for group in ["observed_data", "posterior_predictive", "prior_predictive"] {
        assert!(!store.join(group).join("data.contrast").exists(), "{group}");
    }
    assert!(text("observed_data/specimen/c/0").contains("V-02"));
    assert!(text("posterior/qoi/c/0").contains("slope_N_per_mm"));
    assert!(text("posterior/parameter/c/0").contains("matrix.young_mpa"));

    // the report has its sections, and a second report is identical
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in [
        "Where the uncertainty comes from",
        "divergent transitions",
        "correlation[peak-force,slope]",
        "Damage at the MAP",
        "prefers-color-scheme: dark",
        "<svg viewBox=",
    ] {
        assert!(page.contains(part), "{part}");
    }
    std::fs::remove_file(results.join("report.html")).unwrap();

    // the same command makes only the missing product again
    let stamp = |name: &str| std::fs::metadata(results.join(name)).unwrap().modified().unwrap();
    let names = ["runs.csv", "surrogate.json", "map.csv", "confirm.csv"];
    let before = names.map(stamp);
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!(names.map(stamp), before);
    assert!(page == std::fs::read_to_string(results.join("report.html")).unwrap());

    // run the case file in the results folder; a change of the sampler does not repeat simulations
    let case = results.join("case.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    assert!(text.contains("draws = 150"), "{text}");
    std::fs::write(&case, text.replace("draws = 150", "draws = 160")).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!([stamp("runs.csv"), stamp("surrogate.json")], before[..2]);
    // a file whose content is the same is not written again: the draws show that the sampler ran
    assert_eq!(table(&results.join("posterior.csv")).len(), 2 * 160);
}

/// Files of finished runs with their time stamps; every ensemble has a separate folder.
fn finished(runs: &Path) -> BTreeMap<std::path::PathBuf, std::time::SystemTime> {
    let entries = |path: &Path| std::fs::read_dir(path).into_iter().flatten().flatten();
    entries(runs)
        .flat_map(|ensemble| entries(&ensemble.path()).collect::<Vec<_>>())
        .filter(|e| e.file_name().to_string_lossy().starts_with("run-"))
        .filter(|e| e.path().extension().is_some_and(|x| x == "json"))
        .map(|e| (e.path(), e.metadata().unwrap().modified().unwrap()))
        .collect()
}

#[test]
fn killed_at_any_moment_it_goes_on_and_ends_at_the_same_numbers() {
    let dir = case_folder();
    let runs = dir.path().join("killed/ensemble");
    let mut seen = BTreeMap::new();
    // the program is killed twice, each time after more runs have finished
    for wanted in [2, 6] {
        let mut child =
            start(dir.path(), &["run", "tiny.toml", "--out", "killed", "--threads", "1"]);
        let deadline = Instant::now() + Duration::from_secs(300);
        while finished(&runs).len() < wanted && child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "no run is ever finished");
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let now = finished(&runs);
        assert!(
            seen.iter().all(|(path, time)| now.get(path) == Some(time)),
            "a finished run was run again"
        );
        seen = now;
    }
    assert!(seen.len() < 12, "killed too late to test anything");
    let (code, _, err) =
        breccia(dir.path(), &["run", "tiny.toml", "--out", "killed", "--threads", "1"]);
    assert_eq!(code, Some(0), "{err}");
    let now = finished(&runs);
    assert!(
        seen.iter().all(|(path, time)| now.get(path) == Some(time)),
        "a finished run was run again"
    );

    let (killed, whole) = (dir.path().join("killed"), finished_tiny().dir.path().join("results"));
    assert_eq!(without_seconds(&killed.join("runs.csv")), without_seconds(&whole.join("runs.csv")));
    for name in ["experiments.csv", "surrogate.json", "posterior.csv", "map.csv", "confirm.csv"] {
        let [a, b] = [&killed, &whole].map(|dir| std::fs::read(dir.join(name)).unwrap());
        assert!(a == b, "{name} differs after a kill, or with the number of threads");
    }
}

#[cfg(unix)]
#[test]
fn signals_to_end_keep_what_is_finished_and_say_how_to_go_on() {
    let dir = case_folder();
    let runs = dir.path().join("out/ensemble");
    for signal in ["-INT", "-TERM", "-HUP"] {
        let before = finished(&runs).len();
        let mut child = start(dir.path(), &["run", "tiny.toml", "--out", "out", "--threads", "1"]);
        let deadline = Instant::now() + Duration::from_secs(300);
        while finished(&runs).len() == before && child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "no run is ever finished");
            std::thread::sleep(Duration::from_millis(5));
        }
        let status = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(status.success());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{signal}: {err}");
        assert!(err.contains("the same command resumes"), "{signal}: {err}");
        let kept = finished(&runs).len();
        assert!((before + 1..12).contains(&kept), "{signal}: {kept} runs");
    }
}
