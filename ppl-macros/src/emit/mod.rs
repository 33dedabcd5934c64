//! From a plan to Rust that a person can follow.
//!
//! Names of the macro's own have mixed-site spans: variables of a user called `cx` are others.
//! Tokens of the user are handed on as they are.

mod data;
mod model;
mod names;
mod statements;
mod submodel;

use proc_macro2::TokenStream;

use crate::ast::Model;
use crate::plan::Plan;

/// The function that the user has declared.
pub(crate) fn emit(model: &Model, plan: &Plan) -> TokenStream {
    match &model.value {
        None => model::model(model, plan),
        Some(value) => submodel::submodel(model, value, plan),
    }
}
