//! Analyses of the syntax tree. The results of the analyses are tables whose key is the number of a
//! statement.

mod activity;
mod branches;
mod changes;
mod facts;
mod names;
mod plates;
mod refusals;
mod uses;

use quote::ToTokens;

use crate::ast::{Argument, Model};
use crate::syntax::tokens::says;
use facts::{Facts, facts};
use refusals::Scope;

pub(crate) use activity::Activity;
pub(crate) use names::Site;
pub(crate) use plates::Plate;

/// The results of all analyses of a body.
pub(crate) struct Analysis {
    pub(crate) activity: Activity,
    /// Whether the model runs the same statements and uses the same data at every point of the parameter space,
    /// provided that this is true of each submodel that it calls.
    pub(crate) is_static: bool,
    pub(crate) facts: Facts,
}

impl Analysis {
    pub(crate) fn new(model: &Model) -> Self {
        // arguments of type `Real` of a submodel may be unknowns
        let is_number =
            |data: &&Argument| model.value.is_some() && says(data.ty.to_token_stream(), "Real");
        let real_arguments = model.arguments.iter().filter(is_number).map(|data| data.name.clone());
        let activity = Activity::new(&model.body, real_arguments.clone());
        // an argument of generic type may hold unknowns, because the caller of the submodel chooses the type
        let is_generic = |data: &&Argument| {
            let mut parameters = model.generics.type_params();
            model.value.is_some()
                && parameters.any(|own| says(data.ty.to_token_stream(), &own.ident.to_string()))
        };
        let generic = model.arguments.iter().filter(is_generic).map(|data| data.name.clone());
        let possible = Activity::new(&model.body, real_arguments.chain(generic));
        let names = model.arguments.iter().map(|data| data.name.clone());
        let scope: Scope = names.map(|name| (name, false)).collect();
        Self {
            is_static: branches::is_static(&model.body, &possible),
            facts: facts(&model.body, &activity, scope),
            activity,
        }
    }
}
