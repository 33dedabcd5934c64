//! Properties of token streams: the names that occur in them, and their source text.

use proc_macro2::{TokenStream, TokenTree};
use syn::Ident;
use syn::buffer::Cursor;

/// Calls `f` for every identifier that may be a variable. An identifier after a dot is a field or a method and is
/// skipped.
pub(crate) fn variables(tokens: TokenStream, f: &mut impl FnMut(&Ident)) {
    let mut dots = 0;
    for tree in tokens {
        match &tree {
            TokenTree::Ident(name) if dots != 1 => f(name),
            TokenTree::Group(group) => variables(group.stream(), f),
            _ => {}
        }
        dots = match tree {
            TokenTree::Punct(punct) if punct.as_char() == '.' => dots + 1,
            _ => 0,
        };
    }
}

/// Returns how many times a variable occurs in the tokens.
pub(crate) fn count(tokens: TokenStream, name: &Ident) -> usize {
    let mut uses = 0;
    variables(tokens, &mut |variable| uses += usize::from(variable == name));
    uses
}

/// Whether a variable for which `is_wanted` returns true occurs in the tokens.
pub(crate) fn mentions(tokens: TokenStream, is_wanted: &impl Fn(&Ident) -> bool) -> bool {
    let mut occurs = false;
    variables(tokens, &mut |name| occurs = occurs || is_wanted(name));
    occurs
}

/// Whether an identifier occurs in the tokens, as a variable, a field, a method or anything else.
pub(crate) fn says(tokens: TokenStream, word: &str) -> bool {
    tokens.into_iter().any(|tree| match tree {
        TokenTree::Ident(name) => name == word,
        TokenTree::Group(group) => says(group.stream(), word),
        _ => false,
    })
}

pub(crate) fn is(tree: &TokenTree, character: char) -> bool {
    matches!(tree, TokenTree::Punct(punct) if punct.as_char() == character)
}

/// Returns the tokens between two positions of a token stream.
pub(crate) fn between(mut begin: Cursor, end: Cursor) -> Vec<TokenTree> {
    let mut trees = Vec::new();
    while begin != end
        && let Some((tree, next)) = begin.token_tree()
    {
        trees.push(tree);
        begin = next;
    }
    trees
}

/// Returns the source text of the tokens as one line, without attributes and the final `;`. Text of more than 72
/// characters is truncated.
pub(crate) fn source(tokens: &[TokenTree]) -> String {
    const LONGEST: usize = 72;
    let attributes = tokens.chunks(2).take_while(|pair| is(&pair[0], '#')).count();
    let trees = tokens.get(2 * attributes..).unwrap_or_default();
    let trees = match trees {
        [rest @ .., end] if is(end, ';') => rest,
        all => all,
    };
    let text = match proc_macro::is_available() {
        true => written(trees),
        false => trees.iter().cloned().collect::<TokenStream>().to_string(),
    };
    match text.chars().count() > LONGEST {
        true => text.chars().take(LONGEST - 1).chain(['…']).collect(),
        false => text,
    }
}

/// Returns the source text of the tokens, with each run of white space replaced by one space.
fn written(trees: &[TokenTree]) -> String {
    let mut text = String::new();
    let mut end = None;
    for tree in trees {
        let span = tree.span().unwrap();
        let start = span.start();
        if end.is_some_and(|end| end != (start.line(), start.column())) {
            text.push(' ');
        }
        let piece = span.source_text().unwrap_or_else(|| tree.to_string());
        text.push_str(&piece.split_whitespace().collect::<Vec<_>>().join(" "));
        end = Some((span.end().line(), span.end().column()));
    }
    text
}
