//! The arguments of a model: their types, lifetimes and bindings, and the type that holds them.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{
    GenericParam, Generics, Ident, Lifetime, Type, TypeFnPtr, WherePredicate, parse_quote,
    parse_quote_spanned,
};

use crate::ast::Argument;

/// The generics and types of the data: elided lifetimes get names.
pub(super) fn owned(generics: &Generics, arguments: &[Argument]) -> (Generics, Vec<Type>) {
    let mut named = Named {
        taken: generics.lifetimes().map(|parameter| parameter.lifetime.ident.to_string()).collect(),
        argument: String::new(),
        new: Vec::new(),
    };
    let types = arguments.iter().map(|argument| {
        let mut ty = argument.ty.clone();
        named.argument = argument.name.unraw().to_string();
        named.visit_type_mut(&mut ty);
        ty
    });
    let types = types.collect();
    let mut generics = generics.clone();
    for lifetime in named.new.iter().rev() {
        generics.params.insert(0, parse_quote!(#lifetime));
    }
    (generics, types)
}

/// The parameters of the data as arguments.
pub(super) fn applied(generics: &Generics) -> Option<TokenStream> {
    let arguments = generics.params.iter().map(argument);
    (!generics.params.is_empty()).then(|| quote!(<#(#arguments),*>))
}

/// The types and constants of a model as arguments; lifetimes follow from the data.
pub(super) fn given(generics: &Generics) -> Option<TokenStream> {
    let is_lifetime = |parameter: &&GenericParam| matches!(parameter, GenericParam::Lifetime(_));
    let given: Vec<_> = generics.params.iter().filter(|p| !is_lifetime(p)).map(argument).collect();
    (!given.is_empty()).then(|| quote!(::<#(#given),*>))
}

/// A parameter as an argument. A constant stands in braces: a bare name there would be taken for
/// that of a type, if there is one in scope.
fn argument(parameter: &GenericParam) -> TokenStream {
    match parameter {
        GenericParam::Type(parameter) => parameter.ident.to_token_stream(),
        GenericParam::Const(parameter) => {
            let name = &parameter.ident;
            quote_spanned!(name.span()=> { #name })
        }
        GenericParam::Lifetime(parameter) => parameter.lifetime.to_token_stream(),
    }
}

/// Type parameters can be shared; the bound goes where the user has put others.
pub(super) fn with_sync(generics: &mut Generics) -> &mut Generics {
    let mut elsewhere = generics.where_clause.take();
    for parameter in generics.type_params_mut() {
        let name = &parameter.ident;
        let bounds =
            elsewhere.iter_mut().flat_map(|clause| &mut clause.predicates).find_map(|predicate| {
                match predicate {
                    WherePredicate::Type(bound) if bound.bounded_ty == parse_quote!(#name) => {
                        Some(&mut bound.bounds)
                    }
                    _ => None,
                }
            });
        let sync = parse_quote_spanned!(name.span()=> ::core::marker::Sync);
        bounds.unwrap_or(&mut parameter.bounds).push(sync);
    }
    generics.where_clause = elsewhere;
    generics
}

/// Names elided lifetimes after the argument that they stand in.
struct Named {
    taken: HashSet<String>,
    argument: String,
    new: Vec<Lifetime>,
}

impl Named {
    fn next(&mut self, span: Span) -> Lifetime {
        let mut name = self.argument.clone();
        while !self.taken.insert(name.clone()) {
            name.push('_');
        }
        let lifetime = Lifetime::new(&format!("'{name}"), span);
        self.new.push(lifetime.clone());
        lifetime
    }
}

impl VisitMut for Named {
    fn visit_type_reference_mut(&mut self, ty: &mut syn::TypeReference) {
        if ty.lifetime.is_none() {
            ty.lifetime = Some(self.next(ty.and_token.span()));
        }
        visit_mut::visit_type_reference_mut(self, ty);
    }

    fn visit_lifetime_mut(&mut self, lifetime: &mut Lifetime) {
        if lifetime.ident == "_" {
            *lifetime = self.next(lifetime.span());
        }
    }

    // lifetimes in there are bound there
    fn visit_type_fn_ptr_mut(&mut self, _: &mut TypeFnPtr) {}
    fn visit_parenthesized_generic_arguments_mut(
        &mut self,
        _: &mut syn::ParenthesizedGenericArguments,
    ) {
    }
}

/// Data in the body: references and numbers as they are, everything else behind `&`.
pub(super) fn binding(argument: &Argument) -> TokenStream {
    const NUMBERS: [&str; 16] = [
        "f64", "f32", "usize", "u8", "u16", "u32", "u64", "u128", "isize", "i8", "i16", "i32",
        "i64", "i128", "bool", "char",
    ];
    let span = Span::mixed_site();
    let (name, this) = (&argument.name, Ident::new("self", span));
    let copied = match &argument.ty {
        Type::Reference(_) => true,
        Type::Path(path) => NUMBERS.iter().any(|number| path.path.is_ident(number)),
        _ => false,
    };
    if copied {
        quote_spanned!(span=> let #name = #this.#name;)
    } else {
        quote_spanned!(span=> let #name = &#this.#name;)
    }
}

/// The name of the type that holds the data.
pub(super) fn data_name(function: &Ident) -> Ident {
    format_ident!("__{}", camel_case(&function.unraw().to_string()), span = function.span())
}

fn camel_case(name: &str) -> String {
    let words = name.split('_').filter(|word| !word.is_empty());
    let capital = |word: &str| {
        let mut letters = word.chars();
        let first = letters.next().into_iter().flat_map(char::to_uppercase);
        first.chain(letters).collect::<String>()
    };
    words.map(capital).collect()
}
