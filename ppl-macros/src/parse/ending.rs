//! What a body ends with: a value, if it is that of a submodel.

use syn::{Expr, Result, Stmt, Type};

use crate::ast::{Block, Flow, Kind, Mark, Statement};
use crate::errors::{self, at};
use crate::syntax::expressions::is_assignment;

/// The body of a model, or with `value` that of a submodel that returns it.
pub(super) fn ended(mut body: Block, value: Option<&Type>) -> (Block, Result<()>) {
    let result = match value {
        Some(ty) => submodel(&mut body, ty),
        None => {
            model(&mut body);
            Ok(())
        }
    };
    // `Ok(())` follows what is not the value
    if let Some(Statement { kind: Kind::Rust(Stmt::Expr(_, semi)), .. }) =
        body.statements.last_mut()
    {
        semi.get_or_insert_default();
    }
    (body, result)
}

/// A model ends with a statement.
fn model(body: &mut Block) {
    if let Some(last) = body.statements.last_mut()
        && let Kind::Rust(Stmt::Expr(value, None)) = &last.kind
        && is_value(value)
    {
        last.kind = Kind::Broken { names: Vec::new(), error: at(value, errors::VALUE_AT_END) };
    }
}

/// A submodel ends with its value, unless that is `()`.
fn submodel(body: &mut Block, ty: &Type) -> Result<()> {
    let is_unit = matches!(ty, Type::Tuple(tuple) if tuple.elems.is_empty());
    let Some(last) = body.statements.last_mut() else {
        return if is_unit { Ok(()) } else { Err(at(ty, errors::NO_VALUE)) };
    };
    let is_unmarked = last.mark == Mark::None && last.dims.is_empty();
    let end = match &last.kind {
        Kind::Flow(
            flow @ (Flow::Match { .. } | Flow::Block(_) | Flow::If { otherwise: Some(_), .. }),
        ) if is_unmarked && !is_unit => flow.clone(),
        Kind::Rust(Stmt::Expr(value, None))
            if is_unmarked && !matches!(value, Expr::While(_) | Expr::Loop(_)) =>
        {
            Flow::Value(value.clone())
        }
        // what is broken may have been the value
        Kind::Broken { .. } => return Ok(()),
        _ if is_unit => return Ok(()),
        _ => return Err(at(ty, errors::NO_VALUE)),
    };
    last.kind = Kind::End(end);
    Ok(())
}

/// Whether an expression at the end of the model is certainly not a statement.
fn is_value(expr: &Expr) -> bool {
    match expr {
        Expr::Binary(binary) => !is_assignment(&binary.op),
        Expr::Path(_) | Expr::Lit(_) | Expr::Tuple(_) | Expr::Array(_) | Expr::Unary(_) => true,
        Expr::Field(_) | Expr::Index(_) => true,
        _ => false,
    }
}
