//! Stress, energy, forces and J-integral of given fields.

mod energy_release;

use std::path::Path;

use nalgebra::Vector3;

use crate::element::{Domain, PointValues};
use crate::error::FemError;
use crate::fields::{Fields, LawState};
use crate::operator::{CellStress, Increment, Operator, Residual, StepContext, state_len};
use crate::problem::definition::Setup;
use fem_mesh::vtu;

pub use energy_release::CrackExtension;

/// Fields of a problem, from which stresses, energies and forces are computed; created by
/// [`Problem::evaluate`](crate::Problem::evaluate).
///
/// Laws with a state ([`ConstitutiveLaw`](crate::ConstitutiveLaw)) are evaluated with the state that the fields contain
/// ([`Fields::state`]). For fields with an empty state, the laws are evaluated for a single increment of one second that
/// starts from the state zero and ends at these fields.
///
/// # Example
/// A block that is pulled by 1 %: its stress, its energy, and the force on its upper end.
/// ```
/// use fem::{Axis, Conditions, CylinderLattice, Material, Problem, Schedule};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let (volume, area) = (mesh.volume(), mesh.volume() / 4.4);
/// let problem = Problem::builder(mesh)
///     .materials([Material::hencky(10.0, 0.4)])
///     .conditions(
///         Conditions::new()
///             .fix("bottom", [Axis::Z])
///             .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.044 * time_s])
///             .remove_rigid_motions(),
///     )
///     .schedule(Schedule::fixed(1.0, 1))
///     .build()?;
/// let outcome = problem.run(&mut ());
/// let state = problem.evaluate(&outcome.fields)?;
///
/// // with the logarithmic strain ε = ln 1.01: ψ = E ε²/2 and σ = E ε λ^(2ν − 1)
/// let strain = 1.01f64.ln();
/// let stress = 10.0 * strain * 1.01f64.powf(2.0 * 0.4 - 1.0);
/// let element = &state.elements()?[0];
/// assert!((element.stress_mpa[2] - stress).abs() < 1e-6 * stress);
/// assert!((state.energy_n_mm()? - 5.0 * strain.powi(2) * volume).abs() < 1e-6 * volume);
/// let force = state.force_n("top")?[2];
/// assert!((force - 10.0 * strain / 1.01 * area).abs() < 1e-6 * force);
/// assert!(state.torque_n_mm("top", [0.0; 3], [0.0, 0.0, 1.0])?.abs() < 1e-6 * force);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<'a> {
    pub(super) setup: &'a Setup,
    /// Operator of the whole mesh (not only of the part of one rank).
    pub(super) operator: &'a dyn Operator,
    pub(super) fields: &'a Fields,
}

impl<'a> Evaluation<'a> {
    /// Checks that the fields and the state of their laws belong to the problem.
    pub(super) fn new(
        setup: &'a Setup,
        operator: &'a dyn Operator,
        fields: &'a Fields,
    ) -> Result<Self, FemError> {
        let expected = operator.domain().nodes().len();
        for nodes in [fields.displacement.len(), fields.damage.len()] {
            if nodes != expected {
                return Err(FemError::OtherFields { nodes, expected });
            }
        }
        let values = fields.state.values.len();
        let expected = operator.domain().elastic_points() * state_len(&setup.point_materials);
        if values != 0 && values != expected {
            return Err(FemError::OtherState { values, expected });
        }
        Ok(Self { setup, operator, fields })
    }

    pub(super) fn increment(&self) -> Increment<'a> {
        let LawState { values, duration_s } = &self.fields.state;
        // without a state, the duration has no effect
        let duration = if values.is_empty() { 1.0 } else { *duration_s };
        let start = StepContext::new(&self.fields.damage, duration);
        let context = StepContext { state: values, ..start };
        Increment { materials: &self.setup.point_materials, fields: self.fields, context }
    }

    /// Returns stress and energy density of every element, in the order of the mesh. Laws with a state are evaluated
    /// with the state of the fields, [`Fields::state`].
    ///
    /// # Errors
    /// [`FemError::InvertedFields`] if an element is inverted.
    pub fn elements(&self) -> Result<Vec<CellStress>, FemError> {
        self.operator.stresses(&self.increment()).map_err(|_| FemError::InvertedFields)
    }

    /// Returns the elastic energy ∫ (g ψ⁺ + ψ⁻) dV, N mm: g is the degradation, ψ⁺ and ψ⁻ are the degraded and the
    /// intact part of the energy density.
    ///
    /// # Errors
    /// The errors of [`elements`](Self::elements).
    pub fn energy_n_mm(&self) -> Result<f64, FemError> {
        Ok(self.residual()?.elastic)
    }

    fn residual(&self) -> Result<Residual, FemError> {
        let mut residual = Residual::new(self.fields.damage.len());
        self.operator
            .residual(&self.increment(), &mut residual)
            .map_err(|_| FemError::InvertedFields)?;
        Ok(residual)
    }

    /// Returns the external force at every node, N, which balances the forces of the stress: the reaction where the
    /// displacement is prescribed, the contact force under a platen, the consistent nodal force of loads, and zero
    /// elsewhere.
    ///
    /// # Errors
    /// The errors of [`elements`](Self::elements).
    pub fn nodal_forces_n(&self) -> Result<Vec<[f64; 3]>, FemError> {
        Ok(self.residual()?.nodal.iter().map(|&[x, y, z, _]| [x, y, z]).collect())
    }

    /// Returns the sum of the nodal forces on a surface or a node set of the conditions, N.
    ///
    /// # Errors
    /// [`FemError::MissingSurface`] if there is no such surface or node set; otherwise the errors
    /// of [`elements`](Self::elements).
    pub fn force_n(&self, surface: &str) -> Result<[f64; 3], FemError> {
        let (nodes, forces) = (self.nodes_of(surface)?, self.nodal_forces_n()?);
        let force = |&n: &u32| Vector3::from(forces[n as usize]);
        Ok(nodes.iter().map(force).sum::<Vector3<f64>>().into())
    }

    /// Returns the torque of the nodal forces on a surface or a node set about an axis in the deformed body, N mm: Σ
    /// ((x − p) × f) · a, summed over the nodes at the deformed positions x with the forces f. The axis passes through
    /// the point p (`point_mm`) in the direction a (`axis`, of any length).
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] if the axis has no length or the point is not finite; otherwise the errors of
    /// [`force_n`](Self::force_n).
    pub fn torque_n_mm(
        &self,
        surface: &str,
        point_mm: [f64; 3],
        axis: [f64; 3],
    ) -> Result<f64, FemError> {
        let (point, axis) = (Vector3::from(point_mm), Vector3::from(axis));
        let length = axis.norm();
        if !(length > 0.0 && length.is_finite()) {
            let requirement = "positive: the axis is a vector such as [0, 0, 1]";
            return Err(FemError::parameter("torque", "length of the axis", length, requirement));
        }
        if let Some(x) = point_mm.into_iter().find(|x| !x.is_finite()) {
            let requirement = "a position with finite coordinates, mm";
            return Err(FemError::parameter("torque", "point_mm", x, requirement));
        }
        let (nodes, forces) = (self.nodes_of(surface)?, self.nodal_forces_n()?);
        let reference = self.operator.domain().nodes();
        let moment = |&n: &u32| {
            let n = n as usize;
            let x = Vector3::from(reference[n]) + Vector3::from(self.fields.displacement[n]);
            (x - point).cross(&Vector3::from(forces[n]))
        };
        Ok(nodes.iter().map(moment).sum::<Vector3<f64>>().dot(&axis) / length)
    }

    fn nodes_of(&self, surface: &str) -> Result<Vec<u32>, FemError> {
        let definition = &self.setup.definition;
        definition.conditions.nodes_of(
            surface,
            "a force is requested",
            &definition.mesh,
            self.operator.domain(),
        )
    }

    /// Returns ∫ f dV of a function of the fields at each quadrature point, by a rule of degree 5.
    pub fn integral(&self, mut f: impl FnMut(&PointValues) -> f64) -> f64 {
        let mut sum = 0.0;
        self.operator.domain().visit(self.fields, &mut |point, volume| sum += volume * f(point));
        sum
    }

    /// Writes the mesh for ParaView (`.vtu`), with quadratic cells for quadratic elements. Fields at nodes:
    /// `displacement_mm` and `damage`. Fields of elements: the region, the elastic energy per reference volume
    /// `energy_density_mpa` (N mm/mm³), the mean Cauchy stress `stress_mpa` and its von Mises equivalent
    /// `von_mises_mpa`.
    ///
    /// # Errors
    /// [`FemError::Mesh`] if the file cannot be written; otherwise the errors of
    /// [`elements`](Self::elements).
    pub fn write_vtu(&self, path: impl AsRef<Path>) -> Result<(), FemError> {
        let point_fields = [
            vtu::Field::vector("displacement_mm", &self.fields.displacement),
            vtu::Field::scalar("damage", &self.fields.damage),
        ];
        let elements = self.elements()?;
        let energy: Vec<f64> = elements.iter().map(|s| s.energy_density_mpa).collect();
        let stress: Vec<[f64; 6]> = elements.iter().map(|s| s.stress_mpa).collect();
        let von_mises: Vec<f64> = elements.iter().map(CellStress::von_mises_mpa).collect();
        let cell_fields = [
            vtu::Field::scalar("energy_density_mpa", &energy),
            vtu::Field::tensor("stress_mpa", &stress),
            vtu::Field::scalar("von_mises_mpa", &von_mises),
        ];
        let (path, mesh, domain) =
            (path.as_ref(), self.setup.definition.mesh.as_ref(), self.operator.domain());
        match quadratic_tets(domain) {
            None => vtu::write_straight(path, mesh, &point_fields, &cell_fields)?,
            Some(tets) => {
                vtu::write_quadratic(
                    path,
                    mesh,
                    domain.nodes(),
                    &tets,
                    &point_fields,
                    &cell_fields,
                )?;
            }
        }
        Ok(())
    }
}

/// Returns the nodes of quadratic elements; `None` for linear elements.
fn quadratic_tets(domain: &dyn Domain) -> Option<Vec<[u32; 10]>> {
    (0..domain.tets()).map(|tet| domain.nodes_of(tet).try_into().ok()).collect()
}

/// Returns linear tetrahedra that fill the body: the elements, or eight for each quadratic element.
pub(super) fn linear_tets(domain: &dyn Domain) -> Vec<[u32; 4]> {
    // nodes 0 to 3 are the vertices, nodes 4 to 9 the midpoints of the edges 01, 12, 20, 03, 13, 23; the inner
    // octahedron is cut along the line between the midpoints of the edges 20 and 13
    const PARTS: [[usize; 4]; 8] = [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 5, 6, 8],
        [5, 9, 6, 8],
        [9, 7, 6, 8],
        [7, 4, 6, 8],
    ];
    let corners = |tet| {
        let nodes = domain.nodes_of(tet);
        [0, 1, 2, 3].map(|k| nodes[k])
    };
    match quadratic_tets(domain) {
        None => (0..domain.tets()).map(corners).collect(),
        Some(tets) => {
            let subdivided = |tet: &[u32; 10]| PARTS.map(|part| part.map(|k| tet[k]));
            tets.iter().flat_map(subdivided).collect()
        }
    }
}
