//! A checked problem, prepared for runs.

use std::sync::Arc;

use super::definition::Definition;
use super::discretisation::Discretisation;
use super::rounding::rounding;
use crate::boundary::ExternalForces;
use crate::error::FemError;
use crate::fields::Fields;
use crate::material::{Material, PointMaterial};
use crate::problem::interface::Interface;
use crate::problem::parameter::MaterialParameter;
use crate::solve::{ForceControl, Rounding, Solver};

/// A checked problem with all data that its runs share.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) definition: Definition,
    pub(crate) discretisation: Arc<Discretisation>,
    /// Materials of the regions, followed by the materials of the interface bands, in the form that
    /// is evaluated at quadrature points.
    pub(crate) point_materials: Arc<[PointMaterial]>,
    /// For each parameter, the materials for a smaller and for a larger value of the parameter.
    pub(crate) shifts: Arc<[PointShift]>,
    /// Size of the residuals that rounding errors cause.
    rounding: Rounding,
}

/// Materials for a smaller and for a larger value of a parameter, in the form that is evaluated at quadrature points.
#[derive(Debug)]
pub(crate) struct PointShift {
    pub(crate) below: Arc<[PointMaterial]>,
    pub(crate) above: Arc<[PointMaterial]>,
    pub(crate) width: f64,
}

impl Setup {
    /// Checks the input data and prepares the unknowns and the structure of the sparse factor.
    pub(crate) fn new(definition: Definition) -> Result<Self, FemError> {
        definition.validate()?;
        let discretisation = Arc::new(Discretisation::new(&definition)?);
        Ok(Self::with(definition, discretisation))
    }

    /// Creates the setup of input data with an existing discretisation of the same mesh.
    fn with(definition: Definition, discretisation: Arc<Discretisation>) -> Self {
        let spacing_mm = definition.strength_spacing_mm();
        let point_materials = |materials: &[Material], interfaces: &[Interface]| {
            let field = definition.phase_field.as_ref();
            discretisation.bands.point_materials(materials, interfaces, field, spacing_mm)
        };
        let shift = |parameter: &MaterialParameter| {
            let own = || [0, 1].map(|_| &definition.interfaces[..]);
            let sides = parameter.interfaces.as_ref();
            let [below, above] = sides.map_or_else(own, |sides| sides.each_ref().map(|s| &s[..]));
            PointShift {
                below: point_materials(&parameter.below, below),
                above: point_materials(&parameter.above, above),
                width: parameter.width,
            }
        };
        let shifts = definition.parameters.iter().map(shift).collect();
        let point_materials = point_materials(&definition.materials, &definition.interfaces);
        let rounding = rounding(&definition, &point_materials);
        Self { point_materials, shifts, rounding, definition, discretisation }
    }

    /// Returns the setup for other materials, interfaces or parameters. The discretisation is shared unless a region
    /// gains or loses its toughness, or an interface has other regions or another width.
    pub(crate) fn with_definition(&self, definition: Definition) -> Result<Self, FemError> {
        definition.validate()?;
        let discretisation = if self.discretisation.suits(&definition) {
            Arc::clone(&self.discretisation)
        } else {
            Arc::new(Discretisation::new(&definition)?)
        };
        Ok(Self::with(definition, discretisation))
    }

    /// Returns the setup for other conditions. Space and linear solver structure are shared.
    pub(crate) fn with_conditions(&self, definition: Definition) -> Result<Self, FemError> {
        definition.validate()?;
        let discretisation = Arc::new(self.discretisation.with_conditions(&definition)?);
        Ok(Self::with(definition, discretisation))
    }

    /// Creates a solver without tangents, factors and counters of earlier steps.
    pub(crate) fn solver(&self) -> Solver<'_> {
        let Discretisation { operator, unknowns, linear, boundary, .. } =
            self.discretisation.as_ref();
        let operator = operator.as_ref();
        Solver::new(
            operator,
            unknowns,
            &self.point_materials,
            self.definition.options,
            linear.solver(operator),
            self.rounding,
            ExternalForces::none(boundary),
            boundary.driven_platen(operator.domain().nodes().len()).map(ForceControl::new),
        )
    }

    /// Sets the prescribed values of the fields for the time `clock`, given as a fraction of the duration.
    pub(crate) fn impose(&self, fields: &mut Fields, clock: f64) {
        let time_s = clock * self.definition.schedule.duration_s;
        self.discretisation.boundary.impose(self.discretisation.nodes(), time_s, fields);
    }
}
