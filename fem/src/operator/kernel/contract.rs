//! Tangent at an elastic point, applied to gradients of displacement and damage.
//!
//! With the gradient h of δu in the principal axes and the change δg of the degradation, the stress increment is f_ii
//! = Σ_j D_ij h_jj − τ_i h_ii + τ⁺_i δg and f_ij = G_ij (h_ij + h_ji) + τ_j h_ij. The flux Q Σ_l f_il s_kl is the
//! force that is conjugate to the difference U_k = ∂δu/∂λ_k − ∂δu/∂λ₀. Viscoelastic and plastic laws add the terms of
//! [`ExtraPoint`]. The product with the tangent applies these formulas to a vector; blocks and diagonal apply the
//! formulas to unit vectors U_k.

use super::point_data::{ExtraPoint, StoredPoint, principal_axes};
use crate::material::{Number, dot, packed};

/// Loader of stored entries of type `P` into numbers.
pub(crate) trait Load<P>: Copy {
    type Number: Number;

    fn load(self, entry: &P) -> Self::Number;

    fn constant(self, x: f64) -> Self::Number;
}

/// Loader of entries that are already numbers of type `T`. The field is any number of this type,
/// from which constants are created.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loaded<T>(pub T);

impl<T: Number> Load<T> for Loaded<T> {
    type Number = T;

    #[inline(always)]
    fn load(self, entry: &T) -> T {
        *entry
    }

    #[inline(always)]
    fn constant(self, x: f64) -> T {
        self.0.constant(x)
    }
}

/// Returns a b in the first step of a sum (`step` = 0), a b + c in later steps.
#[inline(always)]
pub(crate) fn first_or_add<V: Number>(step: usize, a: V, b: V, c: V) -> V {
    if step == 0 { a * b } else { a.mul_add(b, c) }
}

/// Tangent at an elastic point: the linear map from the gradients of displacement and damage to the
/// increments of stress and damage forces.
#[derive(Debug)]
pub(crate) struct Contraction<'a, P, L: Load<P>> {
    stored: StoredPoint<'a, P>,
    /// Tangent terms of viscoelastic and plastic laws; `None` for elastic laws.
    extra: Option<ExtraPoint<'a, P>>,
    loader: L,
    /// Principal axes, one per row.
    axes: [[L::Number; 3]; 3],
}

impl<'a, P, V: Number, L: Load<P, Number = V>> Contraction<'a, P, L> {
    /// Creates the tangent with the stored principal axes.
    #[inline(always)]
    pub(crate) fn new(stored: StoredPoint<'a, P>, loader: L) -> Self {
        let [x, y, z, w] = stored.rotation;
        let rotation = [loader.load(x), loader.load(y), loader.load(z), loader.load(w)];
        Self { axes: principal_axes(rotation), stored, extra: None, loader }
    }

    /// Adds the tangent terms of viscoelastic and plastic laws.
    #[inline(always)]
    pub(crate) fn with_extra(self, extra: Option<ExtraPoint<'a, P>>) -> Self {
        Self { extra, ..self }
    }

    /// Creates the tangent with the given principal axes, one per row.
    #[inline(always)]
    pub(crate) fn with_axes(stored: StoredPoint<'a, P>, loader: L, axes: [[V; 3]; 3]) -> Self {
        Self { stored, extra: None, loader, axes }
    }

    /// Returns entry `component` of s_k = Qᵀ F⁻ᵀ ∇λ_k.
    #[inline(always)]
    fn push(&self, k: usize, component: usize) -> V {
        self.loader.load(&self.stored.push[3 * k + component])
    }

    /// Returns the gradient h for the differences U_k, which are the first three fields of `du`.
    #[inline(always)]
    pub(crate) fn gradient<const C: usize>(&self, du: &[[V; C]; 3]) -> [[V; 3]; 3] {
        let mut h = [[self.loader.constant(0.0); 3]; 3];
        for k in 0..3 {
            for i in 0..3 {
                let turned = dot(&self.axes[i], &[du[k][0], du[k][1], du[k][2]]);
                for l in 0..3 {
                    h[i][l] = first_or_add(k, turned, self.push(k, l), h[i][l]);
                }
            }
        }
        h
    }

    /// Returns the gradient h if U_k is the unit vector of the coordinate `axis`, and the other differences are zero.
    #[inline(always)]
    fn unit_gradient(&self, k: usize, axis: usize) -> [[V; 3]; 3] {
        let mut h = self.axes;
        for i in 0..3 {
            for l in 0..3 {
                h[i][l] = self.axes[i][axis] * self.push(k, l);
            }
        }
        h
    }

    /// Returns the stress increment f for the gradient h at constant degradation.
    #[inline(always)]
    pub(crate) fn stress(&self, h: &[[V; 3]; 3]) -> [[V; 3]; 3] {
        let mut f = *h;
        for i in 0..3 {
            for j in 0..3 {
                let normal = self.loader.load(&self.stored.normal[packed(i.max(j), i.min(j))]);
                f[i][i] = first_or_add(j, normal, h[j][j], f[i][i]);
                if i != j {
                    let shear = self.loader.load(&self.stored.shear[3 - i - j]);
                    let stress = self.loader.load(&self.stored.stress[j]) * h[i][j];
                    f[i][j] = shear.mul_add(h[i][j] + h[j][i], stress);
                }
            }
        }
        if let Some(extra) = &self.extra {
            self.add_extra(extra, h, &mut f);
        }
        f
    }

    /// Adds the terms of τ outside the principal axes and of the antisymmetric moduli to the stress increment f, as
    /// [`PointTangent::increment`](crate::material::PointTangent::increment).
    #[inline(always)]
    fn add_extra(&self, extra: &ExtraPoint<'a, P>, h: &[[V; 3]; 3], f: &mut [[V; 3]; 3]) {
        let zero = self.loader.constant(0.0);
        let third = self.loader.constant(-2.0 / 3.0);
        let trace = h[0][0] + h[1][1] + h[2][2];
        let (mut inclined, mut slanted) = (zero, zero);
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let oblique = self.loader.load(&extra.oblique[k]);
            inclined = oblique.mul_add(h[i][j] + h[j][i], inclined);
            slanted = self.loader.load(&extra.skew[k]).mul_add(h[k][k], slanted);
            let moved = third * trace * oblique;
            f[i][j] += moved;
            f[j][i] += moved;
            for row in 0..3 {
                f[row][j] = h[row][i].mul_add(oblique, f[row][j]);
                f[row][i] = h[row][j].mul_add(oblique, f[row][i]);
            }
        }
        for k in 0..3 {
            let skew = self.loader.load(&extra.skew[k]);
            f[k][k] += third * inclined + skew * trace - slanted;
        }
    }

    /// Adds the stress increment that δg causes to f. Returns the increment of the driving energy ∂ψ/∂g that h and δg
    /// cause.
    #[inline(always)]
    pub(crate) fn couple(&self, change_of_g: V, h: &[[V; 3]; 3], f: &mut [[V; 3]; 3]) -> V {
        let mut driving = self.loader.constant(0.0);
        let Some(source) = self.stored.source else { return driving };
        for i in 0..3 {
            let source = self.loader.load(&source[i]);
            f[i][i] = source.mul_add(change_of_g, f[i][i]);
            let driven = match &self.extra {
                Some(extra) => self.loader.load(&extra.driving[i]),
                None => source,
            };
            driving = first_or_add(i, driven, h[i][i], driving);
        }
        if let Some(extra) = &self.extra {
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let source = self.loader.load(&extra.oblique_source[k]);
                f[i][j] = source.mul_add(change_of_g, f[i][j]);
                f[j][i] = source.mul_add(change_of_g, f[j][i]);
                let driven = self.loader.load(&extra.oblique_driving[k]);
                driving = driven.mul_add(h[i][j] + h[j][i], driving);
            }
        }
        if let Some([driving_slope]) = self.stored.driving_slope {
            driving = self.loader.load(driving_slope).mul_add(change_of_g, driving);
        }
        driving
    }

    /// Returns the flux that is conjugate to U_k, for the stress increment f.
    #[inline(always)]
    pub(crate) fn flux(&self, k: usize, f: &[[V; 3]; 3]) -> [V; 3] {
        let mut flux = [self.loader.constant(0.0); 3];
        for i in 0..3 {
            let mut back = flux[0];
            for l in 0..3 {
                back = first_or_add(l, self.push(k, l), f[i][l], back);
            }
            for m in 0..3 {
                flux[m] = first_or_add(i, self.axes[i][m], back, flux[m]);
            }
        }
        flux
    }

    /// Returns the flux of the damage gradient that is conjugate to the difference k of δφ, for the differences
    /// `change`. `shared` is the gradient term that a plain element stores once, with the weight of the point.
    #[inline(always)]
    pub(crate) fn damage_flux(
        &self,
        k: usize,
        change: &[V; 3],
        shared: Option<(&[P; 6], f64)>,
    ) -> V {
        let gradient = self.stored.gradient.or(shared.map(|(gradient, _)| gradient));
        let mut sum = self.loader.constant(0.0);
        let Some(gradient) = gradient else { return sum };
        for l in 0..3 {
            let entry = self.loader.load(&gradient[packed(k.max(l), k.min(l))]);
            sum = first_or_add(l, entry, change[l], sum);
        }
        let weight = shared.map_or(1.0, |(_, weight)| weight);
        self.loader.constant(weight) * sum
    }

    /// Returns the tangent for unit differences: entry (k, l) is the 3 × 3 matrix that maps U_l to the flux conjugate
    /// to U_k. Without tangent terms of inelastic laws, the tangent is symmetric and the entries l > k are zero.
    #[inline(always)]
    pub(crate) fn unit_blocks(&self) -> [[[[V; 3]; 3]; 3]; 3] {
        let zero = self.loader.constant(0.0);
        let mut blocks = [[[[zero; 3]; 3]; 3]; 3];
        for l in 0..3 {
            for j in 0..3 {
                let f = self.stress(&self.unit_gradient(l, j));
                for k in if self.extra.is_some() { 0 } else { l }..3 {
                    let flux = self.flux(k, &f);
                    for i in 0..3 {
                        blocks[k][l][i][j] = flux[i];
                    }
                }
            }
        }
        blocks
    }

    /// Returns, for δg = 1, the flux that is conjugate to each difference U_k.
    #[inline(always)]
    pub(crate) fn unit_source(&self) -> [[V; 3]; 3] {
        let zero = self.loader.constant(0.0);
        let mut f = [[zero; 3]; 3];
        self.couple(self.loader.constant(1.0), &[[zero; 3]; 3], &mut f);
        [self.flux(0, &f), self.flux(1, &f), self.flux(2, &f)]
    }

    /// Returns the flux that is conjugate to each difference U_k, for the derivative of the driving energy with respect
    /// to the strain. This flux equals [`unit_source`](Self::unit_source) if the tangent is symmetric.
    #[inline(always)]
    pub(crate) fn unit_driving(&self) -> [[V; 3]; 3] {
        let Some(extra) = &self.extra else { return self.unit_source() };
        let zero = self.loader.constant(0.0);
        let mut f = [[zero; 3]; 3];
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            f[k][k] = self.loader.load(&extra.driving[k]);
            f[i][j] = self.loader.load(&extra.oblique_driving[k]);
            f[j][i] = f[i][j];
        }
        [self.flux(0, &f), self.flux(1, &f), self.flux(2, &f)]
    }

    /// Returns the second derivative of the energy with respect to g; `None` in plain elements.
    #[inline(always)]
    pub(crate) fn driving_slope(&self) -> Option<V> {
        self.stored.driving_slope.map(|[driving_slope]| self.loader.load(driving_slope))
    }
}
