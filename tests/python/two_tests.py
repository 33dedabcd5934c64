"""Posterior of two tests, computed without ppl: usage two_tests.py joint_model.json summary.csv

Reads the surrogates, measured quantities, priors and covariances that breccia exports, samples the joint posterior by
differential evolution (ter Braak 2006, Stat. Comput. 16, 239), and compares means and quantiles with summary.csv.
The error that the surrogates leave is included. Standard errors come from independent groups of walkers.

The densities are written down independently: the likelihood of n specimens from their mean and their sums of products, and
the LKJ prior as a power of the determinant of the correlation matrix.
"""

import csv
import json
import sys

import numpy as np

ETA = 3.0  # concentration of the LKJ prior of the correlations
SD_MEAN, SD_SD = 0.15, 0.25  # normal prior of the relative scatter, truncated at zero
GROUPS, WALKERS, WARMUP, STEPS = 12, 60, 900, 600  # independent groups of walkers


def legendre(order, t):
    """Legendre polynomials of orders 0 to `order`, orthonormal for the density 1/2 on [-1, 1]."""
    p = [np.ones_like(t), t]
    for k in range(1, order):
        p.append(((2 * k + 1) * t * p[k] - k * p[k - 1]) / (k + 1))
    return [np.sqrt(2 * k + 1) * p[k] for k in range(order + 1)]


class Surrogate:
    def __init__(self, file):
        assert file["basis"] == "orthonormal Legendre"
        self.inputs = file["inputs"]
        self.outputs = file["outputs"]
        self.logarithmic = set(file.get("logarithmic", []))
        self.indices = [term["index"] for term in file["terms"]]
        self.coefficients = np.array([term["coefficients"] for term in file["terms"]])

    def basis(self, x):
        """Values of the basis polynomials (points x terms) at inputs (points x inputs)."""
        factors = []
        for i, entry in enumerate(self.inputs):
            scale = np.log if entry["name"] in self.logarithmic else lambda value: value
            low, high = scale(entry["lower"]), scale(entry["upper"])
            t = 2.0 * (scale(x[:, i]) - low) / (high - low) - 1.0
            factors.append(legendre(max(index[i] for index in self.indices), t))
        basis = [np.prod([f[k] for f, k in zip(factors, index)], axis=0) for index in self.indices]
        return np.stack(basis, axis=1)

    def __call__(self, x):
        """Outputs (points x outputs) at inputs (points x inputs)."""
        values = self.basis(x) @ self.coefficients
        is_log = np.array([name in self.logarithmic for name in self.outputs])
        return np.where(is_log, np.exp(np.where(is_log, values, 0.0)), values)


class SurrogateError:
    """Error of the coefficients of a surrogate: the covariance of a single run times the leverage psi' (Psi' Psi)^-1 psi."""

    def __init__(self, file, means):
        self.estimate = Surrogate(file["estimate"])
        self.factor = np.array(file["factor"])
        # relative to the means: the covariance of a logarithm is relative already
        is_log = np.array([name in self.estimate.logarithmic for name in self.estimate.outputs])
        scale = np.where(is_log, 1.0, 1.0 / means)
        self.scatter = np.array(file["scatter"]) * np.outer(scale, scale)

    def covariance(self, x):
        """Covariance of the error (points x outputs x outputs)."""
        leverage = np.sum((self.estimate.basis(x) @ self.factor) ** 2, axis=1)
        return leverage[:, None, None] * self.scatter


class Test:
    def __init__(self, file, between):
        self.name = file["name"]
        self.surrogate = Surrogate(file["surrogate"])
        assert not file["known_inputs"], "not in this script"
        rows = np.array(file["quantities"], dtype=float)
        assert np.isfinite(rows).all(), "not in this script: a specimen lacks a quantity"
        self.n, self.size = rows.shape
        self.means = rows.mean(axis=0)
        relative = rows / self.means
        centred = relative - relative.mean(axis=0)
        self.mean, self.products = relative.mean(axis=0), centred.T @ centred
        self.shared = np.array(file["shared_covariance"])
        self.errors = [SurrogateError(entry, self.means) for entry in file["errors_of_surrogate"]]
        self.parameters, self.bounds = [], []
        for entry in self.surrogate.inputs:
            name, prior = entry["name"], file["priors"][entry["name"]]
            assert isinstance(prior, list), "not in this script: a prior that is not uniform"
            relation = between.get(name, "shared")
            assert relation in ("shared", "own"), "not in this script: " + str(relation)
            is_own = relation == "own" or name in file["own"]
            self.parameters.append(f"{name} ({self.name})" if is_own else name)
            self.bounds.append(prior)

    def ln_likelihood(self, theta, sds, correlation):
        scatter = correlation * sds[:, :, None] * sds[:, None, :]
        shared = self.shared + sum(error.covariance(theta) for error in self.errors)
        total = scatter + self.n * shared
        gap = self.mean - self.surrogate(theta) / self.means
        squares = np.einsum("wi,wij,wj->w", gap, np.linalg.inv(total), gap)
        spread = np.einsum("wij,ji->w", np.linalg.inv(scatter), self.products)
        determinants = (self.n - 1) * np.linalg.slogdet(scatter)[1] + np.linalg.slogdet(total)[1]
        return -0.5 * (determinants + spread + self.n * squares)


class Model:
    def __init__(self, file):
        self.tests = [Test(test, file["between_tests"]) for test in file["tests"]]
        self.names, self.bounds = [], []
        for test in self.tests:
            for name, bounds in zip(test.parameters, test.bounds):
                if name not in self.names:
                    self.names.append(name)
                    self.bounds.append(bounds)
        self.bounds = np.array(self.bounds)
        self.size = len(self.names)
        for test in self.tests:
            self.size += test.size + test.size * (test.size - 1) // 2

    def values(self, y):
        """Parameters, and scatter and correlation matrix of each test, at unbounded coordinates; ln of the Jacobian."""
        count = len(self.names)
        low, high = self.bounds[:, 0], self.bounds[:, 1]
        unit = 1.0 / (1.0 + np.exp(-y[:, :count]))
        ln_jacobian = np.sum(np.log(unit) + np.log1p(-unit), axis=1)
        theta, place, parts = low + (high - low) * unit, count, []
        for test in self.tests:
            sds = np.exp(y[:, place : place + test.size])
            ln_jacobian += np.sum(y[:, place : place + test.size], axis=1)
            place += test.size
            correlation = np.tile(np.eye(test.size), (len(y), 1, 1))
            for i in range(test.size):
                for j in range(i):
                    r = np.tanh(y[:, place])
                    ln_jacobian += np.log1p(-r * r)
                    correlation[:, i, j] = correlation[:, j, i] = r
                    place += 1
            parts.append((sds, correlation))
        return theta, parts, ln_jacobian

    def ln_density(self, y):
        with np.errstate(all="ignore"):
            theta, parts, ln_density = self.values(y)
            for test, (sds, correlation) in zip(self.tests, parts):
                eigenvalues = np.linalg.eigvalsh(correlation)
                is_possible = eigenvalues[:, 0] > 1e-9
                correlation = np.where(is_possible[:, None, None], correlation, np.eye(test.size))
                ln_density += np.where(is_possible, 0.0, -np.inf)
                ln_density += (ETA - 1.0) * np.linalg.slogdet(correlation)[1]
                ln_density -= 0.5 * np.sum(((sds - SD_MEAN) / SD_SD) ** 2, axis=1)
                point = theta[:, [self.names.index(name) for name in test.parameters]]
                ln_density += test.ln_likelihood(point, sds, correlation)
        return np.where(np.isfinite(ln_density), ln_density, -np.inf)

    def flat(self, y):
        theta, parts, _ = self.values(y)
        columns = [theta] + [sds for sds, _ in parts]
        for test, (_, correlation) in zip(self.tests, parts):
            lower = [correlation[:, i, j] for i in range(test.size) for j in range(i)]
            columns.append(np.stack(lower, axis=1) if lower else np.empty((len(y), 0)))
        return np.concatenate(columns, axis=1)


def sample(model, rng, levels):
    """Means of the values, of their squares, and of the shares below each of the levels (one row of quantities per statistic
    and group)."""
    count, half = GROUPS * WALKERS, WALKERS // 2
    parts = [rng.normal(0.0, 1.0, (count, len(model.names)))]
    for test in model.tests:
        parts.append(rng.normal(-2.5, 0.3, (count, test.size)))
        parts.append(rng.normal(0.0, 0.1, (count, test.size * (test.size - 1) // 2)))
    y = np.concatenate(parts, axis=1).reshape(GROUPS, WALKERS, -1)
    ln = model.ln_density(y.reshape(count, -1)).reshape(GROUPS, WALKERS)
    assert np.isfinite(ln).all()
    group = np.arange(GROUPS)[:, None]
    sums = 0.0
    for step in range(WARMUP + STEPS):
        if step == WARMUP // 3:
            # walkers that have not found the posterior start again at other walkers of their group
            order = np.argsort(-ln, axis=1)
            chosen = order[group, rng.integers(half, size=(GROUPS, WALKERS))]
            is_lost = ln < np.median(ln, axis=1)[:, None] - 2.0 * model.size
            y = np.where(is_lost[:, :, None], y[group, chosen], y)
            ln = np.where(is_lost, ln[group, chosen], ln)
        for moved, others in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
            # differences of walkers of the other half: the proposal is symmetric
            first = rng.integers(half, size=(GROUPS, half))
            second = (first + rng.integers(1, half, size=(GROUPS, half))) % half
            factor = 1.0 if step % 10 == 0 else 2.38 / np.sqrt(2 * model.size) * rng.uniform(0.4, 1.2)
            other = y[:, others]
            proposed = y[:, moved] + factor * (other[group, first] - other[group, second])
            proposed += rng.normal(0.0, 1e-5, proposed.shape)
            ln_proposed = model.ln_density(proposed.reshape(GROUPS * half, -1)).reshape(GROUPS, half)
            accepted = np.log(rng.uniform(size=(GROUPS, half))) < ln_proposed - ln[:, moved]
            y[:, moved] = np.where(accepted[:, :, None], proposed, y[:, moved])
            ln[:, moved] = np.where(accepted, ln_proposed, ln[:, moved])
        if step >= WARMUP:
            values = model.flat(y.reshape(count, -1)).reshape(GROUPS, WALKERS, -1)
            statistics = [values, values**2] + [values < level for level in levels]
            sums = sums + np.array([statistic.mean(axis=1) for statistic in statistics])
    return sums / STEPS


def main(model_file, summary_file):
    with open(model_file) as file:
        model = Model(json.load(file))
    with open(summary_file) as file:
        summary = {row["parameter"]: row for row in csv.DictReader(file)}
    names = list(model.names)
    # breccia lists scatter and correlations test by test, in the order of the quantities
    for kind in ("sd[", "correlation["):
        names += [name for name in summary if name.startswith(kind)]
    quantiles = {"q05": 0.05, "q50": 0.5, "q95": 0.95}
    levels = np.array([[float(summary[name][column]) for name in names] for column in quantiles])
    statistics = sample(model, np.random.default_rng(1), levels)
    assert statistics.shape[2] == len(names), (statistics.shape, names)
    all_means, errors = statistics.mean(axis=1), statistics.std(axis=1, ddof=1) / np.sqrt(GROUPS)
    is_wrong = False
    for k, name in enumerate(names):
        mean, error = all_means[0, k], errors[0, k]
        sd = np.sqrt(all_means[1, k] - mean**2)
        row = {c: float(summary[name][c]) for c in ("mean", "sd", "ess_bulk", "ess_tail")}
        other = row["sd"] / np.sqrt(row["ess_bulk"])
        z = [(mean - row["mean"]) / np.hypot(error, other)]
        # shares below the quantiles: standard deviations would be compared poorly, because the tails are heavy
        for level, share in enumerate(quantiles.values()):
            other_error = np.sqrt(share * (1.0 - share) / min(row["ess_bulk"], row["ess_tail"]))
            gap = all_means[2 + level, k] - share
            z.append(gap / np.hypot(errors[2 + level, k], other_error))
        scores = ", ".join(f"{score:.2f}" for score in z)
        print(f"{name}: {mean:.5g} +- {sd:.3g} here, {row['mean']:.5g} +- {row['sd']:.3g}; z {scores}")
        assert error < 0.05 * sd and other < 0.05 * sd, f"{name}: too few draws for a comparison"
        # some forty quantiles are compared, in tails that are sampled less well than the middle
        is_wrong |= abs(z[0]) > 4.0 or max(abs(score) for score in z[1:]) > 5.0
    sys.exit("the posteriors differ: a mean by more than 4 standard errors, or a quantile by more than 5" if is_wrong else 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
