//! The product of the matrix-free tangent on the elements of a chunk.

use faer::traits::pulp::{Simd, WithSimd};

use super::batches::Chunk;
use super::lanes::{LANES, Lane, Real};
use super::matrix_free::{Layout, MIDDLE};
use super::reduced::{POINT, SLOPES, STIFFNESS, packed};

/// y += A x for the elements of a chunk, on the values of its nodes.
pub(super) struct ChunkProduct<'a, T> {
    pub(super) layout: &'a Layout,
    pub(super) chunk: &'a Chunk,
    pub(super) data: &'a [Lane<T>],
    pub(super) x: &'a [[f64; 4]],
    pub(super) y: &'a mut [[f64; 4]],
}

impl<T: Real> WithSimd for ChunkProduct<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.layout.rule.nodes {
            4 => self.elements::<S, 4>(simd),
            _ => self.elements::<S, 10>(simd),
        }
    }
}

impl<T: Real> ChunkProduct<'_, T> {
    #[inline(always)]
    fn elements<S: Simd, const N: usize>(self, simd: S) {
        let rule = &self.layout.rule;
        let mut u = [[[T::default(); LANES]; 4]; N];
        let mut r = u;
        let batches = self.data.chunks_exact(rule.width()).zip(self.chunk.local.chunks_exact(N));
        for (data, local) in batches {
            for (u, local) in u.iter_mut().zip(local) {
                for lane in 0..LANES {
                    let value = &self.x[usize::from(local[lane])];
                    for k in 0..4 {
                        u[k][lane] = T::of(value[k]);
                    }
                }
            }
            for register in 0..T::registers::<S>() {
                let batch = Batch { layout: self.layout, simd, register, data };
                if N == 4 {
                    batch.linear(&u, &mut r);
                } else {
                    batch.quadratic(&u, &mut r);
                }
            }
            for (r, local) in r.iter().zip(local) {
                for lane in 0..LANES {
                    let value = &mut self.y[usize::from(local[lane])];
                    for k in 0..4 {
                        value[k] += r[k][lane].wide();
                    }
                }
            }
        }
    }
}

/// One register of elements.
struct Batch<'a, T, S> {
    layout: &'a Layout,
    simd: S,
    register: usize,
    data: &'a [Lane<T>],
}

/// The most damage points of a rule.
const MOST: usize = 14;

/// φ at the damage points, g′ φ there, and what the elastic points give back.
struct DamagePoints<V> {
    phi: [V; MOST],
    soft: [V; MOST],
    drive: [V; MOST],
}

impl<T: Real, S: Simd> Batch<'_, T, S> {
    #[inline(always)]
    fn load(&self, lane: &Lane<T>) -> T::V<S> {
        T::load(self.simd, lane, self.register)
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> T::V<S> {
        T::splat(self.simd, T::of(x))
    }

    #[inline(always)]
    fn mul_add(&self, a: T::V<S>, b: T::V<S>, c: T::V<S>) -> T::V<S> {
        T::mul_add(self.simd, a, b, c)
    }

    #[inline(always)]
    fn add(&self, a: T::V<S>, b: T::V<S>) -> T::V<S> {
        T::add(self.simd, a, b)
    }

    #[inline(always)]
    fn sub(&self, a: T::V<S>, b: T::V<S>) -> T::V<S> {
        T::sub(self.simd, a, b)
    }

    /// The data behind those of the elastic points: gradient term, g′ and local part.
    #[inline(always)]
    fn damage_data(&self) -> [&[Lane<T>]; 3] {
        let rule = &self.layout.rule;
        let rest = &self.data[POINT * rule.at.len()..];
        let (gradient, damage) = rest.split_at(SLOPES);
        let (softening, local) = damage.split_at(rule.damage.len());
        [gradient, softening, local]
    }

    #[inline(always)]
    fn damage_points<const N: usize>(&self, u: &[[Lane<T>; 4]; N]) -> DamagePoints<T::V<S>> {
        let rule = &self.layout.rule;
        let zero = self.constant(0.0);
        let [_, softening, _] = self.damage_data();
        let mut points =
            DamagePoints { phi: [zero; MOST], soft: [zero; MOST], drive: [zero; MOST] };
        for (p, shape) in rule.damage.iter().enumerate() {
            let phi = if self.layout.nodal {
                self.load(&u[p][3])
            } else {
                let mut sum = zero;
                for (b, &n) in shape.iter().enumerate() {
                    sum = self.mul_add(self.constant(n), self.load(&u[b][3]), sum);
                }
                sum
            };
            points.phi[p] = phi;
            points.soft[p] = T::mul(self.simd, self.load(&softening[p]), phi);
        }
        points
    }

    /// The flux of elastic point q for the slopes `du` of the four fields.
    #[inline(always)]
    fn flux(
        &self,
        q: usize,
        du: &[[T::V<S>; 4]; 3],
        points: &mut DamagePoints<T::V<S>>,
    ) -> [[T::V<S>; 4]; 3] {
        let rule = &self.layout.rule;
        let zero = self.constant(0.0);
        let point: &[Lane<T>; POINT] =
            self.data[q * POINT..(q + 1) * POINT].try_into().expect("the numbers of a point");
        let mut flux = [[zero; 4]; 3];
        let flat: [T::V<S>; 9] = std::array::from_fn(|s| du[s / 3][s % 3]);
        for s in 0..9 {
            let mut sum = zero;
            for t in 0..9 {
                let a = if t <= s { packed(s, t) } else { packed(t, s) };
                sum = self.mul_add(self.load(&point[a]), flat[t], sum);
            }
            flux[s / 3][s % 3] = sum;
        }
        if rule.damage.is_empty() {
            return flux;
        }
        let mixing = &rule.mixing[q];
        let mut seen = zero;
        for (&c, &soft) in mixing.iter().zip(&points.soft) {
            seen = self.mul_add(self.constant(c), soft, seen);
        }
        let mut work = zero;
        for s in 0..9 {
            let force = self.load(&point[STIFFNESS + s]);
            flux[s / 3][s % 3] = self.mul_add(force, seen, flux[s / 3][s % 3]);
            work = self.mul_add(force, flat[s], work);
        }
        for (&c, drive) in mixing.iter().zip(&mut points.drive) {
            *drive = self.mul_add(self.constant(c), work, *drive);
        }
        let [gradient, ..] = self.damage_data();
        let weight = self.constant(rule.weight[q]);
        for k in 0..3 {
            let mut sum = zero;
            for l in 0..3 {
                let a = self.load(&gradient[packed(k.max(l), k.min(l))]);
                sum = self.mul_add(a, du[l][3], sum);
            }
            flux[k][3] = T::mul(self.simd, weight, sum);
        }
        flux
    }

    /// Adds the rows of φ that need no gradient.
    #[inline(always)]
    fn add_local<const N: usize>(&self, points: &DamagePoints<T::V<S>>, r: &mut [[T::V<S>; 4]; N]) {
        let [_, softening, local] = self.damage_data();
        for (p, shape) in self.layout.rule.damage.iter().enumerate() {
            let drive = T::mul(self.simd, self.load(&softening[p]), points.drive[p]);
            let value = self.mul_add(self.load(&local[p]), points.phi[p], drive);
            if self.layout.nodal {
                r[p][3] = self.add(r[p][3], value);
            } else {
                for (b, &n) in shape.iter().enumerate() {
                    r[b][3] = self.mul_add(self.constant(n), value, r[b][3]);
                }
            }
        }
    }

    #[inline(always)]
    fn store<const N: usize>(&self, from: &[[T::V<S>; 4]; N], to: &mut [[Lane<T>; 4]; N]) {
        for (from, to) in from.iter().zip(to) {
            for c in 0..4 {
                T::store(self.simd, &mut to[c], self.register, from[c]);
            }
        }
    }

    #[inline(always)]
    fn linear<const N: usize>(&self, u: &[[Lane<T>; 4]; N], r: &mut [[Lane<T>; 4]; N]) {
        let zero = self.constant(0.0);
        let first: [T::V<S>; 4] = std::array::from_fn(|c| self.load(&u[0][c]));
        let du: [[T::V<S>; 4]; 3] = std::array::from_fn(|k| {
            std::array::from_fn(|c| self.sub(self.load(&u[k + 1][c]), first[c]))
        });
        let mut points = self.damage_points(u);
        let flux = self.flux(0, &du, &mut points);
        let mut out = [[zero; 4]; N];
        for c in 0..4 {
            let sum = self.add(self.add(flux[0][c], flux[1][c]), flux[2][c]);
            out[0][c] = self.sub(zero, sum);
            for k in 0..3 {
                out[k + 1][c] = flux[k][c];
            }
        }
        self.add_local(&points, &mut out);
        self.store(&out, r);
    }

    /// With M_kj = 4 u_kj (u at the node between vertices k and j), ∂u/∂λ_k = Σ_j λ_j M_kj − u_k;
    /// the part of λ that all four have in common is summed once for all points.
    #[inline(always)]
    fn quadratic<const N: usize>(&self, u: &[[Lane<T>; 4]; N], r: &mut [[Lane<T>; 4]; N]) {
        let zero = self.constant(0.0);
        let four = self.constant(4.0);
        let mut sums = [[zero; 4]; 4];
        for k in 0..4 {
            for c in 0..4 {
                let mut sum = zero;
                for j in 0..4 {
                    sum = self.add(sum, self.load(&u[MIDDLE[k][j]][c]));
                }
                sums[k][c] = T::mul(self.simd, four, sum);
            }
        }
        let mut points = self.damage_points(u);
        let (mut total, mut common) = ([[zero; 4]; 4], [[zero; 4]; 4]);
        let mut own = [[zero; 4]; N];
        for (q, (least, above)) in self.layout.excess.iter().enumerate() {
            let least = self.constant(*least);
            let mut d = [[zero; 4]; 4];
            for k in 0..4 {
                for c in 0..4 {
                    d[k][c] = T::mul(self.simd, least, sums[k][c]);
                    d[k][c] = self.sub(d[k][c], self.load(&u[k][c]));
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(4.0 * excess);
                for k in 0..4 {
                    for c in 0..4 {
                        d[k][c] = self.mul_add(excess, self.load(&u[MIDDLE[k][j]][c]), d[k][c]);
                    }
                }
            }
            let du =
                std::array::from_fn(|k| std::array::from_fn(|c| self.sub(d[k + 1][c], d[0][c])));
            let flux = self.flux(q, &du, &mut points);
            for c in 0..4 {
                let sum = self.add(self.add(flux[0][c], flux[1][c]), flux[2][c]);
                d[0][c] = self.sub(zero, sum);
                for k in 0..3 {
                    d[k + 1][c] = flux[k][c];
                }
            }
            for k in 0..4 {
                for c in 0..4 {
                    total[k][c] = self.add(total[k][c], d[k][c]);
                    common[k][c] = self.mul_add(least, d[k][c], common[k][c]);
                }
            }
            for &(j, excess) in above {
                let excess = self.constant(excess);
                for k in 0..4 {
                    let node = MIDDLE[k][j];
                    for c in 0..4 {
                        own[node][c] = self.mul_add(excess, d[k][c], own[node][c]);
                    }
                }
            }
        }
        for k in 0..4 {
            for j in 0..4 {
                let node = MIDDLE[k][j];
                for c in 0..4 {
                    own[node][c] = self.add(own[node][c], common[k][c]);
                }
            }
        }
        for (a, own) in own.iter_mut().enumerate() {
            for c in 0..4 {
                own[c] = T::mul(self.simd, four, own[c]);
                if a < 4 {
                    own[c] = self.sub(own[c], total[a][c]);
                }
            }
        }
        self.add_local(&points, &mut own);
        self.store(&own, r);
    }
}
