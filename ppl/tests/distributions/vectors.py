"""Writes vectors.csv: log densities of matrices with 50 digits.

Needs mpmath. Arguments are the doubles that Rust reads from the same decimals; matrices go row
by row with their zeros. Matrix densities are computed from determinants and traces, with the
Jacobian from W to its Cholesky factor, not as the crate does.
"""

import csv

from mpmath import log, loggamma, matrix, mp, mpf, pi

mp.dps = 80


def numbers(values):
    return [mpf(v) for v in values]


def square(values):
    k = int(len(values) ** 0.5)
    return matrix([numbers(values[i * k:(i + 1) * k]) for i in range(k)])


def lkj(x, p):
    """p(R) = c det(R)^(eta - 1) over correlations, times the Jacobian from R to its factor."""
    eta, l = mpf(p[0]), square(x)
    k = l.rows
    constant = (k - 1) * loggamma(eta + mpf(k - 1) / 2) - sum(
        mpf(j) / 2 * log(pi) + loggamma(eta + mpf(k - 1 - j) / 2) for j in range(1, k))
    return constant + sum((k - i - 1 + 2 * eta - 2) * log(l[i, i]) for i in range(1, k))


CORRELATION = [1.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.28, 0.0, 0.96]
CASES = [
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
