//! The report: figures and a self-contained HTML page, from plain results.

mod chart;
mod comparison;
mod data_uri;
mod digits;
mod document;
mod figures;
mod page;
mod provenance;
mod results;
mod specimen_figures;
mod study;
mod style;
mod ticks;
mod validation_results;
mod verdict;

pub use chart::{Chart, Ink};
pub(crate) use digits::number;
pub use fem_pictures::{
    DamagedBody, Raster, damage_picture, grain_picture, mesh_picture, side_by_side,
};
pub(crate) use page::{JointResults, WithoutTest, joint_page, page};
pub(crate) use results::{
    BandEnd, CalibratedParameter, ChangedKey, DamageModel, DamageState, Finding, FurtherExpected,
    FurtherNeeded, FurtherParameter, FurtherTestResult, InputFile, LeftOut, MOST_SHIFT, Methods,
    Misfit, OrderErrors, ParameterSensitivity, Picture, PictureContent, Points, PredictedBand,
    Provenance, Qoi, Qualifier, QuantityMisfit, Results, SpecimenFacts, Summarised,
    ValidatedQuantity, ValidationCoverage, ValidationResult, ValidationVerdict, mean,
};
pub(crate) use specimen_figures::{grain_sizes, mesh_quality};
pub(crate) use study::{ComparedCase, Pair, StudyResults, Variant, study_page};
