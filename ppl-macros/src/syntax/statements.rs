//! Detects the beginning and the end of a statement, and a nested `~` inside a statement.

use proc_macro2::{Delimiter, Span, TokenTree};
use syn::buffer::Cursor;
use syn::parse::ParseStream;
use syn::{Error, Expr, Result, Token, token};

use crate::errors;
use crate::syntax::tokens::is;

/// Parses an expression. If parsing fails because of a nested `~`, the error is [`errors::TILDE_INSIDE`].
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

/// Returns the position of the first `~` between braces or parentheses in the statement that starts at `begin`.
/// Control flow with such a `~` contains statements of the model.
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

/// Whether the next token certainly begins a new statement.
pub(crate) fn starts_statement(input: ParseStream) -> bool {
    input.peek(Token![let]) || input.peek(Token![for]) || input.peek(Token![#])
}

/// Whether the next tokens begin a plate, that is, a `for` loop in the body of a model.
pub(crate) fn starts_plate(input: ParseStream) -> bool {
    input.peek(Token![for]) && !input.peek2(Token![<])
        || input.peek(syn::Lifetime) && input.peek3(Token![for])
}

/// Whether the next token begins an `if`, a `match` or a block.
pub(crate) fn starts_flow(input: ParseStream) -> bool {
    input.peek(Token![if]) || input.peek(Token![match]) || input.peek(token::Brace)
}

/// Whether the next tokens begin a Rust item, such as a constant, a function or an import.
pub(crate) fn starts_item(input: ParseStream) -> bool {
    const ITEMS: [&str; 9] =
        ["const", "static", "use", "fn", "struct", "enum", "type", "impl", "trait"];
    starts_with(input, &ITEMS) && !input.peek2(token::Brace)
}

/// Whether the next token is one of the given words.
pub(crate) fn starts_with(input: ParseStream, words: &[&str]) -> bool {
    input.cursor().ident().is_some_and(|(name, _)| words.iter().any(|word| name == word))
}

/// Skips the rest of a statement that could not be parsed. Parsing resumes after the `;` or the final block of the
/// statement, or at the beginning of the next statement.
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
        // after these tokens, `let` or `for` does not begin a statement, as in `if let`, `while let`, `&& let`,
        // `'label: for`
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
