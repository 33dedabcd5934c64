"""Writes vectors.csv: log densities of vectors, matrices and categories with 50 digits.

Needs mpmath. Arguments are the doubles that Rust reads from the same decimals; matrices go row
by row with their zeros. Matrix densities are computed from determinants and traces, with the
Jacobian from W to its Cholesky factor, not as the crate does.
"""

import csv

from mpmath import exp, log, loggamma, matrix, mp, mpf, pi

mp.dps = 80


def numbers(values):
    return [mpf(v) for v in values]


def square(values):
    k = int(len(values) ** 0.5)
    return matrix([numbers(values[i * k:(i + 1) * k]) for i in range(k)])


def dirichlet(x, a):
    x, a = numbers(x), numbers(a)
    return loggamma(sum(a)) - sum(map(loggamma, a)) + sum((a - 1) * log(x) for a, x in zip(a, x))


def categorical_logit(k, l):
    l = numbers(l)
    return l[k[0]] - log(sum(map(exp, l)))


def lkj(x, p):
    """p(R) = c det(R)^(eta - 1) over correlations, times the Jacobian from R to its factor."""
    eta, l = mpf(p[0]), square(x)
    k = l.rows
    constant = (k - 1) * loggamma(eta + mpf(k - 1) / 2) - sum(
        mpf(j) / 2 * log(pi) + loggamma(eta + mpf(k - 1 - j) / 2) for j in range(1, k))
    return constant + sum((k - i - 1 + 2 * eta - 2) * log(l[i, i]) for i in range(1, k))


CORRELATION = [1.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.28, 0.0, 0.96]
CASES = [
    ("Dirichlet", dirichlet, [
        ([0.25, 0.75], [2.0, 3.0]), ([0.25, 0.25, 0.5], [1.0, 1.0, 1.0]),
        ([0.125, 0.375, 0.5], [0.1, 20.0, 3.5]), ([0.125, 0.375, 0.5], [1e-6, 1e-3, 1.0]),
        ([0.25, 0.75], [1e5, 3e5]), ([1e-30, 1.0], [0.5, 0.5]),
    ]),
    ("CategoricalLogit", categorical_logit, [
        ([0], [0.0, 0.0]), ([1], [0.3, -1.2, 2.0]), ([0], [-900.0, 900.0]), ([2], [1e4, 0.0, 1e4]),
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
