//! C kernels for the residual, the tangent and its diagonal, recorded from the code of the processor.

use std::fmt::Write;

use super::product_source::StoredType;
use crate::device::Kernel;
use crate::element::{Geometry, Rule};
use crate::material::{
    CrackDensity, DamageEnergies, Degradation, DegradationLaw, Degraded, DrivingHistory,
    Homogenisation, LaneLaw, LawForm, MixedPhases, PointSplit, RegionLaw, Split, Term, begin,
    functions, statements,
};
use crate::operator::cpu::Row;
use crate::operator::kernel::DataLayout;
use crate::operator::kernel::{Constants, ElementState, diagonal, linearise, residual};

/// Settings of the model that determine the source of the kernels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    /// Distinct laws of the regions.
    pub laws: Vec<RegionLaw>,
    /// Distinct degradation functions of the regions.
    pub degradations: Vec<DegradationLaw>,
    pub density: CrackDensity,
    /// Whether the largest driving energy so far drives damage.
    pub history: bool,
    /// Homogenisation rule of mixtures; `None` if there are no mixtures.
    pub mixed: Option<Homogenisation>,
}

impl Setting {
    /// Returns the number of state values per elastic point.
    pub(super) fn state_len(&self) -> usize {
        let law = self.laws.iter().map(RegionLaw::state_len).max().unwrap_or(0);
        law + usize::from(self.history)
    }
}

/// Number of values of an element's geometry at a point: the three gradients ∇λ_k, and the volume.
pub(crate) const GEOMETRY: usize = 10;
/// Number of constants per element.
pub(crate) const ROW: usize = size_of::<Row>() / size_of::<f64>();

/// Returns the number of geometries stored per element: 1 for plain elements, else one per elastic point.
pub(crate) fn geometries(rule: &Rule, plain: bool) -> usize {
    if plain { 1 } else { rule.elastic_points.len() }
}

/// Records a computation on an element. The inputs are, in this order: u_x, u_y, u_z, φ of the element's nodes; φ_n
/// of the nodes; the geometry, the material constants and the state of the element; the duration of the increment.
fn record<const N: usize, R>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
    work: impl FnOnce(&ElementState<Term, DrivingHistory<LaneLaw<Term>>, N>, &mut [Term]) -> R,
) -> R {
    begin();
    let mut indices = 0..;
    let mut given = || Term::given(indices.next().expect("an endless range"));
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
    let phases = setting.mixed.filter(|_| !plain).map(|homogenisation| MixedPhases {
        homogenisation,
        matrix: [bulk, shear],
        grain,
        fraction,
    });
    let law = LaneLaw::new(&setting.laws, law, [bulk, shear], phases);
    let law = DrivingHistory { law, active: setting.history };
    let degradation = Degradation { soft, laws: &setting.degradations, law: degradation };
    let state: Vec<Term> =
        (0..setting.state_len() * rule.elastic_points.len()).map(|_| given()).collect();
    let element = ElementState {
        rule,
        constants: Constants { law, degradation, local, gradient, viscous },
        density: setting.density,
        displacement,
        damage,
        before,
        geometry: &geometry,
        plain,
        state: &state,
        duration: given(),
    };
    work(&element, &mut vec![Term::default(); setting.state_len()])
}

/// C code by which a kernel reads the inputs of an element.
struct Inputs {
    /// C statements that compute the addresses of the inputs.
    begin: String,
    nodes: usize,
    geometry: usize,
    /// Number of state values of an element.
    state: usize,
}

impl Inputs {
    const PARAMETERS: [(&'static str, &'static str); 11] = [
        ("index", "slots"),
        ("index", "first"),
        ("index", "count"),
        ("const unsigned *", "nodes"),
        ("const double *", "geometry"),
        ("const unsigned *", "rows"),
        ("const double *", "table"),
        ("const double *", "fields"),
        ("const double *", "before"),
        ("const double *", "state"),
        ("double", "duration"),
    ];

    fn new(rule: &Rule, setting: &Setting, plain: bool) -> Self {
        let mut begin = String::new();
        for a in 0..rule.nodes {
            writeln!(begin, "    index i{a} = nodes[{a} * slots + first + at];")
                .expect("writing to a string cannot fail");
        }
        writeln!(begin, "    const double *row = table + {ROW} * (index)rows[at];")
            .expect("writing to a string cannot fail");
        let (nodes, geometry) = (rule.nodes, GEOMETRY * geometries(rule, plain));
        Self { begin, nodes, geometry, state: setting.state_len() * rule.elastic_points.len() }
    }

    /// Returns the C expression of an input, by its index.
    fn given(&self, index: usize) -> String {
        let Self { nodes, geometry, state, .. } = *self;
        if index < 4 * nodes {
            return format!("fields[4 * i{} + {}]", index / 4, index % 4);
        }
        match index - 4 * nodes {
            a if a < nodes => format!("before[i{a}]"),
            k if k < nodes + geometry => format!("geometry[{} * count + at]", k - nodes),
            k => match k - nodes - geometry {
                k if k < ROW => format!("row[{k}]"),
                k if k < ROW + state => format!("state[{} * count + at]", k - ROW),
                _ => "duration".into(),
            },
        }
    }
}

/// Number of values that the kernels write per slot in addition to nodal values: three energies, and 1 if the element
/// is not inverted.
pub(crate) const SUMS: usize = 4;

/// Creates the kernel for residual and energies, with one element per slot. The kernel writes the contributions of
/// slot s to its node a at index a · slots + s of `copies` (four values) and of `drive` (one value).
pub(crate) fn residual_kernel<const N: usize>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
) -> Kernel {
    let inputs = Inputs::new(rule, setting, plain);
    #[expect(
        clippy::redundant_closure,
        reason = "the function is not general over the lifetime of the element"
    )]
    let residual =
        record::<N, _>(rule, setting, plain, |element, scratch| residual(element, scratch));
    let mut results = residual.nodal.as_flattened().to_vec();
    results.extend(residual.drive);
    results.extend(residual.energies);
    results.push(residual.sound);
    let (lines, results) = statements(&results, &|index| inputs.given(index));
    let mut body = inputs.begin + &lines;
    for (k, value) in results.iter().enumerate() {
        let to = match k {
            k if k < 4 * N => format!("copies[4 * ({} * slots + first + at) + {}]", k / 4, k % 4),
            k if k < 5 * N => format!("drive[{} * slots + first + at]", k - 4 * N),
            k => format!("sums[{SUMS} * (first + at) + {}]", k - 5 * N),
        };
        writeln!(body, "    {to} = {value};").expect("writing to a string cannot fail");
    }
    let outputs = [("double *", "copies"), ("double *", "drive"), ("double *", "sums")];
    let name = if plain { "plain_residual" } else { "residual" };
    Kernel::new(name, &[&Inputs::PARAMETERS[..], &outputs].concat(), body).calling(functions())
}

/// Creates the kernel for the stored data of an element's fully coupled tangent. The kernel writes the packs that the
/// product reads.
pub(crate) fn tangent_kernel<const N: usize>(
    rule: &Rule,
    setting: &Setting,
    plain: bool,
    stored: StoredType,
) -> Kernel {
    let inputs = Inputs::new(rule, setting, plain);
    let width = DataLayout::new(rule, plain).width();
    let mut results = vec![Term::default(); width];
    let sound = record::<N, _>(rule, setting, plain, |element, scratch| {
        linearise::<_, _, false, N>(element, true, &mut results, scratch)
    });
    results.push(sound);
    let (lines, results) = statements(&results, &|index| inputs.given(index));
    let mut body = inputs.begin + &lines + &stored.declare(stored.write, width);
    for (k, value) in results[..width].iter().enumerate() {
        writeln!(body, "    {} = {value};", stored.entry(k))
            .expect("writing to a string cannot fail");
    }
    writeln!(body, "    sums[{SUMS} * (first + at) + 3] = {};", results[width])
        .expect("writing to a string cannot fail");
    let outputs = [(stored.write, "data"), ("double *", "sums")];
    let name = if plain { "plain_tangent" } else { "tangent" };
    Kernel::new(name, &[&Inputs::PARAMETERS[..], &outputs].concat(), body).calling(functions())
}

/// Creates the kernel for the diagonal of an element's tangent. This kernel reads the stored data and writes the
/// contributions of the elements to their nodes, in the same layouts as the kernel of the product.
pub(crate) fn diagonal_kernel(rule: &Rule, plain: bool, stored: StoredType) -> Kernel {
    begin();
    let width = DataLayout::new(rule, plain).width();
    let tangent_data: Vec<Term> = (0..width).map(Term::given).collect();
    let of_nodes = match rule.nodes {
        4 => diagonal::<Term, 4>(rule, plain, &tangent_data).to_vec(),
        _ => diagonal::<Term, 10>(rule, plain, &tangent_data).to_vec(),
    };
    let (lines, results) = statements(of_nodes.as_flattened(), &|index| stored.entry(index));
    let mut body = stored.declare(stored.read, width) + &lines;
    for (k, value) in results.iter().enumerate() {
        writeln!(body, "    copies[4 * ({} * slots + first + at) + {}] = {value};", k / 4, k % 4)
            .expect("writing to a string cannot fail");
    }
    let parameters =
        [("index", "slots"), ("index", "first"), (stored.read, "data"), ("double *", "copies")];
    Kernel::new(if plain { "plain_diagonal" } else { "diagonal" }, &parameters, body)
}

/// Creates the kernel that sums the energies and counts the inverted elements of each block of `block` slots.
pub(crate) fn block_sum(block: usize) -> Kernel {
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

/// Creates kernels for a test: quadratic elements, a law with a split, and mixtures.
pub fn equations_kernels(rule: &Rule) -> Vec<Kernel> {
    let split = PointSplit::Standard(Split::Spectral);
    let setting = Setting {
        laws: vec![RegionLaw {
            strength: None,
            form: LawForm::Hencky,
            inelastic: None,
            energies: DamageEnergies::default(),
            degraded: Degraded { split, hybrid: false },
        }],
        degradations: vec![DegradationLaw::Quadratic],
        density: CrackDensity::At2,
        history: true,
        mixed: Some(Homogenisation::GeometricMean),
    };
    let kernels_of_kind = |plain| {
        [
            residual_kernel::<10>(rule, &setting, plain),
            tangent_kernel::<10>(rule, &setting, plain, StoredType::new::<f32>()),
            diagonal_kernel(rule, plain, StoredType::new::<f32>()),
        ]
    };
    [true, false].into_iter().flat_map(kernels_of_kind).chain([block_sum(256)]).collect()
}
