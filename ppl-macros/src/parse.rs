//! Statements as written, read one by one. What cannot be read becomes a [`Kind::Broken`]
//! statement, and reading goes on behind it.

use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::parse::discouraged::Speculative;
use syn::{
    Attribute, Error, Expr, ExprCall, Ident, Label, Pat, PatType, Result, Stmt, Token, braced,
    token,
};

use crate::ast::{Arm, ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::{Head, head};
use crate::errors::{self, at};
use crate::scan;

/// The statements between braces; an error only if there are no braces.
pub(crate) fn block(input: ParseStream) -> Result<Block> {
    let content;
    let brace = braced!(content in input);
    let mut statements = Vec::new();
    while !content.is_empty() {
        if content.parse::<Option<Token![;]>>()?.is_none() {
            next(&content, &mut statements);
        }
    }
    Ok(Block { brace, statements })
}

fn next(input: ParseStream, statements: &mut Vec<Statement>) {
    let (begin, span) = (input.cursor(), input.span());
    let ahead = input.fork();
    let mut names = Vec::new();
    let result = statement(&ahead, &mut names);
    match &result {
        Ok(_) => input.advance_to(&ahead),
        Err(_) => scan::resynchronise(input),
    }
    let text = scan::source(begin, input.cursor());
    let mut push = |head: Head, kind| {
        statements.push(Statement {
            attrs: head.attrs,
            mark: head.mark,
            dims: head.dims,
            kind,
            text: text.clone(),
            span,
            site: None,
            predicted: false,
        });
    };
    match result {
        Ok((head, mut kind, ended)) => {
            if let (Kind::Rust(Stmt::Expr(_, semi)), false) = (&mut kind, ended) {
                semi.get_or_insert_default();
            }
            push(head, kind);
            if !ended {
                let error =
                    Error::new(scan::last_span(begin, input.cursor()), errors::MISSING_SEMICOLON);
                push(Head::default(), Kind::Broken { names: Vec::new(), error });
            }
        }
        Err(error) => push(Head::default(), Kind::Broken { names, error }),
    }
}

/// One statement, and whether it ended as it should. The names that it declares are written to
/// `names` as soon as they are known.
fn statement(input: ParseStream, names: &mut Vec<Ident>) -> Result<(Head, Kind, bool)> {
    let head = head(input.call(Attribute::parse_outer)?);
    let (kind, ended) = if input.peek(Token![let]) {
        declaration(input, names)?
    } else if starts_flow(input) {
        (Kind::Flow(flow(input)?), true)
    } else if scan::starts_item(input) {
        (Kind::Rust(input.parse()?), true)
    } else {
        expression_statement(input, names)?
    };
    Ok((head?, kind, ended))
}

fn declaration(input: ParseStream, names: &mut Vec<Ident>) -> Result<(Kind, bool)> {
    let let_token: Token![let] = input.parse()?;
    if input.peek(Token![~]) || input.peek(Token![=]) {
        return Err(input.error(errors::NO_NAME));
    }
    let mut pat = Pat::parse_single(input)?;
    names.extend(scan::bound_names(&pat));
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
        let kind = if calls_function(&distribution) {
            Kind::Part { let_token, name, tilde, part: distribution }
        } else {
            Kind::Unknown { let_token, name, tilde, distribution }
        };
        return Ok((kind, end(input)));
    }
    if input.peek(Token![.]) || input.peek(token::Bracket) {
        return Err(Error::new(let_token.span, errors::LET_PLACE));
    }
    let init = if input.peek(Token![=]) { Some(init(input)?) } else { None };
    let kind = Kind::Let { let_token, pat, init };
    Ok((kind, end(input)))
}

/// Whether a function is called, by its Rust name: constructors of distributions are types.
fn calls_function(expr: &Expr) -> bool {
    let Expr::Call(call) = expr else { return false };
    let Expr::Path(path) = &*call.func else { return false };
    let last = path.path.segments.last().map(|segment| segment.ident.unraw().to_string());
    last.is_some_and(|name| name.starts_with(|c: char| c.is_lowercase() || c == '_'))
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
    if input.is_empty() || input.peek(Token![;]) || scan::starts_statement(input) {
        return Err(at(tilde, errors::NO_DISTRIBUTION));
    }
    let distribution = scan::expression(input, Expr::parse_with_earlier_boundary_rule)?;
    if input.peek(Token![~]) {
        return Err(input.error(errors::TWO_TILDES));
    }
    Ok(distribution)
}

fn init(input: ParseStream) -> Result<Init> {
    let eq: Token![=] = input.parse()?;
    if input.peek(Token![~]) {
        return Err(input.error(errors::TILDE_EQUALS));
    }
    if starts_flow(input) && !input.peek(Token![for]) && scan::tilde_in_braces(input) {
        return Ok(Init::Flow(eq, flow(input)?));
    }
    let value = scan::expression(input, |input| input.parse())?;
    let diverge = if input.peek(Token![else]) {
        let else_token = input.parse()?;
        if !input.peek(token::Brace) {
            return Err(input.error(errors::ELSE));
        }
        Some((else_token, scan::expression(input, Expr::parse_with_earlier_boundary_rule)?))
    } else {
        None
    };
    Ok(Init::Value { eq, value, diverge })
}

fn expression_statement(input: ParseStream, names: &mut Vec<Ident>) -> Result<(Kind, bool)> {
    let value = scan::expression(input, Expr::parse_with_earlier_boundary_rule)?;
    if input.peek(Token![~]) {
        let tilde = input.parse()?;
        let incomplete = imputed(&value)?;
        names.extend(incomplete.as_ref().and_then(plain_name).cloned());
        let distribution = distribution(input, tilde)?;
        let kind = match incomplete {
            Some(place) => Kind::Impute { place, tilde, distribution },
            None => Kind::Observe { place: value, tilde, distribution, apart: false },
        };
        return Ok((kind, end(input)));
    }
    if let Expr::Call(call) = &value
        && let Some(name) = factor(call)
    {
        let mut weights = call.args.iter();
        let (Some(weight), None) = (weights.next(), weights.next()) else {
            return Err(at(call, errors::FACTOR_ARGUMENT));
        };
        let weight = weight.clone();
        return Ok((Kind::Factor { name, weight }, end(input)));
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

/// The variable, if that is all of the place.
pub(crate) fn plain_name(place: &Expr) -> Option<&Ident> {
    match place {
        Expr::Path(path) => path.path.get_ident(),
        _ => None,
    }
}

/// The name `factor`, if that is what is called.
pub(crate) fn factor(call: &ExprCall) -> Option<Ident> {
    match &*call.func {
        Expr::Path(path) => path.path.get_ident().filter(|name| *name == "factor").cloned(),
        _ => None,
    }
}

/// Takes the `;` and says whether it was there.
fn end(input: ParseStream) -> bool {
    matches!(input.parse::<Option<Token![;]>>(), Ok(Some(_)))
}

fn starts_flow(input: ParseStream) -> bool {
    input.peek(Token![for]) && !input.peek2(Token![<])
        || input.peek(Token![if])
        || input.peek(Token![match])
        || input.peek(token::Brace)
        || input.peek(syn::Lifetime) && input.peek3(Token![for])
}

fn flow(input: ParseStream) -> Result<Flow> {
    if input.peek(Token![if]) {
        let if_token = input.parse()?;
        let condition = Expr::parse_without_eager_brace(input)?;
        let then = block(input)?;
        let otherwise = if input.peek(Token![else]) {
            let else_token = input.parse()?;
            if !input.peek(Token![if]) && !input.peek(token::Brace) {
                return Err(input.error(errors::ELSE));
            }
            Some((else_token, Box::new(flow(input)?)))
        } else {
            None
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
            arms.push(arm(&content)?);
        }
        return Ok(Flow::Match { match_token, scrutinee, brace, arms });
    }
    if input.peek(token::Brace) {
        return Ok(Flow::Block(block(input)?));
    }
    let label: Option<Label> = input.parse()?;
    let for_token = input.parse()?;
    let pat = Box::new(Pat::parse_multi_with_leading_vert(input)?);
    let in_token = input.parse()?;
    let iter = Expr::parse_without_eager_brace(input)?;
    let leaves = scan::leaves(input, label.as_ref().map(|label| &label.name.ident));
    let body = block(input)?;
    let (summed, totals) = (Vec::new(), Vec::new());
    Ok(Flow::For {
        label,
        for_token,
        pat,
        in_token,
        iter,
        body,
        leaves,
        unwinds: false,
        pools: false,
        summed,
        totals,
        linear: None,
    })
}

fn arm(input: ParseStream) -> Result<Arm> {
    let pat = Pat::parse_multi_with_leading_vert(input)?;
    let guard = if input.peek(Token![if]) { Some((input.parse()?, input.parse()?)) } else { None };
    let arrow = input.parse()?;
    let body = if input.peek(token::Brace) {
        ArmBody::Block(block(input)?)
    } else {
        let value = scan::expression(input, Expr::parse_with_earlier_boundary_rule)?;
        if input.peek(Token![~]) || matches!(&value, Expr::Call(call) if factor(call).is_some()) {
            return Err(at(value, errors::TILDE_IN_ARM));
        }
        ArmBody::Value(value)
    };
    let comma: Option<Token![,]> = input.parse()?;
    if comma.is_none() && matches!(body, ArmBody::Value(_)) && !input.is_empty() {
        return Err(input.error(errors::ARM_COMMA));
    }
    Ok(Arm { pat, guard, arrow, body })
}
