//! The product of the matrix-free tangent on one register of elements.

use faer::traits::pulp::Simd;

use super::lanes::{Real, prefetch};
use crate::material::packed;
use crate::operator::layout::{Layout, MIDDLE};
use crate::operator::point_data::{NORMAL, PUSH, ROTATION, SHEAR, SLOPES, SOURCE, STRESS};

/// One register of elements.
pub(super) struct Kernel<'a, T: Real, S, const C: usize, const D: usize, const L: usize> {
    pub(super) layout: &'a Layout,
    pub(super) simd: S,
    /// Its place in a pack.
    pub(super) register: usize,
    /// The numbers of these elements, and of those behind.
    pub(super) data: &'a [T::Pack],
}

/// Packs that memory is asked for before they are needed.
const AHEAD: usize = 128;

/// φ at the damage points, g′ φ there, and what the elastic points give back.
struct DamagePoints<V, const D: usize> {
    phi: [V; D],
    soft: [V; D],
    drive: [V; D],
}

impl<T: Real, S: Simd, const C: usize, const D: usize, const L: usize> Kernel<'_, T, S, C, D, L> {
    /// Numbers of an elastic point.
    const WIDTH: usize = if D == 0 { SOURCE } else { SOURCE + 3 };
    /// Numbers before those of the elastic points: g′ and gradient term.
    const HEAD: usize = if D == 0 { 0 } else { D + SLOPES };

    #[inline(always)]
    fn load(&self, pack: &T::Pack) -> T::V<S> {
        T::load(self.simd, pack, self.register)
    }

    /// The next `M` numbers from a place on; those far behind are asked for.
    #[inline(always)]
    fn read<const M: usize>(&self, place: usize) -> &[T::Pack; M] {
        const PER_LINE: usize = 2;
        for k in (0..M).step_by(PER_LINE) {
            prefetch(self.data, place + AHEAD + k);
        }
        self.data[place..].first_chunk().expect("as many numbers as the rule says")
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> T::V<S> {
        T::splat(self.simd, T::of(x))
    }

    #[inline(always)]
    fn mul_add(&self, a: T::V<S>, b: T::V<S>, c: T::V<S>) -> T::V<S> {
        T::mul_add(self.simd, a, b, c)
    }

    /// a b + c, or a b in the first step of a sum.
    #[inline(always)]
    fn first_or_add(&self, step: usize, a: T::V<S>, b: T::V<S>, c: T::V<S>) -> T::V<S> {
        if step == 0 { self.mul(a, b) } else { self.mul_add(a, b, c) }
    }

    #[inline(always)]
    fn mul(&self, a: T::V<S>, b: T::V<S>) -> T::V<S> {
        T::mul(self.simd, a, b)
    }

    #[inline(always)]
    fn add(&self, a: T::V<S>, b: T::V<S>) -> T::V<S> {
        T::add(self.simd, a, b)
    }

    #[inline(always)]
    fn sub(&self, a: T::V<S>, b: T::V<S>) -> T::V<S> {
        T::sub(self.simd, a, b)
    }

    #[inline(always)]
    fn damage_points<const N: usize>(&self, u: &[[T::V<S>; C]; N]) -> DamagePoints<T::V<S>, D> {
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
                    points.phi[p] =
                        self.mul_add(self.constant(shape[b]), u[b][C - 1], points.phi[p]);
                }
            }
            points.soft[p] = self.mul(self.load(&softening[p]), points.phi[p]);
        }
        points
    }

    /// The principal axes of a point, as `point_data` reads them.
    #[inline(always)]
    fn axes(&self, point: &[T::Pack; SOURCE]) -> [[T::V<S>; 3]; 3] {
        let one = self.constant(1.0);
        let x = self.load(&point[ROTATION]);
        let y = self.load(&point[ROTATION + 1]);
        let z = self.load(&point[ROTATION + 2]);
        let w = self.load(&point[ROTATION + 3]);
        let [xx, yy, zz] = [self.mul(x, x), self.mul(y, y), self.mul(z, z)];
        let [xy, xz, yz] = [self.mul(x, y), self.mul(x, z), self.mul(y, z)];
        let [wx, wy, wz] = [self.mul(w, x), self.mul(w, y), self.mul(w, z)];
        [
            [self.sub(self.sub(one, yy), zz), self.add(xy, wz), self.sub(xz, wy)],
            [self.sub(xy, wz), self.sub(self.sub(one, xx), zz), self.add(yz, wx)],
            [self.add(xz, wy), self.sub(yz, wx), self.sub(self.sub(one, xx), yy)],
        ]
    }

    /// The flux of elastic point q for the slopes `du` of the fields.
    #[inline(always)]
    fn flux(
        &self,
        q: usize,
        du: &[[T::V<S>; C]; 3],
        points: &mut DamagePoints<T::V<S>, D>,
    ) -> [[T::V<S>; C]; 3] {
        let zero = self.constant(0.0);
        let place = Self::HEAD + q * Self::WIDTH;
        let point = self.read::<SOURCE>(place);
        let axes = self.axes(point);
        let mut h = [[zero; 3]; 3];
        for k in 0..3 {
            for i in 0..3 {
                let mut turned = self.mul(axes[i][0], du[k][0]);
                for m in 1..3 {
                    turned = self.mul_add(axes[i][m], du[k][m], turned);
                }
                for l in 0..3 {
                    let push = self.load(&point[PUSH + 3 * k + l]);
                    h[i][l] = self.first_or_add(k, turned, push, h[i][l]);
                }
            }
        }
        let mut f = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let normal = self.load(&point[NORMAL + packed(i.max(j), i.min(j))]);
                f[i][i] = self.first_or_add(j, normal, h[j][j], f[i][i]);
                if i != j {
                    let shear = self.load(&point[SHEAR + 3 - i - j]);
                    let stress = self.mul(self.load(&point[STRESS + j]), h[i][j]);
                    f[i][j] = self.mul_add(shear, self.add(h[i][j], h[j][i]), stress);
                }
            }
        }
        let mut flux = [[zero; C]; 3];
        if D > 0 {
            let rule = &self.layout.rule;
            let mixing = rule.mixing[q].first_chunk::<D>().expect("a share of each point");
            let mut seen = zero;
            for p in 0..D {
                seen = self.first_or_add(p, self.constant(mixing[p]), points.soft[p], seen);
            }
            let source = self.read::<3>(place + SOURCE);
            let mut work = zero;
            for i in 0..3 {
                let source = self.load(&source[i]);
                f[i][i] = self.mul_add(source, seen, f[i][i]);
                work = self.first_or_add(i, source, h[i][i], work);
            }
            for p in 0..D {
                let share = self.constant(mixing[p]);
                points.drive[p] = self.first_or_add(q, share, work, points.drive[p]);
            }
            let gradient = self.read::<SLOPES>(D);
            let weight = self.constant(rule.points[q].weight);
            for k in 0..3 {
                let mut sum = zero;
                for l in 0..3 {
                    let a = self.load(&gradient[packed(k.max(l), k.min(l))]);
                    sum = self.first_or_add(l, a, du[l][C - 1], sum);
                }
                flux[k][C - 1] = self.mul(weight, sum);
            }
        }
        for k in 0..3 {
            for i in 0..3 {
                let mut back = self.mul(self.load(&point[PUSH + 3 * k]), f[i][0]);
                for l in 1..3 {
                    back = self.mul_add(self.load(&point[PUSH + 3 * k + l]), f[i][l], back);
                }
                for m in 0..3 {
                    flux[k][m] = self.first_or_add(i, axes[i][m], back, flux[k][m]);
                }
            }
        }
        flux
    }

    /// Adds the rows of φ that need no gradient.
    #[inline(always)]
    fn add_local<const N: usize>(
        &self,
        points: &DamagePoints<T::V<S>, D>,
        r: &mut [[T::V<S>; C]; N],
    ) {
        if D == 0 {
            return;
        }
        let softening = self.read::<D>(0);
        let place = Self::HEAD + self.layout.rule.points.len() * Self::WIDTH;
        let local = self.read::<L>(place);
        for p in 0..D {
            let drive = self.mul(self.load(&softening[p]), points.drive[p]);
            let value = self.mul_add(self.load(&local[p % L]), points.phi[p], drive);
            if self.layout.nodal {
                r[p % N][C - 1] = self.add(r[p % N][C - 1], value);
            } else {
                let shape = &self.layout.rule.damage[p].shape;
                for b in 0..N {
                    r[b][C - 1] = self.mul_add(self.constant(shape[b]), value, r[b][C - 1]);
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn linear<const N: usize>(&self, u: &[[T::V<S>; C]; N]) -> [[T::V<S>; C]; N] {
        let zero = self.constant(0.0);
        let mut du = [[zero; C]; 3];
        for c in 0..C {
            for k in 0..3 {
                du[k][c] = self.sub(u[k + 1][c], u[0][c]);
            }
        }
        let mut points = self.damage_points(u);
        let flux = self.flux(0, &du, &mut points);
        let mut r = [[zero; C]; N];
        for c in 0..C {
            let sum = self.add(self.add(flux[0][c], flux[1][c]), flux[2][c]);
            r[0][c] = self.sub(zero, sum);
            for k in 0..3 {
                r[k + 1][c] = flux[k][c];
            }
        }
        self.add_local(&points, &mut r);
        r
    }

    /// With M_kj = 4 u_kj (u at the node between vertices k and j), ∂u/∂λ_k = Σ_j λ_j M_kj − u_k;
    /// the part of λ that all four have in common is summed once for all points.
    #[inline(always)]
    pub(super) fn quadratic<const N: usize>(&self, u: &[[T::V<S>; C]; N]) -> [[T::V<S>; C]; N] {
        let zero = self.constant(0.0);
        let four = self.constant(4.0);
        let mut sums = [[zero; C]; 4];
        for k in 0..4 {
            for c in 0..C {
                let mut sum = zero;
                for j in 0..4 {
                    sum = self.add(sum, u[MIDDLE[k][j]][c]);
                }
                sums[k][c] = self.mul(four, sum);
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
                    d[k][c] = self.sub(self.mul(least, sums[k][c]), u[k][c]);
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(4.0 * excess);
                for k in 0..4 {
                    for c in 0..C {
                        d[k][c] = self.mul_add(excess, u[MIDDLE[k][j]][c], d[k][c]);
                    }
                }
            }
            let mut du = [[zero; C]; 3];
            for k in 0..3 {
                for c in 0..C {
                    du[k][c] = self.sub(d[k + 1][c], d[0][c]);
                }
            }
            let flux = self.flux(q, &du, &mut points);
            for c in 0..C {
                let sum = self.add(self.add(flux[0][c], flux[1][c]), flux[2][c]);
                d[0][c] = self.sub(zero, sum);
                for k in 0..3 {
                    d[k + 1][c] = flux[k][c];
                }
            }
            for k in 0..4 {
                for c in 0..C {
                    total[k][c] = self.add(total[k][c], d[k][c]);
                    common[k][c] = self.mul_add(least, d[k][c], common[k][c]);
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(excess);
                for k in 0..4 {
                    let node = MIDDLE[k][j];
                    for c in 0..C {
                        own[node][c] = self.mul_add(excess, d[k][c], own[node][c]);
                    }
                }
            }
        }
        for k in 0..4 {
            for j in 0..4 {
                let node = MIDDLE[k][j];
                for c in 0..C {
                    own[node][c] = self.add(own[node][c], common[k][c]);
                }
            }
        }
        for (a, own) in own.iter_mut().enumerate() {
            for c in 0..C {
                own[c] = self.mul(four, own[c]);
                if a < 4 {
                    own[c] = self.sub(own[c], total[a][c]);
                }
            }
        }
        self.add_local(&points, &mut own);
        own
    }
}
