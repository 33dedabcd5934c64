//! Sums that are written with iterators become loops: `xs.iter().map(|x| b * x).sum::<Real<_>>()`
//! is `let mut sum = 0; for x in xs.iter() { sum += b * x; }`, which is one formula.

use proc_macro2::Span;
use quote::{format_ident, quote_spanned};
use syn::spanned::Spanned;
use syn::{Expr, ExprMethodCall, GenericArgument, Ident, Pat, Stmt, Type, UnOp, parse_quote};

use crate::arithmetic::{is_arithmetic, is_function, is_type};
use crate::ast::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::fold::{is_pure, is_repeated};
use crate::inspect::is_pooled;

/// Takes the sums out of arithmetic in the statements.
pub(crate) fn unroll(body: &mut Block) {
    Unroll { sums: 0 }.block(body);
}

struct Unroll {
    sums: usize,
}

impl Unroll {
    fn block(&mut self, block: &mut Block) {
        let mut i = 0;
        while i < block.statements.len() {
            let statement = &mut block.statements[i];
            let span = statement.span;
            // what is marked stays one statement
            let is_bare = statement.mark == Mark::None && !statement.predicted;
            let mut loops = Vec::new();
            match &mut statement.kind {
                Kind::Flow(flow) => self.flow(flow),
                _ if !is_bare => {}
                Kind::Observe { distribution: Expr::Call(call), .. } if is_type(&call.func) => {
                    call.args.iter_mut().for_each(|argument| self.expr(argument, &mut loops));
                }
                Kind::Let { init: Some(Init::Value { value, diverge: None, .. }), .. } => {
                    self.expr(value, &mut loops);
                }
                Kind::Let { init: Some(Init::Flow(_, flow)), .. } => self.flow(flow),
                Kind::Factor { weight, .. } => self.expr(weight, &mut loops),
                _ => {}
            }
            let mut added = Vec::new();
            for sum in loops {
                added.extend(sum.statements(span));
            }
            let count = added.len();
            block.statements.splice(i..i, added);
            i += 1 + count;
        }
    }

    fn flow(&mut self, flow: &mut Flow) {
        match flow {
            // one distribution for all data needs no sum but its own
            Flow::For { pat, body, .. } if is_pooled(pat, body) => {}
            Flow::For { body, .. } => self.block(body),
            Flow::If { then, otherwise, .. } => {
                self.block(then);
                if let Some((_, otherwise)) = otherwise {
                    self.flow(otherwise);
                }
            }
            Flow::Match { arms, .. } => {
                for arm in arms {
                    if let ArmBody::Block(block) = &mut arm.body {
                        self.block(block);
                    }
                }
            }
            Flow::Block(block) => self.block(block),
        }
    }

    /// Puts names in the places of sums that are operands.
    fn expr(&mut self, expr: &mut Expr, loops: &mut Vec<Iterated>) {
        match expr {
            Expr::Paren(paren) => self.expr(&mut paren.expr, loops),
            Expr::Group(group) => self.expr(&mut group.expr, loops),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => {
                self.expr(&mut unary.expr, loops);
            }
            Expr::Binary(binary) if is_arithmetic(&binary.op) => {
                self.expr(&mut binary.left, loops);
                self.expr(&mut binary.right, loops);
            }
            Expr::MethodCall(call) => match mapped(call) {
                Some((pat, iter, value)) => {
                    let span = Span::mixed_site().located_at(call.span());
                    let name = format_ident!("__iterated_{}", self.sums, span = span);
                    self.sums += 1;
                    let placed = parse_quote!(#name);
                    loops.push(Iterated { name, pat, iter, value });
                    *expr = placed;
                }
                None if is_function(call) => self.expr(&mut call.receiver, loops),
                None => {}
            },
            _ => {}
        }
    }
}

/// `iter.map(|pat| value).sum::<Real<_>>()` as its parts.
fn mapped(call: &ExprMethodCall) -> Option<(Pat, Expr, Expr)> {
    let of = call.turbofish.as_ref().filter(|_| call.method == "sum")?;
    let Some(GenericArgument::Type(Type::Path(of))) = of.args.first() else { return None };
    let Expr::MethodCall(map) = &*call.receiver else { return None };
    let Some(Expr::Closure(each)) = map.args.first().filter(|_| map.method == "map") else {
        return None;
    };
    let is_plain = each.attrs.is_empty() && each.asyncness.is_none() && each.inputs.len() == 1;
    let is_real = of.path.segments.last()?.ident == "Real";
    let holds = is_plain && is_real && is_repeated(&map.receiver) && is_pure(&each.body);
    let pat = each.inputs.first().filter(|pat| holds && !matches!(pat, Pat::Type(_)))?;
    let iter = match &*map.receiver {
        Expr::Paren(paren) => &*paren.expr,
        other => other,
    };
    Some((pat.clone(), iter.clone(), (*each.body).clone()))
}

struct Iterated {
    name: Ident,
    pat: Pat,
    iter: Expr,
    value: Expr,
}

impl Iterated {
    fn statements(self, span: Span) -> [Statement; 2] {
        let Self { name, pat, iter, value } = self;
        let zero = quote_spanned!(name.span()=> ::ppl::Real::<__C::Number>::from(0.0));
        let mut sum = Statement::rust(Stmt::Expr(parse_quote!(()), None), span, false);
        sum.kind = Kind::Let {
            let_token: Default::default(),
            pat: parse_quote!(mut #name),
            init: Some(Init::Value {
                eq: Default::default(),
                value: parse_quote!(#zero),
                diverge: None,
            }),
        };
        let step = Stmt::Expr(parse_quote!(#name += #value), Some(Default::default()));
        let mut body = Block::empty();
        body.statements.push(Statement::rust(step, span, false));
        let mut turns = Statement::rust(Stmt::Expr(parse_quote!(()), None), span, false);
        turns.kind = Kind::Flow(Flow::For {
            label: None,
            for_token: Default::default(),
            pat: Box::new(pat),
            in_token: Default::default(),
            iter,
            body,
            leaves: false,
            unwinds: false,
            pools: false,
            summed: Vec::new(),
            totals: Vec::new(),
            linear: None,
        });
        [sum, turns]
    }
}
