//! Where a statement begins and ends, and whether it contains a nested `~`.

use proc_macro2::{Delimiter, Span, TokenTree};
use syn::buffer::Cursor;
use syn::parse::ParseStream;
use syn::{Error, Expr, Result, Token, token};

use crate::errors;
use crate::syntax::tokens::is;

/// Parses an expression. If parsing fails because of a nested `~`, the error says so.
pub(crate) fn expression(
    input: ParseStream,
    parse: impl FnOnce(ParseStream) -> Result<Expr>,
) -> Result<Expr> {
    let begin = input.cursor();
    parse(input).map_err(|error| match nested_tilde(begin) {
        Some(tilde) => Error::new(tilde, errors::TILDE_INSIDE),
        None => error,
    })
}

/// The first `~` between braces or parentheses in the statement that begins here. Control flow with such a
/// `~` contains statements of the model.
pub(crate) fn nested_tilde(begin: Cursor) -> Option<Span> {
    fn inside(tree: TokenTree) -> Option<Span> {
        let TokenTree::Group(group) = tree else { return None };
        group.stream().into_iter().find_map(|tree| match is(&tree, '~') {
            true => Some(tree.span()),
            false => inside(tree),
        })
    }
    begin.token_stream().into_iter().take_while(|tree| !is(tree, ';')).find_map(inside)
}

/// Whether a new statement certainly begins here.
pub(crate) fn starts_statement(input: ParseStream) -> bool {
    input.peek(Token![let]) || input.peek(Token![for]) || input.peek(Token![#])
}

/// Whether a plate, a `for` loop of the model, begins here.
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

/// Whether the next token is one of these words.
pub(crate) fn starts_with(input: ParseStream, words: &[&str]) -> bool {
    input.cursor().ident().is_some_and(|(found, _)| words.iter().any(|word| found == word))
}

/// Skips the rest of a statement that could not be parsed: up to and including its `;` or its final block, or
/// up to the beginning of the next statement.
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
        // no new statement begins after these words in `if let`, `while let`, `&& let`, `'label: for`
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
