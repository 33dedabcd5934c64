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
    "a submodel returns a value, not a reference: write the return type without `&`";
pub(crate) const REAL_DATA: &str = "data of a model are plain numbers: write `f64` (`Real` belongs \
     in a submodel, a function with a return type)";
pub(crate) const IMPL_TRAIT: &str = "name the type of this argument: \
     `fn name<F: Trait>(f: F)` instead of `f: impl Trait`";
pub(crate) const MUT_REFERENCE: &str =
    "data do not change while a model is sampled: write `&` instead of `&mut`";
pub(crate) const ARGUMENT_PATTERN: &str =
    "an argument must be a plain name: copy or destructure the argument with `let` in the body";
pub(crate) const MISSING_SEMICOLON: &str = "missing `;` after this statement";
pub(crate) const NO_DISTRIBUTION: &str =
    "nothing on the right of `~`: write a distribution, as in `~ Normal(0.0, 1.0)`";
pub(crate) const NO_NAME: &str = "a name is missing: `let x ~ Normal(0.0, 1.0);`";
pub(crate) const TILDE_EQUALS: &str =
    "write `~` without `=`: `x ~ D` gives `x` a distribution, `x = …` gives `x` a value";
pub(crate) const TILDE_INSIDE: &str = "`~` is a statement of the model: it is allowed in the body \
     and in the blocks of `for`, `if` and `match`, but not in `while` or `loop`, in another \
     expression, in a closure or in a macro";
pub(crate) const ARM_END: &str =
    "an arm of `match` ends with `,`, and a statement in an arm needs braces: `=> { … }`";
pub(crate) const UNKNOWN_NAME: &str = "an unknown is declared by one name, without `mut` and \
     without a type: write `let x ~ D;`, and copy or destructure `x` in a later statement";
pub(crate) const RECORDED_NAME: &str =
    "a recorded quantity needs one name, without `mut`, and a value: write `let x = …;`";
pub(crate) const NOT_A_PLACE: &str = "the left side of `~` must be a variable, a field or an \
     element: write `let name = …;` first, then `name ~ D;`";
pub(crate) const TRACK_WHAT: &str =
    "`#[track]` is allowed only before `let x = …;` (unknowns are always recorded)";
pub(crate) const PREDICT_WHAT: &str =
    "`#[predict]` is allowed only before `let x ~ D;` with a new name, `let x = …;` or `for`";
pub(crate) const PREDICT_LAST: &str = "`#[predict]` statements end a block, because they run only \
     on finished draws: move this statement before the first `#[predict]`, or mark this statement \
     with `#[predict]` too";
pub(crate) const OBSERVE_IN_PREDICTION: &str =
    "predictions run on finished draws, so that they cannot condition on data";
pub(crate) const FACTOR: &str = "`factor(log_weight);` is a statement of the model with one \
     argument, a number: it is not allowed inside another expression";
pub(crate) const REJECT_REASON: &str =
    "`reject!` needs a reason, as in `reject!(\"no solution at {x}\")`";
pub(crate) const REJECT_IN_CLOSURE: &str = "`reject!` is not allowed in a closure: return a \
     `Result` from the closure, and write `?` after its call";
pub(crate) const RETURN: &str = "`return` is not allowed, because a model runs to its end: use \
     `if`, or `reject!(\"…\")` to reject the point";
pub(crate) const VALUE_AT_END: &str = "a model has no final value: record the value with `#[track] \
     let x = …;`, or give the function a return type, which makes it a submodel";
pub(crate) const LET_PLACE: &str = "`let` declares a new name: for a variable in scope write \
     `place ~ D;` without `let`, or `place.impute() ~ D;` if values are missing";
pub(crate) const ATTRIBUTE: &str =
    "a statement can have `#[track]` or `#[predict]`, and one `#[dims(…)]`: remove `#[{}]`";
pub(crate) const DIMS_NAMES: &str =
    "name the dimensions: `#[dims(school)]`, or with labels `#[dims(school = names)]`";
pub(crate) const DIMS_TAKEN: &str =
    "each dimension needs a different name, other than `chain` and `draw`, which every result has";
pub(crate) const DIMS_WHAT: &str = "`#[dims(…)]` is allowed on one recorded quantity (`let x ~ \
     D;`, `place ~ D;`, `#[track] let x = …;`), and with one name on the `for` that stacks the \
     quantity; the dimensions of a submodel are named inside the submodel";
pub(crate) const ASSIGNED: &str =
    "the unknown `{}` cannot be assigned: give the new value a new name, `let y = …;`";
pub(crate) const DECLARED_DATA: &str = "`{}` is already in scope: to condition on `{}`, write `{} \
     ~ …` without `let`; to declare an unknown, use another name";
pub(crate) const DECLARED_TWICE: &str =
    "the name `{}` is used by another statement: rename one of them";
pub(crate) const OBSERVED_TWICE: &str = "`{}` is already observed by another statement: write `let \
     other = {};` and `other ~ …`, so that the results have two names; only entries, `{}[…] ~ …`, \
     can share a name";
pub(crate) const OBSERVED_UNKNOWN: &str = "the unknown `{}` already has a distribution: add a term \
     to its density with `factor(D.ln_density(&{}));`";
pub(crate) const NOT_IN_SCOPE: &str = "`{}` is not in scope, so that it cannot be conditioned on: \
     declare an unknown with `let {} ~ …`, or add an argument with the data";
pub(crate) const BEGINS_AS_DATA: &str = "the initial value of this variable is a plain number, but \
     a later value depends on unknowns: begin with `Real::from({})`";
pub(crate) const PLAIN_VALUE: &str = "`value` drops the derivatives: compare and compute with \
     unknowns directly, as in `x > 0.0`; a computation that needs plain numbers must be a \
     user-defined function over `Scalar`, or must only be recorded, by `#[track]` or `#[predict]`";
pub(crate) const UNKNOWN_INDEX: &str = "the unknown `{}` is a real number and not an index: \
     marginalise a discrete choice with `Mixture` or `factor(ln_sum_exp(…))`, and take indices \
     from data";
pub(crate) const RUN_TIME_SIZE: &str = "`{}` is known only at run time, but a size in `<…>` must \
     be a constant: write `.iid({})` in place of `.array::<{}>()`, `LkjCholesky::of({}, eta)` in \
     place of `LkjCholesky::<{}>(eta)`, and vectors in place of arrays";
pub(crate) const FUNCTION_OF_F64: &str = "`f64::{}` takes plain numbers and has no derivatives: \
     write the method `x.{}(…)`, which unknowns also have";
pub(crate) const LOST_DERIVATIVES: &str = "`{}` returns a plain number without derivatives with \
     respect to unknowns: use `ln_cdf` or `ln_sf`, which have derivatives, or `.censor(…)` for \
     data beyond a limit; if the value is only recorded, mark the statement with `#[track]`";

/// An error whose span covers all of `tokens`.
pub(crate) fn at(tokens: impl ToTokens, message: impl Display) -> Error {
    Error::new_spanned(tokens, message)
}

/// An error whose span covers all of `tokens`; `name` replaces `{}` in the message.
pub(crate) fn about(name: impl Display, tokens: impl ToTokens, message: &str) -> Error {
    at(tokens, message.replace("{}", &name.to_string()))
}
