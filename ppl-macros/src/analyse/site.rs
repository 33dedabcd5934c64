//! A place of the model, as `ppl::Site` will hold it.

use proc_macro2::Span;

#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) span: Span,
    pub(crate) repeated: bool,
    /// Names of the dimensions along which the plates around stack, the innermost last.
    pub(crate) plates: Vec<String>,
    /// Names of the value's own dimensions.
    pub(crate) dims: Vec<String>,
}
