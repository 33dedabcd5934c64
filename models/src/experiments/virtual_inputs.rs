//! Keys of `[experiments.virtual]` as inputs of a stage.

use crate::case::{ByParameter, NoiseCase};
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;

/// Defines a function for each listed key of `[experiments.virtual]`. The function records the key and returns its value.
/// Each key is recorded separately, because different stages depend on different keys.
macro_rules! keys {
    ($($name:ident => $type:ty;)*) => {$(
        pub(crate) fn $name<'a>(inputs: &Inputs<'a>) -> Result<&'a $type, WorkflowError> {
            inputs.reads(concat!("experiments.virtual.", stringify!($name)));
            let experiments = inputs.unrecorded().case.experiments.as_ref();
            match experiments.and_then(|experiments| experiments.virtual_specimens.as_ref()) {
                Some(virtual_specimens) => Ok(&virtual_specimens.$name),
                None => Err(inputs.missing("experiments.virtual", "how specimens are simulated")),
            }
        }
    )*};
}

keys! {
    specimens => usize;
    seed => u64;
    group => String;
    spacing_mm => Option<f64>;
    truth => ByParameter<f64>;
    scatter => ByParameter<f64>;
    noise => NoiseCase;
    scans => bool;
}
