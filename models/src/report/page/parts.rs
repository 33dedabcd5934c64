//! Elements of the sections of a page.

use maud::{Markup, PreEscaped, html};

use crate::report::data_uri;
use crate::report::figures::Place;
use crate::report::results::{Picture, PictureContent};

/// Placeholder for the number of a figure, which [`numbered`] replaces. Text of the user cannot contain the
/// placeholder, because this text is escaped.
const NUMBER: &str = "<!--number of the figure-->";

/// Numbers the figures of a page in their order.
pub(super) fn numbered(page: &str) -> String {
    let mut pieces = page.split(NUMBER);
    let mut numbered = pieces.next().unwrap_or_default().to_owned();
    for (k, piece) in pieces.enumerate() {
        numbered += &format!("{}{piece}", k + 1);
    }
    numbered
}

/// Caption of a figure: the number of the figure, a description, and advice for the case that the
/// figure looks wrong.
pub(super) fn caption(shown: Markup, if_wrong: &str) -> Markup {
    html! {
        figcaption {
            b { "Figure " (PreEscaped(NUMBER)) ". " } (shown)
            span.wrong { b { "If it looks wrong: " } (if_wrong) }
        }
    }
}

/// A picture with its caption below.
pub(super) fn picture(picture: &Picture) -> Markup {
    html! {
        figure {
            @match &picture.content {
                PictureContent::Svg(svg) => (PreEscaped(svg)),
                PictureContent::Png(bytes) => (image(bytes, &picture.caption)),
            }
            (caption(html! { (picture.caption) }, picture.if_wrong))
        }
    }
}

pub(super) fn image(png: &[u8], shows: &str) -> Markup {
    html! { img src=(data_uri::of_png(png)) alt=(shows); }
}

/// A figure with its caption below.
pub(super) fn figure(svg: &str, shown: Markup, if_wrong: &str) -> Markup {
    html! { figure { (PreEscaped(svg)) (caption(shown, if_wrong)) } }
}

/// Panels side by side, wrapped to the width of the page, with their caption below.
pub(super) fn panels(svgs: &[String], shown: Markup, if_wrong: &str) -> Markup {
    html! {
        figure {
            div.panels { @for svg in svgs { (PreEscaped(svg)) } }
            (caption(shown, if_wrong))
        }
    }
}

/// A table with its own scroll bar if the page is too narrow.
pub(in crate::report) fn table(header: Markup, rows: Markup) -> Markup {
    html! {
        div.scroll { table { thead { tr { (header) } } tbody { (rows) } } }
    }
}

pub(super) fn facts(pairs: &[(String, String)]) -> Markup {
    html! {
        table.facts { tbody {
            @for (name, value) in pairs { tr { td.name { (name) } td { (value) } } }
        } }
    }
}

/// A matrix of panels. A narrow page omits the panels above the diagonal and shows one panel per row.
pub(super) fn pairs(matrix: &[(Place, String)], shown: Markup, if_wrong: &str) -> Markup {
    let columns = matrix.iter().filter(|(position, _)| *position == Place::Diagonal).count();
    let class = |position: Place| match position {
        Place::Above => "above",
        Place::Diagonal | Place::Below => "kept",
    };
    html! {
        figure {
            div.pairs style={ "--columns: " (columns) } {
                @for (position, svg) in matrix { div class=(class(*position)) { (PreEscaped(svg)) } }
            }
            (caption(shown, if_wrong))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_numbered_in_their_order() {
        let one = || figure("<svg></svg>", html! { "shown" }, "do this").into_string();
        let page = numbered(&format!("{}{}", one(), one()));
        assert_eq!(page.matches("<b>Figure 1. </b>shown").count(), 1, "{page}");
        assert_eq!(page.matches("<b>Figure 2. </b>shown").count(), 1, "{page}");
        assert!(
            page.contains("<b>If it looks wrong: </b>do this") && !page.contains("<!--"),
            "{page}"
        );
    }
}
