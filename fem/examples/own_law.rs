//! Defines an elastic law outside the crate: Hencky's law with a shear part that stiffens with strain.
//!
//! ψ = K/2 (tr ε)² + μ |dev ε|² (1 + β |dev ε|²), in the principal logarithmic strains ε_i. The user writes only this
//! energy; stress and tangent are derived automatically.
//!
//! ```text
//!   force        ╱ own law
//!     │        ╱ ╱ Hencky         ┌───┐ ↑ top moves up to a stretch of 1.3
//!     │     ╱ ╱                   │   │
//!     │  ╱╱                       │   │
//!     └────────────── stretch     └───┘ bottom slides on a plane
//! ```
//!
//! ```text
//! cargo run --release -p fem --example own_law
//! ```
//!
//! Expected output:
//! ```text
//! small strain: E = 11.2500 MPa, Poisson's ratio 0.4062
//! stretch,force_own_N,force_hencky_N
//! 1.050,9.974,9.802
//! 1.100,19.492,18.277
//! 1.150,29.246,25.636
//! 1.200,39.583,32.049
//! 1.250,50.624,37.655
//! 1.300,62.345,42.571
//! ```

use fem::{
    Axis, Conditions, CylinderLattice, HyperelasticLaw, Material, PrincipalStrain, Problem, Scalar,
    Schedule, assert_material,
};

#[derive(Debug)]
struct Stiffening {
    bulk_mpa: f64,
    shear_mpa: f64,
    /// β, without unit.
    stiffening: f64,
}

impl HyperelasticLaw for Stiffening {
    #[inline(always)]
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let volumetric = strain.log_volume();
        let [a, b, c] = strain.isochoric_log();
        let deviatoric = a * a + b * b + c * c;
        let shear = deviatoric * (deviatoric * self.stiffening + 1.0) * self.shear_mpa;
        volumetric * volumetric * (0.5 * self.bulk_mpa) + shear
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let law = |stiffening| Stiffening { bulk_mpa: 20.0, shear_mpa: 4.0, stiffening };
    let stiffening = Material::hyperelastic(law(3.0))?;
    // checks stress and tangent against differences of the energy
    assert_material(&stiffening, None);
    println!(
        "small strain: E = {:.4} MPa, Poisson's ratio {:.4}",
        stiffening.elasticity.young_mpa(),
        stiffening.elasticity.poisson()
    );
    println!("stretch,force_own_N,force_hencky_N");
    let curves = [curve(stiffening)?, curve(Material::hyperelastic(law(0.0))?)?];
    for (stiffening, hencky) in curves[0].iter().zip(&curves[1]) {
        println!("{:.3},{:.3},{:.3}", 1.0 + stiffening[0] / HEIGHT_MM, stiffening[1], hencky[1]);
    }
    Ok(())
}

const HEIGHT_MM: f64 = 4.4;

/// Returns displacement (mm) and force (N) of a cylinder of this material in tension.
fn curve(material: Material) -> Result<Vec<[f64; 2]>, Box<dyn std::error::Error>> {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: HEIGHT_MM, spacing_mm: 1.5 }.build()?;
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.3 * HEIGHT_MM * time_s])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, 1.0]);
    let outcome = Problem::builder(mesh)
        .materials([material])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 6))
        .build()?
        .run(&mut ());
    Ok(outcome.curve.iter().map(|point| [point.displacement_mm, point.force_n]).collect())
}
