//! The `model!` macro of `ppl`.

use proc_macro::TokenStream;

/// Declares a probabilistic model.
#[proc_macro]
pub fn model(input: TokenStream) -> TokenStream {
    input
}
