//! Elements of the sections of a page.

use maud::{Markup, PreEscaped, html};

use crate::report::data_uri;
use crate::report::figures::Place;
use crate::report::results::PictureContent;

/// A picture with its caption below.
pub(super) fn captioned(content: &PictureContent, caption: &str) -> Markup {
    html! {
        figure {
            @match content {
                PictureContent::Svg(svg) => (PreEscaped(svg)),
                PictureContent::Png(bytes) => (image(bytes, caption)),
            }
            figcaption { (caption) }
        }
    }
}

pub(super) fn image(png: &[u8], shows: &str) -> Markup {
    html! { img src=(data_uri::of_png(png)) alt=(shows); }
}

/// A figure with its caption below.
pub(super) fn figure(svg: &str, caption: Markup) -> Markup {
    html! { figure { (PreEscaped(svg)) figcaption { (caption) } } }
}

/// Panels side by side, wrapped to the width of the page, with their caption below.
pub(super) fn panels(svgs: &[String], caption: Markup) -> Markup {
    html! {
        figure {
            div.panels { @for svg in svgs { (PreEscaped(svg)) } }
            figcaption { (caption) }
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

/// A matrix of panels. A narrow page omits the panels above the diagonal and shows two panels per row.
pub(super) fn pairs(matrix: &[(Place, String)], caption: Markup) -> Markup {
    let columns = matrix.iter().filter(|(place, _)| *place == Place::Diagonal).count();
    let class = |place: Place| match place {
        Place::Above => "above",
        Place::Diagonal | Place::Below => "kept",
    };
    html! {
        figure {
            div.pairs style={ "--columns: " (columns) } {
                @for (place, svg) in matrix { div class=(class(*place)) { (PreEscaped(svg)) } }
            }
            figcaption { (caption) }
        }
    }
}
