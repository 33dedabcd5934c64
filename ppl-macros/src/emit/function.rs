//! Emits the function that the user declares. The function of a model returns the model bound to its data. The
//! function of a submodel stores its arguments; the statements of the submodel are generic over the number type of
//! the calling model, because arguments may be unknowns.
//!
//! The struct that stores the data has one type parameter for each argument, so that lifetimes which the user elided
//! stay elided. The struct also has the const parameters of the model, because the types of the data do not
//! necessarily mention these parameters.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::{Ident, Type, parse_quote};

use super::statements::{cx, statements};
use crate::analyse::{Analysis, Site};
use crate::ast::{Argument, Kind, Model, Statement};

pub(crate) fn function(model: &Model, analysis: &Analysis) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, arguments, errors, .. } = model;
    let mut generics = model.generics.clone();
    match &model.value {
        Some(_) => generics.params.push(parse_quote!(__S: ::ppl::Scalar)),
        // the types of the data must be `Sync`, because threads share the data
        None => generics.type_params_mut().for_each(|parameter| {
            parameter.bounds.push(parse_quote!(::core::marker::Sync));
        }),
    }
    let (introduced, _, bounds) = generics.split_for_impl();
    let parameters = arguments.iter().map(|Argument { attrs, name, colon, ty }| {
        let ty = if is_number(ty) { quote!(impl ::core::convert::Into<#ty>) } else { quote!(#ty) };
        quote!(#(#attrs)* #name #colon #ty)
    });
    let fields = arguments.iter().map(|Argument { name, ty, .. }| match is_number(ty) {
        true => quote!(#name: ::core::convert::Into::into(#name)),
        false => quote!(#name),
    });
    let constants: Vec<_> = model.generics.const_params().collect();
    // the const argument is in braces: a bare name would be parsed as a type if a type of that name is in scope
    let given = constants.iter().map(|constant| &constant.ident);
    let given: Vec<_> = given.map(|name| quote_spanned!(name.span()=> { #name })).collect();
    let names: Vec<_> = arguments.iter().map(|argument| &argument.name).collect();
    let types = arguments.iter().map(|argument| &argument.ty);
    let type_parameters: Vec<_> = (0..names.len()).map(|i| format_ident!("__T{i}")).collect();
    let inferred = names.iter().map(|_| quote!(_));
    // errors about the data, such as a type that threads cannot share, are reported at the model's name
    let at_name = span.located_at(name.span());
    let data = quote_spanned!(at_name=> __Data<#(#given,)* #(#types),*>);
    let declaration = quote_spanned! {at_name=>
        struct __Data<#(#constants,)* #(#type_parameters),*> {
            #(#names: #type_parameters,)*
        }
    };
    let made = quote_spanned!(at_name=> __Data::<#(#given,)* #(#inferred),*> { #(#fields),* });
    let is_static = analysis.is_static;
    let (returned, made, interface, item, context, output) = match &model.value {
        Some(value) => (
            quote!(::ppl::Part<impl ::ppl::Submodel<__S, Value = #value>>),
            quote!(::ppl::Part(#made)),
            quote!(::ppl::Submodel<__S>),
            quote! {
                type Value = #value;
                const STATIC: bool = #is_static;
            },
            quote!(::ppl::Context<Number = __S>),
            quote!(Self::Value),
        ),
        None => (
            quote!(::ppl::Bound<impl ::ppl::Model>),
            quote!(::ppl::Bound::new(#made)),
            quote!(::ppl::Model),
            quote!(const STATIC: bool = #is_static;),
            quote!(::ppl::Context),
            quote!(()),
        ),
    };
    let formulas = quote_spanned! {span=>
        #[allow(unused_imports)]
        use ::ppl::__private::{
            Apart as _, At as _, Number as _, Of as __Of, Other as _, Together as _,
        };
    };
    // the body of a submodel is compiled into the code of the calling model
    let inline = model.value.is_some().then(|| quote!(#[inline(always)]));
    let (cx, this) = (cx(), Ident::new("self", span));
    let (statements, sites) = statements(model, analysis);
    let (sites, bindings) = (table(&sites), arguments.iter().map(binding));
    let end = ending(model, analysis);
    let errors = errors.iter().map(syn::Error::to_compile_error);
    quote_spanned! {span=>
        #(#errors)*
        #(#attrs)*
        // silence lints about emitted code: bounds that are written twice, braces around a loop
        #[allow(
            clippy::multiple_bound_locations,
            clippy::too_many_arguments,
            single_use_lifetimes,
            unused_braces
        )]
        #vis #fn_token #name #introduced(#(#parameters),*) -> #returned #bounds {
            #declaration
            impl #introduced #interface for #data #bounds {
                #item
                #inline
                fn run<__C: #context>(
                    &#this,
                    #cx: &mut __C,
                ) -> ::core::result::Result<#output, ::ppl::Rejection> {
                    #formulas
                    #sites
                    #(#bindings)*
                    #statements
                    #end
                }
            }
            #made
        }
    }
}

/// Whether a type is `Real`, the number type in the signature of a submodel. An argument of this type also accepts
/// plain numbers.
fn is_number(ty: &Type) -> bool {
    *ty == parse_quote!(::ppl::Real<__S>)
}

/// Emits the `let` statement that binds an argument in the body. References and numbers are copied; values of any
/// other type are borrowed.
fn binding(argument: &Argument) -> TokenStream {
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
    let borrow = (!is_copied && !is_number(&argument.ty)).then(|| quote!(&));
    quote_spanned!(span=> let #name = #borrow #this.#name;)
}

/// Emits the table of the sites of a model. A site is the position and the name of a statement.
fn table(sites: &[Site]) -> Option<TokenStream> {
    let span = Span::mixed_site();
    let count = Literal::usize_unsuffixed(sites.len());
    let entries = sites.iter().map(|Site { name, text, span: place, repeated, plates, dims }| {
        let line = if proc_macro::is_available() { place.unwrap().line() } else { 0 };
        let line = Literal::usize_unsuffixed(line);
        let in_loop = match plates.is_empty() {
            false => Some(quote!(.along(&[#(#plates),*]))),
            true => repeated.then(|| quote!(.in_loop())),
        };
        let dims = (!dims.is_empty()).then(|| quote!(.dims(&[#(#dims),*])));
        quote_spanned!(span=> ::ppl::Site::at(#name, #text, ::core::file!(), #line)#in_loop #dims)
    });
    let table = quote_spanned! {span=>
        static __SITES: [::ppl::Site; #count] = [#(#entries),*];
    };
    (!sites.is_empty()).then_some(table)
}

/// Emits the final expression of the body; None if the last statement already returns a value.
fn ending(Model { value, body, .. }: &Model, analysis: &Analysis) -> Option<TokenStream> {
    let is_end = |last: &Statement| {
        matches!(last.kind, Kind::End(_)) && !analysis.facts.errors.contains_key(&last.id)
    };
    let is_unit = |ty: &Type| matches!(ty, Type::Tuple(tuple) if tuple.elems.is_empty());
    match body.statements.last() {
        Some(last) if is_end(last) => None,
        _ if value.as_ref().is_none_or(is_unit) => Some(quote!(::core::result::Result::Ok(()))),
        // the last statement is invalid and was replaced by a compile error
        _ => Some(quote!(::core::unreachable!())),
    }
}
