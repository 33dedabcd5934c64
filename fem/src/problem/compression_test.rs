//! The unconfined compression test as a boundary-value problem.

use serde::{Deserialize, Serialize};

use super::builder::ProblemBuilder;
use super::problem::Problem;
use super::schedule::Schedule;
use crate::boundary::{Axis, Conditions, Platen};
use crate::error::FemError;
use fem_mesh::TetMesh;

/// How the platens of a compression test hold the specimen. In a file they stand by name; the numbers
/// of their friction have places of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Platens {
    /// The ends keep to the platens and slide without friction: exact where nothing lifts off.
    #[default]
    Sliding,
    /// The ends may lift off; sliding is resisted as [`Friction`] says.
    Unilateral(#[serde(skip)] Friction),
}

/// Resistance to sliding, see [`Platen`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coulomb's coefficient μ.
    pub coefficient: f64,
    /// Velocity ε below which friction fades into creep, mm/s.
    pub slip_velocity_mm_per_s: f64,
    /// Viscous drag F_v, MPa s/mm.
    pub drag_mpa_s_per_mm: f64,
}

impl Default for Friction {
    fn default() -> Self {
        Self::none()
    }
}

impl Friction {
    /// None.
    pub fn none() -> Self {
        Self { coefficient: 0.0, slip_velocity_mm_per_s: 1.0, drag_mpa_s_per_mm: 0.0 }
    }
}

/// The unconfined compression of a specimen between two rigid platens: what makes a [`Problem`] of a
/// mesh.
///
/// The lower end (surface `bottom`) keeps its height, the upper one (`top`) moves down at constant
/// speed, by the displacement over the duration of the schedule; [`Platens`] says how they hold the
/// specimen. Displacement and damage solve
/// ∫ τ : (∇v F⁻¹) dV = 0 and
/// ∫ g′(φ) ψ⁺ q + (Gc/(c₀ ℓ₀)) (α′(φ) q + 2 ℓ₀² ∇φ·∇q) + (ξ/Δt)(φ − φ_n) q dV = 0.
///
/// # Example
/// ```
/// use fem::{CompressionTest, CylinderLattice, Material, Schedule};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let area = mesh.volume() / 4.4;
/// let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
///     .builder(mesh)?
///     .materials([Material::hencky(275.0, 0.25)])
///     .build()?;
/// let outcome = problem.run(&mut ());
/// let stretch: f64 = 0.95;
/// let exact = -area * 275.0 * stretch.ln() / stretch;
/// assert!((outcome.curve[0].force_n - exact).abs() < 1e-6 * exact);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompressionTest {
    /// Full displacement, mm, downwards.
    pub displacement_mm: f64,
    /// How the platens hold the specimen.
    pub platens: Platens,
    /// The time that the full displacement takes, and the steps.
    pub schedule: Schedule,
}

impl CompressionTest {
    /// A test between platens on which the ends slide freely.
    pub fn new(displacement_mm: f64, schedule: Schedule) -> Self {
        Self { displacement_mm, platens: Platens::Sliding, schedule }
    }

    /// The same test between other platens.
    pub fn platens(self, platens: Platens) -> Self {
        Self { platens, ..self }
    }

    /// The test as a problem on a mesh, whose materials are still to be given.
    ///
    /// # Errors
    /// Ends that are not above each other or have nodes in common, or a displacement that is not
    /// between zero and the height.
    pub fn builder(&self, mesh: TetMesh) -> Result<ProblemBuilder, FemError> {
        let conditions = self.conditions(&mesh)?;
        Ok(Problem::builder(mesh).conditions(conditions).schedule(self.schedule.clone()))
    }

    /// The platens as boundary conditions; the first increment starts from a uniform shortening.
    ///
    /// # Errors
    /// As [`builder`](Self::builder).
    pub fn conditions(&self, mesh: &TetMesh) -> Result<Conditions, FemError> {
        let [bottom, top] = levels(mesh)?;
        let (full, duration) = (self.displacement_mm, self.schedule.duration_s);
        // a mesh that lacks an end has no height, which is told where its surfaces are looked up
        let height = top - bottom;
        if !(full > 0.0 && (height.is_nan() || full < height)) {
            return Err(FemError::parameter(
                "test",
                "displacement_mm",
                full,
                "positive (downwards) and less than the specimen's height",
            ));
        }
        let speed = full / duration;
        // exactly the full displacement at the end
        let down = move |time_s: f64| time_s / duration * full;
        let shorten =
            move |x: [f64; 3], time_s: f64| [0.0, 0.0, -down(time_s) / height * (x[2] - bottom)];
        let conditions = match self.platens {
            Platens::Sliding => Conditions::new().fix("bottom", [Axis::Z]).prescribe(
                "top",
                [Axis::Z],
                move |_, time_s| [0.0, 0.0, -down(time_s)],
            ),
            Platens::Unilateral(friction) => {
                let platen = |level, up| {
                    Platen::plane([0.0, 0.0, level], [0.0, 0.0, up])
                        .friction(friction.coefficient, friction.slip_velocity_mm_per_s)
                        .drag(friction.drag_mpa_s_per_mm)
                };
                let moving = platen(top, -1.0).moving(move |time_s| [0.0, 0.0, -speed * time_s]);
                Conditions::new().platen("bottom", platen(bottom, 1.0)).platen("top", moving)
            }
        };
        Ok(conditions
            .described_as(format!("{self:?}"))
            .remove_rigid_motions()
            .measure_travel("top", [0.0, 0.0, -1.0], down)
            .first_guess(shorten))
    }
}

/// The heights of the two ends, mm.
fn levels(mesh: &TetMesh) -> Result<[f64; 2], FemError> {
    let nodes_of = |name: &str| -> Vec<u32> {
        let mut nodes: Vec<u32> =
            mesh.surfaces.get(name).into_iter().flatten().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    };
    let level = |nodes: &[u32]| {
        let height = |&n: &u32| mesh.nodes.get(n as usize).map_or(f64::NAN, |x| x[2]);
        nodes.iter().map(height).sum::<f64>() / nodes.len() as f64
    };
    let [bottom, top] = ["bottom", "top"].map(nodes_of);
    let levels = [level(&bottom), level(&top)];
    if levels[1] - levels[0] <= 0.0 {
        return Err(FemError::Platens("surface 'top' does not lie above 'bottom' (the axis is z)"));
    }
    if top.iter().any(|n| bottom.binary_search(n).is_ok()) {
        return Err(FemError::Platens(
            "surfaces 'bottom' and 'top' have nodes in common, which cannot stand still and move",
        ));
    }
    Ok(levels)
}
