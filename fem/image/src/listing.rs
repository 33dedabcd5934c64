//! Lists of examples in messages.

/// Largest number of items that a message lists.
const LISTED: usize = 5;

/// Joins the first five items of a list, and appends the number of the other items.
///
/// # Example
/// ```
/// use fem_image::listed;
///
/// assert_eq!(listed((1..=2).map(|n| n.to_string()), ", "), "1, 2");
/// assert_eq!(listed((1..=8).map(|n| n.to_string()), ", "), "1, 2, 3, 4, 5 and 3 others");
/// ```
pub fn listed(items: impl IntoIterator<Item = impl AsRef<str>>, separator: &str) -> String {
    let mut items = items.into_iter();
    let mut text = String::new();
    for (n, item) in items.by_ref().take(LISTED).enumerate() {
        if n > 0 {
            text.push_str(separator);
        }
        text.push_str(item.as_ref());
    }
    match items.count() {
        0 => text,
        1 => text + " and 1 other",
        others => format!("{text} and {others} others"),
    }
}
