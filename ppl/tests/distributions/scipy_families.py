"""Writes `scipy_families.csv` here; needs scipy.

Each row: family, parameters, point, ln density (log probability), P(X <= x), P(X > x); the probabilities are empty for
vectors.
"""

import pathlib

from scipy import stats

rows = ["family,parameters,point,ln_density,cdf,sf"]


def number(family, parameters, distribution, points):
    ln = distribution.logpmf if hasattr(distribution.dist, "logpmf") else distribution.logpdf
    for x in points:
        tails = [float(distribution.cdf(x)), float(distribution.sf(x))]
        row(family, parameters, [x], float(ln(x)), *tails)


def row(family, parameters, point, *values):
    texts = [" ".join(repr(float(x)) for x in numbers) for numbers in (parameters, point)]
    rows.append(",".join([family, *texts, *(repr(v) for v in values), *[""] * (3 - len(values))]))


for a, b in [(2.5, 4.0), (0.7, 0.3), (40.0, 900.0)]:
    inverse_gamma = stats.invgamma(a, scale=b)
    number("InverseGamma", [a, b], inverse_gamma, inverse_gamma.ppf([0.001, 0.3, 0.5, 0.95]))
for m, s in [(0.0, 1.0), (-3.0, 2.5)]:
    gumbel = stats.gumbel_r(m, s)
    number("Gumbel", [m, s], gumbel, [m - 4 * s, m - s, m + 0.3 * s, m + 30 * s])
for m, s in [(0.0, 1.0), (5.0, 0.2)]:
    number("Cauchy", [m, s], stats.cauchy(m, s), [m - 1e6 * s, m - s, m + 0.3 * s, m + 80 * s])
for a, c, b in [(0.0, 1.0, 4.0), (-2.0, -2.0, 1.0), (-1.0, 3.0, 3.0)]:
    triangular = stats.triang((c - a) / (b - a), loc=a, scale=b - a)
    number("Triangular", [a, c, b], triangular, triangular.ppf([0.01, 0.2, 0.6, 0.99]))
for m, r in [(3.0, 1.0), (20.0, 0.4), (7.5, 1000.0)]:
    number("NegativeBinomial", [m, r], stats.nbinom(r, r / (r + m)), [0, 1, 7, 60])
for alpha, x in [
    ([1.0, 1.0, 1.0], [0.2, 0.3, 0.5]),
    ([0.3, 2.0, 5.5], [0.01, 0.29, 0.7]),
    ([40.0, 2.0, 0.5], [0.93, 0.06, 0.01]),
]:
    row("Dirichlet", alpha, x, float(stats.dirichlet(alpha).logpdf(x)))
for nu, mean, lower, x in [
    (4.0, [1.0, -1.0], [2.0, 0.5, 1.5], [0.3, 2.0]),
    (1.0, [0.0, 0.0], [1.0, -0.4, 0.3], [30.0, -7.0]),
    (200.0, [1.0, 2.0], [0.1, 0.0, 3.0], [1.05, -1.0]),
]:
    a, b, c = lower
    shape = [[a * a, a * b], [a * b, b * b + c * c]]
    ln = stats.multivariate_t(mean, shape, df=nu).logpdf(x)
    row("MvStudentTCholesky", [nu, *mean, *lower], x, float(ln))

path = pathlib.Path(__file__).with_name("scipy_families.csv")
path.write_text("\n".join(rows) + "\n")
