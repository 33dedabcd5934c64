//! What was written: models and their statements, as they were read and never changed afterwards.

use proc_macro2::{Span, TokenStream};
use syn::{
    Attribute, Error, Expr, Generics, Ident, Label, Pat, Stmt, Token, Type, Visibility, token,
};

use crate::syntax::patterns::bound_names;
use crate::syntax::places::plain_name;

/// The function that declares a model.
pub(crate) struct Model {
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) vis: Visibility,
    pub(crate) fn_token: Token![fn],
    pub(crate) name: Ident,
    pub(crate) generics: Generics,
    pub(crate) arguments: Vec<Argument>,
    /// The type of the value that it ends with, if it is a submodel.
    pub(crate) value: Option<Type>,
    pub(crate) body: Block,
    /// What is wrong with the signature, where the model can still be declared.
    pub(crate) errors: Vec<Error>,
}

/// Data.
pub(crate) struct Argument {
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) colon: Token![:],
    pub(crate) ty: Type,
}

#[derive(Clone)]
pub(crate) struct Block {
    pub(crate) brace: token::Brace,
    pub(crate) statements: Vec<Statement>,
}

/// By which analyses speak of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Id(pub(crate) usize);

#[derive(Clone)]
pub(crate) struct Statement {
    pub(crate) id: Id,
    /// Lint attributes, handed on.
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) mark: Mark,
    /// `#[dims(…)]`.
    pub(crate) dims: Vec<Dim>,
    pub(crate) kind: Kind,
    /// All of it.
    pub(crate) tokens: TokenStream,
    /// As it reads, for reports.
    pub(crate) text: String,
    /// Where it begins.
    pub(crate) span: Span,
}

impl Statement {
    /// The names that it puts into scope.
    pub(crate) fn declared(&self) -> Vec<Ident> {
        match &self.kind {
            Kind::Tilde { left: Left::Unknown(_, name) | Left::Part(_, name), .. } => {
                vec![name.clone()]
            }
            Kind::Tilde { left: Left::Missing(place), .. } => {
                plain_name(place).cloned().into_iter().collect()
            }
            Kind::Let { pat, .. } => bound_names(pat),
            Kind::Broken { names, .. } => names.clone(),
            _ => Vec::new(),
        }
    }
}

#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Mark {
    #[default]
    None,
    Track,
    Predict,
}

/// The name of a dimension, and what to call the entries along it: `name`, `name = labels`.
#[derive(Clone)]
pub(crate) struct Dim {
    pub(crate) name: Ident,
    pub(crate) labels: Option<Expr>,
}

#[derive(Clone)]
pub(crate) enum Kind {
    /// `left ~ right;`
    Tilde { left: Left, tilde: Token![~], right: Expr },
    /// `let pat = …;`
    Let { let_token: Token![let], pat: Pat, init: Option<Init> },
    /// `factor(weight);`
    Factor { name: Ident, weight: Expr },
    /// A plate.
    For(Box<For>),
    /// Branches with statements inside.
    Flow(Flow),
    /// The value that a submodel ends with.
    End(Flow),
    /// Any other Rust.
    Rust(Stmt),
    /// What could not be read, with the names that it would have declared.
    Broken { names: Vec<Ident>, error: Error },
}

/// What stands before `~`.
#[derive(Clone)]
pub(crate) enum Left {
    /// `let name`, with a distribution after it.
    Unknown(Token![let], Ident),
    /// `let name`, with a function after it, which may return a submodel or a distribution.
    Part(Token![let], Ident),
    /// A place with data.
    Place(Expr),
    /// `place.impute()`, a place with data that may be missing.
    Missing(Expr),
}

/// `= value else { … }`.
#[derive(Clone)]
pub(crate) struct Init {
    pub(crate) eq: Token![=],
    pub(crate) value: Flow,
    pub(crate) diverge: Option<(Token![else], Block)>,
}

/// Something with a value, that may have statements inside.
#[derive(Clone)]
pub(crate) enum Flow {
    If {
        if_token: Token![if],
        condition: Expr,
        then: Block,
        otherwise: Option<(Token![else], Box<Flow>)>,
    },
    Match {
        match_token: Token![match],
        scrutinee: Expr,
        brace: token::Brace,
        arms: Vec<Arm>,
    },
    Block(Block),
    /// Without statements inside.
    Value(Expr),
}

impl Flow {
    /// The expression, if there are no statements inside.
    pub(crate) fn rust(&self) -> Option<&Expr> {
        match self {
            Self::Value(value) => Some(value),
            _ => None,
        }
    }
}

#[derive(Clone)]
pub(crate) struct For {
    pub(crate) label: Option<Label>,
    pub(crate) for_token: Token![for],
    pub(crate) pat: Pat,
    pub(crate) in_token: Token![in],
    pub(crate) iter: Expr,
    pub(crate) body: Block,
}

#[derive(Clone)]
pub(crate) struct Arm {
    pub(crate) pat: Pat,
    pub(crate) guard: Option<(Token![if], Expr)>,
    pub(crate) arrow: Token![=>],
    pub(crate) body: Flow,
}
