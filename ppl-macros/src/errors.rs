//! The error messages of the macro. Each message explains how to fix the error. `{}` is replaced by a name.

use std::fmt::Display;

use quote::ToTokens;
use syn::Error;

pub(crate) const NO_FUNCTION: &str =
    "`model!` declares functions: `pub fn name(data: &[f64]) { … }`";
pub(crate) const NO_BODY: &str = "a model needs its statements in braces: `{ … }`";
pub(crate) const QUALIFIER: &str =
    "a model is plain code that is run thousands of times: remove `{}`";
pub(crate) const SELF_ARGUMENT: &str =
    "a model is a free function: give its data as arguments instead of `self`";
pub(crate) const NO_VALUE: &str = "a function with a return type is a submodel, and ends with its \
     value: write it as the last line, without `;`";
pub(crate) const VALUE_REFERENCE: &str =
    "a submodel returns what it made, not a reference: write the type without `&`";
pub(crate) const REAL_DATA: &str = "data of a model are plain numbers: write `f64` (`Real` belongs \
     in a submodel, a function with a return type)";
pub(crate) const IMPL_TRAIT: &str = "name the type of this argument: \
     `fn name<F: Trait>(f: F)` instead of `f: impl Trait`";
pub(crate) const MUT_REFERENCE: &str =
    "data do not change while a model is sampled: take `&` instead of `&mut`";
pub(crate) const ARGUMENT_PATTERN: &str =
    "an argument has a plain name: copy it or take it apart with `let` in the body";
pub(crate) const MISSING_SEMICOLON: &str = "missing `;` after this statement";
pub(crate) const NO_DISTRIBUTION: &str =
    "nothing on the right of `~`: write a distribution, as in `~ Normal(0.0, 1.0)`";
pub(crate) const NO_NAME: &str = "a name is missing: `let x ~ Normal(0.0, 1.0);`";
pub(crate) const TILDE_EQUALS: &str =
    "write `~` alone: `x ~ D` has a distribution, `x = …` a value";
pub(crate) const TILDE_INSIDE: &str = "`~` is a statement: it can stand in the body of the model, \
     and in the blocks of `for`, `if` and `match`, not in `while` or `loop`, whose length is not \
     known beforehand, nor inside another expression, a closure or a macro";
pub(crate) const ARM_END: &str = "an arm of `match` ends with `,`, and a statement in it has braces \
     around it: `=> { … }`";
pub(crate) const UNKNOWN_NAME: &str = "an unknown is one name, without `mut` and without a type: \
     write `let x ~ D;`, and copy it or take it apart after it";
pub(crate) const RECORDED_NAME: &str =
    "what is recorded has one name, without `mut`, and a value: write `let x = …;`";
pub(crate) const NOT_A_PLACE: &str = "on the left of `~` stands a variable, a field or an \
     element: write `let name = …;` first, then `name ~ D;`";
pub(crate) const TRACK_WHAT: &str =
    "`#[track]` records a `let x = …;`: put it there (unknowns are recorded anyway)";
pub(crate) const PREDICT_WHAT: &str =
    "`#[predict]` goes with `let x ~ D;` of a new name, `let x = …;` or `for`";
pub(crate) const PREDICT_LAST: &str = "`#[predict]` ends a block, since it runs on finished draws \
     only: move this statement before the first `#[predict]`, or mark it too";
pub(crate) const OBSERVE_IN_PREDICTION: &str =
    "predictions run on finished draws, where nothing can be conditioned on any more";
pub(crate) const FACTOR: &str = "`factor(log_weight);` is a statement of the model, with one number: \
     it cannot stand inside another expression";
pub(crate) const REJECT_REASON: &str =
    "`reject!` needs a reason, as in `reject!(\"no solution at {x}\")`";
pub(crate) const REJECT_IN_CLOSURE: &str =
    "`reject!` cannot leave a closure: return a `Result` from it, and write `?` after the call";
pub(crate) const RETURN: &str = "a model runs to its end: use `if`, or `reject!(\"…\")` to reject \
     the point";
pub(crate) const VALUE_AT_END: &str = "a model has no value: record this as \
     `#[track] let x = …;`, or give the function a return type, which makes it a submodel";
pub(crate) const LET_PLACE: &str = "`let` declares a name: for something in scope write \
     `place ~ D;`, or `place.impute() ~ D;` if values are missing, without `let`";
pub(crate) const ATTRIBUTE: &str = "a statement takes `#[track]` or `#[predict]`, and one \
     `#[dims(…)]`: remove `#[{}]`";
pub(crate) const DIMS_NAMES: &str =
    "name the dimensions: `#[dims(school)]`, or with labels `#[dims(school = names)]`";
pub(crate) const DIMS_TAKEN: &str =
    "each dimension has a name of its own, other than the `chain` and `draw` of every result";
pub(crate) const DIMS_WHAT: &str = "`#[dims(…)]` goes with one quantity that is recorded \
     (`let x ~ D;`, `place ~ D;`, `#[track] let x = …;`), and with one name with the `for` that \
     stacks it; those of a submodel are named inside it";
pub(crate) const ASSIGNED: &str =
    "the unknown `{}` does not change: give the new value a new name, `let y = …;`";
pub(crate) const DECLARED_DATA: &str = "`{}` is in scope already: to condition on it write `{} ~ …` \
     without `let`; for an unknown take another name";
pub(crate) const DECLARED_TWICE: &str =
    "the name `{}` is taken by another statement: rename one of them";
pub(crate) const OBSERVED_TWICE: &str = "`{}` is observed by another statement: write \
     `let other = {};` and `other ~ …`, so that both are told apart in the results; only entries, \
     `{}[…] ~ …`, can share a name";
pub(crate) const OBSERVED_UNKNOWN: &str = "the unknown `{}` has a distribution already: add to it \
     with `factor(D.ln_density(&{}));`";
pub(crate) const NOT_IN_SCOPE: &str = "`{}` is not in scope, so that there is nothing to condition \
     on: declare an unknown by `let {} ~ …`, or take data as an argument";
pub(crate) const BEGINS_AS_DATA: &str = "this begins as data and becomes what follows from \
     unknowns: begin with `Real::from({})`";
pub(crate) const PLAIN_VALUE: &str = "`value` drops the derivatives: compare unknowns as they are, \
     `x > 0.0`, and compute with them; what needs a plain number is a function of your own over \
     `Scalar`, or is only recorded, by `#[track]` or `#[predict]`";
pub(crate) const UNKNOWN_INDEX: &str = "the unknown `{}` is a real number, not an index: sum a \
     discrete choice out, by `Mixture` or `factor(ln_sum_exp(…))`, and take indices from data";
pub(crate) const RUN_TIME_SIZE: &str = "`{}` is known at run time, but a size in `<…>` is a constant: \
     write `.iid({})` in place of `.array::<{}>()`, `LkjCholesky::of({}, eta)` in place of \
     `LkjCholesky::<{}>(eta)`, and vectors in place of arrays";
pub(crate) const FUNCTION_OF_F64: &str = "`f64::{}` takes plain numbers, without derivatives: write \
     the method, `x.{}(…)`, which unknowns have too";
pub(crate) const LOST_DERIVATIVES: &str = "`{}` is a plain number, without derivatives in unknowns: \
     `ln_cdf` and `ln_sf` have them, `.censor(…)` observes what is beyond a limit, and what is only \
     recorded takes `#[track]`";

/// An error whose span covers all of `tokens`.
pub(crate) fn at(tokens: impl ToTokens, message: impl Display) -> Error {
    Error::new_spanned(tokens, message)
}

/// An error whose span covers all of `tokens`; `name` replaces `{}` in the message.
pub(crate) fn about(name: impl Display, tokens: impl ToTokens, message: &str) -> Error {
    at(tokens, message.replace("{}", &name.to_string()))
}
