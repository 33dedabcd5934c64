//! Snapshots of the expansions of the models in the README and on the first page of `ppl`. Reviewers can read the
//! committed snapshots. Accept a change with `INSTA_UPDATE=always cargo test -p ppl-macros`.

use proc_macro2::{Group, TokenStream, TokenTree};

use crate::expand;

const README: &str = include_str!("../../../README.md");
const FIRST_PAGE: &str = include_str!("../../../ppl/src/lib.rs");

/// Returns the tokens inside `model! { … }` from the fenced block of `text` that contains `name`.
fn model(text: &str, name: &str) -> TokenStream {
    let is_comment = text.starts_with("//!");
    let plain = |line: &str| line.strip_prefix("//!").unwrap_or(line).to_owned();
    let lines: Vec<String> = text
        .lines()
        .filter(|line| !is_comment || line.starts_with("//!"))
        .map(|line| if is_comment { plain(line) } else { line.to_owned() })
        .collect();
    let text = lines.join("\n");
    let fences: Vec<&str> = text.split("```").skip(1).step_by(2).collect();
    let fence = fences.iter().find(|fence| fence.contains(name)).expect("a fence with the model");
    let code = fence.trim_start_matches("rust").replace("\n # ", "\n ");
    let tokens: TokenStream = code.parse().expect("tokens of Rust");
    let trees: Vec<TokenTree> = tokens.into_iter().collect();
    let is_macro = |pair: &&[TokenTree]| pair[0].to_string() == "model";
    let invocation = trees.windows(3).find(is_macro).expect("a `model!`");
    let TokenTree::Group(group) = &invocation[2] else { panic!("braces follow `model!`") };
    Group::stream(group)
}

fn expanded(text: &str, name: &str) -> String {
    let tokens = expand(model(text, name));
    prettyplease::unparse(&syn::parse2(tokens).expect("the expansion is Rust"))
}

macro_rules! expansion {
    ($test:ident, $text:expr, $name:expr) => {
        #[test]
        fn $test() {
            insta::with_settings!({
                snapshot_path => "../snapshots",
                prepend_module_to_snapshot => false,
                omit_expression => true,
            }, {
                insta::assert_snapshot!(stringify!($test), expanded($text, $name));
            });
        }
    };
}
expansion!(calibration, README, "fn calibration(");
expansion!(mooney_rivlin, README, "fn mooney_rivlin(");
expansion!(spring, FIRST_PAGE, "fn spring(");
