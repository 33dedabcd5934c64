//! Parses the attributes of a statement.

use quote::ToTokens;
use syn::parse::ParseStream;
use syn::punctuated::Punctuated;
use syn::{Attribute, Ident, Meta, Result, Token};

use crate::ast::{Dim, Mark};
use crate::errors::{self, about, at};

/// The attributes of a statement: lint attributes, the mark `#[track]` or `#[predict]`, and the named dimensions.
pub(super) type Head = (Vec<Attribute>, Mark, Vec<Dim>);

pub(super) fn head(attrs: Vec<Attribute>) -> Result<Head> {
    let (mut lints, mut mark, mut named) = Head::default();
    for attr in attrs {
        let is = |name: &&str| attr.path().is_ident(name);
        let takes_mark = matches!(attr.meta, Meta::Path(_)) && mark == Mark::None;
        if ["allow", "expect", "warn", "deny", "forbid"].iter().any(is) {
            lints.push(attr);
        } else if is(&"dims") && named.is_empty() {
            named = dims(&attr)?;
        } else if is(&"track") && takes_mark {
            mark = Mark::Track;
        } else if is(&"predict") && takes_mark {
            mark = Mark::Predict;
        } else if !is(&"doc") {
            // doc comments are dropped: rustdoc does not document statements
            let written = attr.meta.to_token_stream().to_string().replace(' ', "");
            return Err(about(written, &attr, errors::ATTRIBUTE));
        }
    }
    Ok((lints, mark, named))
}

/// Parses an attribute such as `#[dims(year, school = names)]`.
fn dims(attr: &Attribute) -> Result<Vec<Dim>> {
    let dim = |input: ParseStream| {
        let name: Ident = input.parse()?;
        let eq: Option<Token![=]> = input.parse()?;
        let labels = eq.map(|_| input.parse()).transpose()?;
        Ok(Dim { name, labels })
    };
    let dims = attr.parse_args_with(|input: ParseStream| {
        Punctuated::<_, Token![,]>::parse_terminated_with(input, dim)
    });
    let dims: Vec<Dim> = dims.map_err(|_| at(attr, errors::DIMS_NAMES))?.into_iter().collect();
    if dims.is_empty() {
        return Err(at(attr, errors::DIMS_NAMES));
    }
    for (k, dim) in dims.iter().enumerate() {
        let is_taken = dims[..k].iter().any(|other| other.name == dim.name);
        if is_taken || dim.name == "chain" || dim.name == "draw" {
            return Err(at(&dim.name, errors::DIMS_TAKEN));
        }
    }
    Ok(dims)
}
