//! A compression test, ready to run.

use std::path::Path;
use std::sync::Arc;

use super::arc_length;
use super::curve::{Fields, Observer, Outcome};
use super::discretisation::Discretisation;
use super::loading::Loading;
use super::march::March;
use crate::element::Order;
use crate::error::FemError;
use crate::material::{Material, PhaseField};
use crate::mesh::{TetMesh, vtu};
use crate::solve::{Scheme, SolverOptions};

/// The unconfined compression of a specimen between rigid, frictionless platens.
///
/// The lower end (surface `bottom`) keeps its height, the upper one (`top`) moves down at constant
/// speed; both slide freely in their plane. Displacement and damage solve
/// ∫ τ : (∇v F⁻¹) dV = 0 and
/// ∫ g′(φ) ψ⁺ q + (Gc/(c₀ ℓ₀)) (α′(φ) q + 2 ℓ₀² ∇φ·∇q) + (ξ/Δt)(φ − φ_n) q dV = 0.
///
/// # Example
/// ```
/// use fem::{CompressionTest, CylinderLattice, ElasticLaw, Loading, Material, Order, SolverOptions, Stepping};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let area = mesh.volume() / 4.4;
/// let loading = Loading { displacement_mm: 0.22, duration_s: 1.0, stepping: Stepping::Fixed(1), stop_below_peak: None };
/// let rubber = Material::elastic(ElasticLaw::Hencky, 275.0, 0.25);
/// let test = CompressionTest::new(mesh, Order::Linear, vec![rubber], None, loading, SolverOptions::default())?;
/// let outcome = test.run(&mut ());
/// let stretch: f64 = 0.95;
/// let exact = -area * 275.0 * stretch.ln() / stretch;
/// assert!((outcome.curve[0].force_n - exact).abs() < 1e-6 * exact);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompressionTest {
    mesh: Arc<TetMesh>,
    order: Order,
    pub(super) materials: Vec<Material>,
    pub(super) phase_field: Option<PhaseField>,
    loading: Loading,
    options: SolverOptions,
    pub(super) discretisation: Arc<Discretisation>,
}

impl CompressionTest {
    /// Checks the input and prepares the unknowns and the structure of the factor.
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
        check_materials(&mesh, &materials, phase_field.as_ref())?;
        if let Some(field) = &phase_field {
            field.validate()?;
        }
        options.validate()?;
        let turns = phase_field.as_ref().is_some_and(|field| !field.is_variational());
        let scheme = if turns { Scheme::Alternate } else { options.scheme };
        let options = SolverOptions { scheme, ..options };
        let damaged = damaged_regions(&materials, phase_field.as_ref());
        let discretisation =
            Arc::new(Discretisation::new(&mesh, order, phase_field.as_ref(), damaged)?);
        loading.validate(discretisation.height)?;
        arc_length::check(&loading, &materials, phase_field.as_ref())?;
        Ok(Self {
            mesh: Arc::new(mesh),
            order,
            materials,
            phase_field,
            loading,
            options,
            discretisation,
        })
    }

    /// The same test with other materials; mesh, unknowns and the structure of the factor are shared
    /// unless a region gains or loses its toughness.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_materials(&self, materials: Vec<Material>) -> Result<Self, FemError> {
        let field = self.phase_field.as_ref();
        check_materials(&self.mesh, &materials, field)?;
        arc_length::check(&self.loading, &materials, field)?;
        let damaged = damaged_regions(&materials, field);
        let discretisation = if damaged == self.discretisation.damaged {
            Arc::clone(&self.discretisation)
        } else {
            Arc::new(Discretisation::new(&self.mesh, self.order, field, damaged)?)
        };
        Ok(Self { materials, discretisation, ..self.clone() })
    }

    /// Runs the test on the calling thread.
    pub fn run(&self, observer: &mut dyn Observer) -> Outcome {
        let points: Vec<_> =
            self.materials.iter().map(|m| m.at_point(self.phase_field.as_ref())).collect();
        let field = self.phase_field.as_ref();
        March::new(&self.discretisation, &points, field, self.loading, self.options, observer).run()
    }

    /// The mesh.
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// The materials, by region.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The loading.
    pub fn loading(&self) -> &Loading {
        &self.loading
    }

    /// Reference positions of the nodes that [`Fields`] refer to, mm.
    pub fn nodes(&self) -> &[[f64; 3]] {
        &self.discretisation.nodes
    }

    /// Writes the mesh with `displacement_mm`, `damage` and its regions for ParaView (`.vtu`);
    /// quadratic elements are written as such.
    ///
    /// # Errors
    /// [`FemError::Mesh`] if the fields are those of another test or the file cannot be written.
    pub fn write_vtu(&self, path: impl AsRef<Path>, fields: &Fields) -> Result<(), FemError> {
        let points = [
            vtu::Field::vector("displacement_mm", &fields.displacement),
            vtu::Field::scalar("damage", &fields.damage),
        ];
        match self.order {
            Order::Linear => vtu::write(path, &self.mesh, &points, &[])?,
            Order::Quadratic => {
                let nodes_of = |tet| {
                    let nodes = self.discretisation.operator.nodes_of(tet);
                    nodes.try_into().expect("a quadratic tetrahedron has ten nodes")
                };
                let tets: Vec<[u32; 10]> = (0..self.mesh.tets.len()).map(nodes_of).collect();
                vtu::write_quadratic(path, &self.mesh, self.nodes(), &tets, &points, &[])?;
            }
        }
        Ok(())
    }

    /// Number of equations.
    pub fn unknowns(&self) -> usize {
        self.discretisation.unknowns.count
    }

    /// Entries of the sparse factor; zero where the linear solver is iterative.
    pub fn factor_entries(&self) -> usize {
        self.discretisation.linear.fill()
    }
}

fn damaged_regions(materials: &[Material], phase_field: Option<&PhaseField>) -> Vec<bool> {
    materials.iter().map(|m| phase_field.is_some() && m.toughness_n_per_mm.is_some()).collect()
}

fn check_materials(
    mesh: &TetMesh,
    materials: &[Material],
    phase_field: Option<&PhaseField>,
) -> Result<(), FemError> {
    if materials.len() != mesh.regions.len() {
        return Err(FemError::MaterialCount {
            materials: materials.len(),
            regions: mesh.regions.len(),
            names: mesh.regions.join(", "),
        });
    }
    mesh.regions
        .iter()
        .zip(materials)
        .try_for_each(|(region, material)| material.validate(region, phase_field))
}
