//! The function that declares a model: name, generics, data.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use syn::ext::IdentExt;
use syn::parse::discouraged::Speculative;
use syn::parse::{ParseStream, Parser};
use syn::visit::Visit;
use syn::{
    Attribute, Error, Generics, Ident, LitStr, Pat, Receiver, Result, ReturnType, Token, Type,
    Visibility, parenthesized, token,
};

use crate::errors::{self, at};
use crate::parse::{self, Block};

/// A model as written.
pub(crate) struct Model {
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) vis: Visibility,
    pub(crate) fn_token: Token![fn],
    pub(crate) name: Ident,
    pub(crate) generics: Generics,
    pub(crate) arguments: Vec<Argument>,
    pub(crate) body: Block,
    /// What is wrong with the signature, where the model can still be declared.
    pub(crate) errors: Vec<Error>,
}

/// Data.
pub(crate) struct Argument {
    pub(crate) attrs: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) colon: Token![:],
    pub(crate) ty: Type,
}

/// A model whose signature cannot be used.
pub(crate) struct Refused {
    pub(crate) vis: Visibility,
    pub(crate) name: Option<Ident>,
    pub(crate) error: Error,
}

impl Refused {
    fn nameless(error: Error) -> Self {
        Self { vis: Visibility::Inherited, name: None, error }
    }
}

/// All models of one invocation.
pub(crate) fn models(input: TokenStream) -> Vec<std::result::Result<Model, Refused>> {
    let parser = |input: ParseStream| {
        let mut models = Vec::new();
        if input.is_empty() {
            models.push(Err(Refused::nameless(Error::new(Span::call_site(), errors::EMPTY))));
        }
        while !input.is_empty() {
            let ahead = input.fork();
            let (mut vis, mut name) = (Visibility::Inherited, None);
            let model = model(&ahead, &mut vis, &mut name);
            match model {
                Ok(_) => input.advance_to(&ahead),
                Err(_) => skip(input),
            }
            models.push(model.map_err(|error| Refused { vis, name, error }));
        }
        Ok(models)
    };
    parser.parse2(input).unwrap_or_else(|error| vec![Err(Refused::nameless(error))])
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
        errors.push(at(&qualifier, errors::qualifier(&qualifier.to_string())));
    }
    if !input.peek(Token![fn]) {
        return Err(input.error(errors::NO_FUNCTION));
    }
    let fn_token = input.parse()?;
    let ident: Ident = input.parse()?;
    *name = Some(ident.clone());
    let mut generics: Generics = input.parse()?;
    let arguments = arguments(input, &mut errors)?;
    let output: ReturnType = input.parse()?;
    if let ReturnType::Type(..) = &output {
        errors.push(at(&output, errors::RETURN_TYPE));
    }
    generics.where_clause = input.parse()?;
    if !input.peek(token::Brace) {
        return Err(input.error(errors::NO_BODY));
    }
    Ok(Model {
        attrs,
        vis: vis.clone(),
        fn_token,
        name: ident,
        generics,
        arguments,
        body: parse::block(input)?,
        errors,
    })
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
            arguments.push(argument(&content, errors)?);
        }
        if !content.is_empty() {
            content.parse::<Token![,]>()?;
        }
    }
    Ok(arguments)
}

fn argument(input: ParseStream, errors: &mut Vec<Error>) -> Result<Argument> {
    let attrs = input.call(Attribute::parse_outer)?;
    let pat = Pat::parse_single(input)?;
    let name = match pat {
        Pat::Ident(pat) if pat.by_ref.is_none() && pat.subpat.is_none() => {
            if let Some(mutability) = pat.mutability {
                errors.push(at(mutability, errors::MUT_ARGUMENT));
            }
            pat.ident
        }
        other => return Err(at(other, errors::ARGUMENT_PATTERN)),
    };
    if !input.peek(Token![:]) {
        return Err(at(&name, errors::argument_type(&name.to_string())));
    }
    let argument = Argument { attrs, name, colon: input.parse()?, ty: input.parse()? };
    let mut refused = RefusedTypes(None);
    refused.visit_type(&argument.ty);
    match refused.0 {
        Some(error) => Err(error),
        None => Ok(argument),
    }
}

/// Types that data cannot have.
struct RefusedTypes(Option<Error>);

impl<'a> Visit<'a> for RefusedTypes {
    fn visit_type_impl_trait(&mut self, ty: &'a syn::TypeImplTrait) {
        self.0 = Some(at(ty, errors::IMPL_TRAIT));
    }

    fn visit_type_reference(&mut self, ty: &'a syn::TypeReference) {
        if ty.mutability.is_some() {
            self.0 = Some(at(ty, errors::MUT_REFERENCE));
        }
        syn::visit::visit_type_reference(self, ty);
    }

    // what these take and return is not data of the model
    fn visit_type_fn_ptr(&mut self, _: &'a syn::TypeFnPtr) {}
    fn visit_parenthesized_generic_arguments(&mut self, _: &'a syn::ParenthesizedGenericArguments) {
    }
}

/// Goes past a model that could not be read.
fn skip(input: ParseStream) {
    while let Ok(tree) = input.parse::<TokenTree>() {
        match tree {
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => return,
            TokenTree::Punct(punct) if punct.as_char() == ';' => return,
            _ => {}
        }
    }
}
