//! Statements as written, read one by one.

use std::cell::Cell;

use syn::parse::ParseStream;
use syn::parse::discouraged::Speculative;
use syn::{Attribute, Error, Expr, Ident, Pat, PatType, Result, Stmt, Token, braced, token};

use super::attributes::{Head, head};
use crate::ast::{Arm, Block, Flow, For, Id, Init, Kind, Left, Statement};
use crate::errors::{self, at};
use crate::syntax::expressions::{calls_function, plain_function};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::plain_name;
use crate::syntax::statements::{
    expression, resynchronise, starts_flow, starts_item, starts_plate, starts_statement,
    tilde_in_braces,
};
use crate::syntax::tokens::{between, last_span, source};

/// Reads statements, and counts them.
#[derive(Default)]
pub(super) struct Reader {
    next: Cell<usize>,
}

impl Reader {
    /// The statements between braces; an error only if there are no braces.
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
        let tokens = between(begin, input.cursor());
        let mut push = |head: Head, kind| {
            let id = Id(self.next.replace(self.next.get() + 1));
            let Head { attrs, mark, dims } = head;
            let (text, tokens) = (source(&tokens), tokens.iter().cloned().collect());
            statements.push(Statement { id, attrs, mark, dims, kind, tokens, text, span });
        };
        match result {
            Ok((head, mut kind, ended)) => {
                if let (Kind::Rust(Stmt::Expr(_, semi)), false) = (&mut kind, ended) {
                    semi.get_or_insert_default();
                }
                push(head, kind);
                if !ended {
                    let span = last_span(begin, input.cursor());
                    let error = Error::new(span, errors::MISSING_SEMICOLON);
                    push(Head::default(), Kind::Broken { names: Vec::new(), error });
                }
            }
            Err(error) => push(Head::default(), Kind::Broken { names, error }),
        }
    }

    /// One statement, and whether it ended as it should. The names that it declares are written to
    /// `names` as soon as they are known.
    fn statement(&self, input: ParseStream, names: &mut Vec<Ident>) -> Result<(Head, Kind, bool)> {
        let head = head(input.call(Attribute::parse_outer)?);
        let (kind, ended) = if input.peek(Token![let]) {
            self.declaration(input, names)?
        } else if starts_plate(input) {
            (Kind::For(Box::new(self.plate(input)?)), true)
        } else if starts_flow(input) {
            (Kind::Flow(self.flow(input)?), true)
        } else if starts_item(input) {
            (Kind::Rust(input.parse()?), true)
        } else {
            expression_statement(input, names)?
        };
        Ok((head?, kind, ended))
    }

    fn declaration(&self, input: ParseStream, names: &mut Vec<Ident>) -> Result<(Kind, bool)> {
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
        if input.peek(Token![~]) {
            let tilde = input.parse()?;
            let distribution = distribution(input, tilde)?;
            let name = unknown_name(pat)?;
            let left = match calls_function(&distribution) {
                true => Left::Part(let_token, name),
                false => Left::Unknown(let_token, name),
            };
            return Ok((Kind::Tilde { left, tilde, right: distribution }, end(input)));
        }
        if input.peek(Token![.]) || input.peek(token::Bracket) {
            return Err(Error::new(let_token.span, errors::LET_PLACE));
        }
        let init = if input.peek(Token![=]) { Some(self.init(input)?) } else { None };
        Ok((Kind::Let { let_token, pat, init }, end(input)))
    }

    fn init(&self, input: ParseStream) -> Result<Init> {
        let eq: Token![=] = input.parse()?;
        if input.peek(Token![~]) {
            return Err(input.error(errors::TILDE_EQUALS));
        }
        let value = match starts_flow(input) && tilde_in_braces(input) {
            true => self.flow(input)?,
            false => Flow::Value(expression(input, |input| input.parse())?),
        };
        let diverge = match input.parse()? {
            Some(else_token) => Some((else_token, self.block(input)?)),
            None => None,
        };
        Ok(Init { eq, value, diverge })
    }

    fn flow(&self, input: ParseStream) -> Result<Flow> {
        if input.peek(Token![if]) {
            let if_token = input.parse()?;
            let condition = Expr::parse_without_eager_brace(input)?;
            let then = self.block(input)?;
            let otherwise = match input.parse()? {
                Some(else_token) if input.peek(Token![if]) => {
                    Some((else_token, Box::new(self.flow(input)?)))
                }
                Some(else_token) => Some((else_token, Box::new(Flow::Block(self.block(input)?)))),
                None => None,
            };
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

    fn plate(&self, input: ParseStream) -> Result<For> {
        Ok(For {
            label: input.parse()?,
            for_token: input.parse()?,
            pat: Pat::parse_multi_with_leading_vert(input)?,
            in_token: input.parse()?,
            iter: Expr::parse_without_eager_brace(input)?,
            body: self.block(input)?,
        })
    }

    fn arm(&self, input: ParseStream) -> Result<Arm> {
        let pat = Pat::parse_multi_with_leading_vert(input)?;
        let guard =
            if input.peek(Token![if]) { Some((input.parse()?, input.parse()?)) } else { None };
        let arrow = input.parse()?;
        let body = if input.peek(token::Brace) {
            Flow::Block(self.block(input)?)
        } else {
            let value = expression(input, Expr::parse_with_earlier_boundary_rule)?;
            let is_factor = |value: &Expr| match value {
                Expr::Call(call) => plain_function(call).is_some_and(|name| name == "factor"),
                _ => false,
            };
            if input.peek(Token![~]) || is_factor(&value) {
                return Err(at(value, errors::TILDE_IN_ARM));
            }
            Flow::Value(value)
        };
        let comma: Option<Token![,]> = input.parse()?;
        if comma.is_none() && matches!(body, Flow::Value(_)) && !input.is_empty() {
            return Err(input.error(errors::ARM_COMMA));
        }
        Ok(Arm { pat, guard, arrow, body })
    }
}

fn unknown_name(pat: Pat) -> Result<Ident> {
    match pat {
        Pat::Ident(pat) if pat.by_ref.is_none() && pat.subpat.is_none() => match pat.mutability {
            Some(mutability) => Err(at(mutability, errors::UNKNOWN_MUT)),
            None => Ok(pat.ident),
        },
        Pat::Type(pat) => Err(at(pat.ty, errors::UNKNOWN_TYPE)),
        other => Err(at(other, errors::UNKNOWN_PATTERN)),
    }
}

fn distribution(input: ParseStream, tilde: Token![~]) -> Result<Expr> {
    if input.peek(Token![=]) {
        return Err(at(tilde, errors::TILDE_EQUALS));
    }
    if input.is_empty() || input.peek(Token![;]) || starts_statement(input) {
        return Err(at(tilde, errors::NO_DISTRIBUTION));
    }
    let distribution = expression(input, Expr::parse_with_earlier_boundary_rule)?;
    if input.peek(Token![~]) {
        return Err(input.error(errors::TWO_TILDES));
    }
    Ok(distribution)
}

fn expression_statement(input: ParseStream, names: &mut Vec<Ident>) -> Result<(Kind, bool)> {
    let value = expression(input, Expr::parse_with_earlier_boundary_rule)?;
    if input.peek(Token![~]) {
        let tilde = input.parse()?;
        let incomplete = imputed(&value)?;
        names.extend(incomplete.as_ref().and_then(plain_name).cloned());
        let distribution = distribution(input, tilde)?;
        let left = incomplete.map_or(Left::Place(value), Left::Missing);
        return Ok((Kind::Tilde { left, tilde, right: distribution }, end(input)));
    }
    if let Expr::Call(call) = &value
        && let Some(name) = plain_function(call).filter(|name| *name == "factor")
    {
        let mut weights = call.args.iter();
        let (Some(weight), None) = (weights.next(), weights.next()) else {
            return Err(at(call, errors::FACTOR_ARGUMENT));
        };
        let kind = Kind::Factor { name: name.clone(), weight: weight.clone() };
        return Ok((kind, end(input)));
    }
    let semi: Option<Token![;]> = input.parse()?;
    let braced = match &value {
        Expr::While(_) | Expr::Loop(_) | Expr::Unsafe(_) | Expr::Block(_) => true,
        Expr::Macro(mac) => matches!(mac.mac.delimiter, syn::MacroDelimiter::Brace(_)),
        _ => false,
    };
    let ended = semi.is_some() || braced || input.is_empty();
    Ok((Kind::Rust(Stmt::Expr(value, semi)), ended))
}

/// The place in `place.impute()`.
fn imputed(left: &Expr) -> Result<Option<Expr>> {
    match left {
        Expr::MethodCall(call) if call.method == "impute" => {
            if !call.args.is_empty() || call.turbofish.is_some() {
                return Err(at(call, errors::IMPUTE_ARGUMENTS));
            }
            Ok(Some((*call.receiver).clone()))
        }
        _ => Ok(None),
    }
}

/// Takes the `;` and says whether it was there.
fn end(input: ParseStream) -> bool {
    matches!(input.parse::<Option<Token![;]>>(), Ok(Some(_)))
}
