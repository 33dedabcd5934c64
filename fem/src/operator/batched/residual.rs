//! Residual and energies of several elements at once.

use faer::traits::pulp::{Simd, WithSimd};

use super::Batched;
use super::elements::{At, Elements, store_rows};
use crate::material::{Inverted, Many, POINTS, dot};
use crate::operator::element::{ElementResidual, MOST_POINTS};
use crate::operator::lanes::{LANES, Rows};

pub(super) struct Residuals<'a, 'b, const N: usize> {
    pub(super) batched: &'a Batched<'a, N>,
    pub(super) first: usize,
    pub(super) out: &'b mut [ElementResidual<N>],
}

impl<const N: usize> WithSimd for Residuals<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut first = self.first;
        for out in self.out.chunks_mut(Many::<S>::COUNT) {
            Elements::gather(simd, self.batched, self.batched.rows(first, out.len()))
                .residual(out)?;
            first += out.len();
        }
        Ok(())
    }
}

impl<S: Simd, const N: usize> Elements<'_, S, N> {
    #[inline(always)]
    fn residual(&self, out: &mut [ElementResidual<N>]) -> Result<(), Inverted> {
        let zero = self.constant(0.0);
        let rule = &self.batched.space.rule;
        let (mut nodal, mut drive) = ([[zero; 4]; N], [zero; N]);
        let [mut elastic, mut fracture, mut viscous] = [zero; 3];
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        for q in 0..rule.points.len() {
            let at = self.at(q, &phi)?;
            let At { weight, ref shape, ref principal, ref response } = at;
            elastic = weight.mul_add(response.energy, elastic);
            let piola = principal.piola(&response.stress, weight);
            for a in 0..N {
                for i in 0..3 {
                    nodal[a][i] += dot(&piola[i], &shape[a]);
                }
            }
            if rule.damage.is_empty() {
                continue;
            }
            self.add_driving(q, &at, &mut driving);
            let mut slope = [zero; 3];
            for a in 0..N {
                for k in 0..3 {
                    slope[k] = self.damage[a].mul_add(shape[a][k], slope[k]);
                }
            }
            let stiffness = weight * self.gradient;
            fracture = stiffness.mul_add(dot(&slope, &slope), fracture);
            for a in 0..N {
                nodal[a][3] = (stiffness + stiffness).mul_add(dot(&slope, &shape[a]), nodal[a][3]);
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let weight = self.volume * self.constant(point.weight);
            let [alpha, slope, _] = self.density(phi[p]);
            let growth = phi[p] - self.interpolate(&self.before, &point.shape);
            let rate = self.viscous * growth;
            fracture = (weight * self.local).mul_add(alpha, fracture);
            viscous = (weight * rate).mul_add(growth, viscous);
            let force = self.softening(phi[p]) * driving[p];
            let local = weight.mul_add(self.local.mul_add(slope, rate), force);
            for a in 0..N {
                if point.shape[a] != 0.0 {
                    let shape = self.constant(point.shape[a]);
                    nodal[a][3] = shape.mul_add(local, nodal[a][3]);
                    drive[a] = shape.mul_add(force, drive[a]);
                }
            }
        }
        let mut rows = Rows([[0.0; 4]; LANES]);
        for a in 0..N {
            store_rows(self.simd, &nodal[a], &mut rows);
            for (out, row) in out.iter_mut().zip(&rows.0) {
                out.nodal[a] = *row;
            }
        }
        let places = &self.batched.places;
        let mut column = [0.0; POINTS];
        let mut scalars = |x: Many<S>, write: &dyn Fn(&mut ElementResidual<N>, f64)| {
            x.store(&mut column);
            for (out, &place) in out.iter_mut().zip(places) {
                write(out, column[place]);
            }
        };
        for a in 0..N {
            scalars(drive[a], &|out, x| out.drive[a] = x);
        }
        scalars(elastic, &|out, x| out.elastic = x);
        scalars(fracture, &|out, x| out.fracture = x);
        scalars(viscous, &|out, x| out.viscous = x);
        Ok(())
    }
}
