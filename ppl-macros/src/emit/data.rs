//! The arguments of a model, and the type that holds them.
//!
//! It is generic over the type of each: so that lifetimes which the user has left out stay out. The
//! constants of the model are its own too, since no type of the data need speak of them.

use proc_macro2::{Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::{Generics, Ident, Type, parse_quote, parse_quote_spanned};

use crate::ast::{Argument, Model};

/// The type that holds the data, and how to speak of it.
pub(super) struct Data {
    pub(super) declaration: TokenStream,
    /// With the types of the data.
    pub(super) applied: TokenStream,
    /// The data in it.
    pub(super) made: TokenStream,
}

pub(super) fn data(model: &Model) -> Data {
    // where data are refused, as those that threads cannot share
    let span = Span::mixed_site().located_at(model.name.span());
    let constants: Vec<_> = model.generics.const_params().collect();
    // in braces: a bare name would be taken for that of a type, if there is one in scope
    let given = constants.iter().map(|constant| {
        let name = &constant.ident;
        quote_spanned!(name.span()=> { #name })
    });
    let given: Vec<_> = given.collect();
    let names: Vec<_> = model.arguments.iter().map(|argument| &argument.name).collect();
    let types: Vec<_> = model.arguments.iter().map(|argument| &argument.ty).collect();
    let own: Vec<_> = (0..names.len()).map(|i| format_ident!("__T{i}")).collect();
    let inferred = names.iter().map(|_| quote!(_));
    let fields = model.arguments.iter().map(|Argument { name, ty, .. }| match is_number(ty) {
        true => quote!(#name: ::core::convert::Into::into(#name)),
        false => quote!(#name),
    });
    Data {
        declaration: quote_spanned! {span=>
            struct __Data<#(#constants,)* #(#own),*> {
                #(#names: #own,)*
            }
        },
        applied: quote_spanned!(span=> __Data<#(#given,)* #(#types),*>),
        made: quote_spanned!(span=> __Data::<#(#given,)* #(#inferred),*> { #(#fields),* }),
    }
}

/// Type parameters can be shared.
pub(super) fn add_sync(generics: &mut Generics) {
    for parameter in generics.type_params_mut() {
        let sync = parse_quote_spanned!(parameter.ident.span()=> ::core::marker::Sync);
        parameter.bounds.push(sync);
    }
}

/// `Real` in the signature of a submodel, which takes plain numbers too.
pub(super) fn is_number(ty: &Type) -> bool {
    *ty == parse_quote!(::ppl::Real<__S>)
}

/// Data in the body: references and numbers as they are, everything else behind `&`.
pub(super) fn binding(argument: &Argument) -> TokenStream {
    const NUMBERS: [&str; 16] = [
        "f64", "f32", "usize", "u8", "u16", "u32", "u64", "u128", "isize", "i8", "i16", "i32",
        "i64", "i128", "bool", "char",
    ];
    let span = Span::mixed_site();
    let (name, this) = (&argument.name, Ident::new("self", span));
    let is_copied = match &argument.ty {
        Type::Reference(_) => true,
        Type::Path(path) => NUMBERS.iter().any(|number| path.path.is_ident(number)),
        _ => false,
    };
    if is_copied || is_number(&argument.ty) {
        quote_spanned!(span=> let #name = #this.#name;)
    } else {
        quote_spanned!(span=> let #name = &#this.#name;)
    }
}
