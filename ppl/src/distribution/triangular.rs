//! Lower triangular matrices of plain numbers; what stands above the diagonal is not read.

type Matrix<const K: usize> = [[f64; K]; K];

fn lower<const K: usize>(mut entry: impl FnMut(usize, usize) -> f64) -> Matrix<K> {
    let mut matrix = [[0.0; K]; K];
    for (i, row) in matrix.iter_mut().enumerate() {
        row[..=i].iter_mut().enumerate().for_each(|(j, x)| *x = entry(i, j));
    }
    matrix
}

/// A B.
pub(super) fn product<const K: usize>(a: &Matrix<K>, b: &Matrix<K>) -> Matrix<K> {
    lower(|i, j| (j..=i).map(|k| a[i][k] * b[k][j]).sum())
}

/// A⁻¹ B.
pub(super) fn solve<const K: usize>(a: &Matrix<K>, b: &Matrix<K>) -> Matrix<K> {
    let mut x = [[0.0; K]; K];
    for i in 0..K {
        for j in 0..=i {
            let known: f64 = (j..i).map(|k| a[i][k] * x[k][j]).sum();
            x[i][j] = (b[i][j] - known) / a[i][i];
        }
    }
    x
}

/// The lower triangle of A⁻ᵀ B.
pub(super) fn solve_transposed<const K: usize>(a: &Matrix<K>, b: &Matrix<K>) -> Matrix<K> {
    let mut x = [[0.0; K]; K];
    for i in (0..K).rev() {
        for j in 0..=i {
            let known: f64 = (i + 1..K).map(|k| a[k][i] * x[k][j]).sum();
            x[i][j] = (b[i][j] - known) / a[i][i];
        }
    }
    x
}

/// The lower triangle of A Bᵀ.
pub(super) fn product_transposed<const K: usize>(a: &Matrix<K>, b: &Matrix<K>) -> Matrix<K> {
    lower(|i, j| (0..=j).map(|k| a[i][k] * b[j][k]).sum())
}
