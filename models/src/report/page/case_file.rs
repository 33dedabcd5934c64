//! Section with the settings of the run, the keys that differ from their defaults, and the whole case file.

use maud::{Markup, html};

use super::parts::{facts, table};
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    Some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "How it was made" }
            (facts(&results.settings))
            @if !results.changed_keys.is_empty() {
                h3 { "Keys that differ from their defaults" }
                (table(
                    html! { th { "key" } th.text { "value" } th.text { "default" } },
                    html! { @for changed in &results.changed_keys { tr {
                        td.path { (changed.key) }
                        td.path { (changed.value) }
                        td.path { @match &changed.default { Some(value) => (value), None => "none" } }
                    } } },
                ))
            }
            details {
                summary { "The case file, with every default filled in" }
                pre { (results.case_toml) }
            }
            // on paper, a closed section cannot be opened
            div.on-paper {
                h3 { "The case file, with every default filled in" }
                pre { (results.case_toml) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::ChangedKey;

    #[test]
    fn changed_keys_stand_beside_their_defaults_and_paper_has_the_case_too() {
        let changed = |key: &str, default: Option<&str>| ChangedKey {
            key: key.into(),
            value: "12".into(),
            default: default.map(str::to_owned),
        };
        let results = Results {
            case_toml: "the case".into(),
            changed_keys: vec![changed("design.runs", Some("100")), changed("test.steps", None)],
            ..Results::default()
        };
        let html = show(&results).into_string();
        let cells = |key: &str, default: &str| {
            format!(
                "<td class=\"path\">{key}</td><td class=\"path\">12</td><td class=\"path\">{default}</td>"
            )
        };
        assert!(html.contains(&cells("design.runs", "100")), "{html}");
        assert!(html.contains(&cells("test.steps", "none")), "{html}");
        let paper = html.split("on-paper").nth(1).unwrap_or_default();
        assert!(paper.contains("<pre>the case</pre>"), "{html}");
    }
}
