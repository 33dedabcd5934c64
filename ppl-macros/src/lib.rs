//! The `model!` macro of `ppl`. The language is described at `ppl::model!`.
//!
//! `signature` and `parse` read what was written, statement by statement, and keep going after
//! an error, into the statements of `ast`; `lower` checks it and numbers the statements; `formula`
//! joins arithmetic to what is differentiated as a whole; `emit` writes the implementation of `ppl::Model`. An error stays in
//! the statement where it happened, as a `compile_error!` in place of the value, so that one
//! mistake stays one error and everything else is still there for completion.

mod arithmetic;
mod ast;
mod attributes;
mod check;
mod data;
mod derived;
mod effects;
mod emit;
mod errors;
mod fold;
mod formula;
#[cfg(test)]
mod fuzz;
mod inspect;
mod iterated;
mod linear;
mod literals;
mod lower;
mod names;
mod operands;
mod parse;
mod rewrite;
mod rows;
mod scan;
mod signature;
mod starts;
mod submodel;
mod updates;

use proc_macro2::TokenStream;
use quote::ToTokens;

use crate::derived::Derived;

// Documented where it is re-exported, in `ppl`, which its examples need.
#[allow(missing_docs)]
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    expand(input.into()).into()
}

fn expand(input: TokenStream) -> TokenStream {
    let models = signature::models(input).into_iter().map(|model| match model {
        Ok(mut model) => {
            let sites = lower::lower(&mut model);
            match &model.value {
                None => {
                    iterated::unroll(&mut model.body);
                    let is_static = formula::formulas(&mut model.body);
                    emit::model(&model, &sites, is_static)
                }
                Some(value) => {
                    let numbers = model
                        .arguments
                        .iter()
                        .filter(|data| inspect::says(data.ty.to_token_stream(), "Real"));
                    let given = numbers.map(|data| data.name.clone());
                    let derived = Derived::of(&model.body, given);
                    literals::align_all(&mut model.body, &derived);
                    submodel::submodel(&model, value, &sites)
                }
            }
        }
        Err(error) => error.to_compile_error(),
    });
    models.collect()
}
