//! Parses the end of a body, which is the final value of a submodel.

use syn::{Expr, Result, Stmt, Type};

use crate::ast::{Block, Flow, Kind, Mark};
use crate::errors::{self, at};
use crate::syntax::expressions::is_assignment;

/// Marks the last statement of the body as `Kind::End` if the function is a submodel with return type `value` and the
/// statement is its final value. Returns an error if a submodel has no final value. If a model without return type
/// ends with a value, the last statement becomes `Kind::Broken`.
pub(super) fn end(body: &mut Block, value: Option<&Type>) -> Result<()> {
    let is_unit = |ty: &Type| matches!(ty, Type::Tuple(tuple) if tuple.elems.is_empty());
    let needed = value.filter(|ty| !is_unit(ty));
    let no_value = || needed.map_or(Ok(()), |ty| Err(at(ty, errors::NO_VALUE)));
    let Some(last) = body.statements.last_mut() else { return no_value() };
    let is_unmarked = last.mark == Mark::None && last.dims.is_empty();
    let end = match &mut last.kind {
        Kind::Rust(Stmt::Expr(expr, None)) if value.is_none() && is_value(expr) => {
            let error = at(expr, errors::VALUE_AT_END);
            Kind::Broken { names: Vec::new(), error }
        }
        Kind::Rust(Stmt::Expr(expr, None)) if value.is_some() && is_unmarked => {
            Kind::End(Flow::Value(expr.clone()))
        }
        Kind::Flow(
            flow @ (Flow::Match { .. } | Flow::Block(_) | Flow::If { otherwise: Some(_), .. }),
        ) if needed.is_some() && is_unmarked => Kind::End(flow.clone()),
        // any other final expression is a statement; the emitted code returns `Ok(())` after it
        Kind::Rust(Stmt::Expr(_, semi)) => {
            semi.get_or_insert_default();
            return no_value();
        }
        // a broken statement may have been the final value
        Kind::Broken { .. } => return Ok(()),
        _ => return no_value(),
    };
    last.kind = end;
    Ok(())
}

/// Whether an expression at the end of a model can only be a value, not a statement.
fn is_value(expr: &Expr) -> bool {
    match expr {
        Expr::Binary(binary) => !is_assignment(&binary.op),
        Expr::Path(_) | Expr::Lit(_) | Expr::Tuple(_) | Expr::Array(_) | Expr::Unary(_) => true,
        Expr::Field(_) | Expr::Index(_) => true,
        _ => false,
    }
}
