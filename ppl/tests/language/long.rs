//! Formulas with too many terms for one Rust type.

use ppl::prelude::*;

use crate::densities::assert_same;

ppl::model! {
    fn written_out(x: &[f64; 72], y: &[f64]) {
        let b ~ Normal(0.0, 1.0).array::<72>();
        let mean = b[0] * x[0] + b[1] * x[1] + b[2] * x[2] + b[3] * x[3] + b[4] * x[4] + b[5] * x[5] + b[6] * x[6] + b[7] * x[7] + b[8] * x[8] + b[9] * x[9] + b[10] * x[10] + b[11] * x[11] + b[12] * x[12] + b[13] * x[13] + b[14] * x[14] + b[15] * x[15] + b[16] * x[16] + b[17] * x[17] + b[18] * x[18] + b[19] * x[19] + b[20] * x[20] + b[21] * x[21] + b[22] * x[22] + b[23] * x[23] + b[24] * x[24] + b[25] * x[25] + b[26] * x[26] + b[27] * x[27] + b[28] * x[28] + b[29] * x[29] + b[30] * x[30] + b[31] * x[31] + b[32] * x[32] + b[33] * x[33] + b[34] * x[34] + b[35] * x[35] + b[36] * x[36] + b[37] * x[37] + b[38] * x[38] + b[39] * x[39] + b[40] * x[40] + b[41] * x[41] + b[42] * x[42] + b[43] * x[43] + b[44] * x[44] + b[45] * x[45] + b[46] * x[46] + b[47] * x[47] + b[48] * x[48] + b[49] * x[49] + b[50] * x[50] + b[51] * x[51] + b[52] * x[52] + b[53] * x[53] + b[54] * x[54] + b[55] * x[55] + b[56] * x[56] + b[57] * x[57] + b[58] * x[58] + b[59] * x[59] + b[60] * x[60] + b[61] * x[61] + b[62] * x[62] + b[63] * x[63] + b[64] * x[64] + b[65] * x[65] + b[66] * x[66] + b[67] * x[67] + b[68] * x[68] + b[69] * x[69] + b[70] * x[70] + b[71] * x[71];
        for y in y {
            y ~ Normal(mean + b[0] * y + b[3] * y + b[6] * y + b[9] * y + b[12] * y + b[15] * y + b[18] * y + b[21] * y + b[24] * y + b[27] * y + b[30] * y + b[33] * y + b[36] * y + b[39] * y + b[42] * y + b[45] * y + b[48] * y + b[51] * y + b[54] * y + b[57] * y + b[60] * y + b[63] * y + b[66] * y + b[69] * y, 1.0);
        }
    }

    fn in_a_loop(x: &[f64; 72], y: &[f64]) {
        let b ~ Normal(0.0, 1.0).array::<72>();
        let mean = dot(x, &b);
        for y in y {
            let mut slope = 0.0 * b[0];
            for i in 0..24 {
                slope += b[3 * i];
            }
            y ~ Normal(mean + slope * *y, 1.0);
        }
    }
}

#[test]
fn many_terms_are_their_sum() {
    let x = std::array::from_fn(|i| (i as f64).sin());
    let y = [0.3, -0.2];
    assert_same(&written_out(&x, &y), &in_a_loop(&x, &y));
}
