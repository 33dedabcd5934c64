//! Parses the function that declares a model: its name, generics and arguments (the data).

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use quote::{ToTokens, format_ident, quote};
use syn::parse::discouraged::Speculative;
use syn::parse::{ParseStream, Parser};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{
    Attribute, Error, FnArg, Ident, PatType, Result, ReturnType, Signature, Type, Visibility,
    parse_quote_spanned, token,
};

use super::ending::end;
use super::statements::Reader;
use crate::ast::{Argument, Model};
use crate::errors::{self, about, at};
use crate::syntax::patterns::only_name;
use crate::syntax::statements::starts_with;
use crate::syntax::tokens::says;

/// Parses all models of one invocation of the macro.
pub(crate) fn models(input: TokenStream) -> Vec<Result<Model>> {
    let parser = |input: ParseStream| {
        let mut models = Vec::new();
        while !input.is_empty() || models.is_empty() {
            let ahead = input.fork();
            let model = model(&ahead);
            match &model {
                Ok(_) => input.advance_to(&ahead),
                Err(_) => skip(input),
            }
            models.push(model);
        }
        Ok(models)
    };
    parser.parse2(input).unwrap_or_else(|error| vec![Err(error)])
}

fn model(input: ParseStream) -> Result<Model> {
    let (attrs, vis) = (input.call(Attribute::parse_outer)?, input.parse()?);
    if !starts_with(input, &["fn", "async", "const", "extern", "unsafe"]) {
        return Err(input.error(errors::NO_FUNCTION));
    }
    let signature: Signature = input.parse()?;
    let (mut typed, mut errors) = (Vec::new(), Vec::new());
    let Signature { constness, asyncness, safety, abi, variadic, .. } = &signature;
    let qualifiers = quote!(#constness #asyncness #safety #abi #variadic);
    if !qualifiers.is_empty() {
        errors.push(about(&qualifiers, &qualifiers, errors::QUALIFIER));
    }
    for argument in signature.inputs {
        match argument {
            FnArg::Typed(argument) => typed.push(argument),
            FnArg::Receiver(receiver) => errors.push(at(receiver, errors::SELF_ARGUMENT)),
        }
    }
    let mut value = match signature.output {
        ReturnType::Type(_, ty) => Some(*ty),
        ReturnType::Default => None,
    };
    let (name, arity) = (signature.ident, typed.len());
    let read = arguments(typed, value.as_mut()).and_then(|arguments| {
        if !input.peek(token::Brace) {
            return Err(input.error(errors::NO_BODY));
        }
        Ok((arguments, Reader::default().block(input)?))
    });
    let (arguments, mut body) = match read {
        Ok(read) => read,
        Err(error) => {
            skip(input);
            return stand_in(&vis, &name, arity, error);
        }
    };
    errors.extend(end(&mut body, value.as_ref()).err());
    let (fn_token, generics) = (signature.fn_token, signature.generics);
    Ok(Model { attrs, vis, fn_token, name, generics, arguments, value, body, errors })
}

/// Returns a model without statements that replaces a model whose signature is invalid. Calls of the model then
/// compile and cause no further errors.
fn stand_in(vis: &Visibility, name: &Ident, arity: usize, error: Error) -> Result<Model> {
    let types: Vec<_> = (0..arity).map(|i| format_ident!("__T{i}")).collect();
    let names = (0..arity).map(|i| format_ident!("_{i}"));
    let stand_in = quote!(#vis fn #name<#(#types),*>(#(#names: #types),*) {});
    Ok(Model { errors: vec![error], ..model.parse2(stand_in)? })
}

/// Parses the arguments. `value` is the return type of a submodel, None for a model. In a submodel, `Real` becomes
/// the number type of the model that calls the submodel.
fn arguments(typed: Vec<PatType>, value: Option<&mut Type>) -> Result<Vec<Argument>> {
    let arguments: Result<Vec<_>> = typed.into_iter().map(argument).collect();
    let mut arguments = arguments?;
    match value {
        Some(Type::Reference(reference)) if reference.lifetime.is_none() => {
            return Err(at(reference, errors::VALUE_REFERENCE));
        }
        Some(ty) => {
            let types = arguments.iter_mut().map(|argument| &mut argument.ty);
            types.chain([ty]).for_each(|ty| NumberType.visit_type_mut(ty));
        }
        None => {
            let is_real = |argument: &&Argument| says(argument.ty.to_token_stream(), "Real");
            if let Some(argument) = arguments.iter().find(is_real) {
                return Err(at(&argument.ty, errors::REAL_DATA));
            }
        }
    }
    Ok(arguments)
}

fn argument(typed: PatType) -> Result<Argument> {
    let PatType { attrs, pat, colon_token: colon, ty } = typed;
    let name = only_name(&pat).ok_or_else(|| at(&pat, errors::ARGUMENT_PATTERN))?.clone();
    match refused(&ty) {
        Some(message) => Err(at(ty, message)),
        None => Ok(Argument { attrs, name, colon, ty: *ty }),
    }
}

/// Returns the error message for a type that data cannot have; None for an allowed type.
fn refused(ty: &Type) -> Option<&'static str> {
    match ty {
        Type::ImplTrait(_) => Some(errors::IMPL_TRAIT),
        Type::Reference(reference) if reference.mutability.is_some() => Some(errors::MUT_REFERENCE),
        Type::Reference(reference) => refused(&reference.elem),
        _ => None,
    }
}

/// Replaces the type `Real` by the number type of the model that calls the submodel.
struct NumberType;

impl VisitMut for NumberType {
    fn visit_type_mut(&mut self, ty: &mut Type) {
        match ty {
            Type::Path(path) if path.qself.is_none() && path.path.is_ident("Real") => {
                let real = &path.path;
                *ty = parse_quote_spanned!(path.span()=> ::ppl::#real<__S>);
            }
            _ => visit_mut::visit_type_mut(self, ty),
        }
    }
}

/// Skips the rest of a model that could not be parsed.
fn skip(input: ParseStream) {
    while let Ok(tree) = input.parse::<TokenTree>() {
        match tree {
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => break,
            TokenTree::Punct(punct) if punct.as_char() == ';' => break,
            _ => {}
        }
    }
}
