//! Order of slices by the numbers in their file names, and detection of gaps in these numbers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::ImageError;

/// Maximum number of digits of a number; a longer sequence of digits counts as text.
const MOST_DIGITS: usize = 30;

/// Files in the order of their slices.
#[derive(Debug)]
pub(crate) struct Ordered {
    pub(crate) paths: Vec<PathBuf>,
    /// Difference between the numbers in the names of consecutive slices.
    pub(crate) step: i128,
    /// A warning about the numbers in the file names, if any.
    pub(crate) note: Option<String>,
}

/// Returns the name of a file without its folder.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Sorts the files of one folder by the number of the slice, which is one of the numbers in each file name.
///
/// # Errors
/// [`ImageError::Series`]: names without numbers, names of several patterns or several series, a missing or repeated
/// number.
pub(crate) fn order(folder: &Path, paths: Vec<PathBuf>) -> Result<Ordered, ImageError> {
    if paths.len() < 2 {
        return Ok(Ordered { paths, step: 1, note: None });
    }
    let refuse = |message: String, help| ImageError::Series { path: folder.into(), message, help };
    let names = one_pattern(paths.into_iter().map(Name::of).collect()).map_err(|message| {
        refuse(
            message,
            "keep only the slices of one scan in the folder, without copies or other images",
        )
    })?;
    let columns = columns(&names);
    if columns.is_empty() {
        let [first, second] = [0, 1].map(|n| file_name(&names[n].path));
        let message = format!("names without numbers ({first}, {second}) have no order");
        return Err(refuse(message, "number the slices"));
    }
    let distinct =
        |column: &&Vec<i128>| column.iter().collect::<BTreeSet<_>>().len() == names.len();
    let counting: Vec<&Vec<i128>> = columns.iter().filter(distinct).collect();
    if counting.is_empty() {
        let (message, help) = repeated(&names, &columns);
        return Err(refuse(message, help));
    }
    let regular: Vec<&Vec<i128>> =
        counting.iter().copied().filter(|column| step(column).is_some()).collect();
    let Some(&column) = regular.last() else {
        let column = counting[counting.len() - 1];
        let message = gap(&names, column);
        let help = "copy or write the missing slices again; if no slice is missing, number the slices without gaps";
        return Err(refuse(message, help));
    };
    if let Some(other) = regular.iter().find(|other| !same_order(other, column)) {
        let at = |column: &[i128]| {
            let least = (0..column.len()).min_by_key(|&n| column[n]).unwrap_or(0);
            file_name(&names[least].path)
        };
        let message = format!(
            "two numbers in the names order the slices differently: {} or {} would be the first",
            at(other),
            at(column)
        );
        return Err(refuse(message, "use only one number in the names of the slices"));
    }
    let step = step(column).unwrap_or(1);
    let note = series_note(&columns, column);
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_key(|&n| column[n]);
    Ok(Ordered { paths: order.into_iter().map(|n| names[n].path.clone()).collect(), step, note })
}

/// A file name split into numbers and the texts around the numbers.
#[derive(Debug)]
struct Name {
    path: PathBuf,
    texts: Vec<String>,
    /// Sign and absolute value of each number.
    numbers: Vec<(Option<char>, i128)>,
}

impl Name {
    fn of(path: PathBuf) -> Self {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (mut texts, mut numbers, mut text) = (Vec::new(), Vec::new(), String::new());
        let mut rest = stem.as_str();
        while let Some(first) = rest.chars().next() {
            let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
            if digits == 0 {
                text.push(first);
                rest = &rest[first.len_utf8()..];
                continue;
            }
            let (number, after) = rest.split_at(digits);
            rest = after;
            match number.parse::<i128>() {
                Ok(value) if digits <= MOST_DIGITS => {
                    // a `-` directly between two numbers is a dash, not a sign
                    let may_be_signed = numbers.is_empty() || text.chars().count() > 1;
                    let sign =
                        text.chars().last().filter(|c| may_be_signed && matches!(c, '+' | '-'));
                    if sign.is_some() {
                        text.pop();
                    }
                    numbers.push((sign, value));
                    texts.push(std::mem::take(&mut text));
                }
                _ => text.push_str(number),
            }
        }
        texts.push(text);
        Self { path, texts, numbers }
    }

    fn pattern(&self) -> String {
        self.texts.join("#")
    }
}

/// Returns the names if they differ only in their numbers, otherwise a message about the different patterns.
fn one_pattern(names: Vec<Name>) -> Result<Vec<Name>, String> {
    let mut groups: BTreeMap<String, Vec<&Name>> = BTreeMap::new();
    names.iter().for_each(|name| groups.entry(name.pattern()).or_default().push(name));
    if groups.len() == 1 {
        return Ok(names);
    }
    let mut groups: Vec<Vec<&Name>> = groups.into_values().collect();
    groups.sort_by_key(|group| std::cmp::Reverse(group.len()));
    let shown = |group: &Vec<&Name>| {
        let first = file_name(&group[0].path);
        match group.len() {
            1 => first,
            files => format!("{files} files such as {first}"),
        }
    };
    let mut all: Vec<String> = groups.iter().take(3).map(shown).collect();
    if groups.len() > 3 {
        all.push(format!("{} other patterns", groups.len() - 3));
    }
    Err(format!("the names do not belong to one series: {}", all.join(", ")))
}

/// Returns the values of each number in the names, over all files. A `-` or `+` before a number is a sign only if the
/// names differ in this character (a name without it counts as different); otherwise the character is part of the text.
fn columns(names: &[Name]) -> Vec<Vec<i128>> {
    let count = names[0].numbers.len();
    (0..count)
        .map(|field| {
            let signs: BTreeSet<Option<char>> =
                names.iter().map(|name| name.numbers[field].0).collect();
            let value = |name: &Name| match name.numbers[field] {
                (Some('-'), value) if signs.len() > 1 => -value,
                (_, value) => value,
            };
            names.iter().map(value).collect()
        })
        .collect()
}

/// Returns the difference between consecutive sorted values, or `None` if the differences vary.
fn step(column: &[i128]) -> Option<i128> {
    let mut sorted = column.to_vec();
    sorted.sort_unstable();
    let step = sorted[1] - sorted[0];
    sorted.windows(2).all(|pair| pair[1] - pair[0] == step).then_some(step)
}

/// Returns whether two numbers in the names sort the files in the same order or in reverse order. A column contains the
/// values of one number, one per file.
fn same_order(a: &[i128], b: &[i128]) -> bool {
    let sorted_by = |column: &[i128]| {
        let mut order: Vec<usize> = (0..column.len()).collect();
        order.sort_by_key(|&n| column[n]);
        order
    };
    let (a, b) = (sorted_by(a), sorted_by(b));
    a == b || a.iter().rev().eq(&b)
}

/// Returns message and advice for file names in which no number is different in every file.
fn repeated(names: &[Name], columns: &[Vec<i128>]) -> (String, &'static str) {
    let varied = |column: &&Vec<i128>| column.iter().collect::<BTreeSet<_>>().len() > 1;
    let varying: Vec<&Vec<i128>> = columns.iter().filter(varied).collect();
    let richest = columns.iter().max_by_key(|column| column.iter().collect::<BTreeSet<_>>().len());
    let column = richest.unwrap_or(&columns[0]);
    let mut seen: BTreeMap<i128, usize> = BTreeMap::new();
    let twice = (0..column.len()).find_map(|n| seen.insert(column[n], n).map(|before| (before, n)));
    let (first, second) = twice.unwrap_or((0, 1));
    let mut pair = [first, second].map(|n| file_name(&names[n].path));
    pair.sort();
    let [a, b] = pair;
    if varying.len() > 1 {
        let message = format!(
            "several numbers vary in the names, so {a} and {b} are probably the same slice of two series"
        );
        (message, "keep only the slices of one scan, one channel and one time in the folder")
    } else {
        (format!("{a} and {b} have the same number"), "keep one file for each slice")
    }
}

/// Returns a message about the first gap in the numbers.
fn gap(names: &[Name], column: &[i128]) -> String {
    let mut order: Vec<usize> = (0..column.len()).collect();
    order.sort_by_key(|&n| column[n]);
    let mut counts: BTreeMap<i128, usize> = BTreeMap::new();
    order.windows(2).for_each(|w| *counts.entry(column[w[1]] - column[w[0]]).or_default() += 1);
    let usual = counts.iter().max_by_key(|(step, count)| (**count, std::cmp::Reverse(**step)));
    let usual = usual.map_or(1, |(step, _)| *step);
    let differs = |w: &&[usize]| column[w[1]] - column[w[0]] != usual;
    let Some(at) = order.windows(2).find(differs) else { return String::new() };
    let [before, after] = [at[0], at[1]].map(|n| file_name(&names[n].path));
    let difference = column[at[1]] - column[at[0]];
    let all: i128 = order
        .windows(2)
        .map(|w| column[w[1]] - column[w[0]])
        .filter(|difference| difference % usual == 0)
        .map(|difference| difference / usual - 1)
        .sum();
    if difference % usual == 0 {
        let missing = difference / usual - 1;
        format!(
            "{before} is followed by {after}; missing slices between them: {missing}, in the whole folder: {all}"
        )
    } else {
        format!(
            "{before} is followed by {after}: the numbers of the slices do not increase in equal steps"
        )
    }
}

/// Returns a warning if another number in the names divides the files into parts, for example into two scans whose
/// slices are numbered consecutively.
fn series_note(columns: &[Vec<i128>], counting: &[i128]) -> Option<String> {
    let values = |column: &Vec<i128>| column.iter().collect::<BTreeSet<_>>().len();
    let parts = columns
        .iter()
        .filter(|column| column.as_slice() != counting)
        .map(values)
        .find(|&values| values > 1 && values * 2 <= counting.len())?;
    Some(format!(
        "Grains are wrong if the folder contains slices of several scans: a second number in the names has {parts} values."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ordered(names: &[&str]) -> Result<Vec<String>, String> {
        let paths = names.iter().map(PathBuf::from).collect();
        let ordered = order(Path::new("scan"), paths).map_err(|error| error.to_string())?;
        Ok(ordered.paths.iter().map(|path| file_name(path)).collect())
    }

    #[test]
    fn slices_are_ordered_by_number() {
        for (names, expected) in [
            (vec!["s10.tif", "s9.tif", "s8.tif"], vec!["s8.tif", "s9.tif", "s10.tif"]),
            (vec!["a2_10.tif", "a2_9.tif"], vec!["a2_9.tif", "a2_10.tif"]),
            (
                vec!["z+1.tif", "z-1.tif", "z0.tif", "z-2.tif"],
                vec!["z-2.tif", "z-1.tif", "z0.tif", "z+1.tif"],
            ),
            // the `-` is a dash and not a sign, because all names contain a `-`
            (vec!["z-3.tif", "z-1.tif", "z-2.tif"], vec!["z-1.tif", "z-2.tif", "z-3.tif"]),
            (vec!["a_64-127.tif", "a_0-63.tif"], vec!["a_0-63.tif", "a_64-127.tif"]),
            // each name has a counter and a time of day; the steps of the time vary
            (
                vec!["i2_101500.tif", "i1_101458.tif", "i3_101507.tif"],
                vec!["i1_101458.tif", "i2_101500.tif", "i3_101507.tif"],
            ),
            (vec!["only.tif"], vec!["only.tif"]),
        ] {
            let order = ordered(&names).unwrap();
            assert_eq!(order, expected);
        }
    }

    #[test]
    fn names_of_several_series_are_refused() {
        for (names, parts) in [
            (
                vec!["s1.tif", "s2.tif", "s4.tif"],
                ["s2.tif is followed by s4.tif", "missing slices between them: 1"],
            ),
            (vec!["s1.tif", "s2.tif", "s2 (1).tif"], ["one series", "s2 (1).tif"]),
            (
                vec!["a1.tif", "a2.tif", "b1.tif", "b2.tif"],
                ["2 files such as a1.tif", "2 files such as b1.tif"],
            ),
            (
                vec!["a1_1.tif", "a1_2.tif", "a2_1.tif", "a2_2.tif"],
                ["several numbers vary", "a1_1.tif and a2_1.tif"],
            ),
            (vec!["s1.tif", "s01.tif", "s2.tif"], ["s01.tif and s1.tif", "same number"]),
            (vec!["a.tif", "b.tif"], ["names do not belong to one series", "a.tif"]),
            (vec!["1_3.tif", "2_1.tif", "3_2.tif"], ["order the slices differently", "one number"]),
        ] {
            let error = ordered(&names).unwrap_err();
            assert!(parts.iter().all(|part| error.contains(part)), "{names:?}: {error}");
        }
    }
}
