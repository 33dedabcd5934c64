//! Where a statement begins, where it ends, and where a `~` hides in it.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use syn::buffer::Cursor;
use syn::parse::ParseStream;
use syn::{Error, Expr, Result, Token, token};

use crate::errors;
use crate::syntax::tokens::{between, is};

/// An expression without a `~` inside, which is an error even where any tokens can stand.
pub(crate) fn expression(
    input: ParseStream,
    parse: impl FnOnce(ParseStream) -> Result<Expr>,
) -> Result<Expr> {
    let begin = input.cursor();
    let result = parse(input);
    let trees = match &result {
        Ok(_) => between(begin, input.cursor()),
        Err(_) => rest_of_statement(begin),
    };
    match trees.iter().find_map(nested_tilde) {
        Some(tilde) => Err(Error::new(tilde, errors::TILDE_INSIDE)),
        None => result,
    }
}

/// Whether the control flow that begins here has statements of the model inside.
pub(crate) fn tilde_in_braces(input: ParseStream) -> bool {
    rest_of_statement(input.cursor()).iter().any(|tree| nested_tilde(tree).is_some())
}

fn nested_tilde(tree: &TokenTree) -> Option<Span> {
    fn first(stream: TokenStream) -> Option<Span> {
        stream.into_iter().find_map(|tree| match tree {
            TokenTree::Punct(punct) if punct.as_char() == '~' => Some(punct.span()),
            TokenTree::Group(group) => first(group.stream()),
            _ => None,
        })
    }
    match tree {
        TokenTree::Group(group) => first(group.stream()),
        _ => None,
    }
}

fn rest_of_statement(mut cursor: Cursor) -> Vec<TokenTree> {
    let mut trees = Vec::new();
    while let Some((tree, next)) = cursor.token_tree() {
        if is(&tree, ';') {
            break;
        }
        trees.push(tree);
        cursor = next;
    }
    trees
}

/// Whether a new statement certainly begins here.
pub(crate) fn starts_statement(input: ParseStream) -> bool {
    input.peek(Token![let]) || input.peek(Token![for]) || input.peek(Token![#])
}

/// Whether a plate begins here.
pub(crate) fn starts_plate(input: ParseStream) -> bool {
    input.peek(Token![for]) && !input.peek2(Token![<])
        || input.peek(syn::Lifetime) && input.peek3(Token![for])
}

/// Whether a branch or a block begins here.
pub(crate) fn starts_flow(input: ParseStream) -> bool {
    input.peek(Token![if]) || input.peek(Token![match]) || input.peek(token::Brace)
}

/// Whether an item begins here: a constant, a function, an import.
pub(crate) fn starts_item(input: ParseStream) -> bool {
    const ITEMS: [&str; 9] =
        ["const", "static", "use", "fn", "struct", "enum", "type", "impl", "trait"];
    starts_with(input, &ITEMS) && !input.peek2(token::Brace)
}

/// Whether one of these words begins here.
pub(crate) fn starts_with(input: ParseStream, words: &[&str]) -> bool {
    input.cursor().ident().is_some_and(|(found, _)| words.iter().any(|word| found == word))
}

/// Goes to the end of a statement that could not be read: behind its `;`, behind the block that
/// it ends with, or before the next statement if that comes first.
pub(crate) fn resynchronise(input: ParseStream) {
    let skip = || input.parse::<TokenTree>().ok();
    while input.peek(Token![#]) {
        skip();
        skip();
    }
    let flow = starts_with(input, &["for", "if", "match", "while", "loop"]);
    let mut previous = skip();
    while let Some(last) = previous {
        if is(&last, ';') {
            return;
        }
        let block = matches!(&last, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace);
        if flow && block && !input.peek(Token![else]) {
            return;
        }
        // `if let`, `while let`, `&& let`, `'label: for`
        let continues = match &last {
            TokenTree::Ident(word) => word == "if" || word == "while" || word == "else",
            TokenTree::Punct(punct) => "&|:".contains(punct.as_char()),
            _ => false,
        };
        if starts_statement(input) && !continues {
            return;
        }
        previous = skip();
    }
}
