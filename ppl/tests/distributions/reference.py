"""Writes `ln_density.csv` here and `../unit/special.csv`; needs mpmath.

Every value is computed with 50 digits or more from the textbook formula written below, at
arguments that are exact binary floating-point numbers.
"""

import pathlib

from mpmath import *

mp.dps = 60
HERE = pathlib.Path(__file__).parent

# --- log densities -------------------------------------------------------------------------
# Every family is the list of the terms of its formula, as written in its documentation: the
# largest of them, and the largest of their derivatives, are what an error is measured against.
upper_normal = lambda z: erfc(z / sqrt(2)) / 2
half = mpf(1) / 2
ln_root = log(2 * pi) / 2
ln_beta = lambda a, b: [loggamma(a), loggamma(b), -loggamma(a + b)]
minus = lambda terms: [-t for t in terms]
ln_choose = lambda n, k: [loggamma(n + 1), -loggamma(k + 1), -loggamma(n - k + 1)]
FAMILIES = {
    "Normal": lambda x, m, s: [-((x - m) / s) ** 2 / 2, -log(s), -ln_root],
    "Uniform": lambda x, a, b: [-log(b - a)],
    "HalfNormal": lambda x, s: [log(2 / pi) / 2, -log(s), -((x / s) ** 2) / 2],
    "LogNormal": lambda x, m, s: [-((log(x) - m) / s) ** 2 / 2, -log(x), -log(s), -ln_root],
    "Exponential": lambda x, l: [log(l), -l * x],
    "Gamma": lambda x, a, b: [a * log(b), -loggamma(a), (a - 1) * log(x), -b * x],
    "Beta": lambda x, a, b: [(a - 1) * log(x), (b - 1) * log1p(-x), *minus(ln_beta(a, b))],
    "StudentT": lambda x, n, m, s: [loggamma((n + 1) / 2), -loggamma(n / 2), -log(n * pi) / 2,
                                    -log(s), -(n + 1) / 2 * log1p(((x - m) / s) ** 2 / n)],
    "HalfCauchy": lambda x, s: [log(2 / pi), -log(s), -log1p((x / s) ** 2)],
    "Poisson": lambda k, l: [k * log(l), -l, -loggamma(k + 1)],
    "Weibull": lambda x, a, s: [log(a), -log(s), (a - 1) * log(x / s), -((x / s) ** a)],
    "Binomial": lambda k, n, p: [*ln_choose(n, k), k * log(p), (n - k) * log1p(-p)],
    "BinomialLogit": lambda k, n, x: [*ln_choose(n, k), -k * log1p(exp(-x)),
                                      -(n - k) * log1p(exp(x))],
    "PoissonLog": lambda k, e: [k * e, -exp(e), -loggamma(k + 1)],
    "MixtureOfNormals": lambda x, w, m, s: [log(
        w * exp(fsum(FAMILIES["Normal"](x, 0, s))) + (1 - w) * exp(fsum(FAMILIES["Normal"](x, m, s)))
    )],
}
# truncated and censored at c, as far out as it takes
FAMILIES["NormalAbove"] = lambda x, m, s, a: [*FAMILIES["Normal"](x, m, s),
                                              -log(upper_normal((a - m) / s))]
FAMILIES["NormalBelow"] = lambda x, m, s, b: [*FAMILIES["Normal"](x, m, s),
                                              -log(upper_normal((m - b) / s))]
FAMILIES["GammaAbove"] = lambda x, a, b, c: [*FAMILIES["Gamma"](x, a, b), -log(
    gammainc(a, b * c, inf, regularized=True))]
FAMILIES["BetaAbove"] = lambda x, a, b, c: [*FAMILIES["Beta"](x, a, b), -log(
    quad(lambda t: exp(fsum(FAMILIES["Beta"](t, a, b))), linspace(c, 1, 9)))]
FAMILIES["NormalTail"] = lambda x, m, s: [log(upper_normal((x - m) / s))]
FAMILIES["GammaTail"] = lambda x, a, b: [log(gammainc(a, b * x, inf, regularized=True))]
FAMILIES["GammaBelow"] = lambda x, a, b: [log(gammainc(a, 0, b * x, regularized=True))]
FAMILIES["StudentTTail"] = lambda x, n, m, s: [log(betainc(
    n / 2, half, 0, n / (n + ((x - m) / s) ** 2), regularized=True) / 2)]
FAMILIES["WeibullTail"] = lambda x, a, s: [-((x / s) ** a)]
POINTS = {
    "Normal": [(0.1, 0.0, 1.0), (1e3, -5.0, 1e-3), (1e-9, 0.0, 1e9), (7.5, 7.5, 1e-300),
               (40.0, 0.0, 1.0), (1e200, 0.0, 1e190), (-3.25, 2.5, 0.7)],
    "Uniform": [(260.0, 250.0, 300.0), (0.0, -1e-9, 1e-9), (1e300, -1e300, 2e300)],
    "HalfNormal": [(0.0, 2.0), (1e-12, 1e-10), (50.0, 1.0), (3.0, 700.0), (1.7, 0.9)],
    "LogNormal": [(1e-300, 0.0, 3.0), (1e300, 5.0, 20.0), (1.0, 0.0, 0.01), (3.7, 1.2, 0.4),
                  (0.02, -4.0, 1e-3)],
    "Exponential": [(0.0, 3.0), (1e-12, 1e10), (700.0, 1.0), (1e6, 1e-6), (0.3, 1.7)],
    "Gamma": [(1e-300, 0.01, 1.0), (1e-5, 0.5, 2.0), (3.0, 1.0, 0.25), (1e-8, 1e-6, 1e-6),
              (2.0, 7.5, 3.1), (1e6, 1e6, 1.0), (1000500.0, 1e6, 1.0), (0.999, 1e8, 1e8),
              (1e-3, 50.0, 2.0), (900.0, 0.3, 1.5), (12.0, 9.99, 1.0), (12.0, 10.01, 1.0)],
    "Beta": [(1e-300, 0.02, 3.0), (0.5, 0.5, 0.5), (0.3, 1.0, 1.0), (0.999999, 2.0, 0.25),
             (1e-9, 5.0, 1e6), (0.5, 1e6, 1e6), (0.5005, 1e6, 1e6), (0.25, 1e-4, 1e-5),
             (0.125, 3.5, 80.0), (0.001, 1e3, 1e6), (0.75, 12.0, 4.0)],
    "StudentT": [(0.0, 1.0, 0.0, 1.0), (1e200, 1.0, 0.0, 1.0), (1e150, 3.0, 0.0, 1e-3),
                 (2.0, 1e10, 0.0, 1.0), (2.0, 1e6, 1.0, 0.5), (30.0, 1e15, 0.0, 1.0),
                 (1e-9, 4.0, 0.0, 1.0), (5.0, 0.01, 0.0, 1.0), (-3.0, 7.5, 1.5, 2.5),
                 (8.0, 19.99, 1.0, 2.0), (8.0, 20.01, 1.0, 2.0)],
    "HalfCauchy": [(0.0, 2.0), (1e200, 1.0), (1e-200, 1.0), (3.0, 2.5), (1e9, 1.0), (1e-3, 1e8)],
    "Poisson": [(0, 1e-300), (0, 700.0), (1, 1e-12), (3, 2.5), (9, 10.0), (10, 10.0), (150, 3.0),
                (1000000, 1e6), (1002000, 1e6), (1000000000000, 1e12), (5, 1e4)],
    "Weibull": [(0.1, 1.5, 1.0), (1e-200, 0.5, 1.0), (9.0, 3.5, 2.0), (340.0, 12.0, 340.0),
                (1.0625, 200.0, 1.0), (1e10, 0.25, 1e-5)],
    "Binomial": [(3, 10, 0.25), (0, 10, 1e-300), (1000, 1000, 0.999), (500000, 1000000, 0.5),
                 (501000, 1000000, 0.5), (5, 1000000000, 1e-9), (9, 20, 0.4375)],
    "BinomialLogit": [(3, 10, -1.0), (0, 10, -600.0), (1000, 1000, 9.0), (500000, 1000000, 0.0),
                      (1, 10, -600.0)],
    "PoissonLog": [(3, 1.0), (0, -600.0), (1000000, 13.8125), (5, 9.0)],
    "MixtureOfNormals": [(0.5, 0.25, 4.0, 1.0), (30.0, 0.5, 4.0, 0.75), (-30.0, 1e-9, 4.0, 1.0)],
    "NormalAbove": [(0.2, 0.15, 0.25, 0.0), (8.5, 0.0, 1.0, 8.0), (37.1, 0.0, 1.0, 37.0),
                    (101.0, 0.0, 1.0, 100.0), (0.5, 0.0, 1.0, -20.0), (3.0, 1.0, 0.5, 2.0)],
    "NormalBelow": [(-8.5, 0.0, 1.0, -8.0), (-101.0, 0.0, 1.0, -100.0), (0.5, 1.0, 2.0, 0.75),
                    (0.5, -9.0, 1.0, 12.0)],
    "GammaAbove": [(0.75, 2.5, 1.5, 0.5), (40.0, 0.75, 2.0, 30.0), (2.0, 20.0, 3.0, 1e-3)],
    "BetaAbove": [(0.75, 2.5, 1.5, 0.5), (0.96875, 3.0, 9.0, 0.9375)],
    "NormalTail": [(1.0, 0.0, 1.0), (-3.0, 0.0, 1.0), (50.0, 0.0, 1.0), (9.0, 1.0, 0.01)],
    "GammaTail": [(1.0, 2.5, 1.5), (40.0, 0.75, 2.0), (0.01, 2.5, 1.5)],
    "StudentTTail": [(1.0, 4.0, 0.0, 1.0), (1e6, 3.0, 0.0, 1.0), (3.0, 7.5, 1.0, 0.5)],
    "WeibullTail": [(1.0, 2.5, 1.5), (1e4, 0.75, 2.0), (1e-9, 2.5, 1.5)],
    "GammaBelow": [(1.0, 2.5, 1.5), (1e-30, 0.75, 2.0), (40.0, 2.5, 1.5), (1e-3, 60.0, 2.0)],
}
# a count has no derivative
COUNTS = {"Poisson", "Binomial", "BinomialLogit", "PoissonLog"}
# observed at the end of the interval
TAILS = {family for family in POINTS if family.endswith("Tail")} | {"GammaBelow"}


def field(x):
    return repr(float(x))


def partial(f, point, i):
    """The derivative of `f` in its argument `i`, by a difference whose error is 40 digits down."""
    # x − μ − step needs all digits between the largest argument and the step
    with workdps(320 if max(map(abs, point)) > 1e100 else 140):
        step = mpf(10) ** -60 * (abs(point[i]) if point[i] else mpf(10) ** -20)
        moved = lambda sign: f(*[v + sign * step if k == i else v for k, v in enumerate(point)])
        return [(a - b) / (2 * step) for a, b in zip(moved(1), moved(-1))]


with open(HERE / "ln_density.csv", "w") as out:
    print("family,x,a,b,c,ln_density,largest," + ",".join(
        f"d{v},largest_d{v}" for v in "xabc"), file=out)
    for family, points in POINTS.items():
        f = FAMILIES[family]
        for point in points:
            point = [mpf(v) for v in point]
            blanks = [""] * (4 - len(point))
            with workdps(120):
                terms = f(*point)
                row = [family, *map(field, point), *blanks, nstr(fsum(terms), 22),
                       nstr(max(map(abs, terms)), 6)]
            for i in range(4):
                whole = (i == 0 and family in COUNTS) or (
                    i == 1 and family in {"Binomial", "BinomialLogit"})
                # bounds are data
                bound = (family.endswith(("Above", "Below")) and i == 3) or (
                    family in TAILS and i == 0)
                # at an end of the support there is no derivative
                end = point[0] == 0 and i == 0 and family in {
                    "HalfNormal", "Exponential", "HalfCauchy"}
                if i >= len(point) or whole or bound or end:
                    row += ["", ""]
                else:
                    terms = partial(f, point, i)
                    row += [nstr(fsum(terms), 20), nstr(max(map(abs, terms)), 6)]
            print(",".join(row), file=out)

# --- special functions ---------------------------------------------------------------------
rows = []


def emit(function, arguments, value):
    blanks = [""] * (3 - len(arguments))
    rows.append(",".join([function, *map(field, arguments), *blanks, nstr(value, 22)]))


for x in map(mpf, [1e-300, 1e-10, 1e-3, 0.1, 0.5, 0.9, 1.1, 1.5, 1.999, 2.5, 3, 5, 7.3, 9.99, 10,
                   12.5, 33.25, 100, 1234.5, 1e6, 1e10, 1e15, 1e100]):
    mp.dps = 250 if x > 1e20 else 80
    emit("ln_gamma", [x], loggamma(x))
    emit("stirling_error", [x], loggamma(x) - (x - mpf(1) / 2) * log(x) + x - log(2 * pi) / 2)
    emit("ln_minus_digamma", [x], log(x) - digamma(x))
mp.dps = 80
for a, b in [(0.5, 0.5), (1e-10, 3), (0.5, 3.5), (2, 3), (1e3, 2e3), (1e10, 0.5), (1e8, 1e-3),
             (1e15, 1e15), (30, 1e6)]:
    a, b = mpf(a), mpf(b)
    emit("ln_beta", [a, b], loggamma(a) + loggamma(b) - loggamma(a + b))
for x in map(mpf, [-0.999, -0.5, -0.39, -0.1, -1e-3, -1e-8, 1e-12, 1e-5, 0.05, 0.3, 0.59, 0.61, 2,
                   1e5]):
    emit("ln_1p_minus", [x], log1p(x) - x)
mp.dps = 320
for x in map(mpf, [1e-300, 1e-10, 0.1, 0.6, 0.7, 2, 40, 700]):
    emit("ln_one_minus_exp", [x], log(-expm1(-x)))
mp.dps = 80
for a, m in [(1, 1.0000001), (1e6, 1000100), (5, 1e-5), (1e-5, 3), (2.5, 3.4), (2.5, 3.6),
             (1e-300, 1e10), (1e12, 1.1e12)]:
    a, m = mpf(a), mpf(m)
    emit("deviance", [a, m], a * log(a / m) + m - a)
for a, x in [(0.5, 1e-8), (0.5, 0.3), (0.5, 4), (0.01, 0.001), (0.01, 2.0), (3, 0.1), (3, 3),
             (3, 30), (3, 600), (30, 5), (30, 29), (30, 31.5), (30, 90), (1000, 900),
             (1000, 1000), (1000, 1100), (1e5, 99000), (1e5, 1e5), (1e5, 101000)]:
    a, x = mpf(a), mpf(x)
    emit("gamma_p", [a, x], gammainc(a, 0, x, regularized=True))
    emit("gamma_q", [a, x], gammainc(a, x, inf, regularized=True))
lower_beta = lambda a, b, x: (
    x**a * (1 - x) ** b / (a * beta(a, b)) * hyp2f1(a + b, 1, a + 1, x, maxterms=10**7)
)
for a, b, x in [(0.5, 0.5, 1e-6), (0.5, 0.5, 0.3), (2, 3, 0.01), (2, 3, 0.4), (2, 3, 0.99),
                (30, 0.5, 0.2), (30, 0.5, 0.99), (0.5, 30, 0.5), (100, 200, 0.2),
                (100, 200, 0.33), (100, 200, 0.5), (1e4, 1e4, 0.49), (1e4, 1e4, 0.51),
                (0.01, 5, 1e-5)]:
    a, b, x = mpf(a), mpf(b), mpf(x)
    emit("beta_lower", [a, b, x], lower_beta(a, b, x))
    emit("beta_upper", [a, b, x], lower_beta(b, a, 1 - x))
for z in map(mpf, [-37, -8, -3, -1, -1e-3, 0, 0.5, 1, 2, 2.99, 3, 3.01, 4, 6, 10, 38, 1e4]):
    if z >= -6:
        emit("mills_ratio", [z], upper_normal(z) / npdf(z))
    if z <= 8:
        emit("normal_cdf", [z], upper_normal(-z))
        emit("normal_from_zero", [z], erf(z / sqrt(2)) / 2)
density = lambda z: npdf(z) if isfinite(z) else mpf(0)
moment = lambda z: z * npdf(z) if isfinite(z) else mpf(0)
mp.dps = 120
for a, b in [(-1, 1), (-1, 2), (0, 0.25), (-3, -1), (8, inf), (8, 8.01), (-8.5, -8), (20, 21),
             (50, inf), (50, 50.001), (-60, -55), (1e-3, 1.001e-3), (-1e-6, 1e-6), (-0.6, inf),
             (2, 5), (0.1, 40), (-9, 0.2), (1000, inf), (3, 3.3)]:
    a, b = mpf(a), mpf(b)
    if a >= 0:
        mass = upper_normal(a) - upper_normal(b)
    elif b <= 0:
        mass = upper_normal(-b) - upper_normal(-a)
    else:
        mass = 1 - upper_normal(-a) - upper_normal(b)
    emit("interval_ln_mass", [a, b], log(mass))
    emit("interval_first", [a, b], (density(a) - density(b)) / mass)
    emit("interval_second", [a, b], (moment(a) - moment(b)) / mass)
mp.dps = 340
for q, guess in [(1e-300, 37), (1e-100, 21.3), (1e-16, 8.2), (1e-5, 4.3), (0.01, 2.3), (0.2, 0.84),
                 (0.45, 0.12), (0.6, -0.25), (0.97, -1.9)]:
    q = mpf(q)
    root = findroot(lambda z: log(upper_normal(z)) - log(q), mpf(guess))
    emit("normal_upper_quantile", [q], root)
for q, guess in [(1e-300, -37.1), (1e-20, -9.3), (1e-3, -3.1), (0.1, -1.3), (0.3, -0.5), (0.49, -0.02),
                 (0.6, 0.25), (0.9, 1.28), (0.999, 3.1)]:
    q = mpf(q)
    root = findroot(lambda z: log(upper_normal(-z)) - log(q), mpf(guess))
    emit("normal_quantile", [q], root)
mp.dps = 60
for p in map(mpf, [1e-20, 1e-5, 0.1, 0.49, 0.51, 0.9, 0.999999]):
    emit("half_normal_quantile", [p], sqrt(2) * erfinv(p))

with open(HERE / "../unit/special.csv", "w") as out:
    print("function,a,b,c,value", *rows, sep="\n", file=out)
