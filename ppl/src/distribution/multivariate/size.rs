//! Sizes of vectors and matrices: in their type, or known at run time only.

use std::fmt::Debug;
use std::ops::IndexMut;

use crate::datum::Recordable;

/// An entry of a vector or a matrix.
pub trait MatrixEntry: Copy + Debug + Recordable {}

impl<T: Copy + Debug + Recordable> MatrixEntry for T {}

/// The size of a matrix, and what vectors and matrices of this size are kept in. What is written over
/// a size is compiled for [`Fixed`] ones as for arrays: loops are unrolled, nothing is allocated.
pub trait Size: Copy + Debug {
    /// The size, if the type tells; the largest number otherwise.
    const AT_MOST: usize;

    /// As many numbers.
    type Vector<T: MatrixEntry>: Clone
        + Debug
        + Recordable
        + AsRef<[T]>
        + IndexMut<usize, Output = T>;

    /// As many rows of as many numbers.
    type Matrix<T: MatrixEntry>: Clone
        + Debug
        + Recordable
        + IndexMut<usize, Output: IndexMut<usize, Output = T> + AsRef<[T]>>;

    /// The size.
    fn get(self) -> usize;

    /// A vector, entry by entry.
    fn vector<T: MatrixEntry>(self, entry: impl FnMut(usize) -> T) -> Self::Vector<T>;

    /// A matrix of the same number everywhere.
    fn filled<T: MatrixEntry>(self, value: T) -> Self::Matrix<T>;
}

/// A size in the type.
#[derive(Clone, Copy, Debug)]
pub struct Fixed<const K: usize>;

/// A size that comes from the data.
#[derive(Clone, Copy, Debug)]
pub struct Free(pub usize);

impl<const K: usize> Size for Fixed<K> {
    const AT_MOST: usize = K;
    type Vector<T: MatrixEntry> = [T; K];
    type Matrix<T: MatrixEntry> = [[T; K]; K];

    #[inline(always)]
    fn get(self) -> usize {
        K
    }

    #[inline(always)]
    fn vector<T: MatrixEntry>(self, entry: impl FnMut(usize) -> T) -> [T; K] {
        std::array::from_fn(entry)
    }

    #[inline(always)]
    fn filled<T: MatrixEntry>(self, value: T) -> [[T; K]; K] {
        [[value; K]; K]
    }
}

impl Size for Free {
    const AT_MOST: usize = usize::MAX;
    type Vector<T: MatrixEntry> = Vec<T>;
    type Matrix<T: MatrixEntry> = Vec<Vec<T>>;

    fn get(self) -> usize {
        self.0
    }

    fn vector<T: MatrixEntry>(self, entry: impl FnMut(usize) -> T) -> Vec<T> {
        (0..self.0).map(entry).collect()
    }

    fn filled<T: MatrixEntry>(self, value: T) -> Vec<Vec<T>> {
        vec![vec![value; self.0]; self.0]
    }
}
