//! Adaptive quadrature of a density that is given by its logarithm.

/// Nodes and weights of the 15-point Kronrod rule, and weights of the embedded 7-point Gauss rule, on (−1, 1). Only the
/// half with nodes ≥ 0 is listed.
///
/// Reference: Piessens et al. (1983), *QUADPACK*, routine `qk15`.
const KRONROD: [(f64, f64, f64); 8] = [
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_56, 0.129_484_966_168_869_7),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_19, 0.0),
    (0.741_531_185_599_394_5, 0.140_653_259_715_525_92, 0.279_705_391_489_276_64),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_42, 0.381_830_050_505_118_9),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_89, 0.0),
    (0.0, 0.209_482_141_084_727_82, 0.417_959_183_673_469_4),
];

/// Largest accepted error of a panel (an interval of the quadrature), relative to the whole integral.
const TOLERANCE: f64 = 1e-14;
/// Relative contribution of a panel to the integral below which no further panels are added on the same side of the
/// middle.
const NEGLIGIBLE: f64 = 1e-20;
/// Largest number of bisections of one panel, sufficient to enclose a kink of the density.
const MOST_BISECTIONS: u32 = 40;
/// Largest number of panels.
const MOST_PANELS: usize = 300;
/// Ends of the panels in t, where scale · (eᵗ − 1) is the distance from the middle. Every power-law tail is
/// exponential in t. The last end is 700, because e⁷⁰⁰ is close to the largest `f64` number.
const ENDS: [f64; 13] = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0, 15.0, 30.0, 70.0, 150.0, 350.0, 700.0];

/// A node of the quadrature, with the logarithm of its unnormalised contribution to the integral.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Index of the density evaluation at the node, counted from 0.
    pub(crate) evaluation: usize,
    pub(crate) ln_weight: f64,
}

/// A panel on one side of the middle.
struct Panel {
    /// −1 below the middle, 1 above the middle.
    side: f64,
    from: f64,
    to: f64,
    bisections: u32,
    nodes: [Node; 15],
    /// Logarithm of the integral over the panel. The field `error` is the estimated error, relative to this integral.
    ln_sum: f64,
    error: f64,
}

/// Integrand: a log density over y as a function of t, with y = middle ± scale · (eᵗ − 1).
struct Integrand<'f> {
    ln_density: &'f mut dyn FnMut(f64) -> f64,
    evaluations: usize,
    middle: f64,
    scales: [f64; 2],
}

impl Integrand<'_> {
    fn scale(&self, side: f64) -> f64 {
        self.scales[usize::from(side > 0.0)]
    }

    fn evaluate(&mut self, y: f64) -> f64 {
        self.evaluations += 1;
        (self.ln_density)(y)
    }

    fn panel(&mut self, side: f64, from: f64, to: f64, bisections: u32) -> Panel {
        let (centre, half, scale) = (0.5 * (from + to), 0.5 * (to - from), self.scale(side));
        let mut nodes = [Node { evaluation: 0, ln_weight: f64::NEG_INFINITY }; 15];
        let mut gauss = [0.0; 15];
        for (i, node) in nodes.iter_mut().enumerate() {
            let (offset, weight, embedded) = KRONROD[if i < 8 { i } else { 14 - i }];
            let t = centre + half * if i < 8 { -offset } else { offset };
            let y = self.middle + side * scale * t.exp_m1();
            let (evaluation, density) = (self.evaluations, self.evaluate(y));
            let value = density + t + (scale * half).ln() + weight.ln();
            // nodes with an undefined or infinite density contribute nothing
            let is_usable = y.is_finite() && value < f64::INFINITY;
            *node =
                Node { evaluation, ln_weight: if is_usable { value } else { f64::NEG_INFINITY } };
            gauss[i] = embedded / weight;
        }
        let largest = nodes.iter().map(|node| node.ln_weight).fold(f64::NEG_INFINITY, f64::max);
        let mut panel =
            Panel { side, from, to, bisections, nodes, ln_sum: f64::NEG_INFINITY, error: 0.0 };
        if largest == f64::NEG_INFINITY {
            return panel;
        }
        let weights = nodes.map(|node| (node.ln_weight - largest).exp());
        let sum: f64 = weights.iter().sum();
        let difference: f64 =
            weights.iter().zip(gauss).map(|(weight, share)| weight * (1.0 - share)).sum();
        let mean = sum / 2.0;
        let deviation: f64 = weights
            .iter()
            .enumerate()
            .map(|(i, weight)| (weight - KRONROD[if i < 8 { i } else { 14 - i }].1 * mean).abs())
            .sum();
        panel.ln_sum = largest + sum.ln();
        let scaled = (200.0 * difference.abs() / deviation.max(f64::MIN_POSITIVE)).powf(1.5);
        panel.error = deviation * scaled.min(1.0) / sum;
        panel
    }

    /// Adjusts the scale on one side of the middle, starting from a first estimate, so that the log density changes
    /// by about 1 over the distance `scale` from the middle.
    fn adjust_scale(&mut self, side: f64, length: f64) {
        let (middle, at_middle) = (self.middle, self.evaluate(self.middle));
        let index = usize::from(side > 0.0);
        let mut scale = self.scales[index];
        let mut change = |d: f64| (self.evaluate(middle + side * d) - at_middle).abs();
        for _ in 0..1100 {
            if change(scale) <= 3.0 || scale < f64::MIN_POSITIVE {
                break;
            }
            scale *= 0.5;
        }
        for _ in 0..1100 {
            if scale >= length || change(2.0 * scale) >= 0.5 {
                break;
            }
            scale *= 2.0;
        }
        self.scales[index] = scale.min(length);
    }
}

/// Returns nodes and weights for integrals of smooth functions times the density `exp(ln_density)` over (`lower`,
/// `upper`). The bounds can be infinite. `middle` must lie inside the interval or at a finite bound. `scales` are
/// first estimates of the widths of the density below and above `middle`.
///
/// Panels are bisected until the relative error of the integral of the density is below 1e-14. Heavy tails and kinks
/// are therefore resolved.
pub(crate) fn density_nodes(
    ln_density: &mut dyn FnMut(f64) -> f64,
    [lower, upper]: [f64; 2],
    middle: f64,
    scales: [f64; 2],
) -> Vec<Node> {
    let mut integrand = Integrand { ln_density, evaluations: 0, middle, scales };
    let mut panels: Vec<Panel> = Vec::new();
    let mut total = f64::NEG_INFINITY;
    for (side, length) in [(-1.0, middle - lower), (1.0, upper - middle)] {
        if length.is_nan() || length <= 0.0 {
            continue;
        }
        integrand.adjust_scale(side, length);
        let last = (length / integrand.scale(side)).ln_1p();
        for pair in ENDS.windows(2) {
            let (from, to) = (pair[0], pair[1].min(last));
            if from >= to {
                break;
            }
            let panel = integrand.panel(side, from, to, 0);
            let share = panel.ln_sum - total;
            total = ln_sum(total, panel.ln_sum);
            panels.push(panel);
            if share < NEGLIGIBLE.ln() {
                break;
            }
        }
    }
    let mut finished = Vec::new();
    while let Some(panel) = panels.pop() {
        let error = panel.error * (panel.ln_sum - total).exp();
        let is_accurate = error <= TOLERANCE || panel.bisections >= MOST_BISECTIONS;
        if is_accurate || finished.len() + panels.len() > MOST_PANELS {
            finished.push(panel);
            continue;
        }
        let Panel { side, from, to, bisections, .. } = panel;
        let centre = 0.5 * (from + to);
        panels.push(integrand.panel(side, from, centre, bisections + 1));
        panels.push(integrand.panel(side, centre, to, bisections + 1));
    }
    let nodes = finished.iter().flat_map(|panel| panel.nodes);
    nodes.filter(|node| node.ln_weight > total - 50.0).collect()
}

/// ln(eᵃ + eᵇ).
fn ln_sum(a: f64, b: f64) -> f64 {
    let (large, small) = if a > b { (a, b) } else { (b, a) };
    if large == f64::NEG_INFINITY { large } else { large + (small - large).exp().ln_1p() }
}
