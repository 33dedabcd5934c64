//! Labels of the entries along named dimensions.

use std::ops::Index;

/// Labels of the entries along dimensions, sorted by the name of the dimension.
///
/// The labels are stored in a vector and not in a map, because every crate with a model would compile the destructor
/// of a map again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coordinates(Vec<(String, Vec<String>)>);

impl Coordinates {
    fn position(&self, dimension: &str) -> Result<usize, usize> {
        self.0.binary_search_by(|(name, _)| name.as_str().cmp(dimension))
    }

    /// Whether no dimension has labels.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the labels along `dimension`; `None` if the dimension has no labels.
    pub fn get(&self, dimension: &str) -> Option<&Vec<String>> {
        self.position(dimension).ok().map(|index| &self.0[index].1)
    }

    /// Iterator over all dimensions with labels.
    pub fn iter(&self) -> std::slice::Iter<'_, (String, Vec<String>)> {
        self.0.iter()
    }

    /// Returns the labels along `dimension` for modification. Inserts an empty list if the dimension has no labels.
    pub(crate) fn labels(&mut self, dimension: &str) -> &mut Vec<String> {
        let index = self.position(dimension).unwrap_or_else(|index| {
            self.0.insert(index, (dimension.to_owned(), Vec::new()));
            index
        });
        &mut self.0[index].1
    }
}

impl<'a> IntoIterator for &'a Coordinates {
    type Item = &'a (String, Vec<String>);
    type IntoIter = std::slice::Iter<'a, (String, Vec<String>)>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Index<&str> for Coordinates {
    type Output = Vec<String>;

    /// # Panics
    /// If the dimension has no labels.
    fn index(&self, dimension: &str) -> &Vec<String> {
        self.get(dimension).expect("a dimension with labels")
    }
}
