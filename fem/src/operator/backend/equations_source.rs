//! C kernels for the residual, the tangent and its diagonal, recorded from the code of the processor.

use std::fmt::Write;

use super::product_source::CNumbers;
use super::regions::Row;
use crate::device::Kernel;
use crate::element::{Geometry, Rule};
use crate::material::{
    CrackDensity, Degradation, DegradationLaw, Degraded, Homogenisation, LaneLaw, LawForm,
    MixedPhases, PointSplit, RegionLaw, Split, Term, begin, functions, statements,
};
use crate::operator::blocks::diagonal;
use crate::operator::element::{Constants, ElementState};
use crate::operator::point_data::PointData;

/// Model choices that all elements share.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Setting {
    /// The laws and degradation functions of the regions.
    pub(super) laws: Vec<RegionLaw>,
    pub(super) degradations: Vec<DegradationLaw>,
    pub(super) density: CrackDensity,
    /// Homogenisation rule of mixtures; `None` if there are no mixtures.
    pub(super) mixed: Option<Homogenisation>,
}

/// Number of geometry values per elastic point: ∇λ_k and the volume.
pub(super) const GEOMETRY: usize = 10;
/// Number of constants per element.
pub(super) const ROW: usize = size_of::<Row>() / size_of::<f64>();

/// Number of geometries stored per element: 1 if it is straight, else one per elastic point.
pub(super) fn geometries(rule: &Rule, plain: bool) -> usize {
    if plain { 1 } else { rule.points.len() }
}

/// Records a computation on an element. The inputs are, in this order, the values u_x, u_y, u_z, φ of its
/// nodes, φ_n of its nodes, its geometry, and its constants.
fn record<const N: usize, R>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
    work: impl FnOnce(&ElementState<Term, LaneLaw<Term>, N>) -> R,
) -> R {
    begin();
    let mut places = 0..;
    let mut given = || Term::given(places.next().expect("places do not end"));
    let (mut displacement, mut damage) = ([[Term::default(); 3]; N], [Term::default(); N]);
    for a in 0..N {
        displacement[a] = std::array::from_fn(|_| given());
        damage[a] = given();
    }
    let before = std::array::from_fn(|_| given());
    let geometry: Vec<Geometry<Term>> = (0..geometries(rule, plain))
        .map(|_| {
            let barycentric = std::array::from_fn(|_| std::array::from_fn(|_| given()));
            Geometry { barycentric, volume: given() }
        })
        .collect();
    let row: [Term; ROW] = std::array::from_fn(|_| given());
    let [bulk, shear, soft, local, gradient, viscous, law, degradation, fraction, grain @ ..] = row;
    let phases = setting.mixed.filter(|_| !plain).map(|rule| MixedPhases {
        rule,
        matrix: [bulk, shear],
        grain,
        fraction,
    });
    let law = LaneLaw::new(&setting.laws, law, [bulk, shear], phases);
    let degradation = Degradation { soft, laws: &setting.degradations, law: degradation };
    work(&ElementState {
        rule,
        constants: Constants { law, degradation, local, gradient, viscous },
        density: setting.density,
        displacement,
        damage,
        before,
        geometry: &geometry,
        plain,
        history: None,
    })
}

/// C code with which a kernel reads the inputs of an element.
struct Inputs {
    /// C statements that compute the addresses of the inputs.
    begin: String,
    nodes: usize,
    geometry: usize,
}

impl Inputs {
    const PARAMETERS: [(&'static str, &'static str); 9] = [
        ("index", "slots"),
        ("index", "first"),
        ("index", "count"),
        ("const unsigned *", "nodes"),
        ("const double *", "geometry"),
        ("const unsigned *", "rows"),
        ("const double *", "table"),
        ("const double *", "fields"),
        ("const double *", "before"),
    ];

    fn new(rule: &Rule, plain: bool) -> Self {
        let mut begin = String::new();
        for a in 0..rule.nodes {
            writeln!(begin, "    index i{a} = nodes[{a} * slots + first + at];")
                .expect("a string takes all");
        }
        writeln!(begin, "    const double *row = table + {ROW} * (index)rows[at];")
            .expect("a string takes all");
        Self { begin, nodes: rule.nodes, geometry: GEOMETRY * geometries(rule, plain) }
    }

    /// The C expression of the input with index `place`.
    fn given(&self, place: usize) -> String {
        let Self { nodes, geometry, .. } = *self;
        if place < 4 * nodes {
            return format!("fields[4 * i{} + {}]", place / 4, place % 4);
        }
        match place - 4 * nodes {
            a if a < nodes => format!("before[i{a}]"),
            k if k < nodes + geometry => format!("geometry[{} * count + at]", k - nodes),
            k => format!("row[{}]", k - nodes - geometry),
        }
    }
}

/// Values that the kernels write per slot in addition to nodal values: three energies, and whether the
/// element is sound (not inverted).
pub(super) const SUMS: usize = 4;

/// The kernel for residual and energies, one element per slot. It writes the contributions of slot s to its
/// node a at index a · slots + s of `copies` (four values) and `drive` (one value).
pub(super) fn residual_kernel<const N: usize>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
) -> Kernel {
    let inputs = Inputs::new(rule, plain);
    let residual = record::<N, _>(rule, setting, plain, |element| element.residual());
    let mut results = residual.nodal.as_flattened().to_vec();
    results.extend(residual.drive);
    results.extend(residual.energies);
    results.push(residual.sound);
    let (lines, results) = statements(&results, &|place| inputs.given(place));
    let mut body = inputs.begin + &lines;
    for (k, value) in results.iter().enumerate() {
        let to = match k {
            k if k < 4 * N => format!("copies[4 * ({} * slots + first + at) + {}]", k / 4, k % 4),
            k if k < 5 * N => format!("drive[{} * slots + first + at]", k - 4 * N),
            k => format!("sums[{SUMS} * (first + at) + {}]", k - 5 * N),
        };
        writeln!(body, "    {to} = {value};").expect("a string takes all");
    }
    let outputs = [("double *", "copies"), ("double *", "drive"), ("double *", "sums")];
    let name = if plain { "plain_residual" } else { "residual" };
    Kernel::new(name, &[&Inputs::PARAMETERS[..], &outputs].concat(), body).calling(functions())
}

/// The kernel for the point data of an element's fully coupled tangent, written to the packs that the product
/// reads.
pub(super) fn tangent_kernel<const N: usize>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
    stored: CNumbers,
) -> Kernel {
    let inputs = Inputs::new(rule, plain);
    let width = PointData::of(rule, plain).width();
    let mut results = vec![Term::default(); width];
    let sound = record::<N, _>(rule, setting, plain, |element| {
        element.linearise::<false>(true, &mut results)
    });
    results.push(sound);
    let (lines, results) = statements(&results, &|place| inputs.given(place));
    let mut body = inputs.begin + &lines + &stored.own(stored.write, width);
    for (k, value) in results[..width].iter().enumerate() {
        writeln!(body, "    own[{}] = {value};", stored.lanes * k).expect("a string takes all");
    }
    writeln!(body, "    sums[{SUMS} * (first + at) + 3] = {};", results[width])
        .expect("a string takes all");
    let outputs = [(stored.write, "data"), ("double *", "sums")];
    let name = if plain { "plain_tangent" } else { "tangent" };
    Kernel::new(name, &[&Inputs::PARAMETERS[..], &outputs].concat(), body).calling(functions())
}

/// The kernel for the diagonal of an element's tangent. It reads point data and writes copies as the kernel
/// of the product does.
pub(super) fn diagonal_kernel(rule: &Rule, plain: bool, stored: CNumbers) -> Kernel {
    begin();
    let width = PointData::of(rule, plain).width();
    let numbers: Vec<Term> = (0..width).map(Term::given).collect();
    let of_nodes = match rule.nodes {
        4 => diagonal::<Term, 4>(rule, plain, &numbers).to_vec(),
        _ => diagonal::<Term, 10>(rule, plain, &numbers).to_vec(),
    };
    let (lines, results) =
        statements(of_nodes.as_flattened(), &|place| format!("own[{}]", stored.lanes * place));
    let mut body = stored.own(stored.read, width) + &lines;
    for (k, value) in results.iter().enumerate() {
        writeln!(body, "    copies[4 * ({} * slots + first + at) + {}] = {value};", k / 4, k % 4)
            .expect("a string takes all");
    }
    let parameters =
        [("index", "slots"), ("index", "first"), (stored.read, "data"), ("double *", "copies")];
    Kernel::new(if plain { "plain_diagonal" } else { "diagonal" }, &parameters, body)
}

/// The kernel that sums the energies, and counts the inverted elements, of each block of `block` slots.
pub(super) fn block_sum(block: usize) -> Kernel {
    let body = format!(
        "    double sum[{SUMS}] = {{0.0}};\n    \
         for (index s = {block} * at; s < {block} * (at + 1) && s < slots; s++) {{\n        \
         if (!live[s]) continue;\n        \
         for (int k = 0; k < 3; k++) sum[k] += sums[{SUMS} * s + k];\n        \
         sum[3] += sums[{SUMS} * s + 3] == 1.0 ? 0.0 : 1.0;\n    }}\n    \
         for (int k = 0; k < {SUMS}; k++) out[{SUMS} * at + k] = sum[k];\n"
    );
    let parameters = [
        ("index", "slots"),
        ("const unsigned char *", "live"),
        ("const double *", "sums"),
        ("double *", "out"),
    ];
    Kernel::new("block_sum", &parameters, body)
}

/// The kernels for a test: quadratic elements, a law with a split, and mixtures.
pub fn equations_kernels(rule: &Rule) -> Vec<Kernel> {
    let split = PointSplit::Standard(Split::Spectral);
    let setting = Setting {
        laws: vec![RegionLaw {
            form: LawForm::Hencky,
            degraded: Degraded { split, hybrid: false },
        }],
        degradations: vec![DegradationLaw::Quadratic],
        density: CrackDensity::At2,
        mixed: Some(Homogenisation::GeometricMean),
    };
    let of = |plain| {
        [
            residual_kernel::<10>(rule, &setting, plain),
            tangent_kernel::<10>(rule, &setting, plain, CNumbers::of::<f32>()),
            diagonal_kernel(rule, plain, CNumbers::of::<f32>()),
        ]
    };
    [true, false].into_iter().flat_map(of).chain([block_sum(256)]).collect()
}
