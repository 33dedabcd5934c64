//! From a CT image to a force–displacement curve: segmentation, mesh, compression.
//!
//! ```text
//! grey values ──► labels of grains ──► mesh ──► compression test ──► curve
//!  ░░▓▓░░▓░        00110020            ◿◺◿◺       ↓↓↓↓↓             ╱╲
//!  ░▓▓░░░▓▓        01100022            ◺◿◺◿       ▔▔▔▔▔            ╱  ╲
//! ```
//!
//! ```text
//! cargo run --release -p fem --example image_to_curve [-- STACK VOXEL_MM]
//! ```
//!
//! `STACK` is a TIFF stack, a folder of slices, or a file of another format that `fem::read_image` reads; `VOXEL_MM` is
//! the edge length of a voxel. Without arguments, a virtual scanner images a known packing of balls, so that the result
//! can be compared with the known packing.
//!
//! Expected output without arguments:
//! ```text
//! 31 grains in a cylinder of radius 2.50 mm and height 4.40 mm
//! 4820 elements
//! displacement_mm,force_N
//! 0.0100,21.56
//! 0.0200,43.13
//! 0.0300,64.43
//! …
//! 0.0900,155.97
//! 0.1000,158.47
//! 0.1100,155.13
//! …
//! 0.1301,125.83
//! the run ended with BelowPeak
//! ```

use fem::{
    CompressionTest, Fracture, GrainList, Material, Meshing, Packing, PhaseField, ReadOptions,
    Scanner, Schedule, Segmentation, Volume, VoxelGrains, read_image,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let image: Volume<f32> = match arguments.as_slice() {
        [stack, voxel_mm] => {
            let options = ReadOptions { voxel_mm: Some(voxel_mm.parse()?), ..Default::default() };
            read_image(stack.as_ref(), &options)?.volume
        }
        _ => {
            let grains = Packing::new(0.2, 1).fill(RADIUS_MM, HEIGHT_MM)?;
            let grains = GrainList::new(grains, RADIUS_MM, HEIGHT_MM);
            Scanner::new(0.08, 1).scan(RADIUS_MM, HEIGHT_MM, &grains)?.grey
        }
    };

    // from grey values to grains; the warnings list results that the user should check
    let segmented = Segmentation::default().run(&image, &mut |_| ())?;
    for warning in &segmented.warnings {
        println!("warning: {warning}");
    }
    let cylinder = &segmented.cylinder;
    let (radius_mm, height_mm) = (cylinder.radius_mm, cylinder.height_mm());
    println!(
        "{} grains in a cylinder of radius {radius_mm:.2} mm and height {height_mm:.2} mm",
        segmented.regions.len()
    );

    // from grains to a mesh
    let grains = VoxelGrains::new(&segmented.labels, Some(&segmented.solid), cylinder);
    let meshed = Meshing::new(0.6).build(radius_mm, height_mm, &grains)?;
    for warning in meshed.report.warnings() {
        println!("warning: {warning}");
    }
    println!("{} elements", meshed.mesh.tets.len());

    // compression by 5 % of the height
    let breakable = |young_mpa, toughness_n_per_mm, viscosity_mpa_s| {
        let residual_stiffness = 0.01;
        Material::hencky(young_mpa, 0.25).with_fracture(Fracture {
            toughness_n_per_mm,
            viscosity_mpa_s,
            residual_stiffness,
        })
    };
    let schedule = Schedule::fixed(1.0, 22).stop_below_peak(0.1);
    let outcome = CompressionTest::new(0.05 * height_mm, schedule)
        .builder(meshed.mesh)?
        .materials([breakable(275.0, 0.0025, 0.3), breakable(22_000.0, 1.83, 0.1)])
        .phase_field(PhaseField::new(0.06))
        .build()?
        .run(&mut ());
    println!("displacement_mm,force_N");
    for point in &outcome.curve {
        println!("{:.4},{:.2}", point.displacement_mm, point.force_n);
    }
    println!("the run ended with {:?}", outcome.end);
    Ok(())
}

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
