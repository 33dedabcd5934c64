//! Joint calibration of the tests of `[[tests]]`. Each test has a separate results folder, `tests/NAME`, with a case
//! for this test alone. First, the stages up to `surrogate` are run in the folder of each test. Then the tests are
//! calibrated together. Finally, the other stages are run in the folder of each test with the joint posterior.
//!
//! 1. `folders`: names of folders and files
//! 2. `evidence`: surrogate, specimens and errors of each test
//! 3. `model_file`, `sources`: the joint model as a file, contributions of tests and errors to the posterior variance
//! 4. `calibrate`, `parameters`, `verdict`, `report`: the stages, and the parameters that they show

mod calibrate;
mod evidence;
pub(crate) mod folders;
mod model_file;
mod parameters;
mod report;
mod sources;
mod verdict;

pub(crate) use calibrate::run as calibrate;
pub(crate) use report::run as report;
pub(crate) use verdict::run as verdict;
