//! What stands before a statement in `#[…]`.

use quote::ToTokens;
use syn::parse::ParseStream;
use syn::punctuated::Punctuated;
use syn::{Attribute, Ident, Meta, Result, Token};

use crate::ast::{Dim, Mark};
use crate::errors::{self, about, at};

/// The attributes of a statement.
#[derive(Default)]
pub(super) struct Head {
    /// About lints.
    pub(super) attrs: Vec<Attribute>,
    pub(super) mark: Mark,
    pub(super) dims: Vec<Dim>,
}

pub(super) fn head(attrs: Vec<Attribute>) -> Result<Head> {
    let mut head = Head::default();
    for attr in attrs {
        let name = attr.path().to_token_stream().to_string().replace(' ', "");
        let bare = matches!(attr.meta, Meta::Path(_));
        let new = match name.as_str() {
            "track" if bare => Mark::Track,
            "predict" if bare => Mark::Predict,
            "dims" if head.dims.is_empty() => {
                head.dims = dims(&attr)?;
                continue;
            }
            "allow" | "expect" | "warn" | "deny" | "forbid" => {
                head.attrs.push(attr);
                continue;
            }
            // comments that would document nothing for rustdoc
            "doc" => continue,
            _ => Mark::None,
        };
        if new == Mark::None || head.mark != Mark::None {
            let written = attr.meta.to_token_stream().to_string().replace(' ', "");
            return Err(about(written, &attr, errors::ATTRIBUTE));
        }
        head.mark = new;
    }
    Ok(head)
}

/// `#[dims(year, school = names)]`.
fn dims(attr: &Attribute) -> Result<Vec<Dim>> {
    let dim = |input: ParseStream| {
        let name: Ident = input.parse()?;
        let labels = match input.parse::<Option<Token![=]>>()? {
            Some(_) => Some(input.parse()?),
            None => None,
        };
        Ok(Dim { name, labels })
    };
    let Meta::List(list) = &attr.meta else {
        return Err(at(attr, errors::DIMS_NAMES));
    };
    let dims = list.parse_args_with(|input: ParseStream| {
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
