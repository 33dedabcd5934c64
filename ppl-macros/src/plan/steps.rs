//! The plan of a body: tokens of the user in their new order, and what the macro adds to them.

use syn::{Attribute, Error, Expr, Ident, Label, Pat, Stmt, Token, token};

use crate::analyse::Site;

pub(crate) struct Plan {
    pub(crate) sites: Vec<Site>,
    /// Whether every point runs the same statements.
    pub(crate) is_static: bool,
    pub(crate) body: Body,
}

/// The statements between braces.
pub(crate) struct Body {
    pub(crate) brace: token::Brace,
    pub(crate) always: Vec<Step>,
    /// Those that run on finished draws only.
    pub(crate) predicted: Vec<Step>,
    /// The value of a submodel.
    pub(crate) value: Option<Box<Step>>,
}

pub(crate) struct Step {
    pub(crate) attrs: Vec<Attribute>,
    /// Names of dimensions with the labels along them.
    pub(crate) labels: Vec<(Ident, Expr)>,
    pub(crate) action: Action,
}

pub(crate) enum Action {
    /// Reads or draws an unknown.
    Declare {
        let_token: Token![let],
        name: Ident,
        tilde: Token![~],
        site: usize,
        distribution: Expr,
        is_predicted: bool,
    },
    /// Runs a submodel.
    Part {
        let_token: Token![let],
        name: Ident,
        tilde: Token![~],
        site: usize,
        part: Expr,
        is_predicted: bool,
        is_tracked: bool,
    },
    /// Conditions on a datum.
    Observe(Observation),
    /// Conditions on all data of a loop at once.
    ObserveAll {
        data: Expr,
        observation: Observation,
    },
    /// Conditions on a datum, or declares it where it is missing; from there on its name means both.
    Complete {
        name: Option<Ident>,
        observation: Observation,
    },
    /// Adds to the log density.
    Factor {
        name: Ident,
        site: usize,
        weight: Expr,
    },
    /// A variable, recorded if there is a place for it.
    Let {
        let_token: Token![let],
        pat: Pat,
        init: Option<Init>,
        recorded: Option<usize>,
        is_predicted: bool,
    },
    Flow(Flow),
    /// The value of a submodel.
    Value(Init),
    Rust(Stmt),
    /// An error in place of the statement, and the names that it would have declared.
    Refuse {
        names: Vec<Ident>,
        error: Error,
    },
}

pub(crate) struct Observation {
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) place: Expr,
    pub(crate) tilde: Token![~],
    pub(crate) site: usize,
    pub(crate) distribution: Expr,
    /// Whether the loop around it sums up its terms.
    pub(crate) is_summed: bool,
}

pub(crate) enum Init {
    Value { eq: Token![=], value: Expr, diverge: Option<(Token![else], Expr)> },
    Flow(Token![=], Flow),
}

pub(crate) enum Flow {
    Plate(Box<Plate>),
    If {
        if_token: Token![if],
        condition: Expr,
        then: Body,
        otherwise: Option<(Token![else], Box<Flow>)>,
    },
    Match {
        match_token: Token![match],
        scrutinee: Expr,
        brace: token::Brace,
        arms: Vec<Arm>,
    },
    Block(Body),
}

pub(crate) struct Plate {
    pub(crate) label: Option<Label>,
    pub(crate) for_token: Token![for],
    pub(crate) pat: Pat,
    pub(crate) in_token: Token![in],
    pub(crate) iter: Expr,
    pub(crate) body: Body,
    /// Whether nothing that an iteration computes outlives it.
    pub(crate) unwinds: bool,
    /// Names from outside whose adjoints the loop sums up apart.
    pub(crate) shared: Vec<Ident>,
    /// The observations in it whose terms it sums up apart, by their sites.
    pub(crate) summed: Vec<usize>,
}

pub(crate) struct Arm {
    pub(crate) pat: Pat,
    pub(crate) guard: Option<(Token![if], Expr)>,
    pub(crate) arrow: Token![=>],
    pub(crate) body: ArmBody,
}

pub(crate) enum ArmBody {
    Block(Body),
    Value(Expr),
}
