//! The `model!` macro of `ppl`. The language is described at `ppl::model!`.
//!
//! `signature` and `parse` read what was written, statement by statement, and keep going after
//! an error; `lower` checks it and numbers the statements; `emit` writes the implementation of
//! `ppl::Model`. An error stays in the statement where it happened, as a `compile_error!` in
//! place of the value, so that one mistake stays one error and everything else is still there
//! for completion.

mod emit;
mod errors;
mod lower;
mod parse;
mod rewrite;
mod scan;
mod signature;

use proc_macro::TokenStream;

// Documented where it is re-exported, in `ppl`, which its examples need.
#[allow(missing_docs)]
#[proc_macro]
pub fn model(input: TokenStream) -> TokenStream {
    signature::models(input.into())
        .into_iter()
        .map(|model| match model {
            Ok(mut model) => {
                let sites = lower::lower(&mut model);
                emit::model(&model, &sites)
            }
            Err(error) => error.to_compile_error(),
        })
        .collect::<proc_macro2::TokenStream>()
        .into()
}
