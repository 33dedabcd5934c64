//! Import of mesh files of other programs: prints notes, errors and the quality of the mesh.
//!
//! `cargo run --release -p fem-mesh --example import -- mesh.msh... [out=folder]`
//!
//! All physical groups are read under their names. With `out`, the meshes are written to that folder under their
//! original file names.

use std::error::Error;
use std::path::{Path, PathBuf};

use fem_mesh::Quality;
use fem_mesh::gmsh::{self, GmshNames};

fn main() -> Result<(), Box<dyn Error>> {
    let (mut files, mut out) = (Vec::new(), None);
    for argument in std::env::args().skip(1) {
        match argument.strip_prefix("out=") {
            Some(folder) => out = Some(PathBuf::from(folder)),
            None => files.push(PathBuf::from(argument)),
        }
    }
    for file in &files {
        let name = file.file_name().map_or(Path::new("mesh.msh"), Path::new);
        match gmsh::import(file, &GmshNames::default()) {
            Err(error) => println!("{}: {error}", name.display()),
            Ok(imported) => {
                let quality = Quality::of(&imported.mesh);
                println!(
                    "{}: {quality}, smallest scaled Jacobian {:.4}",
                    name.display(),
                    quality.min_scaled_jacobian
                );
                imported.notes.iter().for_each(|note| println!("  {note}"));
                if let Some(folder) = &out {
                    gmsh::write(folder.join(name), &imported.mesh)?;
                }
            }
        }
    }
    Ok(())
}
