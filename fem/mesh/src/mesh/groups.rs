//! Members by group in compressed storage.

/// Members of each group in compressed (CSR) storage, for example the tetrahedra of each node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Groups {
    /// Offsets of the groups in `members`; length: number of groups + 1.
    pub start: Vec<u32>,
    /// Members of all groups, one group after the other.
    pub members: Vec<u32>,
}

impl Groups {
    /// Creates the groups from pairs (group, member). The members of a group have the order of the pairs.
    ///
    /// # Panics
    /// If a group number is not below `groups`.
    pub fn new(groups: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Groups {
        let mut start = vec![0; groups + 1];
        for (group, _) in pairs.clone() {
            start[group as usize + 1] += 1;
        }
        for group in 0..groups {
            start[group + 1] += start[group];
        }
        let (mut next, mut members) = (start.clone(), vec![0; start[groups] as usize]);
        for (group, member) in pairs {
            let index = &mut next[group as usize];
            members[*index as usize] = member;
            *index += 1;
        }
        Groups { start, members }
    }

    /// Creates the groups from a list of members per group.
    pub fn from_lists(lists: &[Vec<u32>]) -> Groups {
        let mut start = vec![0];
        start.extend(lists.iter().scan(0, |total, list| {
            *total += list.len() as u32;
            Some(*total)
        }));
        Groups { start, members: lists.concat() }
    }

    /// Returns the members of a group.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn of(&self, group: usize) -> &[u32] {
        &self.members[self.start[group] as usize..self.start[group + 1] as usize]
    }
}
