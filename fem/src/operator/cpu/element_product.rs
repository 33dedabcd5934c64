//! Product with the matrix-free tangent for one register of elements.

use std::marker::PhantomData;

use faer::traits::pulp::Simd;

use super::lanes::{Precision, prefetch};
use crate::material::Number;
use crate::operator::kernel::{Contraction, DataLayout, Load, first_or_add};
use crate::operator::layout::{Layout, MIDDLE};

/// Product for one register of elements with `C` fields per node, `D` damage points and `L` stored entries of the
/// damage terms without gradients. `PLAIN` elements are straight, are not mixtures, and have no tangent terms of
/// viscoelastic and plastic laws.
#[derive(Debug)]
pub(crate) struct ElementProduct<
    'a,
    T: Precision,
    S,
    const PLAIN: bool,
    const C: usize,
    const D: usize,
    const L: usize,
> {
    pub layout: &'a Layout,
    pub simd: S,
    /// Index of the SIMD register within a pack. A pack of 32 bytes contains one value of each of several
    /// elements.
    pub register: usize,
    /// Stored tangent data; the data of the elements in this register come first.
    pub data: &'a [T::Pack],
}

/// Loader that reads one SIMD register from a pack of precision `T`.
#[derive(Clone, Copy)]
struct PackLoader<T, S> {
    simd: S,
    register: usize,
    precision: PhantomData<T>,
}

impl<T: Precision, S: Simd> Load<T::Pack> for PackLoader<T, S> {
    type Number = T::Register<S>;

    #[inline(always)]
    fn load(self, pack: &T::Pack) -> T::Register<S> {
        T::load(self.simd, pack, self.register)
    }

    #[inline(always)]
    fn constant(self, x: f64) -> T::Register<S> {
        T::splat(self.simd, x)
    }
}

/// Prefetch distance, in packs.
const AHEAD: usize = 128;
/// Number of packs in a cache line.
const PER_LINE: usize = 2;

/// Values at the damage points: φ, g′ φ, and the sum of the driving energies from the elastic points.
struct DamagePoints<V, const D: usize> {
    phi: [V; D],
    change_of_g: [V; D],
    drive: [V; D],
}

impl<T: Precision, S: Simd, const PLAIN: bool, const C: usize, const D: usize, const L: usize>
    ElementProduct<'_, T, S, PLAIN, C, D, L>
{
    #[inline(always)]
    fn data_layout(&self) -> DataLayout {
        let layout = DataLayout::for_kind(self.layout.rule.elastic_points.len(), D, L, PLAIN);
        layout.with_extra(!PLAIN && self.layout.rule.extra.stored)
    }

    #[inline(always)]
    fn loader(&self) -> PackLoader<T, S> {
        PackLoader { simd: self.simd, register: self.register, precision: PhantomData }
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> T::Register<S> {
        self.loader().constant(x)
    }

    /// Prefetches `count` packs from index `offset + AHEAD` on, which later elements use.
    #[inline(always)]
    fn prefetch_after(&self, offset: usize, count: usize) {
        for k in (0..count).step_by(PER_LINE) {
            prefetch(self.data, offset + AHEAD + k);
        }
    }

    /// Returns φ and g′ φ at the damage points, with zero driving energy.
    #[inline(always)]
    fn damage_points<const N: usize>(
        &self,
        u: &[[T::Register<S>; C]; N],
    ) -> DamagePoints<T::Register<S>, D> {
        let zero = self.constant(0.0);
        let mut at_damage_points =
            DamagePoints { phi: [zero; D], change_of_g: [zero; D], drive: [zero; D] };
        if D == 0 {
            return at_damage_points;
        }
        self.prefetch_after(0, D);
        let slopes = self.data_layout().degradation_slopes(self.data);
        for p in 0..D {
            if self.layout.nodal {
                at_damage_points.phi[p] = u[p % N][C - 1];
            } else {
                let shape = &self.layout.rule.damage[p].shape;
                for b in 0..N {
                    at_damage_points.phi[p] =
                        self.constant(shape[b]).mul_add(u[b][C - 1], at_damage_points.phi[p]);
                }
            }
            at_damage_points.change_of_g[p] =
                self.loader().load(&slopes[p]) * at_damage_points.phi[p];
        }
        at_damage_points
    }

    /// Returns the flux at elastic point q for the differences `du` = ∂u/∂λ_k − ∂u/∂λ₀ of the fields, and adds the
    /// driving energy to `at_damage_points`.
    #[inline(always)]
    fn flux(
        &self,
        q: usize,
        du: &[[T::Register<S>; C]; 3],
        at_damage_points: &mut DamagePoints<T::Register<S>, D>,
    ) -> [[T::Register<S>; C]; 3] {
        let zero = self.constant(0.0);
        let layout = self.data_layout();
        self.prefetch_after(layout.point_offset(q), layout.per_point());
        let mut tangent = Contraction::new(layout.point(q, self.data), self.loader());
        if !PLAIN {
            tangent = tangent.with_extra(layout.extra(q, self.data));
        }
        let h = tangent.gradient(du);
        let mut f = tangent.stress(&h);
        let mut flux = [[zero; C]; 3];
        if D > 0 {
            let rule = &self.layout.rule;
            let mixing = rule.mixing[q].first_chunk::<D>().expect("a share of each point");
            let mut change_of_g = zero;
            for p in 0..D {
                let share = self.constant(mixing[p]);
                change_of_g = first_or_add(p, share, at_damage_points.change_of_g[p], change_of_g);
            }
            let driving = tangent.couple(change_of_g, &h, &mut f);
            for p in 0..D {
                let share = self.constant(mixing[p]);
                at_damage_points.drive[p] =
                    first_or_add(q, share, driving, at_damage_points.drive[p]);
            }
            let mut shared = None;
            if PLAIN {
                shared = Some((layout.shared_gradient(self.data), rule.elastic_points[q].weight));
            }
            let change = [du[0][C - 1], du[1][C - 1], du[2][C - 1]];
            for k in 0..3 {
                flux[k][C - 1] = tangent.damage_flux(k, &change, shared);
            }
        }
        for k in 0..3 {
            let of_displacement = tangent.flux(k, &f);
            flux[k][..3].copy_from_slice(&of_displacement);
        }
        flux
    }

    /// Adds the terms of the φ equations that contain no gradient of the shape functions.
    #[inline(always)]
    fn add_local<const N: usize>(
        &self,
        at_damage_points: &DamagePoints<T::Register<S>, D>,
        r: &mut [[T::Register<S>; C]; N],
    ) {
        if D == 0 {
            return;
        }
        let (layout, loader) = (self.data_layout(), self.loader());
        self.prefetch_after(layout.point_offset(self.layout.rule.elastic_points.len()), L);
        let slopes = layout.degradation_slopes(self.data);
        for p in 0..D {
            let drive = loader.load(&slopes[p]) * at_damage_points.drive[p];
            let value =
                loader.load(layout.local(p, self.data)).mul_add(at_damage_points.phi[p], drive);
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

    /// Returns the product for linear elements, by node and field.
    #[inline(always)]
    pub(crate) fn linear<const N: usize>(
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
        let mut at_damage_points = self.damage_points(u);
        let flux = self.flux(0, &du, &mut at_damage_points);
        let mut r = [[zero; C]; N];
        for c in 0..C {
            r[0][c] = -(flux[0][c] + flux[1][c] + flux[2][c]);
            for k in 0..3 {
                r[k + 1][c] = flux[k][c];
            }
        }
        self.add_local(&at_damage_points, &mut r);
        r
    }

    /// Returns the product for quadratic elements, by node and field.
    ///
    /// Let u_k be u at vertex k and u_kj be u at the node between the vertices k and j, with u_kk = u_k. Then ∂u/∂λ_k =
    /// 4 Σ_j λ_j u_kj − u_k. At each elastic point, λ_j is split into the smallest λ and an excess. The sum with the
    /// smallest λ is computed once for all points.
    #[inline(always)]
    pub(crate) fn quadratic<const N: usize>(
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
        let mut at_damage_points = self.damage_points(u);
        let (mut total, mut common) = ([[zero; C]; 4], [[zero; C]; 4]);
        let mut nodal = [[zero; C]; N];
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
            let flux = self.flux(q, &du, &mut at_damage_points);
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
                        nodal[node][c] = excess.mul_add(d[k][c], nodal[node][c]);
                    }
                }
            }
        }
        for k in 0..4 {
            for j in 0..4 {
                for c in 0..C {
                    nodal[MIDDLE[k][j]][c] += common[k][c];
                }
            }
        }
        for a in 0..N {
            for c in 0..C {
                nodal[a][c] = four * nodal[a][c];
                if a < 4 {
                    nodal[a][c] = nodal[a][c] - total[a][c];
                }
            }
        }
        self.add_local(&at_damage_points, &mut nodal);
        nodal
    }
}
