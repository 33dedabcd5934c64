//! Text with placeholders for numbers, such as `{k1}` or `{matrix.young_mpa:.6e}`.

use std::fmt::Write as _;

/// Text with placeholders: an input file of a simulator, or an argument of its command.
///
/// A placeholder is a name in braces; after a colon it may have a format: `.4f` (four decimals), `.6e` (six decimals and an
/// exponent) or `e`. Doubled braces around a name write the name in single braces. All other braces are plain text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Template {
    pieces: Vec<Piece>,
}

#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Text(String),
    Placeholder { name: String, format: String, line: usize },
}

/// Value of a placeholder.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Number(f64),
    Text(String),
}

/// Placeholder that cannot be replaced.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BadPlaceholder {
    /// Line of the text, from 1.
    pub(crate) line: usize,
    /// The placeholder with its braces.
    pub(crate) written: String,
    /// The problem, such as `names no parameter`.
    pub(crate) problem: &'static str,
}

impl Template {
    pub(crate) fn parse(text: &str) -> Self {
        let (mut pieces, mut plain, mut rest, mut line) = (Vec::new(), String::new(), text, 1);
        while let Some(start) = rest.find('{') {
            line += rest[..start].matches('\n').count();
            plain.push_str(&rest[..start]);
            rest = &rest[start..];
            if let Some((written, after)) = doubled(rest) {
                plain.push_str(written);
                rest = after;
            } else if let Some((name, format, after)) = placeholder(rest) {
                pieces.push(Piece::Text(std::mem::take(&mut plain)));
                let (name, format) = (name.to_owned(), format.to_owned());
                pieces.push(Piece::Placeholder { name, format, line });
                rest = after;
            } else {
                plain.push('{');
                rest = &rest[1..];
            }
        }
        plain.push_str(rest);
        pieces.push(Piece::Text(plain));
        Self { pieces }
    }

    /// Names of the placeholders, in the order of the text.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.pieces.iter().filter_map(|piece| match piece {
            Piece::Placeholder { name, .. } => Some(name.as_str()),
            Piece::Text(_) => None,
        })
    }

    /// Checks that each placeholder names one of `allowed` and has a valid format.
    ///
    /// # Errors
    /// The first placeholder that cannot be replaced.
    pub(crate) fn check(&self, allowed: &[&str]) -> Result<(), BadPlaceholder> {
        for piece in &self.pieces {
            let Piece::Placeholder { name, format, line } = piece else { continue };
            let bad = |problem| {
                let written = written(name, format);
                Err(BadPlaceholder { line: *line, written, problem })
            };
            if !allowed.contains(&name.as_str()) {
                return bad("names no parameter");
            }
            if formatted(1.0, format).is_none() {
                return bad("has an unknown format");
            }
        }
        Ok(())
    }

    /// Replaces the placeholders. A placeholder without a value is left unchanged.
    pub(crate) fn render(&self, value: &dyn Fn(&str) -> Option<Value>) -> String {
        let mut text = String::new();
        for piece in &self.pieces {
            match piece {
                Piece::Text(plain) => text.push_str(plain),
                Piece::Placeholder { name, format, .. } => match value(name) {
                    Some(Value::Text(replacement)) => text.push_str(&replacement),
                    Some(Value::Number(x)) => {
                        text.push_str(&formatted(x, format).unwrap_or_else(|| shortest(x)));
                    }
                    None => text.push_str(&written(name, format)),
                },
            }
        }
        text
    }
}

fn written(name: &str, format: &str) -> String {
    let colon = if format.is_empty() { "" } else { ":" };
    format!("{{{name}{colon}{format}}}")
}

/// Splits off `{{name}}` at the start of a text. Returns the name in single braces and the rest of the text.
fn doubled(text: &str) -> Option<(&str, &str)> {
    let (.., after) = placeholder(text.strip_prefix('{')?)?;
    let rest = after.strip_prefix('}')?;
    Some((&text[1..text.len() - after.len()], rest))
}

/// Splits off a placeholder at the start of a text: its name, its format, and the rest of the text.
fn placeholder(text: &str) -> Option<(&str, &str, &str)> {
    let (inner, after) = text.strip_prefix('{')?.split_once('}')?;
    let (name, format) = inner.split_once(':').unwrap_or((inner, ""));
    let is_word = |word: &str| {
        let mut letters = word.chars();
        letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
            && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let is_format = format.chars().all(|c| c.is_ascii_alphanumeric() || c == '.');
    (name.split('.').all(is_word) && is_format).then_some((name, format, after))
}

/// Formats a number; returns `None` for an unknown format.
fn formatted(x: f64, format: &str) -> Option<String> {
    if format.is_empty() {
        return Some(shortest(x));
    }
    if format == "e" {
        return Some(format!("{x:e}"));
    }
    let digits = format.strip_prefix('.')?;
    let kind = digits.chars().last()?;
    let digits: usize = digits[..digits.len() - kind.len_utf8()].parse().ok()?;
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = match kind {
        _ if digits > 17 => return None,
        'f' => write!(text, "{x:.digits$}"),
        'e' => write!(text, "{x:.digits$e}"),
        _ => return None,
    };
    Some(text)
}

/// Returns the shortest text that is parsed as exactly the same number.
fn shortest(x: f64) -> String {
    let size = x.abs();
    if size != 0.0 && !(1e-5..1e15).contains(&size) { format!("{x:e}") } else { x.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendered(text: &str) -> String {
        Template::parse(text).render(&|name| match name {
            "k1" => Some(Value::Number(1234.5)),
            "matrix.young_mpa" => Some(Value::Number(2.5e-7)),
            "input" => Some(Value::Text("deck.inp".into())),
            _ => None,
        })
    }

    #[test]
    fn placeholders_are_replaced_and_other_braces_stay() {
        for (text, expected) in [
            ("*ELASTIC\n{k1}, 0.3\n", "*ELASTIC\n1234.5, 0.3\n"),
            ("{k1}{k1:.1f} {k1:.3e} {k1:e}", "1234.51234.5 1.234e3 1.2345e3"),
            ("{matrix.young_mpa}", "2.5e-7"),
            ("-i{input}", "-ideck.inp"),
            ("{{k1}} {\"a\": {k1}}", "{k1} {\"a\": 1234.5}"),
            ("int main() { return 0; } {} {", "int main() { return 0; } {} {"),
            ("{ k1 } {1} {a b} {k1", "{ k1 } {1} {a b} {k1"),
        ] {
            assert_eq!(rendered(text), expected, "{text}");
        }
    }

    #[test]
    fn unknown_names_and_formats_are_refused_with_their_line() {
        let check = |text: &str| Template::parse(text).check(&["k1"]);
        assert_eq!(check("{k1}\n{k1:.2f} {{k2}} { k2 }"), Ok(()));
        let bad = check("a {k1}\n\n b {k2:e}").unwrap_err();
        assert_eq!((bad.line, bad.written.as_str()), (3, "{k2:e}"));
        assert_eq!(bad.problem, "names no parameter");
        for format in ["g", ".6g", ".f", ".99e", "6"] {
            let bad = check(&format!("{{k1:{format}}}")).unwrap_err();
            assert_eq!(bad.problem, "has an unknown format", "{format}");
        }
        let names: Vec<String> =
            Template::parse("{k1} {b.c:e}").names().map(str::to_owned).collect();
        assert_eq!(names, ["k1", "b.c"]);
    }

    #[test]
    fn numbers_read_back_as_the_same_number() {
        for x in [0.0, -1.5, 1e-5, 9.99e-6, 1e15, 123_456_789.123, f64::MIN_POSITIVE] {
            assert_eq!(shortest(x).parse::<f64>().unwrap(), x);
        }
    }
}
