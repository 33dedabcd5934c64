//! Tangent blocks of several elements at once.

use faer::traits::pulp::{Simd, WithSimd};

use super::Batched;
use super::elements::{At, Elements, store_rows};
use crate::material::{Inverted, Many, dot};
use crate::operator::element::{Block, MOST_POINTS};
use crate::operator::lanes::{LANES, Rows};

pub(super) struct Tangents<'a, 'b, const N: usize> {
    pub(super) batched: &'a Batched<'a, N>,
    pub(super) first: usize,
    pub(super) coupled: bool,
    pub(super) out: &'b mut [[[Block; N]; N]],
}

impl<const N: usize> WithSimd for Tangents<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut first = self.first;
        for out in self.out.chunks_mut(Many::<S>::COUNT) {
            Elements::gather(simd, self.batched, self.batched.rows(first, out.len()))
                .tangent(self.coupled, out)?;
            first += out.len();
        }
        Ok(())
    }
}

impl<S: Simd, const N: usize> Elements<'_, S, N> {
    #[inline(always)]
    fn tangent(&self, coupled: bool, out: &mut [[[Block; N]; N]]) -> Result<(), Inverted> {
        let zero = self.constant(0.0);
        let rule = &self.batched.space.rule;
        let mut blocks = [[[[zero; 4]; 4]; N]; N];
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        for q in 0..rule.points.len() {
            let at = self.at(q, &phi)?;
            let At { weight, ref shape, ref principal, ref response } = at;
            let tangent = response.tangent(weight);
            let mut spatial = [[zero; 3]; N];
            for a in 0..N {
                for i in 0..3 {
                    spatial[a][i] = dot(&principal.push[i], &shape[a]);
                }
            }
            // the shape functions add up to one: node 0 follows from the others
            for a in 1..N {
                for b in 1..=a {
                    let block = tangent.block(&principal.basis, &spatial[a], &spatial[b]);
                    for i in 0..3 {
                        for j in 0..3 {
                            blocks[a][b][i][j] += block[i][j];
                        }
                    }
                }
            }
            if rule.damage.is_empty() {
                continue;
            }
            let row = &rule.mixing[q];
            self.add_driving(q, &at, &mut driving);
            let stiffness = weight * (self.gradient + self.gradient);
            for a in 0..N {
                for b in 0..=a {
                    let product = dot(&shape[a], &shape[b]);
                    blocks[a][b][3][3] = stiffness.mul_add(product, blocks[a][b][3][3]);
                }
            }
            if !coupled {
                continue;
            }
            let piola = principal.piola(&response.stress_plus, weight);
            let (mut forces, mut soft) = ([[zero; 3]; N], [zero; N]);
            for ((point, &c), &phi) in rule.damage.iter().zip(row).zip(&phi) {
                let slope = self.constant(c) * self.softening(phi);
                for a in 0..N {
                    soft[a] = slope.mul_add(self.constant(point.shape[a]), soft[a]);
                }
            }
            for a in 0..N {
                for i in 0..3 {
                    forces[a][i] = dot(&piola[i], &shape[a]);
                }
            }
            for a in 0..N {
                for b in 0..=a {
                    let block = &mut blocks[a][b];
                    for i in 0..3 {
                        block[i][3] = forces[a][i].mul_add(soft[b], block[i][3]);
                        block[3][i] = forces[b][i].mul_add(soft[a], block[3][i]);
                    }
                }
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let local = self.local_tangent(point.weight, phi[p], driving[p]);
            for a in 0..N {
                for b in 0..=a {
                    let product = point.shape[a] * point.shape[b];
                    if product != 0.0 {
                        let block = &mut blocks[a][b][3][3];
                        *block = self.constant(product).mul_add(local, *block);
                    }
                }
            }
        }
        for a in 1..N {
            for b in 1..N {
                for i in 0..3 {
                    for j in 0..3 {
                        let block = if b <= a { blocks[a][b][i][j] } else { blocks[b][a][j][i] };
                        blocks[a][0][i][j] = blocks[a][0][i][j] - block;
                    }
                }
            }
        }
        for a in 1..N {
            for i in 0..3 {
                for j in 0..3 {
                    blocks[0][0][i][j] = blocks[0][0][i][j] - blocks[a][0][i][j];
                }
            }
        }
        let mut rows = Rows([[0.0; 4]; LANES]);
        for a in 0..N {
            for b in 0..=a {
                for i in 0..4 {
                    store_rows(self.simd, &blocks[a][b][i], &mut rows);
                    for (out, row) in out.iter_mut().zip(&rows.0) {
                        out[a][b][i] = *row;
                    }
                }
            }
        }
        Ok(())
    }
}
