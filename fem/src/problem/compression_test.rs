//! A compression test, ready to run.

use std::path::Path;

use super::checkpoint::Checkpoint;
use super::curve::{Observer, Outcome};
use super::loading::Loading;
use super::problem::Problem;
use crate::boundary::{Axis, Conditions, Platen};
use crate::element::Order;
use crate::error::FemError;
use crate::fields::Fields;
use crate::material::{Material, PhaseField};
use crate::mesh::TetMesh;
use crate::solve::SolverOptions;

/// How the platens of a compression test hold the specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Platens {
    /// The ends keep to the platens and slide without friction: exact where nothing lifts off.
    #[default]
    Sliding,
    /// The ends may lift off; sliding is resisted as [`Friction`] says.
    Unilateral(Friction),
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

impl Friction {
    /// None.
    pub fn none() -> Self {
        Self { coefficient: 0.0, slip_velocity_mm_per_s: 1.0, drag_mpa_s_per_mm: 0.0 }
    }
}

/// The unconfined compression of a specimen between two rigid platens.
///
/// The lower end (surface `bottom`) keeps its height, the upper one (`top`) moves down at constant
/// speed; [`Platens`] says how they hold the specimen. Displacement and damage solve
/// ∫ τ : (∇v F⁻¹) dV = 0 and
/// ∫ g′(φ) ψ⁺ q + (Gc/(c₀ ℓ₀)) (α′(φ) q + 2 ℓ₀² ∇φ·∇q) + (ξ/Δt)(φ − φ_n) q dV = 0.
///
/// # Example
/// ```
/// use fem::{CompressionTest, CylinderLattice, Loading, Material, Order, SolverOptions, Stepping};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let area = mesh.volume() / 4.4;
/// let loading = Loading { displacement_mm: 0.22, duration_s: 1.0, stepping: Stepping::Fixed(1), stop_below_peak: None };
/// let rubber = Material::hencky(275.0, 0.25);
/// let test = CompressionTest::new(mesh, Order::Linear, vec![rubber], None, loading, SolverOptions::default())?;
/// let outcome = test.run(&mut ());
/// let stretch: f64 = 0.95;
/// let exact = -area * 275.0 * stretch.ln() / stretch;
/// assert!((outcome.curve[0].force_n - exact).abs() < 1e-6 * exact);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompressionTest {
    pub(super) problem: Problem,
    loading: Loading,
}

impl CompressionTest {
    /// Checks the input and prepares the unknowns and the structure of the factor; the platens are
    /// [`Platens::Sliding`].
    ///
    /// `materials` holds one entry for each of `mesh.regions`. Without a phase field the specimen is
    /// elastic and toughnesses are not used; with one, regions without toughness are elastic.
    ///
    /// # Errors
    /// A [`FemError`] that names what is wrong and the mend, before any step is taken.
    pub fn new(
        mesh: TetMesh,
        order: Order,
        materials: Vec<Material>,
        phase_field: Option<PhaseField>,
        loading: Loading,
        options: SolverOptions,
    ) -> Result<Self, FemError> {
        let [bottom, top] = levels(&mesh)?;
        let conditions = conditions(Platens::Sliding, loading, [bottom, top]);
        let schedule = loading.schedule();
        let problem =
            Problem::new(mesh, order, materials, phase_field, conditions, schedule, options)?;
        loading.validate(top - bottom)?;
        Ok(Self { problem, loading })
    }

    /// The same test between other platens.
    ///
    /// # Errors
    /// A coefficient out of its range.
    pub fn with_platens(&self, platens: Platens) -> Result<Self, FemError> {
        let levels = levels(self.problem.mesh())?;
        let conditions = conditions(platens, self.loading, levels);
        Ok(Self { problem: self.problem.with_conditions(conditions)?, loading: self.loading })
    }

    /// The same test with other materials; mesh, unknowns and the structure of the factor are shared
    /// unless a region gains or loses its toughness.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_materials(&self, materials: Vec<Material>) -> Result<Self, FemError> {
        Ok(Self { problem: self.problem.with_materials(materials)?, loading: self.loading })
    }

    /// Runs the test on the calling thread.
    pub fn run(&self, observer: &mut dyn Observer) -> Outcome {
        self.problem.run(observer)
    }

    /// Runs the test with its state on disk, see [`Problem::run_resumable`].
    ///
    /// # Errors
    /// As there.
    pub fn run_resumable(
        &self,
        checkpoint: &Checkpoint,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, FemError> {
        self.problem.run_resumable(checkpoint, observer)
    }

    /// The mesh.
    pub fn mesh(&self) -> &TetMesh {
        self.problem.mesh()
    }

    /// The materials, by region.
    pub fn materials(&self) -> &[Material] {
        self.problem.materials()
    }

    /// The loading.
    pub fn loading(&self) -> &Loading {
        &self.loading
    }

    /// The boundary-value problem that the test is.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Reference positions of the nodes that [`Fields`] refer to, mm.
    pub fn nodes(&self) -> &[[f64; 3]] {
        self.problem.nodes()
    }

    /// Writes the fields for ParaView, see [`Problem::write_vtu`].
    ///
    /// # Errors
    /// [`FemError::Mesh`] if the fields are those of another test or the file cannot be written.
    pub fn write_vtu(&self, path: impl AsRef<Path>, fields: &Fields) -> Result<(), FemError> {
        self.problem.write_vtu(path, fields)
    }

    /// Number of equations.
    pub fn unknowns(&self) -> usize {
        self.problem.unknowns()
    }

    /// Entries of the sparse factor; zero where the linear solver is iterative.
    pub fn factor_entries(&self) -> usize {
        self.problem.factor_entries()
    }
}

/// The platens as boundary conditions; the first increment starts from a uniform shortening.
fn conditions(platens: Platens, loading: Loading, [bottom, top]: [f64; 2]) -> Conditions {
    let speed = loading.displacement_mm / loading.duration_s;
    let (full, duration) = (loading.displacement_mm, loading.duration_s);
    // exactly the full displacement at the end
    let down = move |time_s: f64| time_s / duration * full;
    let shorten = move |x: [f64; 3], time_s: f64| {
        [0.0, 0.0, -down(time_s) / (top - bottom) * (x[2] - bottom)]
    };
    let conditions = match platens {
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
    conditions
        .described_as(format!("{loading:?}"))
        .remove_rigid_motions()
        .measure_travel("top", [0.0, 0.0, -1.0], down)
        .first_guess(shorten)
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
