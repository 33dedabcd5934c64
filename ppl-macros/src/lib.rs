//! The `model!` macro of `ppl`. The language is described at `ppl::model!`.
//!
//! One way: tokens are parsed to a tree of what was written, which nothing changes afterwards;
//! analyses read it and leave tables by statement; statements are emitted in order, and a plan writes
//! the Rust in them. An error stays in the statement where it happened, as a `compile_error!` in place
//! of it, so that one mistake stays one error and all else is still there for completion.
//!
//! The rooms, from the ground up; an import goes down only:
//!
//! 1. `errors`: what the macro says when it refuses
//! 2. `syntax`: questions about Rust as written
//! 3. `ast`, `walk`, `parse`: what was written, the way through it, and how it is read
//! 4. `analyse`: which names are active, what a loop writes, where statements stand
//! 5. `plan`: expressions as they will be written, and the places and sums that these ask for
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

// Documented where it is re-exported, in `ppl`, which its examples need.
#[allow(missing_docs)]
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    expand(input.into()).into()
}

fn expand(input: TokenStream) -> TokenStream {
    let models = parse::models(input).into_iter().map(|model| match model {
        Ok(model) => {
            let analysis = Analysis::of(&model);
            emit::function(&model, &analysis)
        }
        Err(error) => error.to_compile_error(),
    });
    models.collect()
}
