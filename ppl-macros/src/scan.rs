//! Questions that are answered by looking at tokens: where a statement ends, where a `~` hides,
//! how the source reads.

use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use syn::buffer::Cursor;
use syn::parse::ParseStream;
use syn::visit::Visit;
use syn::{Error, Expr, Ident, Pat, PatIdent, Result, Token, token};

use crate::errors;

/// An expression. If it cannot be read because of a `~` inside, the error says so.
pub(crate) fn expression(
    input: ParseStream,
    parse: impl FnOnce(ParseStream) -> Result<Expr>,
) -> Result<Expr> {
    let begin = input.cursor();
    let in_loop = input.peek(Token![while]) || input.peek(Token![loop]);
    let result = parse(input);
    let trees = match &result {
        Ok(_) => between(begin, input.cursor()),
        Err(_) => rest_of_statement(begin),
    };
    if let Some(tilde) = trees.iter().find_map(nested_tilde) {
        let message = if in_loop { errors::TILDE_IN_LOOP } else { errors::TILDE_INSIDE };
        return Err(Error::new(tilde, message));
    }
    if result.is_err()
        && let Some(pair) = trees.windows(2).find(|pair| is(&pair[0], '=') && is(&pair[1], '~'))
    {
        return Err(Error::new(pair[1].span(), errors::TILDE_EQUALS));
    }
    result
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

/// Whether a `break` or `continue` in the body that stands in the input goes on in a loop around
/// the one with the label `own`.
pub(crate) fn leaves(input: ParseStream, own: Option<&Ident>) -> bool {
    let Some(TokenTree::Group(body)) = rest_of_statement(input.cursor()).into_iter().next() else {
        return false;
    };
    let mut labels = Labels { known: own.into_iter().cloned().collect(), targets: Vec::new() };
    labels.read(body.stream());
    labels.targets.iter().any(|target| !labels.known.contains(target))
}

/// The labels of loops, and those that jumps go to.
struct Labels {
    known: Vec<Ident>,
    targets: Vec<Ident>,
}

impl Labels {
    fn read(&mut self, stream: TokenStream) {
        let trees: Vec<TokenTree> = stream.into_iter().collect();
        for (i, tree) in trees.iter().enumerate() {
            match tree {
                TokenTree::Group(group) => self.read(group.stream()),
                TokenTree::Ident(name) if i > 0 && is(&trees[i - 1], '\'') => {
                    let jumps = i > 1
                        && matches!(&trees[i - 2], TokenTree::Ident(word)
                            if word == "break" || word == "continue");
                    if jumps {
                        self.targets.push(name.clone());
                    } else if trees.get(i + 1).is_some_and(|next| is(next, ':')) {
                        self.known.push(name.clone());
                    }
                }
                _ => {}
            }
        }
    }
}

fn is(tree: &TokenTree, character: char) -> bool {
    matches!(tree, TokenTree::Punct(punct) if punct.as_char() == character)
}

fn between(mut begin: Cursor, end: Cursor) -> Vec<TokenTree> {
    let mut trees = Vec::new();
    while begin != end
        && let Some((tree, next)) = begin.token_tree()
    {
        trees.push(tree);
        begin = next;
    }
    trees
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

/// The last token between two positions.
pub(crate) fn last_span(begin: Cursor, end: Cursor) -> Span {
    match between(begin, end).last() {
        Some(TokenTree::Group(group)) => group.span_close(),
        Some(tree) => tree.span(),
        None => begin.span(),
    }
}

/// Whether a new statement certainly begins here.
pub(crate) fn starts_statement(input: ParseStream) -> bool {
    input.peek(Token![let]) || input.peek(Token![for]) || input.peek(Token![#])
}

/// Whether an item begins here: a constant, a function, an import.
pub(crate) fn starts_item(input: ParseStream) -> bool {
    input.peek(Token![const]) && !input.peek2(token::Brace)
        || input.peek(Token![static])
        || input.peek(Token![use])
        || input.peek(Token![fn])
        || input.peek(Token![struct])
        || input.peek(Token![enum])
        || input.peek(Token![type])
        || input.peek(Token![impl])
        || input.peek(Token![trait])
}

/// Goes to the end of a statement that could not be read: behind its `;`, behind the block that
/// it ends with, or before the next statement if that comes first.
pub(crate) fn resynchronise(input: ParseStream) {
    let skip = || input.parse::<TokenTree>().ok();
    while input.peek(Token![#]) {
        skip();
        skip();
    }
    let flow = input.peek(Token![for])
        || input.peek(Token![if])
        || input.peek(Token![match])
        || input.peek(Token![while])
        || input.peek(Token![loop]);
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

/// The names that a pattern binds.
pub(crate) fn bound_names(pat: &Pat) -> Vec<Ident> {
    idents(pat, |_| true)
}

/// Those that are variables: what a name that is none refers to, where it can be changed, lies
/// elsewhere.
pub(crate) fn variables(pat: &Pat) -> Vec<Ident> {
    idents(pat, |pat| pat.mutability.is_some() && pat.by_ref.is_none())
}

fn idents(pat: &Pat, asked: fn(&PatIdent) -> bool) -> Vec<Ident> {
    struct Names(Vec<Ident>, fn(&PatIdent) -> bool);
    impl<'a> Visit<'a> for Names {
        fn visit_pat_ident(&mut self, pat: &'a PatIdent) {
            // a capital letter is a constant or a variant
            if !pat.ident.to_string().starts_with(char::is_uppercase) && self.1(pat) {
                self.0.push(pat.ident.clone());
            }
            syn::visit::visit_pat_ident(self, pat);
        }
    }
    let mut names = Names(Vec::new(), asked);
    names.visit_pat(pat);
    names.0
}

/// The names that `if let` conditions bind.
pub(crate) fn bound_by_condition(condition: &Expr) -> Vec<Ident> {
    match condition {
        Expr::Let(binding) => bound_names(&binding.pat),
        Expr::Binary(both) => {
            let mut names = bound_by_condition(&both.left);
            names.extend(bound_by_condition(&both.right));
            names
        }
        _ => Vec::new(),
    }
}

/// The tokens between two positions as they stand in the source, on one line, without attributes
/// and the final `;`, cut to a readable length.
pub(crate) fn source(begin: Cursor, end: Cursor) -> String {
    const LONGEST: usize = 72;
    let mut text = String::new();
    let mut last: Option<Span> = None;
    let mut trees = between(begin, end);
    trees.pop_if(|tree| is(tree, ';'));
    while trees.first().is_some_and(|tree| is(tree, '#')) {
        trees.drain(..trees.len().min(2));
    }
    write(trees, &mut text, &mut last);
    if text.chars().count() > LONGEST {
        text = text.chars().take(LONGEST - 1).chain(['…']).collect();
    }
    text
}

fn write(trees: impl IntoIterator<Item = TokenTree>, text: &mut String, last: &mut Option<Span>) {
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
                write(group.stream(), text, last);
                piece(close, group.span_close(), text, last);
            }
            leaf => piece(&leaf.to_string(), leaf.span(), text, last),
        }
    }
}

/// Appends a token, with a space where there was room in the source.
fn piece(token: &str, span: Span, text: &mut String, last: &mut Option<Span>) {
    let is_apart = |last: &Span| {
        proc_macro::is_available() && point(last.unwrap().end()) != point(span.unwrap().start())
    };
    if last.as_ref().is_some_and(is_apart) {
        text.push(' ');
    }
    text.push_str(token);
    *last = Some(span);
}

fn point(span: proc_macro::Span) -> (usize, usize) {
    (span.line(), span.column())
}

/// Line and column where a span begins; there are none outside the compiler.
pub(crate) fn position(span: Span) -> (usize, usize) {
    if proc_macro::is_available() { point(span.unwrap()) } else { (0, 0) }
}
