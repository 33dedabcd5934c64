//! Parses the statements of a body.

use std::cell::Cell;

use proc_macro2::TokenTree;
use syn::parse::discouraged::Speculative;
use syn::parse::{Parse, ParseStream};
use syn::{Attribute, Error, Expr, Ident, Pat, PatType, Result, Stmt, Token, braced, token};

use super::attributes::{Head, head};
use crate::ast::{Arm, Block, Flow, For, Id, Init, Kind, Left, Statement};
use crate::errors::{self, at};
use crate::syntax::expressions::{calls_function, plain_function};
use crate::syntax::patterns::{bound_names, only_name};
use crate::syntax::places::plain_name;
use crate::syntax::statements::{
    expression, nested_tilde, resynchronise, starts_flow, starts_item, starts_plate,
    starts_statement,
};
use crate::syntax::tokens::{between, is, source};

/// Parses statements and numbers them.
#[derive(Default)]
pub(super) struct Reader {
    next: Cell<usize>,
}

impl Reader {
    /// Parses the statements between braces. Returns an error only if the braces are missing.
    pub(super) fn block(&self, input: ParseStream) -> Result<Block> {
        let content;
        let brace = braced!(content in input);
        let mut statements = Vec::new();
        while !content.is_empty() {
            if content.parse::<Option<Token![;]>>()?.is_none() {
                self.next(&content, &mut statements);
            }
        }
        Ok(Block { brace, statements })
    }

    fn next(&self, input: ParseStream, statements: &mut Vec<Statement>) {
        let (begin, span) = (input.cursor(), input.span());
        let ahead = input.fork();
        let mut names = Vec::new();
        let result = self.statement(&ahead, &mut names);
        match &result {
            Ok(_) => input.advance_to(&ahead),
            Err(_) => resynchronise(input),
        }
        let trees = between(begin, input.cursor());
        let mut push = |(attrs, mark, dims): Head, kind| {
            let id = Id(self.next.replace(self.next.get() + 1));
            let (text, tokens) = (source(&trees), trees.iter().cloned().collect());
            statements.push(Statement { id, attrs, mark, dims, kind, tokens, text, span });
        };
        let (head, mut kind) = match result {
            Ok(read) => read,
            Err(error) => return push(Head::default(), Kind::Broken { names, error }),
        };
        let is_ended = match &mut kind {
            Kind::For(_) | Kind::Flow(_) | Kind::Rust(Stmt::Item(_)) => true,
            Kind::Rust(Stmt::Expr(value, None)) if input.is_empty() || is_braced(value) => true,
            Kind::Rust(Stmt::Expr(_, semi @ None)) => {
                semi.get_or_insert_default();
                false
            }
            _ => trees.last().is_some_and(|tree| is(tree, ';')),
        };
        push(head, kind);
        if !is_ended && let Some(last) = trees.last() {
            let span = match last {
                TokenTree::Group(group) => group.span_close(),
                other => other.span(),
            };
            let error = Error::new(span, errors::MISSING_SEMICOLON);
            push(Head::default(), Kind::Broken { names: Vec::new(), error });
        }
    }

    /// Parses one statement with its final `;`, if present. Adds the declared names to `names` as soon as the names
    /// are parsed, so that a statement with a later syntax error still declares its names.
    fn statement(&self, input: ParseStream, names: &mut Vec<Ident>) -> Result<(Head, Kind)> {
        let head = head(input.call(Attribute::parse_outer)?);
        let kind = if input.peek(Token![let]) {
            self.declaration(input, names)?
        } else if starts_plate(input) {
            Kind::For(Box::new(For {
                label: input.parse()?,
                for_token: input.parse()?,
                pat: Pat::parse_multi_with_leading_vert(input)?,
                in_token: input.parse()?,
                iter: Expr::parse_without_eager_brace(input)?,
                body: self.block(input)?,
            }))
        } else if starts_flow(input) {
            Kind::Flow(self.flow(input)?)
        } else if starts_item(input) {
            Kind::Rust(input.parse()?)
        } else {
            expression_statement(input, names)?
        };
        Ok((head?, kind))
    }

    fn declaration(&self, input: ParseStream, names: &mut Vec<Ident>) -> Result<Kind> {
        let let_token: Token![let] = input.parse()?;
        if input.peek(Token![~]) || input.peek(Token![=]) {
            return Err(input.error(errors::NO_NAME));
        }
        let mut pat = Pat::parse_single(input)?;
        names.extend(bound_names(&pat));
        if input.peek(Token![:]) {
            pat = Pat::Type(PatType {
                attrs: Vec::new(),
                pat: Box::new(pat),
                colon_token: input.parse()?,
                ty: input.parse()?,
            });
        }
        let kind = if input.peek(Token![~]) {
            let tilde = input.parse()?;
            let right = distribution(input, tilde)?;
            let name = only_name(&pat).filter(|_| !matches!(pat, Pat::Type(_)));
            let name = name.ok_or_else(|| at(&pat, errors::UNKNOWN_NAME))?.clone();
            let left = match calls_function(&right) {
                true => Left::Part(let_token, name),
                false => Left::Unknown(let_token, name),
            };
            Kind::Tilde { left, tilde, right }
        } else if input.peek(Token![.]) || input.peek(token::Bracket) {
            return Err(Error::new(let_token.span, errors::LET_PLACE));
        } else {
            let init = if input.peek(Token![=]) { Some(self.init(input)?) } else { None };
            Kind::Let { let_token, pat, init }
        };
        input.parse::<Option<Token![;]>>()?;
        Ok(kind)
    }

    fn init(&self, input: ParseStream) -> Result<Init> {
        let eq: Token![=] = input.parse()?;
        let value = match starts_flow(input) && nested_tilde(input.cursor()).is_some() {
            true => self.flow(input)?,
            false => Flow::Value(expression(input, Expr::parse)?),
        };
        let diverge = input.parse::<Option<_>>()?;
        let diverge = diverge.map(|els| Ok::<_, Error>((els, self.block(input)?))).transpose()?;
        Ok(Init { eq, value, diverge })
    }

    fn flow(&self, input: ParseStream) -> Result<Flow> {
        if input.peek(Token![if]) {
            let if_token = input.parse()?;
            let condition = Expr::parse_without_eager_brace(input)?;
            let then = self.block(input)?;
            let other = || match input.peek(Token![if]) {
                true => self.flow(input),
                false => self.block(input).map(Flow::Block),
            };
            let otherwise = input.parse::<Option<_>>()?;
            let otherwise = otherwise.map(|els| Ok::<_, Error>((els, Box::new(other()?))));
            let otherwise = otherwise.transpose()?;
            return Ok(Flow::If { if_token, condition, then, otherwise });
        }
        if input.peek(Token![match]) {
            let match_token = input.parse()?;
            let scrutinee = Expr::parse_without_eager_brace(input)?;
            let content;
            let brace = braced!(content in input);
            let mut arms = Vec::new();
            while !content.is_empty() {
                arms.push(self.arm(&content)?);
            }
            return Ok(Flow::Match { match_token, scrutinee, brace, arms });
        }
        Ok(Flow::Block(self.block(input)?))
    }

    fn arm(&self, input: ParseStream) -> Result<Arm> {
        let pat = Pat::parse_multi_with_leading_vert(input)?;
        let guard =
            if input.peek(Token![if]) { Some((input.parse()?, input.parse()?)) } else { None };
        let arrow = input.parse()?;
        let body = if input.peek(token::Brace) {
            Flow::Block(self.block(input)?)
        } else {
            Flow::Value(expression(input, Expr::parse_with_earlier_boundary_rule)?)
        };
        let comma: Option<Token![,]> = input.parse()?;
        if comma.is_none() && matches!(body, Flow::Value(_)) && !input.is_empty() {
            return Err(input.error(errors::ARM_END));
        }
        Ok(Arm { pat, guard, arrow, body })
    }
}

fn distribution(input: ParseStream, tilde: Token![~]) -> Result<Expr> {
    if input.peek(Token![=]) {
        return Err(at(tilde, errors::TILDE_EQUALS));
    }
    if input.is_empty() || input.peek(Token![;]) || starts_statement(input) {
        return Err(at(tilde, errors::NO_DISTRIBUTION));
    }
    expression(input, Expr::parse_with_earlier_boundary_rule)
}

fn expression_statement(input: ParseStream, names: &mut Vec<Ident>) -> Result<Kind> {
    let value = expression(input, Expr::parse_with_earlier_boundary_rule)?;
    let kind = if input.peek(Token![~]) {
        let tilde = input.parse()?;
        let incomplete = match &value {
            Expr::MethodCall(call) if call.method == "impute" && call.args.is_empty() => {
                Some(&*call.receiver)
            }
            _ => None,
        };
        names.extend(incomplete.and_then(plain_name).cloned());
        let right = distribution(input, tilde)?;
        let left = match incomplete {
            Some(place) => Left::Missing(place.clone()),
            None => Left::Place(value),
        };
        Kind::Tilde { left, tilde, right }
    } else if let Expr::Call(call) = &value
        && let (Some(name), Some(weight)) = (plain_function(call), call.args.first())
        && name == "factor"
        && call.args.len() == 1
    {
        Kind::Factor { name: name.clone(), weight: weight.clone() }
    } else {
        return Ok(Kind::Rust(Stmt::Expr(value, input.parse()?)));
    };
    input.parse::<Option<Token![;]>>()?;
    Ok(kind)
}

/// Whether an expression at the beginning of a statement needs no `;`, because it ends with braces.
fn is_braced(value: &Expr) -> bool {
    match value {
        Expr::While(_) | Expr::Loop(_) | Expr::Unsafe(_) | Expr::Block(_) => true,
        Expr::Macro(mac) => matches!(mac.mac.delimiter, syn::MacroDelimiter::Brace(_)),
        _ => false,
    }
}
