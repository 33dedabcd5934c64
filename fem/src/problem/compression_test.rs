//! The unconfined compression test as a boundary-value problem.

use std::borrow::Cow;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::control::{LoadProgram, Schedule, SegmentSteps};
use super::problem::{Problem, ProblemBuilder};
use crate::boundary::{Axis, Conditions, Platen};
use crate::error::{FemError, Unsupported};
use fem_mesh::TetMesh;

/// Direction in which the upper platen moves.
const DOWNWARDS: [f64; 3] = [0.0, 0.0, -1.0];

/// Contact between the platens of a compression test and the specimen. Files contain the name of the variant; the
/// values of [`Friction`] are separate keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Platens {
    /// The ends stay in contact with the platens and slide on them without friction. This is exact if no part of an end
    /// lifts off.
    #[default]
    Sliding,
    /// The ends can lift off; [`Friction`] resists sliding.
    Unilateral(#[serde(skip)] Friction),
}

impl JsonSchema for Platens {
    fn schema_name() -> Cow<'static, str> {
        "Platens".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Contact between the platens and the specimen: the ends slide without friction and stay in \
                            contact, or they can lift off, with friction.",
            "type": "string",
            "enum": ["sliding", "unilateral"],
        })
    }
}

/// Resistance of the platens to sliding; the equations are given at [`Platen`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coulomb's coefficient of friction μ.
    pub coefficient: f64,
    /// Slip velocity ε, mm/s. Below ε, the friction stress decreases to zero with the velocity, so that the specimen
    /// creeps instead of sticking.
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
    /// No friction and no drag.
    pub fn none() -> Self {
        Self { coefficient: 0.0, slip_velocity_mm_per_s: 1.0, drag_mpa_s_per_mm: 0.0 }
    }
}

/// Unconfined compression of a specimen between two rigid platens. Creates a [`Problem`] on a mesh.
///
/// The lower end (surface `bottom`) keeps its height. The upper end (`top`) moves down by the full displacement over
/// the duration of the schedule, at constant speed, or follows a [`LoadProgram`], which prescribes displacements or forces.
/// [`Platens`] defines the contact between platens and specimen.
/// The displacement u and the damage φ solve, for all test functions v and q (symbols as in
/// [`equations`](crate::equations)),
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
    /// Full displacement, mm, downwards. With a load program, it is only compared with the height of the specimen; it is
    /// zero if the program states no displacement.
    pub displacement_mm: f64,
    /// Load program; `None` for constant speed.
    program: Option<LoadProgram>,
    /// Contact between the platens and the specimen.
    pub platens: Platens,
    /// Time for the full displacement, and the load steps.
    pub schedule: Schedule,
}

impl CompressionTest {
    /// Creates a test between platens without friction, from which the ends cannot lift off.
    pub fn new(displacement_mm: f64, schedule: Schedule) -> Self {
        Self { displacement_mm, program: None, platens: Platens::Sliding, schedule }
    }

    /// Creates a test that follows a load program, between platens without friction, from which the ends cannot lift
    /// off. `usual` are the load steps of each segment whose point does not state a number of steps.
    ///
    /// # Example
    /// An elastic body returns to zero force:
    /// ```
    /// use fem::{CompressionTest, CylinderLattice, LoadProgram, Material, ProgramPoint, SegmentSteps};
    ///
    /// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
    /// let there = ProgramPoint::new(1.0, 0.1);
    /// let program = LoadProgram::new(vec![there, ProgramPoint::new(3.0, 0.0)])?;
    /// let problem = CompressionTest::following(program, SegmentSteps::Fixed(2))
    ///     .builder(mesh)?
    ///     .materials([Material::hencky(275.0, 0.25)])
    ///     .build()?;
    /// let curve = problem.run(&mut ()).curve;
    /// assert_eq!(curve.iter().map(|p| p.time_s).collect::<Vec<_>>(), [0.5, 1.0, 2.0, 3.0]);
    /// assert!(curve[3].force_n.abs() < 1e-6 * curve[1].force_n);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn following(program: LoadProgram, usual: SegmentSteps) -> Self {
        let schedule = Schedule::of_program(&program, usual);
        let displacement_mm = program.largest_mm();
        Self { displacement_mm, program: Some(program), platens: Platens::Sliding, schedule }
    }

    /// Sets the platens.
    pub fn platens(self, platens: Platens) -> Self {
        Self { platens, ..self }
    }

    /// Creates the builder of the problem on a mesh. The caller must then set the materials.
    ///
    /// # Errors
    /// Returns an error if `top` is not above `bottom`, if both surfaces have common nodes, or if the largest
    /// displacement is not between zero and the height of the specimen.
    pub fn builder(&self, mesh: TetMesh) -> Result<ProblemBuilder, FemError> {
        let conditions = self.conditions(&mesh)?;
        Ok(Problem::builder(mesh).conditions(conditions).schedule(self.schedule.clone()))
    }

    /// Returns the boundary conditions that represent the platens. The initial guess of the first increment is a
    /// uniform compression.
    ///
    /// # Errors
    /// The errors of [`builder`](Self::builder).
    pub fn conditions(&self, mesh: &TetMesh) -> Result<Conditions, FemError> {
        let [bottom, top] = levels(mesh)?;
        let full = self.displacement_mm;
        // the height is NaN if an end surface is missing; a later check reports that error
        let height = top - bottom;
        let by_force = self.program.as_ref().is_some_and(LoadProgram::prescribes_force);
        if !((full > 0.0 || by_force) && (height.is_nan() || full < height)) {
            return Err(FemError::parameter(
                "test",
                "displacement_mm",
                full,
                "positive (downwards) and less than the height of the specimen",
            ));
        }
        let straight = || LoadProgram::straight(self.schedule.duration_s, full);
        let program = Arc::new(self.program.clone().unwrap_or_else(straight));
        let down = || {
            let program = Arc::clone(&program);
            // the displacement in a segment with a prescribed force is not known in advance
            move |time_s: f64| program.displacement_mm(time_s).unwrap_or(0.0)
        };
        let (travel, start) = (down(), down());
        let shorten =
            move |x: [f64; 3], time_s: f64| [0.0, 0.0, -start(time_s) / height * (x[2] - bottom)];
        let conditions = match self.platens {
            Platens::Sliding if by_force => {
                Conditions::new().fix("bottom", [Axis::Z]).drive("top", DOWNWARDS)
            }
            Platens::Sliding => Conditions::new().fix("bottom", [Axis::Z]).prescribe(
                "top",
                [Axis::Z],
                move |_, time_s| [0.0, 0.0, -travel(time_s)],
            ),
            Platens::Unilateral(friction) => {
                let platen = |level, up| {
                    Platen::plane([0.0, 0.0, level], [0.0, 0.0, up])
                        .friction(friction.coefficient, friction.slip_velocity_mm_per_s)
                        .drag(friction.drag_mpa_s_per_mm)
                };
                let conditions = Conditions::new().platen("bottom", platen(bottom, 1.0));
                let upper = platen(top, -1.0);
                if by_force {
                    conditions.drive_platen("top", upper, DOWNWARDS)
                } else {
                    let moving = upper.moving(move |time_s| [0.0, 0.0, -travel(time_s)]);
                    conditions.platen("top", moving)
                }
            }
        };
        let conditions = conditions
            .described_as(format!("{self:?}"))
            .remove_rigid_motions()
            .first_guess(shorten);
        // conditions with a driven platen measure the force and the displacement of this platen
        Ok(if by_force { conditions } else { conditions.measure_travel("top", DOWNWARDS, down()) })
    }
}

/// Returns the mean z coordinates of the surfaces `bottom` and `top`, mm.
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
    let refused = |reason| Err(FemError::unsupported("platens", reason));
    if levels[1] - levels[0] <= 0.0 {
        return refused(Unsupported::TopBelowBottom);
    }
    if top.iter().any(|n| bottom.binary_search(n).is_ok()) {
        return refused(Unsupported::CommonNodesOfPlatens);
    }
    Ok(levels)
}
