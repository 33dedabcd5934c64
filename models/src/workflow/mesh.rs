//! Stage `mesh`: geometry to tetrahedra.

use fem::{gmsh, vtu};

use super::WorkflowError;
use super::simulator::{Simulator, build_mesh, height_mm};
use super::task::Task;
use crate::report::mesh_picture;

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let setup = task.inputs.setup();
    let mesh = build_mesh(&task.inputs.shape()?, setup.path)?;
    gmsh::write(task.product("mesh.msh")?, &mesh)?;
    vtu::write(task.product("mesh.vtu")?, &mesh, &[], &[])?;
    task.write("mesh.svg", &mesh_picture(&mesh))?;

    let mut rows = vec![
        ("nodes".to_owned(), mesh.nodes.len() as f64),
        ("tets".to_owned(), mesh.tets.len() as f64),
        ("height_mm".to_owned(), height_mm(&mesh)),
        ("mean_edge_mm".to_owned(), mesh.mean_edge()),
        ("volume_mm3".to_owned(), mesh.volume()),
    ];
    for name in &mesh.regions {
        rows.push((format!("volume_{name}_mm3"), mesh.region_volume(name)?));
    }
    let (tets, nodes, volume) = (mesh.tets.len(), mesh.nodes.len(), mesh.volume());
    let grain = mesh.region_volume("grain").unwrap_or(0.0) / volume;
    // a case whose materials or test do not fit the mesh fails here, not after a hundred runs
    let simulator = Simulator::new(&setup, mesh, Vec::new())?;
    rows.push(("unknowns".to_owned(), simulator.problem().unknowns() as f64));
    let rows = rows.into_iter().map(|(name, value)| [name, value.to_string()]);
    task.write_csv("mesh.csv", ["quantity", "value"], rows)?;
    Ok(format!("{tets} tetrahedra, {nodes} nodes, {:.1} % grains", 100.0 * grain))
}
