"""Writes vectors.csv: log densities of vectors, matrices and categories with 50 digits.

Needs mpmath. Arguments are the doubles that Rust reads from the same decimals; matrices go row
by row with their zeros. Matrix densities are computed from determinants and traces, with the
Jacobian from W to its Cholesky factor, not as the crate does.
"""

import csv

from mpmath import det, erfc, exp, inf, inverse, log, loggamma, matrix, mp, mpf, pi, sqrt

mp.dps = 80


def numbers(values):
    return [mpf(v) for v in values]


def square(values):
    k = int(len(values) ** 0.5)
    return matrix([numbers(values[i * k:(i + 1) * k]) for i in range(k)])


def dirichlet(x, a):
    x, a = numbers(x), numbers(a)
    return loggamma(sum(a)) - sum(map(loggamma, a)) + sum((a - 1) * log(x) for a, x in zip(a, x))


def multinomial(k, p):
    p = numbers(p)
    ways = loggamma(mpf(sum(k)) + 1) - sum(loggamma(mpf(k) + 1) for k in k)
    return ways + sum(k * log(p) for k, p in zip(k, p))


def categorical_logit(k, l):
    l = numbers(l)
    return l[k[0]] - log(sum(map(exp, l)))


def ordered_logistic(k, p):
    eta, *cuts = numbers(p)
    below = lambda c: 1 / (1 + exp(eta - c))
    edges = [mpf(0)] + [below(c) for c in cuts] + [mpf(1)]
    return log(edges[k[0] + 1] - edges[k[0]])


def ordered_probit(k, p):
    eta, *cuts = numbers(p)
    edges = [-inf] + [c - eta for c in cuts] + [inf]
    a, b = edges[k[0]], edges[k[0] + 1]
    if a + b < 0:
        a, b = -b, -a
    return log((erfc(a / sqrt(2)) - erfc(b / sqrt(2))) / 2)


def student_t(x, p):
    n = len(x)
    nu, mean, l = mpf(p[0]), matrix(numbers(p[1:1 + n])), square(p[1 + n:])
    s = l * l.T
    d = matrix(numbers(x)) - mean
    q = (d.T * inverse(s) * d)[0]
    return (loggamma((nu + n) / 2) - loggamma(nu / 2) - mpf(n) / 2 * log(nu * pi)
            - log(det(s)) / 2 - (nu + n) / 2 * log(1 + q / nu))


def wishart_common(nu, k, l):
    multigamma = mpf(k * (k - 1)) / 4 * log(pi) + sum(loggamma((nu - i) / 2) for i in range(k))
    jacobian = k * log(mpf(2)) + sum((k - i) * log(l[i, i]) for i in range(k))
    return -nu * k / 2 * log(mpf(2)) - multigamma + jacobian


def wishart(x, p):
    nu, l, s = mpf(p[0]), square(x), square(p[1:])
    w, v, k = l * l.T, s * s.T, l.rows
    inner = inverse(v) * w
    trace = sum(inner[i, i] for i in range(k))
    return ((nu - k - 1) / 2 * log(det(w)) - trace / 2 - nu / 2 * log(det(v))
            + wishart_common(nu, k, l))


def inverse_wishart(x, p):
    nu, l, s = mpf(p[0]), square(x), square(p[1:])
    w, v, k = l * l.T, s * s.T, l.rows
    inner = v * inverse(w)
    trace = sum(inner[i, i] for i in range(k))
    return (-(nu + k + 1) / 2 * log(det(w)) - trace / 2 + nu / 2 * log(det(v))
            + wishart_common(nu, k, l))


def lkj(x, p):
    """p(R) = c det(R)^(eta - 1) over correlations, times the Jacobian from R to its factor."""
    eta, l = mpf(p[0]), square(x)
    k = l.rows
    constant = (k - 1) * loggamma(eta + mpf(k - 1) / 2) - sum(
        mpf(j) / 2 * log(pi) + loggamma(eta + mpf(k - 1 - j) / 2) for j in range(1, k))
    return constant + sum((k - i - 1 + 2 * eta - 2) * log(l[i, i]) for i in range(1, k))


UNIT = [1.0, 0.0, 0.5, 2.0]
SKEW = [1.5, 0.0, 0.0, -0.25, 0.75, 0.0, 0.5, 1.25, 2.0]
CORRELATION = [1.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.28, 0.0, 0.96]
CASES = [
    ("Dirichlet", dirichlet, [
        ([0.25, 0.75], [2.0, 3.0]), ([0.25, 0.25, 0.5], [1.0, 1.0, 1.0]),
        ([0.125, 0.375, 0.5], [0.1, 20.0, 3.5]), ([0.125, 0.375, 0.5], [1e-6, 1e-3, 1.0]),
        ([0.25, 0.75], [1e5, 3e5]), ([1e-30, 1.0], [0.5, 0.5]),
    ]),
    ("Multinomial", multinomial, [
        ([1, 2, 3], [0.25, 0.25, 0.5]), ([0, 0, 7], [0.25, 0.25, 0.5]),
        ([1000, 3000], [0.25, 0.75]), ([100000, 0, 5], [0.5, 0.25, 0.25]),
    ]),
    ("CategoricalLogit", categorical_logit, [
        ([0], [0.0, 0.0]), ([1], [0.3, -1.2, 2.0]), ([0], [-900.0, 900.0]), ([2], [1e4, 0.0, 1e4]),
    ]),
    ("OrderedLogistic", ordered_logistic, [
        ([0], [0.3, -1.0, 0.5]), ([1], [0.3, -1.0, 0.5]), ([2], [0.3, -1.0, 0.5]),
        ([1], [0.0, 40.0, 40.0009765625]), ([1], [0.0, -60.0, -50.0]), ([0], [90.0, 10.0]),
        ([1], [-80.0, 10.0]),
    ]),
    ("OrderedProbit", ordered_probit, [
        ([0], [0.3, -1.0, 0.5]), ([1], [0.3, -1.0, 0.5]), ([2], [0.3, -1.0, 0.5]),
        ([1], [0.0, 40.0, 40.0009765625]), ([1], [0.0, -60.0, -50.0]), ([0], [90.0, 10.0]),
        ([1], [-80.0, 10.0]),
    ]),
    ("MvStudentTCholesky", student_t, [
        ([0.5, -1.0], [3.0, 0.0, 1.0] + UNIT), ([0.5, -1.0, 2.0], [0.25, 0.0, 1.0, 0.5] + SKEW),
        ([0.5, -1.0], [1e9, 0.0, 1.0] + UNIT), ([1e8, -1e8], [4.0, 0.0, 1.0] + UNIT),
    ]),
    ("WishartCholesky", wishart, [
        (UNIT, [3.0] + UNIT), (UNIT, [1.125] + UNIT), (SKEW, [4.5] + CORRELATION),
        (CORRELATION, [250.0] + SKEW),
    ]),
    ("InverseWishartCholesky", inverse_wishart, [
        (UNIT, [3.0] + UNIT), (UNIT, [1.125] + UNIT), (SKEW, [4.5] + CORRELATION),
        (CORRELATION, [250.0] + SKEW),
    ]),
    ("LkjCholesky", lkj, [
        (CORRELATION, [1.0]), (CORRELATION, [3.0]), (CORRELATION, [0.01]), (CORRELATION, [500.0]),
    ]),
]

with open("vectors.csv", "w", newline="") as file:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["family", "x", "parameters", "ln_density"])
    for name, density, rows in CASES:
        for x, parameters in rows:
            value = mp.nstr(density(x, parameters), 50)
            spaced = [" ".join(map(repr, v)) for v in (x, parameters)]
            writer.writerow([name, *spaced, value])
