//! Rounding errors of the residuals of a problem.

use super::definition::Definition;
use crate::element::Order;
use crate::material::PointMaterial;
use crate::solve::Rounding;

/// Assumed relative rounding error of a nodal force, in units of `f64::EPSILON`.
const SAFETY: f64 = 4.0;

/// Estimates the residuals that rounding errors cause on the mesh of `definition`. `materials` has one entry per region.
pub(super) fn rounding(definition: &Definition, materials: &[PointMaterial]) -> Rounding {
    let mesh = &definition.mesh;
    let nodes = match definition.order {
        Order::Linear => 4.0,
        Order::Quadratic => 10.0,
    };
    let modulus = |material: &PointMaterial| material.moduli.longitudinal();
    let stiffest = materials.iter().map(modulus).fold(0.0, f64::max);
    let (mut forces, mut damage) = (0.0, 0.0);
    for tet in 0..mesh.tets.len() {
        let material = &materials[usize::from(mesh.region_of[tet])];
        let volume = mesh.tet_volume(tet);
        let size = volume.cbrt();
        let mixed = mesh.mixture.as_ref().is_some_and(|mixture| mixture[tet].fraction > 0.0);
        let modulus = if mixed { stiffest } else { modulus(material) };
        forces += (modulus * size).powi(2);
        if let Some(d) = &material.damage {
            damage += (d.local * volume + d.gradient * size).powi(2);
        }
    }
    let norm = |squares: f64| SAFETY * f64::EPSILON * (nodes * squares).sqrt();
    Rounding { force_per_mm: norm(forces), force: 0.0, damage: norm(damage) }
}
