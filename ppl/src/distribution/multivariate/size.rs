//! Sizes of vectors and matrices, known at compile time or at run time.

use std::fmt::Debug;
use std::ops::IndexMut;

use crate::quantity::datum::Recordable;

/// An entry of a vector or a matrix.
pub trait MatrixEntry: Copy + Debug + Recordable {}

impl<T: Copy + Debug + Recordable> MatrixEntry for T {}

/// Size of a matrix, with the types of its vectors and matrices. Code that is generic over `Size` compiles to array
/// code for [`Fixed`] sizes: loops are unrolled, and nothing is allocated.
pub trait Size: Copy + Debug {
    /// The size K if it is known at compile time, otherwise `usize::MAX`.
    const AT_MOST: usize;

    /// Vector whose number of entries is this size.
    type Vector<T: MatrixEntry>: Clone
        + Debug
        + Recordable
        + AsRef<[T]>
        + IndexMut<usize, Output = T>;

    /// Square matrix whose number of rows is this size.
    type Matrix<T: MatrixEntry>: Clone
        + Debug
        + Recordable
        + IndexMut<usize, Output: IndexMut<usize, Output = T> + AsRef<[T]>>;

    /// Returns the size as a number.
    fn get(self) -> usize;

    /// Creates the vector whose entry `i` is `entry(i)`.
    fn vector<T: MatrixEntry>(self, entry: impl FnMut(usize) -> T) -> Self::Vector<T>;

    /// Creates a matrix whose entries are all `value`.
    fn filled<T: MatrixEntry>(self, value: T) -> Self::Matrix<T>;
}

/// Size known at compile time.
#[derive(Clone, Copy, Debug)]
pub struct Fixed<const K: usize>;

/// Size known only at run time.
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
