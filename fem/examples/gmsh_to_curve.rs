//! Reads a mesh of Gmsh and runs a compression test on it.
//!
//! ```text
//! Gmsh: model.geo ──► model.msh ──► regions matrix, grain    ──► curve.csv
//!                                   surfaces bottom, top
//! ```
//!
//! ```text
//! cargo run --release -p fem --example gmsh_to_curve [-- MODEL.msh]
//! ```
//!
//! A model needs physical volumes `matrix` (tag 1) and `grain` (tag 2), and physical surfaces `bottom` (tag 11) and
//! `top` (tag 12) normal to z. Without an argument, the example itself writes a model: a cylinder with one ball in its
//! middle.
//!
//! Expected output without an argument:
//! ```text
//! 2624 elements in the regions grain, matrix
//! displacement_mm,force_N
//! 0.0110,16.592
//! 0.0220,33.335
//! 0.0330,50.231
//! 0.0440,67.281
//! all columns are in …/gmsh_to_curve.csv
//! ```

use std::path::PathBuf;

use fem::gmsh::{self, GmshNames};
use fem::{CompressionTest, CylinderLattice, Grain, Material, Order, Schedule, label, write_curve};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir();
    let (path, names) = match std::env::args().nth(1) {
        Some(path) => (
            path.into(),
            GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12)]),
        ),
        None => example_model(folder.join("gmsh_to_curve.msh"))?,
    };
    // each note describes a repair of the mesh during the import
    let imported = gmsh::import(&path, &names)?;
    for note in &imported.notes {
        println!("note: {note}");
    }
    let mesh = imported.mesh;
    println!("{} elements in the regions {}", mesh.tets.len(), mesh.regions.join(", "));

    // materials in the order of the regions
    let material = |region: &String| match region.as_str() {
        "grain" => Material::hencky(22_000.0, 0.25),
        _ => Material::hencky(275.0, 0.25),
    };
    let materials: Vec<Material> = mesh.regions.iter().map(material).collect();
    let outcome = CompressionTest::new(0.044, Schedule::fixed(1.0, 4))
        .builder(mesh)?
        .order(Order::Quadratic)
        .materials(materials)
        .build()?
        .run(&mut ());
    let curve_path = folder.join("gmsh_to_curve.csv");
    write_curve(&curve_path, &outcome.curve)?;
    println!("displacement_mm,force_N");
    for point in &outcome.curve {
        println!("{:.4},{:.3}", point.displacement_mm, point.force_n);
    }
    println!("all columns are in {}", curve_path.display());
    Ok(())
}

/// Writes a cylinder with one ball as a MSH file; returns its path and the names of its groups.
fn example_model(path: PathBuf) -> Result<(PathBuf, GmshNames), Box<dyn std::error::Error>> {
    let mut mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.8 }.build()?;
    label(&mut mesh, &[Grain::sphere([0.0, 0.0, 2.2], 1.2)]);
    let names = gmsh::write(&path, &mesh)?;
    Ok((path, names))
}
