//! The product with the matrix-free tangent for one register of elements.

use faer::traits::pulp::Simd;

use super::lanes::{Precision, prefetch};
use crate::material::{Number, dot, packed};
use crate::operator::layout::{Layout, MIDDLE};
use crate::operator::point_data::{
    GRADIENT, NORMAL, PUSH, PointData, ROTATION, SHEAR, SLOPES, SOFTENING, SOURCE, STRESS,
    principal_axes,
};

/// The product for one register of elements with `C` fields, `D` damage points and `L` entries of the local
/// part. `PLAIN` elements are straight and not mixtures.
pub(super) struct ElementProduct<
    'a,
    T: Precision,
    S,
    const PLAIN: bool,
    const C: usize,
    const D: usize,
    const L: usize,
> {
    pub(super) layout: &'a Layout,
    pub(super) simd: S,
    /// Index of the register within a pack.
    pub(super) register: usize,
    /// Point data, beginning with those of these elements.
    pub(super) data: &'a [T::Pack],
}

/// Prefetch distance, in packs.
const AHEAD: usize = 128;

/// Values at the damage points: φ, g′ φ, and the sum of the contributions of the elastic points.
struct DamagePoints<V, const D: usize> {
    phi: [V; D],
    soft: [V; D],
    drive: [V; D],
}

/// a b in the first step of a sum, a b + c in later steps.
#[inline(always)]
fn first_or_add<V: Number>(step: usize, a: V, b: V, c: V) -> V {
    if step == 0 { a * b } else { a.mul_add(b, c) }
}

impl<T: Precision, S: Simd, const PLAIN: bool, const C: usize, const D: usize, const L: usize>
    ElementProduct<'_, T, S, PLAIN, C, D, L>
{
    const WIDTH: usize = PointData::each(D, PLAIN);
    const HEAD: usize = PointData::head(D, PLAIN);

    /// `M` packs beginning at index `place`. Also prefetches packs farther on.
    #[inline(always)]
    fn read<const M: usize>(&self, place: usize) -> &[T::Pack; M] {
        const PER_LINE: usize = 2;
        for k in (0..M).step_by(PER_LINE) {
            prefetch(self.data, place + AHEAD + k);
        }
        self.data[place..].first_chunk().expect("as many numbers as the rule says")
    }

    #[inline(always)]
    fn load(&self, pack: &T::Pack) -> T::Register<S> {
        T::load(self.simd, pack, self.register)
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> T::Register<S> {
        T::splat(self.simd, x)
    }

    #[inline(always)]
    fn damage_points<const N: usize>(
        &self,
        u: &[[T::Register<S>; C]; N],
    ) -> DamagePoints<T::Register<S>, D> {
        let zero = self.constant(0.0);
        let mut points = DamagePoints { phi: [zero; D], soft: [zero; D], drive: [zero; D] };
        if D == 0 {
            return points;
        }
        let softening = self.read::<D>(0);
        for p in 0..D {
            if self.layout.nodal {
                points.phi[p] = u[p % N][C - 1];
            } else {
                let shape = &self.layout.rule.damage[p].shape;
                for b in 0..N {
                    points.phi[p] = self.constant(shape[b]).mul_add(u[b][C - 1], points.phi[p]);
                }
            }
            points.soft[p] = self.load(&softening[p]) * points.phi[p];
        }
        points
    }

    /// The flux at elastic point q for the differences `du` = ∂u/∂λ_k − ∂u/∂λ₀ of the fields.
    #[inline(always)]
    fn flux(
        &self,
        q: usize,
        du: &[[T::Register<S>; C]; 3],
        points: &mut DamagePoints<T::Register<S>, D>,
    ) -> [[T::Register<S>; C]; 3] {
        let zero = self.constant(0.0);
        let place = Self::HEAD + q * Self::WIDTH;
        let point = self.read::<SOURCE>(place);
        let mut rotation = [zero; 4];
        for k in 0..4 {
            rotation[k] = self.load(&point[ROTATION + k]);
        }
        let axes = principal_axes(rotation);
        let mut h = [[zero; 3]; 3];
        for k in 0..3 {
            for i in 0..3 {
                let turned = dot(&axes[i], &[du[k][0], du[k][1], du[k][2]]);
                for l in 0..3 {
                    let push = self.load(&point[PUSH + 3 * k + l]);
                    h[i][l] = first_or_add(k, turned, push, h[i][l]);
                }
            }
        }
        let mut f = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let normal = self.load(&point[NORMAL + packed(i.max(j), i.min(j))]);
                f[i][i] = first_or_add(j, normal, h[j][j], f[i][i]);
                if i != j {
                    let shear = self.load(&point[SHEAR + 3 - i - j]);
                    let stress = self.load(&point[STRESS + j]) * h[i][j];
                    f[i][j] = shear.mul_add(h[i][j] + h[j][i], stress);
                }
            }
        }
        let mut flux = [[zero; C]; 3];
        if D > 0 {
            let rule = &self.layout.rule;
            let mixing = rule.mixing[q].first_chunk::<D>().expect("a share of each point");
            let mut seen = zero;
            for p in 0..D {
                seen = first_or_add(p, self.constant(mixing[p]), points.soft[p], seen);
            }
            let source = self.read::<3>(place + SOURCE);
            let mut work = zero;
            for i in 0..3 {
                let source = self.load(&source[i]);
                f[i][i] = source.mul_add(seen, f[i][i]);
                work = first_or_add(i, source, h[i][i], work);
            }
            if !PLAIN {
                let [softening] = self.read::<1>(place + SOFTENING);
                work = self.load(softening).mul_add(seen, work);
            }
            for p in 0..D {
                let share = self.constant(mixing[p]);
                points.drive[p] = first_or_add(q, share, work, points.drive[p]);
            }
            let gradient = self.read::<SLOPES>(if PLAIN { D } else { place + GRADIENT });
            let weight = self.constant(if PLAIN { rule.points[q].weight } else { 1.0 });
            for k in 0..3 {
                let mut sum = zero;
                for l in 0..3 {
                    let a = self.load(&gradient[packed(k.max(l), k.min(l))]);
                    sum = first_or_add(l, a, du[l][C - 1], sum);
                }
                flux[k][C - 1] = weight * sum;
            }
        }
        for k in 0..3 {
            for i in 0..3 {
                let mut back = zero;
                for l in 0..3 {
                    back = first_or_add(l, self.load(&point[PUSH + 3 * k + l]), f[i][l], back);
                }
                for m in 0..3 {
                    flux[k][m] = first_or_add(i, axes[i][m], back, flux[k][m]);
                }
            }
        }
        flux
    }

    /// Adds the terms of the φ rows that contain no gradient.
    #[inline(always)]
    fn add_local<const N: usize>(
        &self,
        points: &DamagePoints<T::Register<S>, D>,
        r: &mut [[T::Register<S>; C]; N],
    ) {
        if D == 0 {
            return;
        }
        let softening = self.read::<D>(0);
        let local = self.read::<L>(Self::HEAD + self.layout.rule.points.len() * Self::WIDTH);
        for p in 0..D {
            let drive = self.load(&softening[p]) * points.drive[p];
            let value = self.load(&local[p % L]).mul_add(points.phi[p], drive);
            if self.layout.nodal {
                r[p % N][C - 1] += value;
            } else {
                let shape = &self.layout.rule.damage[p].shape;
                for b in 0..N {
                    r[b][C - 1] = self.constant(shape[b]).mul_add(value, r[b][C - 1]);
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn linear<const N: usize>(
        &self,
        u: &[[T::Register<S>; C]; N],
    ) -> [[T::Register<S>; C]; N] {
        let zero = self.constant(0.0);
        let mut du = [[zero; C]; 3];
        for c in 0..C {
            for k in 0..3 {
                du[k][c] = u[k + 1][c] - u[0][c];
            }
        }
        let mut points = self.damage_points(u);
        let flux = self.flux(0, &du, &mut points);
        let mut r = [[zero; C]; N];
        for c in 0..C {
            r[0][c] = -(flux[0][c] + flux[1][c] + flux[2][c]);
            for k in 0..3 {
                r[k + 1][c] = flux[k][c];
            }
        }
        self.add_local(&points, &mut r);
        r
    }

    /// The product for quadratic elements. With M_kj = 4 u_kj, where u_kj is u at the node between vertices k
    /// and j, ∂u/∂λ_k = Σ_j λ_j M_kj − u_k. At each elastic point λ_j is split into the smallest λ and an
    /// excess; the sum with the smallest λ is computed once for all points.
    #[inline(always)]
    pub(super) fn quadratic<const N: usize>(
        &self,
        u: &[[T::Register<S>; C]; N],
    ) -> [[T::Register<S>; C]; N] {
        let zero = self.constant(0.0);
        let four = self.constant(4.0);
        let mut sums = [[zero; C]; 4];
        for k in 0..4 {
            for c in 0..C {
                for j in 0..4 {
                    sums[k][c] += u[MIDDLE[k][j]][c];
                }
                sums[k][c] = four * sums[k][c];
            }
        }
        let mut points = self.damage_points(u);
        let (mut total, mut common) = ([[zero; C]; 4], [[zero; C]; 4]);
        let mut own = [[zero; C]; N];
        for (q, (least, above)) in self.layout.excess.iter().enumerate() {
            let least = self.constant(*least);
            let mut d = [[zero; C]; 4];
            for k in 0..4 {
                for c in 0..C {
                    d[k][c] = least * sums[k][c] - u[k][c];
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(4.0 * excess);
                for k in 0..4 {
                    for c in 0..C {
                        d[k][c] = excess.mul_add(u[MIDDLE[k][j]][c], d[k][c]);
                    }
                }
            }
            let mut du = [[zero; C]; 3];
            for k in 0..3 {
                for c in 0..C {
                    du[k][c] = d[k + 1][c] - d[0][c];
                }
            }
            let flux = self.flux(q, &du, &mut points);
            for c in 0..C {
                d[0][c] = -(flux[0][c] + flux[1][c] + flux[2][c]);
                for k in 0..3 {
                    d[k + 1][c] = flux[k][c];
                }
            }
            for k in 0..4 {
                for c in 0..C {
                    total[k][c] += d[k][c];
                    common[k][c] = least.mul_add(d[k][c], common[k][c]);
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(excess);
                for k in 0..4 {
                    let node = MIDDLE[k][j];
                    for c in 0..C {
                        own[node][c] = excess.mul_add(d[k][c], own[node][c]);
                    }
                }
            }
        }
        for k in 0..4 {
            for j in 0..4 {
                for c in 0..C {
                    own[MIDDLE[k][j]][c] += common[k][c];
                }
            }
        }
        for (a, own) in own.iter_mut().enumerate() {
            for c in 0..C {
                own[c] = four * own[c];
                if a < 4 {
                    own[c] = own[c] - total[a][c];
                }
            }
        }
        self.add_local(&points, &mut own);
        own
    }
}
