//! Questions that are answered by looking at tokens: which names they mention, how the source reads.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use syn::Ident;
use syn::buffer::Cursor;

/// Calls `f` for all that may be variables: what follows a dot is a field or a method.
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

/// How often a variable is mentioned.
pub(crate) fn count(tokens: TokenStream, name: &Ident) -> usize {
    let mut uses = 0;
    variables(tokens, &mut |found| uses += usize::from(found == name));
    uses
}

/// Whether a variable is mentioned that is asked for.
pub(crate) fn mentions(tokens: TokenStream, asked: &impl Fn(&Ident) -> bool) -> bool {
    let mut found = false;
    variables(tokens, &mut |name| found = found || asked(name));
    found
}

/// Whether a word stands there, as whatever.
pub(crate) fn says(tokens: TokenStream, word: &str) -> bool {
    tokens.into_iter().any(|tree| match tree {
        TokenTree::Ident(found) => found == word,
        TokenTree::Group(group) => says(group.stream(), word),
        _ => false,
    })
}

pub(crate) fn is(tree: &TokenTree, character: char) -> bool {
    matches!(tree, TokenTree::Punct(punct) if punct.as_char() == character)
}

/// The tokens between two positions.
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

/// The last token between two positions.
pub(crate) fn last_span(begin: Cursor, end: Cursor) -> Span {
    match between(begin, end).last() {
        Some(TokenTree::Group(group)) => group.span_close(),
        Some(tree) => tree.span(),
        None => begin.span(),
    }
}

/// Tokens as they stand in the source, on one line, without attributes and the final `;`, cut to a
/// readable length.
pub(crate) fn source(tokens: &[TokenTree]) -> String {
    const LONGEST: usize = 72;
    let (mut text, mut last) = (String::new(), None);
    let mut trees = tokens;
    if let [rest @ .., end] = trees
        && is(end, ';')
    {
        trees = rest;
    }
    while let [first, rest @ ..] = trees
        && is(first, '#')
    {
        trees = rest.get(1..).unwrap_or_default();
    }
    if proc_macro::is_available() {
        write(trees.iter().cloned(), &mut text, &mut last);
    } else {
        text = trees.iter().cloned().collect::<TokenStream>().to_string();
    }
    if text.chars().count() > LONGEST {
        text = text.chars().take(LONGEST - 1).chain(['…']).collect();
    }
    text
}

fn write(trees: impl Iterator<Item = TokenTree>, text: &mut String, last: &mut Option<Span>) {
    for tree in trees {
        match tree {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::None => ("", ""),
                };
                piece(open, group.span_open(), text, last);
                write(group.stream().into_iter(), text, last);
                piece(close, group.span_close(), text, last);
            }
            leaf => piece(&leaf.to_string(), leaf.span(), text, last),
        }
    }
}

/// Appends a token, with a space where there was room in the source.
fn piece(token: &str, span: Span, text: &mut String, last: &mut Option<Span>) {
    if last.is_some_and(|last| end(last) != start(span)) {
        text.push(' ');
    }
    text.push_str(token);
    *last = Some(span);
}

fn start(span: Span) -> (usize, usize) {
    point(span.unwrap().start())
}

fn end(span: Span) -> (usize, usize) {
    point(span.unwrap().end())
}

fn point(span: proc_macro::Span) -> (usize, usize) {
    (span.line(), span.column())
}

/// The line on which a span begins; 0 outside the compiler.
pub(crate) fn line(span: Span) -> usize {
    if proc_macro::is_available() { start(span).0 } else { 0 }
}
