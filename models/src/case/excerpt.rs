//! The line of a case file that an error concerns.

use std::ops::Range;
use std::path::Path;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use toml::de::{DeTable, DeValue};

use crate::error::{Excerpt, InputError};

/// Adds the line of the file `path` to an error about a key in its `text`. Errors about other files are returned
/// unchanged.
pub(super) fn with_excerpt(error: InputError, text: &str, path: &Path) -> InputError {
    if error.excerpt.is_some() || error.file != path.display().to_string() {
        return error;
    }
    let span = span_of(text, &error.place);
    InputError { excerpt: span.map(|span| Box::new(excerpt(text, span))), ..error }
}

/// Formats the line of the text where a span begins, with marks below the part of the span on this line.
pub(super) fn excerpt(text: &str, span: Range<usize>) -> Excerpt {
    let start = char_boundary(text, span.start);
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line = text[line_start..].lines().next().unwrap_or("");
    let number = text[..line_start].matches('\n').count() + 1;
    let end = char_boundary(text, span.end) - line_start;
    let marked = (start - line_start).min(line.len())..end.min(line.len());
    let marks = AnnotationKind::Primary.span(marked);
    let snippet = Snippet::source(line).line_start(number).annotation(marks);
    let report = [Group::with_level(Level::ERROR).element(snippet)];
    Excerpt { line: number, picture: Renderer::plain().render(&report).to_string() }
}

/// Returns the largest index of a character's first byte that is at most `index`.
fn char_boundary(text: &str, index: usize) -> usize {
    let index = index.min(text.len());
    (0..=index).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

/// Returns the range of a key's value, or, if the key is missing, of the innermost table around it. A key is a path
/// such as `extend[0].prior.matrix.young_mpa`.
fn span_of(text: &str, key: &str) -> Option<Range<usize>> {
    let table = DeTable::parse_recoverable(text).0;
    let mut table = table.get_ref();
    let mut span = None;
    for part in key.split('.') {
        let (name, index) = match part.strip_suffix(']').and_then(|part| part.split_once('[')) {
            Some((name, index)) => (name, index.parse::<usize>().ok()),
            None => (part, None),
        };
        let Some((key, value)) = table.iter().find(|(key, _)| key.get_ref() == name) else { break };
        let value = match (value.get_ref(), index) {
            (DeValue::Array(values), Some(index)) => values.get(index).unwrap_or(value),
            _ => value,
        };
        let DeValue::Table(inner) = value.get_ref() else { return Some(value.span()) };
        span = Some(key.span());
        table = inner;
    }
    span
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[a]\nx = 1 # one\r\nb.c = [1.0,\n 2.0]\n[[d]]\ny = \"ü\"\n[[d]]\ny = 3\n";

    fn marked(key: &str) -> Option<&'static str> {
        span_of(TEXT, key).map(|span| &TEXT[span])
    }

    #[test]
    fn keys_are_found_in_the_text() {
        assert_eq!(marked("a.x"), Some("1"));
        assert_eq!(marked("a.b.c"), Some("[1.0,\n 2.0]"));
        assert_eq!(marked("d[1].y"), Some("3"));
        assert_eq!(marked("d[0].y"), Some("\"ü\""));
        assert_eq!(marked("a.missing"), Some("a"));
        assert_eq!(marked("missing"), None);
    }

    #[test]
    fn the_value_is_marked() {
        let drawn = |key: &str| excerpt(TEXT, span_of(TEXT, key).unwrap());
        let Excerpt { line, picture } = drawn("a.x");
        assert_eq!((line, picture.as_str()), (2, "  |\n2 | x = 1 # one\n  |     ^"));
        // an array on several lines is marked on its first line
        let Excerpt { line, picture } = drawn("a.b.c");
        assert_eq!((line, picture.as_str()), (3, "  |\n3 | b.c = [1.0,\n  |       ^^^^^"));
        // positions beyond the end of the text are limited to its end
        assert_eq!(excerpt("x", 5..9).line, 1);
    }
}
