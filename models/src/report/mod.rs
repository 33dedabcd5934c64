//! The report: figures and one self-contained HTML page, from plain results.

mod camera;
mod canvas;
mod chart;
mod damage_picture;
mod data_uri;
mod digits;
mod document;
mod figures;
mod grain_picture;
mod mesh_picture;
mod page;
mod raster;
mod results;
mod specimen_figures;
mod study;
mod style;

pub use chart::{Chart, Ink};
pub use damage_picture::{DamagedBody, damage_picture};
pub(crate) use digits::number;
pub use grain_picture::grain_picture;
pub use mesh_picture::mesh_picture;
pub(crate) use page::page;
pub use raster::{Raster, side_by_side};
pub(crate) use results::{
    CalibratedParameter, DamageState, Finding, FurtherExpected, FurtherNeeded, FurtherParameter,
    FurtherTestResult, LeftOut, OrderErrors, Picture, PictureContent, Points, PredictedBand, Qoi,
    Results, Summarised, Verdict, mean,
};
pub(crate) use specimen_figures::{grain_sizes, mesh_quality};
pub(crate) use study::{
    ComparedCase, Conclusion, Pair, REPRODUCED, StudyResults, Variant, study_page,
};
