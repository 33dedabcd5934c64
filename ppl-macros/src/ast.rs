//! The syntax tree of models and their statements. It does not change after parsing.

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
    /// The return type, if the function is a submodel.
    pub(crate) value: Option<Type>,
    pub(crate) body: Block,
    /// Errors in the signature that still allow the model to be declared.
    pub(crate) errors: Vec<Error>,
}

/// An argument of the function: data of the model.
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

/// Number of a statement. It is the key of the tables in which the analyses store their results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Id(pub(crate) usize);

#[derive(Clone)]
pub(crate) struct Statement {
    pub(crate) id: Id,
    /// Lint attributes, copied to the emitted statement.
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) mark: Mark,
    /// The dimensions in `#[dims(…)]`.
    pub(crate) dims: Vec<Dim>,
    pub(crate) kind: Kind,
    /// All tokens of the statement.
    pub(crate) tokens: TokenStream,
    /// The source text of the statement, for reports.
    pub(crate) text: String,
    /// The span of the first token.
    pub(crate) span: Span,
}

impl Statement {
    /// Returns the names that the statement adds to the scope.
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

/// A named dimension of a quantity in `#[dims(…)]`, written `name` or `name = labels`. The labels name the entries
/// along the dimension.
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
    /// A plate, that is, a `for` loop in the body of a model.
    For(Box<For>),
    /// Control flow (`if`, `match` or a block) that contains statements of the model.
    Flow(Flow),
    /// The final value of a submodel.
    End(Flow),
    /// Any other Rust statement.
    Rust(Stmt),
    /// A statement that could not be parsed, with the names that the statement would have declared.
    Broken { names: Vec<Ident>, error: Error },
}

/// The left side of `~`.
#[derive(Clone)]
pub(crate) enum Left {
    /// `let name` with a distribution on the right side.
    Unknown(Token![let], Ident),
    /// `let name` with a function call on the right side, which may return a submodel or a distribution.
    Part(Token![let], Ident),
    /// An observed place without `let`: a variable, a field or an element that has data.
    Place(Expr),
    /// The place in `place.impute() ~ …`: an observed variable, field or element whose data may be missing.
    Missing(Expr),
}

/// The initial value of a declaration, with an optional `else` block: `= value else { … }`.
#[derive(Clone)]
pub(crate) struct Init {
    pub(crate) eq: Token![=],
    pub(crate) value: Flow,
    pub(crate) diverge: Option<(Token![else], Block)>,
}

/// An expression with a value that may contain statements of the model.
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
    /// An expression without statements of the model.
    Value(Expr),
}

impl Flow {
    /// Returns the Rust expression; None if the control flow contains statements of the model.
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
