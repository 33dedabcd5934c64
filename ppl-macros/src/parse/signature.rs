//! The function that declares a model: name, generics, data.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use quote::{ToTokens, format_ident};
use syn::ext::IdentExt;
use syn::parse::discouraged::Speculative;
use syn::parse::{ParseStream, Parser};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{
    Attribute, Error, Generics, Ident, LitStr, Pat, Receiver, Result, ReturnType, Token, Type,
    TypeReference, Visibility, parenthesized, parse_quote, parse_quote_spanned, token,
};

use super::ending::end;
use super::statements::Reader;
use crate::ast::{Argument, Block, Model};
use crate::errors::{self, about, at};
use crate::syntax::patterns::only_name;
use crate::syntax::tokens::{is, says};

/// All models of one invocation.
pub(crate) fn models(input: TokenStream) -> Vec<Result<Model>> {
    let parser = |input: ParseStream| {
        let mut models = Vec::new();
        if input.is_empty() {
            models.push(Err(Error::new(Span::call_site(), errors::NO_FUNCTION)));
        }
        while !input.is_empty() {
            let ahead = input.fork();
            let (mut vis, mut name) = (Visibility::Inherited, None);
            let model = model(&ahead, &mut vis, &mut name);
            let model = match (model, name) {
                (Ok(model), _) => {
                    input.advance_to(&ahead);
                    Ok(model)
                }
                (Err(error), Some(name)) => Ok(stand_in(vis, name, skip(input), error)),
                (Err(error), None) => {
                    skip(input);
                    Err(error)
                }
            };
            models.push(model);
        }
        Ok(models)
    };
    parser.parse2(input).unwrap_or_else(|error| vec![Err(error)])
}

/// A model without statements, for one whose signature cannot be used: calls of it compile, and
/// add no other error.
fn stand_in(vis: Visibility, name: Ident, arity: usize, error: Error) -> Model {
    let types: Vec<_> = (0..arity).map(|i| format_ident!("__T{i}")).collect();
    let arguments = types.iter().enumerate().map(|(i, ty)| Argument {
        attrs: Vec::new(),
        name: format_ident!("_{i}"),
        colon: Default::default(),
        ty: parse_quote!(#ty),
    });
    Model {
        attrs: Vec::new(),
        vis,
        fn_token: Default::default(),
        name,
        generics: parse_quote!(<#(#types),*>),
        arguments: arguments.collect(),
        value: None,
        body: Block::empty(),
        errors: vec![error],
    }
}

fn model(input: ParseStream, vis: &mut Visibility, name: &mut Option<Ident>) -> Result<Model> {
    let mut errors = Vec::new();
    let attrs = input.call(Attribute::parse_outer)?;
    *vis = input.parse()?;
    while input.peek(Token![async])
        || input.peek(Token![const])
        || input.peek(Token![unsafe])
        || input.peek(Token![extern])
    {
        let qualifier: Ident = input.call(Ident::parse_any)?;
        let _abi: Option<LitStr> = input.parse()?;
        errors.push(about(&qualifier, &qualifier, errors::QUALIFIER));
    }
    if !input.peek(Token![fn]) {
        return Err(input.error(errors::NO_FUNCTION));
    }
    let fn_token = input.parse()?;
    let ident: Ident = input.parse()?;
    *name = Some(ident.clone());
    let mut generics: Generics = input.parse()?;
    let mut arguments = arguments(input, &mut errors)?;
    let mut value = match input.parse()? {
        ReturnType::Type(_, ty) => Some(*ty),
        ReturnType::Default => None,
    };
    match &mut value {
        Some(ty) => {
            if let Type::Reference(TypeReference { lifetime: None, .. }) = ty {
                return Err(at(ty, errors::VALUE_REFERENCE));
            }
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
    generics.where_clause = input.parse()?;
    if !input.peek(token::Brace) {
        return Err(input.error(errors::NO_BODY));
    }
    let mut body = Reader::default().block(input)?;
    errors.extend(end(&mut body, value.as_ref()).err());
    let (vis, name) = (vis.clone(), ident);
    Ok(Model { attrs, vis, fn_token, name, generics, arguments, value, body, errors })
}

fn arguments(input: ParseStream, errors: &mut Vec<Error>) -> Result<Vec<Argument>> {
    let content;
    parenthesized!(content in input);
    let mut arguments = Vec::new();
    while !content.is_empty() {
        let ahead = content.fork();
        if let Ok(receiver) = ahead.parse::<Receiver>() {
            content.advance_to(&ahead);
            errors.push(at(receiver, errors::SELF_ARGUMENT));
        } else {
            arguments.push(argument(&content)?);
        }
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    Ok(arguments)
}

fn argument(input: ParseStream) -> Result<Argument> {
    let attrs = input.call(Attribute::parse_outer)?;
    let pat = Pat::parse_single(input)?;
    let name = only_name(&pat).ok_or_else(|| at(&pat, errors::ARGUMENT_PATTERN))?.clone();
    if !input.peek(Token![:]) {
        return Err(about(&name, &name, errors::ARGUMENT_TYPE));
    }
    let argument = Argument { attrs, name, colon: input.parse()?, ty: input.parse()? };
    match refused(&argument.ty) {
        Some(message) => Err(at(&argument.ty, message)),
        None => Ok(argument),
    }
}

/// Why data cannot have a type.
fn refused(ty: &Type) -> Option<&'static str> {
    match ty {
        Type::ImplTrait(_) => Some(errors::IMPL_TRAIT),
        Type::Reference(reference) if reference.mutability.is_some() => Some(errors::MUT_REFERENCE),
        Type::Reference(reference) => refused(&reference.elem),
        _ => None,
    }
}

/// Makes `Real` the number of the reading that a submodel runs in.
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

/// Goes past a model that could not be read, and counts its arguments.
fn skip(input: ParseStream) -> usize {
    let mut arguments = None;
    while let Ok(tree) = input.parse::<TokenTree>() {
        match tree {
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => break,
            TokenTree::Group(group) if group.delimiter() == Delimiter::Parenthesis => {
                arguments.get_or_insert_with(|| count(group.stream()));
            }
            TokenTree::Punct(punct) if punct.as_char() == ';' => break,
            _ => {}
        }
    }
    arguments.unwrap_or_default()
}

/// The number of pieces between commas that are not inside `<…>`.
fn count(arguments: TokenStream) -> usize {
    let (mut depth, mut is_arrow) = (0, false);
    let trees: Vec<TokenTree> = arguments.into_iter().collect();
    let pieces = trees.split(|tree| {
        depth += i32::from(is(tree, '<')) - i32::from(is(tree, '>') && !is_arrow);
        is_arrow = is(tree, '-');
        depth == 0 && is(tree, ',')
    });
    pieces.filter(|piece| !piece.is_empty()).count()
}
