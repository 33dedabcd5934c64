//! Disjoint sets of numbered items: union–find.

/// Disjoint sets of the items 0, 1, … (a disjoint-set forest). Sets can be joined but not split.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    /// Parent of each item; a root is its own parent.
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Creates one set per item.
    pub fn new(items: usize) -> Self {
        DisjointSets { parent: (0..items as u32).collect() }
    }

    /// Returns the root of the set that contains an item.
    pub fn root(&mut self, mut item: u32) -> u32 {
        while self.parent[item as usize] != item {
            let parent = self.parent[item as usize];
            self.parent[item as usize] = self.parent[parent as usize];
            item = self.parent[item as usize];
        }
        item
    }

    /// Joins the sets of two items. The root with the lower index stays a root, so that the roots do not depend on the
    /// order of the calls.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.attach(a.max(b), a.min(b));
    }

    /// Joins the set whose root is `root` to the set that contains `other`. Afterwards, `other` is an ancestor of
    /// `root`.
    pub fn attach(&mut self, root: u32, other: u32) {
        self.parent[root as usize] = other;
    }
}
