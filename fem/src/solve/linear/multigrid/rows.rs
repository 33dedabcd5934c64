//! Exchange of sparse matrix rows between ranks, used while a hierarchy is created.
//!
//! Columns are numbered over all ranks. A rank stores the rows that it owns first, then the rows of its ghosts.

use super::block_csr::BlockCsr;
use crate::parallel::Halo;

type Rows<const R: usize, const C: usize> = BlockCsr<f64, R, C>;

/// Message that contains some matrix rows: the lengths of the rows, their columns and their blocks, as three lists.
struct Message<const R: usize, const C: usize> {
    lengths: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<[[f64; C]; R]>,
}

/// Sends the rows with the local numbers `rows_for(n)` to each neighbour n. Returns the rows received from each
/// neighbour.
fn exchange<'a, const R: usize, const C: usize>(
    halo: &'a Halo,
    rows: &Rows<R, C>,
    rows_for: impl Fn(usize) -> &'a [u32],
) -> Vec<Message<R, C>> {
    let (mut lengths, mut columns, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
    for neighbour in 0..halo.neighbours().len() {
        let (mut length, mut column, mut block) = (Vec::new(), Vec::new(), Vec::<f64>::new());
        for &row in rows_for(neighbour) {
            let (start, end) = (rows.start[row as usize], rows.start[row as usize + 1]);
            let range = start as usize..end as usize;
            length.push(end - start);
            column.extend_from_slice(&rows.column[range.clone()]);
            block.extend(rows.block[range].as_flattened().as_flattened());
        }
        lengths.push(length);
        columns.push(column);
        blocks.push(block);
    }
    let lists = halo.exchange(lengths).into_iter().zip(halo.exchange(columns));
    lists
        .zip(halo.exchange(blocks))
        .map(|((lengths, columns), blocks)| {
            let block = |entries: &[f64]| {
                std::array::from_fn(|i| std::array::from_fn(|j| entries[i * C + j]))
            };
            let blocks = blocks.chunks_exact(R * C).map(block).collect();
            Message { lengths, columns, blocks }
        })
        .collect()
}

/// Appends the rows of the ghosts, received from their owners, to the rows that this rank owns.
pub(super) fn with_ghosts<const R: usize, const C: usize>(
    mut rows: Rows<R, C>,
    halo: &Halo,
) -> Rows<R, C> {
    let received = exchange(halo, &rows, |n| &halo.neighbours()[n].lent);
    // one entry per row: number of the ghost, index of the message, start and end of the row's entries in the message
    let mut ghosts: Vec<(u32, usize, usize, usize)> = Vec::new();
    for (message, (neighbour, their)) in halo.neighbours().iter().zip(&received).enumerate() {
        let mut begin = 0;
        for (&ghost, &length) in neighbour.ghosts.iter().zip(&their.lengths) {
            ghosts.push((ghost, message, begin, begin + length as usize));
            begin += length as usize;
        }
    }
    ghosts.sort_unstable();
    for (_, message, begin, end) in ghosts {
        rows.column.extend_from_slice(&received[message].columns[begin..end]);
        rows.block.extend_from_slice(&received[message].blocks[begin..end]);
        rows.start.push(rows.column.len() as u32);
    }
    rows
}

/// Sums matrix contributions over all ranks, and returns the rows that this rank owns. `partial` is the contribution of
/// this rank to its owned rows and to the rows of its ghosts.
pub(super) fn completed<const R: usize, const C: usize>(
    partial: &Rows<R, C>,
    halo: &Halo,
) -> Rows<R, C> {
    let owned = halo.owned_ranges(partial.rows())[0].end;
    let received = exchange(halo, partial, |n| &halo.neighbours()[n].ghosts);
    let mut more: Vec<Vec<(u32, [[f64; C]; R])>> = vec![Vec::new(); owned];
    for (neighbour, rows) in halo.neighbours().iter().zip(received) {
        let mut entries = rows.columns.into_iter().zip(rows.blocks);
        for (&row, &length) in neighbour.lent.iter().zip(&rows.lengths) {
            more[row as usize].extend(entries.by_ref().take(length as usize));
        }
    }
    let mut sum =
        Rows { columns: partial.columns, start: vec![0], column: Vec::new(), block: Vec::new() };
    for (row, more) in more.into_iter().enumerate() {
        let begin = sum.column.len();
        let range = partial.start[row] as usize..partial.start[row + 1] as usize;
        sum.column.extend_from_slice(&partial.column[range.clone()]);
        sum.block.extend_from_slice(&partial.block[range]);
        for (column, block) in more {
            match sum.column[begin..].iter().position(|&c| c == column) {
                None => {
                    sum.column.push(column);
                    sum.block.push(block);
                }
                Some(position) => {
                    let to = sum.block[begin + position].as_flattened_mut();
                    to.iter_mut().zip(block.as_flattened()).for_each(|(to, &v)| *to += v);
                }
            }
        }
        sum.start.push(sum.column.len() as u32);
    }
    sum
}
