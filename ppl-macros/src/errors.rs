//! What the macro says when it refuses: each message names the way out.

use std::fmt::Display;

use quote::ToTokens;
use syn::Error;

pub(crate) const NO_FUNCTION: &str =
    "`model!` declares functions: `pub fn name(data: &[f64]) { … }`";
pub(crate) const EMPTY: &str =
    "`model!` is empty: declare a model, `pub fn name(data: &[f64]) { … }`";
pub(crate) const NO_BODY: &str = "a model needs its statements in braces: `{ … }`";
pub(crate) const SELF_ARGUMENT: &str =
    "a model is a free function: give its data as arguments instead of `self`";
pub(crate) const SELF_VALUE: &str =
    "there is no `self` in a model: its data are the arguments of the function";
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
pub(crate) const MUT_ARGUMENT: &str =
    "data do not change: remove `mut`, and write `let mut copy = …;` in the body";
pub(crate) const ARGUMENT_PATTERN: &str =
    "an argument needs a plain name: take it apart with `let` in the body";

pub(crate) fn qualifier(token: &str) -> String {
    format!("a model is plain code that is run thousands of times: remove `{token}`")
}

pub(crate) fn argument_type(name: &str) -> String {
    format!("the type of `{name}` is missing: for example `{name}: &[f64]`")
}

pub(crate) const MISSING_SEMICOLON: &str = "missing `;` after this statement";
pub(crate) const NO_DISTRIBUTION: &str =
    "nothing on the right of `~`: write a distribution, as in `~ Normal(0.0, 1.0)`";
pub(crate) const NO_NAME: &str = "a name is missing: `let x ~ Normal(0.0, 1.0);`";
pub(crate) const TWO_TILDES: &str =
    "two `~` in one statement: is a `;` missing? A statement has one distribution";
pub(crate) const TILDE_EQUALS: &str =
    "write `~` alone: `x ~ D` has a distribution, `x = …` a value";
pub(crate) const TILDE_INSIDE: &str = "`~` is a statement: it can stand in the body of the model, \
     and in the blocks of `for`, `if` and `match`, not inside another expression, a closure or a \
     macro";
pub(crate) const TILDE_IN_LOOP: &str = "`~` cannot stand in `while` or `loop`, whose length is \
     not known beforehand: use `for`";
pub(crate) const TILDE_IN_ARM: &str = "put braces around a statement in a `match` arm: `=> { … }`";
pub(crate) const ARM_COMMA: &str = "missing `,` between the arms of `match`";
pub(crate) const UNKNOWN_TYPE: &str =
    "an unknown has the type of its distribution: remove the type";
pub(crate) const UNKNOWN_MUT: &str =
    "an unknown does not change: remove `mut`, and write `let mut copy = …;` after it";
pub(crate) const UNKNOWN_PATTERN: &str = "an unknown needs one name: write `let x ~ D;` and take \
     it apart after it, as in `let [a, b] = x;`";
pub(crate) const RECORDED_PATTERN: &str =
    "what is recorded needs one name: write `let x = …;` with a plain name, without `mut`";
pub(crate) const RECORDED_NOTHING: &str = "a recorded `let` needs its value: `let x = …;`";
pub(crate) const NOT_A_PLACE: &str = "on the left of `~` stands a variable, a field or an \
     element: write `let name = …;` first, then `name ~ D;`";
pub(crate) const TRACK_UNKNOWN: &str = "unknowns are recorded anyway: remove `#[track]`";
pub(crate) const TRACK_WHAT: &str = "`#[track]` records a `let x = …;`: put it there";
pub(crate) const PREDICT_WHAT: &str = "`#[predict]` goes with `let x ~ D;`, `let x = …;` or `for`";
pub(crate) const PREDICT_PLACE: &str = "a prediction has a new name: `#[predict] let y_new ~ D;`";
pub(crate) const TWO_MARKS: &str = "one of `#[track]` and `#[predict]` is enough";
pub(crate) const PREDICT_LAST: &str = "`#[predict]` ends a block, since it runs on finished draws \
     only: move this statement before the first `#[predict]`, or mark it too";
pub(crate) const OBSERVE_IN_PREDICTION: &str =
    "predictions run on finished draws, where nothing can be conditioned on any more";
pub(crate) const FACTOR_ARGUMENT: &str = "`factor` takes one number: `factor(log_weight);`";
pub(crate) const FACTOR_INSIDE: &str =
    "`factor(…);` is a statement of the model: it cannot stand inside another expression";
pub(crate) const REJECT_REASON: &str =
    "`reject!` needs a reason, as in `reject!(\"no solution at {x}\")`";
pub(crate) const REJECT_IN_CLOSURE: &str =
    "`reject!` cannot leave a closure: return a `Result` from it, and write `?` after the call";
pub(crate) const RETURN: &str = "a model runs to its end: use `if`, or `reject!(\"…\")` to reject \
     the point";
pub(crate) const AWAIT: &str =
    "a model cannot wait: compute this before, and pass the result as an argument";
pub(crate) const VALUE_AT_END: &str = "a model has no value: record this as \
     `#[track] let x = …;`, or give the function a return type, which makes it a submodel";
pub(crate) const LET_PLACE: &str = "`let` declares a name: for something in scope write \
     `place ~ D;`, or `place.impute() ~ D;` if values are missing, without `let`";
pub(crate) const IMPUTE_ARGUMENTS: &str = "`.impute()` takes no arguments: what is missing is \
     drawn from the distribution on the right of `~`";
pub(crate) const DIMS_NAMES: &str =
    "name the dimensions: `#[dims(school)]`, or with labels `#[dims(school = names)]`";
pub(crate) const DIMS_TAKEN: &str =
    "`chain` and `draw` are dimensions of every result: choose another name";
pub(crate) const TWO_DIMS: &str = "one `#[dims(…)]` is enough: `#[dims(row, column)]`";
pub(crate) const DIMS_WHAT: &str = "`#[dims(…)]` goes with what is recorded (`let x ~ D;`, \
     `place ~ D;`, `#[track] let x = …;`), or with the `for` that stacks it";
pub(crate) const DIMS_PLATE: &str = "a plate stacks along one dimension: give one name";
pub(crate) const DIMS_PART: &str = "a submodel has several quantities: put `#[dims(…)]` on the \
     statements in it, or on the `for` around this one";

pub(crate) fn dims_twice(name: &str) -> String {
    format!("the dimension `{name}` is named twice: each has a name of its own")
}

pub(crate) fn attribute(name: &str) -> String {
    format!(
        "unknown attribute `{name}`: a statement takes `#[track]`, `#[predict]` or `#[dims(…)]`"
    )
}

pub(crate) fn bare(name: &str) -> String {
    format!("`#[{name}]` takes no arguments: write `#[{name}]`")
}

pub(crate) fn assigned(name: &str) -> String {
    format!("the unknown `{name}` does not change: give the new value a new name, `let y = …;`")
}

pub(crate) fn declared_data(name: &str) -> String {
    format!(
        "`{name}` is in scope already: to condition on it write `{name} ~ …` without `let`; for \
         an unknown take another name"
    )
}

pub(crate) fn declared_twice(name: &str) -> String {
    format!("the name `{name}` is taken by another statement: rename one of them")
}

pub(crate) fn observed_twice(name: &str) -> String {
    format!(
        "`{name}` is observed by another statement: write `let other = {name};` and `other ~ …`, so \
         that both are told apart in the results; only entries, `{name}[…] ~ …`, can share a name"
    )
}

pub(crate) fn observed_unknown(name: &str) -> String {
    format!(
        "the unknown `{name}` has a distribution already: add to it with \
         `factor(D.ln_density(&{name}));`"
    )
}

pub(crate) const PLAIN_VALUE: &str = "`value` drops the derivatives: compare unknowns as they are, \
     `x > 0.0`, and compute with them; what needs a plain number is a function of your own over \
     `Scalar`, or is only recorded, by `#[track]` or `#[predict]`";

pub(crate) fn not_in_scope(name: &str, names: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<_> = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > SHOWN { ", …" } else { "" };
    let scope = match shown.is_empty() {
        true => "nothing is yet".to_owned(),
        false => format!("these are: {}{more}", shown.join(", ")),
    };
    format!(
        "`{name}` is not in scope, so that there is nothing to condition on: declare an unknown by \
         `let {name} ~ …`, or take data as an argument ({scope})"
    )
}

pub(crate) fn unknown_index(name: &str) -> String {
    format!(
        "the unknown `{name}` is a real number, not an index: sum a discrete choice out, by `Mixture` \
         or `factor(ln_sum_exp(…))`, and take indices from data"
    )
}

pub(crate) fn function_of_f64(function: &str, argument: impl ToTokens) -> String {
    let argument = argument.to_token_stream();
    format!(
        "`f64::{function}` takes plain numbers, without derivatives: write the method, \
         `{argument}.{function}(…)`, which unknowns have too"
    )
}

pub(crate) fn begins_as_data(name: &str, value: impl ToTokens) -> String {
    let value = value.to_token_stream().to_string().replace(' ', "");
    format!(
        "`{name}` begins as data and becomes what follows from unknowns: begin with \
         `Real::from({value})`"
    )
}

pub(crate) fn lost_derivatives(method: &str) -> String {
    format!(
        "`{method}` is a plain number, without derivatives in unknowns: `ln_cdf` and `ln_sf` have \
         them, `.censor(…)` observes what is beyond a limit, and what is only recorded takes \
         `#[track]`"
    )
}

/// An error that covers all of `tokens`.
pub(crate) fn at(tokens: impl ToTokens, message: impl Display) -> Error {
    Error::new_spanned(tokens, message)
}
