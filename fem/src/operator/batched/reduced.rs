//! Reduced tangents of several elements at once; see [`crate::operator::reduced`].

use faer::traits::pulp::{Simd, WithSimd};

use super::Batched;
use super::elements::{At, Elements};
use crate::material::{Inverted, Many, POINTS, dot};
use crate::operator::element::MOST_POINTS;
use crate::operator::lanes::LANES;
use crate::operator::reduced::{
    NORMAL, PUSH, ROTATION, ReferenceRule, SHEAR, SOURCE, STRESS, packed,
};

pub(super) struct Reduced<'a, 'b, const N: usize> {
    pub(super) batched: &'a Batched<'a, N>,
    pub(super) tets: [usize; LANES],
    pub(super) coupled: bool,
    pub(super) form: &'a ReferenceRule,
    pub(super) out: &'b mut [[f64; LANES]],
}

impl<const N: usize> WithSimd for Reduced<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for first in (0..LANES).step_by(Many::<S>::COUNT) {
            let mut tets = self.tets;
            tets.rotate_left(first);
            let out = Columns { first, count: Many::<S>::COUNT, all: &mut *self.out };
            Elements::gather(simd, self.batched, tets).reduced(self.form, self.coupled, out)?;
        }
        Ok(())
    }
}

/// Where the numbers of the elements go that are computed together.
struct Columns<'a> {
    first: usize,
    count: usize,
    all: &'a mut [[f64; LANES]],
}

impl Columns<'_> {
    #[inline(always)]
    fn put<S: Simd>(&mut self, number: usize, x: Many<S>) {
        let mut values = [0.0; POINTS];
        x.store(&mut values);
        let to = &mut self.all[number][self.first..self.first + self.count];
        to.copy_from_slice(&values[..self.count]);
    }
}

impl<S: Simd, const N: usize> Elements<'_, S, N> {
    #[inline(always)]
    fn reduced(
        &self,
        form: &ReferenceRule,
        coupled: bool,
        mut out: Columns,
    ) -> Result<(), Inverted> {
        let zero = self.constant(0.0);
        let space = self.batched.space;
        let rule = &space.rule;
        let mut columns = [[[0.0; POINTS]; 3]; 3];
        for lane in 0..Many::<S>::COUNT {
            let slopes = space.barycentric(self.tets[lane]);
            for k in 0..3 {
                for x in 0..3 {
                    columns[k][x][lane] = slopes[k + 1][x];
                }
            }
        }
        let mut slopes = [[zero; 3]; 3];
        for k in 0..3 {
            for x in 0..3 {
                slopes[k][x] = Many::load(self.simd, &columns[k][x]);
            }
        }
        let [softening, gradient, points, locals] = form.lengths();
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        for q in 0..rule.points.len() {
            let at = self.at(q, &phi)?;
            let At { weight, ref principal, ref response, .. } = at;
            let tangent = response.tangent(weight);
            let place = softening + gradient + q * form.point();
            let rotation = rotation(&principal.basis);
            for k in 0..4 {
                out.put(place + ROTATION + k, rotation[k]);
            }
            for k in 0..3 {
                for i in 0..3 {
                    out.put(place + PUSH + 3 * k + i, dot(&principal.push[i], &slopes[k]));
                }
                for l in 0..k {
                    out.put(place + NORMAL + packed(k, l), tangent.normal[3 - k - l]);
                }
                out.put(place + NORMAL + packed(k, k), tangent.diagonal[k][k]);
                out.put(place + SHEAR + k, tangent.shear[k]);
                out.put(place + STRESS + k, weight * response.stress[k]);
            }
            if rule.damage.is_empty() {
                continue;
            }
            self.add_driving(q, &at, &mut driving);
            for i in 0..3 {
                let source = if coupled { weight * response.stress_plus[i] } else { zero };
                out.put(place + SOURCE + i, source);
            }
        }
        if rule.damage.is_empty() {
            return Ok(());
        }
        let stiffness = self.volume * (self.gradient + self.gradient);
        for k in 0..3 {
            for l in 0..=k {
                out.put(softening + packed(k, l), stiffness * dot(&slopes[k], &slopes[l]));
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            out.put(p, self.softening(phi[p]));
            // the same at all points where there is one place for them
            let place = softening + gradient + points + p.min(locals - 1);
            out.put(place, self.local_tangent(point.weight, phi[p], driving[p]));
        }
        Ok(())
    }
}

/// √2 (x, y, z, w) of the rotations with these matrices.
///
/// Each row of 4 q qᵀ, whose entries are sums of those of the matrix, is q times a number; that with
/// the largest diagonal entry loses no digits.
#[inline(always)]
fn rotation<S: Simd>(m: &[[Many<S>; 3]; 3]) -> [Many<S>; 4] {
    let one = m[0][0].constant(1.0);
    let turn = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
    let pair = [m[1][2] + m[2][1], m[0][2] + m[2][0], m[0][1] + m[1][0]];
    let mut largest = one + m[0][0] + m[1][1] + m[2][2];
    let mut best = [turn[0], turn[1], turn[2], largest];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let own = one + m[k][k] - m[i][i] - m[j][j];
        let mut row = [own; 4];
        row[i] = pair[j];
        row[j] = pair[i];
        row[3] = turn[k];
        let larger = largest.less_than(own);
        largest = larger.select(own, largest);
        for c in 0..4 {
            best[c] = larger.select(row[c], best[c]);
        }
    }
    let scale = one / (largest + largest).sqrt();
    for c in 0..4 {
        best[c] = best[c] * scale;
    }
    best
}
