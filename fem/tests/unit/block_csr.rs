//! Products of block-sparse matrices, compared with dense products.

use super::*;

/// Block-sparse matrix whose entries are a function of row and column.
fn sample<const R: usize, const C: usize>(rows: usize, columns: usize) -> BlockCsr<f64, R, C> {
    let (mut start, mut column, mut block) = (vec![0], vec![], vec![]);
    for row in 0..rows {
        for c in (0..columns).filter(|c| (row * 7 + c * 3) % 4 != 0) {
            column.push(c as u32);
            block.push(std::array::from_fn(|i| {
                std::array::from_fn(|j| ((row + 2 * i) as f64 - 1.3 * (c + j) as f64).sin())
            }));
        }
        start.push(column.len() as u32);
    }
    BlockCsr { columns, start, column, block }
}

fn dense<const R: usize, const C: usize>(a: &BlockCsr<f64, R, C>) -> nalgebra::DMatrix<f64> {
    let mut out = nalgebra::DMatrix::zeros(R * a.rows(), C * a.columns);
    for row in 0..a.rows() {
        for (c, b) in a.row(row) {
            for i in 0..R {
                for j in 0..C {
                    out[(R * row + i, C * c + j)] = b[i][j];
                }
            }
        }
    }
    out
}

#[test]
fn products_and_transposes_equal_dense_products_and_transposes() {
    // more rows than one parallel task processes
    let (a, b) = (sample::<3, 6>(1100, 4), sample::<6, 2>(4, 7));
    assert!((dense(&a.multiply(&b)) - dense(&a) * dense(&b)).amax() < 1e-13);
    assert_eq!(dense(&a.transpose()), dense(&a).transpose());
    let x: Vec<[f32; 6]> = (0..4).map(|i| std::array::from_fn(|j| (i * j) as f32 - 2.0)).collect();
    let mut y = vec![[1.0f32; 3]; 1100];
    a.narrow().apply(&x, &mut y, |y, ax| (0..3).for_each(|i| y[i] -= ax[i]));
    let flat = nalgebra::DVector::from_iterator(24, x.iter().flatten().map(|&v| f64::from(v)));
    let expected = dense(&a) * flat;
    for (y, e) in y.iter().flatten().zip(expected.iter()) {
        assert!((f64::from(*y) - (1.0 - e)).abs() < 1e-4);
    }
}

#[test]
fn invertible_parts_of_blocks_are_inverted() {
    let block = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
    let unit = inverse(&inverse(&block));
    for i in 0..3 {
        for j in 0..3 {
            assert!((unit[i][j] - block[i][j]).abs() < 1e-13);
        }
    }
    assert_eq!(inverse(&[[2.0, 0.0], [0.0, 0.0]]), [[0.5, 0.0], [0.0, 0.0]]);
}
