//! HTML page around the content of a report, with an embedded style sheet.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::style::named_clips;

/// Returns a self-contained HTML page for screens, phones, paper and dark mode. The names of the clip paths in its
/// figures start with `clips`.
pub(super) fn document(title: &str, clips: &str, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body { main {
                h1 { (title) }
                (content)
            } }
        }
    };
    named_clips(&page.into_string(), clips)
}
