//! The `model!` macro of `ppl`. The language is described at `ppl::model!`.
//!
//! The macro runs in one direction. The parser turns tokens into a syntax tree, which does not change
//! afterwards. Analyses read the tree and fill tables that are indexed by statement. Code generation emits
//! the statements in order; a plan rewrites the Rust expressions in them. A statement with an error is
//! replaced by a `compile_error!`, so that one mistake gives one error and the rest of the model is still
//! available to code completion.
//!
//! The modules are listed in the order of their layers. A module imports only from modules above it in this list:
//!
//! 1. `errors`: the error messages of the macro
//! 2. `syntax`: properties of Rust syntax, independent of any model
//! 3. `ast`, `walk`, `parse`: the syntax tree of a model, its traversal, and the parser
//! 4. `analyse`: names that may depend on unknowns, variables that a loop changes, sites of statements
//! 5. `plan`: rewritten expressions, and the sites and sums that they need
//! 6. `emit`: statements and functions as tokens

mod analyse;
mod ast;
mod emit;
mod errors;
mod parse;
mod plan;
mod syntax;
#[cfg(test)]
#[path = "../tests/unit/mod.rs"]
mod unit;
mod walk;

use proc_macro2::TokenStream;

use crate::analyse::Analysis;

// The documentation is on the re-export in `ppl`, because its examples need `ppl`.
#[allow(missing_docs)]
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    expand(input.into()).into()
}

fn expand(input: TokenStream) -> TokenStream {
    let models = parse::models(input).into_iter().map(|model| match model {
        Ok(model) => {
            let analysis = Analysis::new(&model);
            emit::function(&model, &analysis)
        }
        Err(error) => error.to_compile_error(),
    });
    models.collect()
}
