//! Where the element blocks go in the sparse matrix: found once, used by every assembly.

use std::collections::BTreeSet;

use super::element::Block;
use super::unknowns::{NONE, Unknowns};

/// The lower triangle of the tangent, column by column, and the place of every element entry.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    pub(crate) size: usize,
    pub(crate) column_start: Vec<usize>,
    pub(crate) row: Vec<usize>,
    /// Element after element, the places of its lower triangle; a prescribed value's place is one
    /// past the end, so that scattering needs no branch.
    place: Vec<u32>,
    /// Entries of one element's lower triangle.
    entries: usize,
}

impl Pattern {
    /// The pattern of a mesh whose elements couple all their nodes.
    pub(crate) fn new<const N: usize>(tets: &[[u32; N]], unknowns: &Unknowns) -> Self {
        let neighbours = neighbours(tets, unknowns.equation.len());
        let mut rows_of: Vec<Vec<usize>> = vec![Vec::new(); unknowns.count];
        for (node, near) in neighbours.iter().enumerate() {
            let mut rows: Vec<usize> = near
                .iter()
                .flat_map(|&m| unknowns.equation[m])
                .filter(|&e| e != NONE)
                .map(|e| e as usize)
                .collect();
            rows.sort_unstable();
            for column in
                unknowns.equation[node].into_iter().filter(|&e| e != NONE).map(|e| e as usize)
            {
                rows_of[column] = rows[rows.partition_point(|&r| r < column)..].to_vec();
            }
        }
        let mut column_start = Vec::with_capacity(unknowns.count + 1);
        column_start.push(0);
        let mut row = Vec::new();
        for rows in rows_of {
            row.extend(rows);
            column_start.push(row.len());
        }
        let entries = 4 * N * (4 * N + 1) / 2;
        let mut place = Vec::with_capacity(entries * tets.len());
        for nodes in tets {
            let equation = |local: usize| unknowns.equation[nodes[local / 4] as usize][local % 4];
            for (i, j) in lower_triangle::<N>() {
                let (e, f) = (equation(i), equation(j));
                place.push(if e == NONE || f == NONE {
                    row.len() as u32
                } else {
                    let (column, line) = (e.min(f) as usize, e.max(f) as usize);
                    let start = column_start[column];
                    let rows = &row[start..column_start[column + 1]];
                    (start + rows.partition_point(|&r| r < line)) as u32
                });
            }
        }
        Self { size: unknowns.count, column_start, row, place, entries }
    }

    /// Entries of the lower triangle.
    pub(crate) fn len(&self) -> usize {
        self.row.len()
    }

    /// Adds the lower triangle of one element to `values`, which has [`len`](Self::len) + 1 places.
    pub(crate) fn add<const N: usize>(
        &self,
        tet: usize,
        blocks: &[[Block; N]; N],
        values: &mut [f64],
    ) {
        let places = &self.place[tet * self.entries..(tet + 1) * self.entries];
        for (&place, (i, j)) in places.iter().zip(lower_triangle::<N>()) {
            values[place as usize] += blocks[i / 4][j / 4][i % 4][j % 4];
        }
    }
}

/// (row, column) of the lower triangle of a 4N × 4N matrix.
fn lower_triangle<const N: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..4 * N).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

/// The nodes that share an element with each node, itself included.
pub(crate) fn neighbours<const N: usize>(tets: &[[u32; N]], nodes: usize) -> Vec<BTreeSet<usize>> {
    let mut near = vec![BTreeSet::new(); nodes];
    for tet in tets {
        for &a in tet {
            near[a as usize].extend(tet.iter().map(|&b| b as usize));
        }
    }
    near
}
