//! Comparison of specimens and model: the specimens, the misfits, and the end of the predicted band.

/// Size and quantities of a specimen.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpecimenFacts {
    /// Name of the specimen.
    pub(crate) id: String,
    pub(crate) group: String,
    /// Height and radius, mm; `None` if they are not known.
    pub(crate) size_mm: Option<[f64; 2]>,
    /// Values of the quantities of interest, in the order of the report's quantities.
    pub(crate) values: Vec<f64>,
}

/// Relative difference of a model at the MAP from the mean of the specimens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Misfit {
    /// Difference, %.
    pub(crate) percent: f64,
    /// Largest difference that is accepted, %.
    pub(crate) threshold_percent: f64,
}

impl Misfit {
    /// Whether the difference is larger than accepted.
    pub(crate) fn is_poor(&self) -> bool {
        self.percent.abs() > self.threshold_percent
    }
}

/// Misfits of the surrogate and of the simulation in one quantity.
#[derive(Clone, Debug)]
pub(crate) struct QuantityMisfit {
    pub(crate) quantity: String,
    pub(crate) surrogate: Misfit,
    /// Misfit of the simulation at the MAP; `None` if it was not run.
    pub(crate) simulation: Option<Misfit>,
}

/// Reason for the end of a predicted band.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BandEnd {
    /// Percentage of the displacement at peak up to which shapes are known.
    pub(crate) percent: u8,
    /// The curve that ends first; `None` if all curves reach the largest percentage that is compared.
    pub(crate) shortest: Option<String>,
}
