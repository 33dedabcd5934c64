//! The page: one self-contained HTML file that fits a screen, a phone, paper and the dark.

mod answer;
mod confirmation;
mod data;
mod posterior;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::data_uri;
use super::results::{PictureContent, Results};
use super::style::named_clips;

const STYLE: &str = include_str!("../style.css");

/// The report as HTML, figures inline.
pub(crate) fn page(results: &Results) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (results.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (results.title) }
                    (answer::parameters(results))
                    (answer::warnings(results))
                    (answer::budget(results))
                    (specimen(results))
                    (data::curves(results))
                    (data::surrogate(results))
                    (posterior::posterior(results))
                    (posterior::sampling(results))
                    (posterior::predictions(results))
                    (confirmation::confirmation(results))
                    (confirmation::damage(results))
                    (details(results))
                }
            }
        }
    };
    named_clips(&page.into_string(), "figure")
}

fn specimen(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Specimen" }
            div.gallery {
                @for picture in &results.pictures { (captioned(&picture.content, picture.caption)) }
            }
            div.gallery {
                @if !results.image_facts.is_empty() {
                    div { h3 { "Image" } (facts(&results.image_facts)) }
                }
                div { h3 { "Mesh" } (facts(&results.mesh_facts)) }
            }
        }
    }
}

fn details(results: &Results) -> Markup {
    html! {
        section {
            h2 { "How it was made" }
            (facts(&results.settings))
            details {
                summary { "The case file, with every default filled in" }
                pre { (results.case_toml) }
            }
        }
    }
}

/// A picture over what it shows.
fn captioned(content: &PictureContent, caption: &str) -> Markup {
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

fn image(png: &[u8], shows: &str) -> Markup {
    html! { img src=(data_uri::of_png(png)) alt=(shows); }
}

/// A figure over what it shows.
fn figure(svg: &str, caption: Markup) -> Markup {
    html! { figure { (PreEscaped(svg)) figcaption { (caption) } } }
}

/// Panels beside each other, as many as the page is wide, over what they show.
fn panels(svgs: &[String], caption: Markup) -> Markup {
    html! {
        figure {
            div.panels { @for svg in svgs { (PreEscaped(svg)) } }
            figcaption { (caption) }
        }
    }
}

/// A table that scrolls by itself where the page is too narrow for it.
fn table(header: Markup, rows: Markup) -> Markup {
    html! {
        div.scroll { table { thead { tr { (header) } } tbody { (rows) } } }
    }
}

fn facts(pairs: &[(String, String)]) -> Markup {
    html! {
        table.facts { tbody {
            @for (name, value) in pairs { tr { td.name { (name) } td { (value) } } }
        } }
    }
}
