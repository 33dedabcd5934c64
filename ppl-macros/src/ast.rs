//! What was written in the body of a model.

use proc_macro2::Span;
use syn::{Attribute, Error, Expr, Ident, Label, Pat, Stmt, Token, token};

use crate::attributes::{Dim, Mark};
use crate::linear::Linear;

pub(crate) struct Block {
    pub(crate) brace: token::Brace,
    pub(crate) statements: Vec<Statement>,
}

impl Block {
    pub(crate) fn empty() -> Self {
        Self { brace: Default::default(), statements: Vec::new() }
    }
}

pub(crate) struct Statement {
    /// Lint attributes, handed on.
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) mark: Mark,
    /// `#[dims(…)]`.
    pub(crate) dims: Vec<Dim>,
    pub(crate) kind: Kind,
    /// As written, for reports.
    pub(crate) text: String,
    /// Where it begins.
    pub(crate) span: Span,
    /// Its number among the places of the model, once it is known to need one.
    pub(crate) site: Option<usize>,
    /// Whether it runs on finished draws only.
    pub(crate) predicted: bool,
}

impl Statement {
    /// A statement of Rust that the macro adds.
    pub(crate) fn rust(stmt: Stmt, span: Span, predicted: bool) -> Self {
        Self {
            attrs: Vec::new(),
            mark: Mark::None,
            dims: Vec::new(),
            kind: Kind::Rust(stmt),
            text: String::new(),
            span,
            site: None,
            predicted,
        }
    }
}

pub(crate) enum Kind {
    /// `let name ~ distribution;`
    Unknown { let_token: Token![let], name: Ident, tilde: Token![~], distribution: Expr },
    /// `let name ~ function(…);`, which may return a submodel or a distribution.
    Part { let_token: Token![let], name: Ident, tilde: Token![~], part: Expr },
    /// `place.impute() ~ distribution;`
    Impute { place: Expr, tilde: Token![~], distribution: Expr },
    /// `place ~ distribution;`
    /// `apart`: the loop around it sums its terms up.
    Observe { place: Expr, tilde: Token![~], distribution: Expr, apart: bool },
    /// `let pat = …;`
    Let { let_token: Token![let], pat: Pat, init: Option<Init> },
    /// `factor(weight);`
    Factor { name: Ident, weight: Expr },
    /// Control flow with statements inside.
    Flow(Flow),
    /// The value that a submodel ends with.
    End(Init),
    /// Any other Rust.
    Rust(Stmt),
    /// What could not be read or was refused, with the names that it would have declared.
    Broken { names: Vec<Ident>, error: Error },
}

pub(crate) enum Init {
    Value { eq: Token![=], value: Expr, diverge: Option<(Token![else], Expr)> },
    Flow(Token![=], Flow),
}

pub(crate) enum Flow {
    For {
        label: Option<Label>,
        for_token: Token![for],
        pat: Box<Pat>,
        in_token: Token![in],
        iter: Expr,
        body: Block,
        /// Whether a jump goes on in a loop around it.
        leaves: bool,
        /// Whether nothing that an iteration computes outlives it.
        unwinds: bool,
        /// Whether it only says `y ~ D` of its own `y`, with one `D` for all.
        pools: bool,
        /// Names from outside whose adjoints the loop sums up apart.
        summed: Vec<Ident>,
        /// The observations in it whose terms it sums up apart, by their sites.
        totals: Vec<usize>,
        /// What it says of normal observations, if rows can stand for them.
        linear: Option<Box<Linear>>,
    },
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
}

pub(crate) struct Arm {
    /// With its guard.
    pub(crate) pat: Pat,
    pub(crate) guard: Option<(Token![if], Expr)>,
    pub(crate) arrow: Token![=>],
    pub(crate) body: ArmBody,
}

pub(crate) enum ArmBody {
    Block(Block),
    Value(Expr),
}
