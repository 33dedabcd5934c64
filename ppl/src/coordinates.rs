//! Labels of the entries along named dimensions.

use std::ops::Index;

/// Labels of the entries along dimensions, by the name of the dimension.
///
/// In the order of the names. No map: every crate with a model compiles the destructor anew.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coordinates(Vec<(String, Vec<String>)>);

impl Coordinates {
    fn position(&self, dimension: &str) -> Result<usize, usize> {
        self.0.binary_search_by(|(name, _)| name.as_str().cmp(dimension))
    }

    /// No dimension has labels.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The labels along `dimension`.
    pub fn get(&self, dimension: &str) -> Option<&Vec<String>> {
        self.position(dimension).ok().map(|index| &self.0[index].1)
    }

    /// All dimensions that have labels.
    pub fn iter(&self) -> std::slice::Iter<'_, (String, Vec<String>)> {
        self.0.iter()
    }

    /// The labels along `dimension`, to be written.
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
