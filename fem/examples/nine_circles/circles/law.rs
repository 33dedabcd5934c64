//! Materials and damage laws of the nine problems.

use fem::{CrackDensity, Fracture, Irreversibility, Material, PhaseField, Strength};

/// Damage law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    At1,
    At2,
    /// AT1 with a strength of its own.
    Strength,
}

/// Usual ratio of node spacing to ℓ₀ where cracks run.
pub(crate) const SPACING: f64 = 1.0 / 3.0;

/// Elastic constants, toughness and strengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    pub(crate) young_mpa: f64,
    pub(crate) poisson: f64,
    pub(crate) toughness_n_per_mm: f64,
    pub(crate) tensile_mpa: f64,
    pub(crate) compressive_mpa: f64,
    /// ℓ₀ of the law with a strength, as a fraction of the largest possible length.
    pub(crate) length_share: f64,
    /// Ratio of node spacing to ℓ₀ where cracks run. The toughness of AT1 and AT2 is divided by the factor of the mesh at
    /// this spacing, so that cracks need Gc.
    pub(crate) spacing: f64,
}

/// Soda-lime glass, as in the reference.
pub(crate) const GLASS: Solid = Solid {
    young_mpa: 70_000.0,
    poisson: 0.22,
    toughness_n_per_mm: 0.010,
    tensile_mpa: 40.0,
    compressive_mpa: 1000.0,
    length_share: 0.125,
    spacing: SPACING,
};

/// Polyurethane elastomer, as in the reference (shear modulus 0.52 MPa, first Lamé constant 85.77 MPa, hydrostatic
/// strength 1 MPa), with the law of Hencky in place of a neo-Hookean law.
pub(crate) const ELASTOMER: Solid = Solid {
    young_mpa: 1.5569,
    poisson: 0.496_987,
    toughness_n_per_mm: 0.041,
    tensile_mpa: 0.3,
    compressive_mpa: 0.375,
    length_share: 0.5,
    spacing: SPACING,
};

impl Law {
    pub(crate) const ALL: [Law; 3] = [Law::At1, Law::At2, Law::Strength];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Law::At1 => "at1",
            Law::At2 => "at2",
            Law::Strength => "strength",
        }
    }
}

impl Solid {
    /// Returns the factor by which the mesh increases the energy of a crack. The law with a strength compensates for the mesh
    /// itself.
    fn mesh_factor(&self, law: Law) -> f64 {
        match law {
            Law::At1 => 1.0 + 0.375 * self.spacing,
            Law::At2 => 1.0 + 0.5 * self.spacing,
            Law::Strength => 1.0,
        }
    }

    /// Returns ℓ₀, mm. AT1 and AT2 get the length with which their uniaxial tensile strength is the tensile strength of the
    /// material. The law with a strength gets a fraction of the largest possible length.
    pub(crate) fn length_mm(&self, law: Law) -> f64 {
        let irwin = self.young_mpa * self.toughness_n_per_mm / self.tensile_mpa.powi(2);
        match law {
            Law::At1 => 0.375 * irwin / self.mesh_factor(law),
            Law::At2 => 27.0 / 256.0 * irwin / self.mesh_factor(law),
            Law::Strength => 0.375 * irwin * self.length_share,
        }
    }

    /// Returns the node spacing where cracks run, mm.
    pub(crate) fn spacing_mm(&self, law: Law) -> f64 {
        self.spacing * self.length_mm(law)
    }

    /// Returns the viscosity (MPa s) with which a step of 1 s moves a crack by some ℓ₀ where the energy release rate
    /// exceeds the toughness by a few percent.
    pub(crate) fn viscosity_mpa_s(&self, law: Law) -> f64 {
        0.004 * self.toughness_n_per_mm / self.length_mm(law)
    }

    /// Returns the material, with a viscosity of damage.
    pub(crate) fn material(&self, law: Law, viscosity_mpa_s: f64) -> Material {
        let fracture = Fracture {
            toughness_n_per_mm: self.toughness_n_per_mm / self.mesh_factor(law),
            viscosity_mpa_s,
            residual_stiffness: 1e-5,
        };
        let material = Material::hencky(self.young_mpa, self.poisson).with_fracture(fracture);
        let spacing = Some(self.spacing_mm(law));
        match law {
            Law::At1 | Law::At2 => material,
            Law::Strength => material.with_strength(Strength {
                node_spacing_mm: spacing,
                ..Strength::new(self.tensile_mpa, self.compressive_mpa)
            }),
        }
    }

    /// Returns the phase field.
    pub(crate) fn phase_field(&self, law: Law) -> PhaseField {
        let model = if law == Law::At2 { CrackDensity::At2 } else { CrackDensity::At1 };
        PhaseField {
            model,
            irreversibility: Irreversibility::ActiveSet,
            ..PhaseField::new(self.length_mm(law))
        }
    }

    /// Returns the factor with which a stress (xx, yy, zz, xy, yz, xz) lies on the Drucker–Prager strength surface
    /// √J₂ + a I₁ = b; infinite if no factor does.
    pub(crate) fn strength_factor(&self, stress: [f64; 6]) -> f64 {
        let (t, c) = (self.tensile_mpa, self.compressive_mpa);
        let [xx, yy, zz, xy, yz, xz] = stress;
        let trace = xx + yy + zz;
        let normal: f64 = [xx, yy, zz].iter().map(|s| (s - trace / 3.0).powi(2)).sum();
        let shear = xy * xy + yz * yz + xz * xz;
        let scale = 3f64.sqrt() * (c + t);
        let load = (0.5 * normal + shear).sqrt() + (c - t) / scale * trace;
        if load > 0.0 { 2.0 * c * t / scale / load } else { f64::INFINITY }
    }
}
