//! Patterns for names of products: `#` stands for a number, `*` for any text without a slash.

/// Whether a name, with `/` between folders, matches the pattern.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let Some(at) = pattern.find(['#', '*']) else { return pattern == name };
    let Some(rest) = name.strip_prefix(&pattern[..at]) else { return false };
    let is_number = pattern[at..].starts_with('#');
    let stands_for = |c: char| if is_number { c.is_ascii_digit() } else { c != '/' };
    let longest = rest.find(|c| !stands_for(c)).unwrap_or(rest.len());
    let ends = rest.char_indices().map(|(end, _)| end).chain([rest.len()]);
    let shortest = usize::from(is_number);
    ends.filter(|end| (shortest..=longest).contains(end))
        .any(|end| matches(&pattern[at + 1..], &rest[end..]))
}

/// Returns the folder of the names that match a pattern; empty for the results folder itself.
pub(crate) fn folder(pattern: &str) -> &str {
    pattern.rsplit_once('/').map_or("", |(folder, _)| folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_digits_and_a_star_ends_at_a_slash() {
        for (pattern, name) in [
            ("mesh.msh", "mesh.msh"),
            ("curves/run-#.csv", "curves/run-001.csv"),
            ("curves/level-#-run-#.csv", "curves/level-2-run-013.csv"),
            ("experiments/curves/*.csv", "experiments/curves/mix A 1.csv"),
            ("experiments/curves/*.csv", "experiments/curves/a.csv.csv"),
            ("experiments/curves/*.csv", "experiments/curves/ü.csv"),
        ] {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("mesh.msh", "mesh.msh.bak"),
            ("curves/run-#.csv", "curves/run-.csv"),
            ("curves/run-#.csv", "curves/run-1a.csv"),
            ("curves/run-#.csv", "curves/rerun-1.csv"),
            ("experiments/curves/*.csv", "experiments/curves/a/b.csv"),
        ] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
        assert_eq!([folder("curves/run-#.csv"), folder("mesh.msh")], ["curves", ""]);
    }
}
