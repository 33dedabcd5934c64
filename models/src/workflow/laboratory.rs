//! Stage `laboratory`: specimens, measured or virtual, to quantities of interest.

use fem::{Packing, RunInput, RunRecord, RunStatus, gmsh};
use rayon::prelude::*;

use super::campaign::run_campaign;
use super::files::{csv_text, write};
use super::fingerprint::Fingerprint;
use super::simulation::{Simulator, height_mm, lattice_mesh, recorded, simulated_qois};
use super::{Stage, Workflow, WorkflowError};
use crate::case::{PriorCase, Shape, VirtualCase};
use crate::csv_table::CsvTable;
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable};
use crate::progress::say;
use crate::qoi::Qois;
use crate::virtual_lab::VirtualSpecimen;

const TABLE: &str = "laboratory/specimens.csv";

pub(super) fn inputs(w: &Workflow) -> Result<Fingerprint, WorkflowError> {
    let case = w.case();
    w.file.table()?;
    let inputs = w.simulation_inputs()?.part(&case.experiments).part(&case.qoi);
    match virtual_case(w)? {
        Some(_) => Ok(inputs.part(&case.specimen)),
        None => {
            let table = SpecimenTable::read(&w.path(TABLE))?;
            Ok(table.to_files().iter().fold(inputs, |inputs, (_, text)| inputs.part(text)))
        }
    }
}

fn virtual_case<'a>(w: &'a Workflow) -> Result<Option<&'a VirtualCase>, WorkflowError> {
    match &w.case().experiments {
        Some(experiments) => Ok(experiments.laboratory.as_ref()),
        None => Err(w.missing_part("experiments", "which curves to calibrate against")),
    }
}

pub(super) fn run(w: &Workflow) -> Result<String, WorkflowError> {
    if let Some(laboratory) = virtual_case(w)? {
        test_virtual_specimens(w, laboratory)?;
    }
    let file = w.path(TABLE);
    let mut table = SpecimenTable::read(&file)?;
    if let Some(group) = w.case().experiments.as_ref().and_then(|e| e.group.as_deref()) {
        table = table.in_group(group, &w.file.path)?;
    }
    let mesh = gmsh::read(w.path("mesh.msh"), &gmsh::GmshNames::default())?;
    let mesh_height = height_mm(&mesh);
    let radius = w.case().specimen.radius_mm;
    let rows = table
        .specimens
        .iter()
        .map(|specimen| experiment_row(w, specimen, mesh_height, radius))
        .collect::<Result<Vec<_>, _>>()?;
    let header = format!(
        "id,group,height_mm,radius_mm,displacement_factor,slope_fraction,{}",
        Qois::NAMES.join(",")
    );
    write(&w.path(Stage::Laboratory.product()), &csv_text(&header, rows))?;
    Ok(format!("{} specimens", table.specimens.len()))
}

/// A specimen's line of `experiments.csv`: its quantities at the height of the mesh.
fn experiment_row(
    w: &Workflow,
    specimen: &Specimen,
    mesh_height: f64,
    mesh_radius: Option<f64>,
) -> Result<Vec<String>, WorkflowError> {
    let factor = mesh_height / specimen.height_mm;
    let differs = (factor - 1.0).abs() > 1e-9;
    let factor = if differs { factor } else { 1.0 };
    if !(0.1..=10.0).contains(&factor) {
        return Err(InputError::new(
            &w.path(TABLE),
            format!("specimen {}, column height_mm", specimen.id),
            specimen.height_mm.to_string(),
            format!("is far from the mesh's height of {mesh_height:.4} mm"),
            "Write heights in mm.",
        )
        .into());
    }
    if differs {
        let (id, height) = (&specimen.id, specimen.height_mm);
        say(
            "note",
            &format!(
                "{id} is {height} mm high, the mesh {mesh_height:.4} mm: its displacements are scaled by {factor:.4}"
            ),
        );
    }
    if let Some(radius) = mesh_radius.filter(|r| (r / specimen.radius_mm - 1.0).abs() > 0.01) {
        let id = &specimen.id;
        say(
            "note",
            &format!(
                "{id} has a radius of {} mm, the mesh {radius} mm: forces are not scaled",
                specimen.radius_mm
            ),
        );
    }
    let fraction = specimen.slope_fraction.unwrap_or(w.case().qoi.slope_fraction);
    let qois = Qois::of(&specimen.curve.scale_displacement(factor), fraction).map_err(|e| {
        let curve = w.path("laboratory/curves").join(format!("{}.csv", specimen.id));
        InputError::new(
            &curve,
            "",
            "",
            e.to_string(),
            "Mend the curve or leave the specimen out of the table.",
        )
    })?;
    Ok([specimen.id.clone(), specimen.group.clone()]
        .into_iter()
        .chain([specimen.height_mm, specimen.radius_mm, factor, fraction].map(|x| x.to_string()))
        .chain(qois.to_array().map(|q| q.to_string()))
        .collect())
}

/// The quantities in an `experiments.csv`.
pub(super) fn read_experiments(w: &Workflow) -> Result<Vec<Qois>, WorkflowError> {
    let path = w.needed(Stage::Laboratory.product(), Stage::Laboratory)?;
    let table = CsvTable::read(&path, &Qois::NAMES)?;
    let mut qois = Vec::new();
    for row in table.rows() {
        let [slope, force, place] = Qois::NAMES.map(|name| row.positive(name));
        qois.push(Qois::from([slope?, force?, place?]));
    }
    Ok(qois)
}

/// Simulates the virtual specimens and writes them as a laboratory would.
fn test_virtual_specimens(w: &Workflow, laboratory: &VirtualCase) -> Result<(), WorkflowError> {
    let Shape::Lattice { radius_mm, height_mm, spacing_mm, grains } = w.file.shape()? else {
        return Err(
            w.missing_part("specimen", "radius, height and spacing of the virtual specimens")
        );
    };
    let spacing = laboratory.spacing_mm.unwrap_or(spacing_mm);
    let specimens = VirtualSpecimen::draw(laboratory, grains.as_ref().map(|g| g.seed));
    let simulator = |seed: Option<u64>, spacing: f64| {
        let grains = grains.as_ref().map(|g| Packing { seed: seed.unwrap_or(g.seed), ..g.clone() });
        Simulator::new(
            &w.file,
            lattice_mesh(&w.file, [radius_mm, height_mm, spacing], grains.as_ref())?,
        )
    };
    let mut tests: Vec<(Simulator, Vec<f64>)> = specimens
        .par_iter()
        .map(|v| Ok((simulator(Some(v.packing_seed), spacing)?, v.parameters.to_vec())))
        .collect::<Result<_, WorkflowError>>()?;
    if spacing != spacing_mm {
        // the surrogate's microstructure at the truth, on both meshes: the bias of the coarse one
        for spacing in [spacing_mm, spacing] {
            tests.push((simulator(None, spacing)?, laboratory.truth.to_array().to_vec()));
        }
    }
    let runs: Vec<RunInput> = (1..)
        .zip(&tests)
        .map(|(id, (_, parameters))| RunInput { id, inputs: parameters.clone() })
        .collect();
    let job = |run: &RunInput, observer: &mut dyn fem::Observer| {
        tests[run.id - 1].0.run(&run.inputs, observer)
    };
    let inputs = w
        .simulation_inputs()?
        .part(&w.case().specimen)
        .part(&(&laboratory.seed, &laboratory.truth, &laboratory.scatter))
        .part(&(laboratory.specimens, spacing));
    let records = run_campaign(w, "laboratory", "laboratory/runs", inputs, &runs, &job)?;
    for (record, name) in
        records.iter().zip(specimens.iter().map(|v| v.id.as_str()).chain(["bias", "bias"]))
    {
        if let RunStatus::Failed(reason) = &record.status {
            return Err(WorkflowError::Unusable(format!(
                "the virtual specimen {name} failed: {reason}; take another seed, fewer grains or more load steps"
            )));
        }
    }
    write_specimens(w, laboratory, &specimens, &records, [height_mm, radius_mm])?;
    match &records[specimens.len()..] {
        [coarse, fine] => write_bias(w, [spacing_mm, spacing], [coarse, fine]),
        _ => Ok(()),
    }
}

fn write_specimens(
    w: &Workflow,
    laboratory: &VirtualCase,
    specimens: &[VirtualSpecimen],
    records: &[RunRecord],
    [height_mm, radius_mm]: [f64; 2],
) -> Result<(), WorkflowError> {
    let table = SpecimenTable {
        specimens: specimens
            .iter()
            .zip(records)
            .map(|(v, record)| Specimen {
                id: v.id.clone(),
                height_mm,
                radius_mm,
                group: laboratory.group.clone(),
                slope_fraction: None,
                curve: v.measure(&recorded(&record.curve), &laboratory.noise),
            })
            .collect(),
    };
    for (path, text) in table.to_files() {
        write(&w.path("laboratory").join(path), &text)?;
    }
    let truth = specimens.iter().map(|v| {
        [v.id.clone(), v.packing_seed.to_string()]
            .into_iter()
            .chain(v.parameters.map(|p| p.to_string()))
    });
    let header = format!("id,packing_seed,{}", PriorCase::NAMES.join(","));
    write(&w.path("laboratory/truth.csv"), &csv_text(&header, truth))
}

/// One microstructure on the surrogate's mesh and on the laboratory's.
fn write_bias(
    w: &Workflow,
    spacing_mm: [f64; 2],
    runs: [&RunRecord; 2],
) -> Result<(), WorkflowError> {
    let qois = |record: &RunRecord| {
        simulated_qois(&record.curve, w.case())
            .map_err(|e| WorkflowError::Unusable(format!("the comparison of the two meshes: {e}")))
    };
    let (coarse, fine) = (qois(runs[0])?.to_array(), qois(runs[1])?.to_array());
    let row = |name: &str, a: f64, b: f64| {
        [name.to_owned(), a.to_string(), b.to_string(), (100.0 * (a / b - 1.0)).to_string()]
    };
    let mut rows = vec![row("spacing_mm", spacing_mm[0], spacing_mm[1])];
    rows.extend((0..3).map(|i| row(Qois::NAMES[i], coarse[i], fine[i])));
    let header = "quantity,surrogate_mesh,laboratory_mesh,percent_bias";
    write(&w.path("laboratory/bias.csv"), &csv_text(header, rows))
}

/// The median truth of virtual specimens, if they are virtual.
pub(super) fn truth(w: &Workflow) -> Option<[f64; 3]> {
    let experiments = w.case().experiments.as_ref()?;
    experiments.laboratory.as_ref().map(|laboratory| laboratory.truth.to_array())
}
