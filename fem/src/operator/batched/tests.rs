//! Elements in batches against elements one by one.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::element::{DamageRule, Linear, Quadratic, Rule, Tetrahedron};
use crate::fields::Fields;
use crate::material::{Material, PhaseField, Split};
use crate::operator::Span;
use crate::operator::element::Element;
use crate::operator::tests::{cube, materials};

/// The greatest |x − y|, and the greatest |y|.
fn distance(pairs: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    pairs.fold([0.0f64; 2], |[d, m], (x, y)| {
        assert!(x.is_finite());
        [d.max((x - y).abs()), m.max(y.abs())]
    })
}

fn assert_as_alone<const N: usize, T: Tetrahedron<N>>(
    rule: DamageRule,
    field: PhaseField,
    coupled: bool,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(31);
    let mesh = cube(2, &mut rng);
    let space = Space::new::<T>(&mesh, Rule::new::<T>(rule));
    let nodes = space.nodes.len();
    // the stiff region is elastic
    let materials = materials(Material::hencky, field, rule == DamageRule::Absent);
    let materials = if rule == DamageRule::Absent {
        materials.into_iter().map(|m| PointMaterial { damage: None, ..m }).collect()
    } else {
        materials
    };
    let mut random = |size: f64| size * rng.random_range(-1.0..1.0);
    for size in [1.0, 1e-4, 1e-9] {
        let fields = Fields {
            displacement: space
                .nodes
                .iter()
                .map(|x| {
                    let pull = if x[0] < 0.5 { 0.1 } else { -0.1 };
                    std::array::from_fn(|k| pull * size * x[k] + random(0.03 * size))
                })
                .collect(),
            damage: (0..nodes).map(|_| 0.5 + random(0.4)).collect(),
        };
        let before: Vec<f64> = fields.damage.iter().map(|phi| 0.9 * phi).collect();
        let points = space.tets.len() * space.rule.points.len();
        let history: Vec<f64> = (0..points).map(|_| random(3.0 * size * size).abs()).collect();
        for history in [&[][..], &history] {
            let span = Span { history, ..Span::new(&before, 0.1) };
            let increment = Increment { materials: &materials, fields: &fields, span };
            let batched = Batched::new(&space, &increment).expect("Hencky solids of one split");
            // the last batch is not full
            let all = space.tets.len() - 3;
            let mut residuals = vec![ElementResidual::zero(); all];
            let mut tangents = vec![[[[[0.0; 4]; 4]; N]; N]; all];
            batched.residuals(0, &mut residuals).expect("no element is inverted");
            batched.tangents(0, coupled, &mut tangents).expect("no element is inverted");
            for tet in 0..all {
                let element = Element::gather(&space, tet, &increment);
                let one = element.residual().expect("as before");
                let mut blocks = [[[[0.0; 4]; 4]; N]; N];
                element.tangent(coupled, &mut blocks).expect("as before");
                let pairs = |k: usize| {
                    let nodal = residuals[tet].nodal.iter().zip(&one.nodal);
                    nodal.map(move |(x, y)| (x[k], y[k]))
                };
                let force = distance((0..3).flat_map(pairs));
                let source = distance(pairs(3));
                let drive = distance(residuals[tet].drive.into_iter().zip(one.drive));
                let [many, one] =
                    [&residuals[tet], &one].map(|r| [r.elastic, r.fracture, r.viscous]);
                let energies = many.into_iter().zip(one).map(|pair| distance([pair].into_iter()));
                let block = |k: fn(usize, usize) -> bool| {
                    let pairs = (0..N).flat_map(|a| (0..=a).map(move |b| (a, b)));
                    let entries = pairs.flat_map(|(a, b)| {
                        (0..16).map(move |e| (a, b, e / 4, e % 4)).filter(move |e| k(e.2, e.3))
                    });
                    distance(
                        entries.map(|(a, b, i, j)| (tangents[tet][a][b][i][j], blocks[a][b][i][j])),
                    )
                };
                let displacement = block(|i, j| i < 3 && j < 3);
                let damage = block(|i, j| i == 3 && j == 3);
                let mixed = block(|i, j| (i < 3) != (j < 3));
                let parts = [force, source, drive, displacement, damage, mixed];
                for (part, [error, size]) in parts.into_iter().chain(energies).enumerate() {
                    assert!(error <= 1e-12 * size, "{error:e} of {size:e}: part {part} of {tet}");
                }
            }
        }
    }
}

#[test]
fn elements_in_batches_equal_elements_alone() {
    let at2 = PhaseField::new(0.3);
    let fields = [
        at2,
        PhaseField { split: Split::VolumetricDeviatoric, ..at2 },
        PhaseField { split: Split::Spectral, model: CrackDensity::At1, ..at2 },
        PhaseField { split: Split::Spectral, hybrid: true, ..at2 },
    ];
    for field in fields {
        for rule in
            [DamageRule::Absent, DamageRule::Vertex, DamageRule::Consistent, DamageRule::Eleven]
        {
            for coupled in [true, false] {
                assert_as_alone::<4, Linear>(rule, field, coupled);
                assert_as_alone::<10, Quadratic>(rule, field, coupled);
            }
        }
    }
}

#[test]
fn other_laws_are_for_single_points() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(32);
    let mesh = cube(2, &mut rng);
    let space = Space::new::<Linear>(&mesh, Rule::new::<Linear>(DamageRule::Vertex));
    let fields = Fields::zero(space.nodes.len());
    let hencky = materials(Material::hencky, PhaseField::new(0.3), false);
    let other = materials(Material::neo_hookean, PhaseField::new(0.3), false);
    let mixed = [hencky[0].clone(), other[1].clone()];
    for (materials, batched) in [(&hencky[..], true), (&other, false), (&mixed, false)] {
        let span = Span::new(&fields.damage, 1.0);
        let increment = Increment { materials, fields: &fields, span };
        assert_eq!(Batched::new(&space, &increment).is_some(), batched);
    }
}
