"""Posterior of two tests, sampled by PyMC: usage two_tests_pymc.py joint_model.json results/ [draws per chain]

Reads the surrogates, measured quantities, priors and covariances that breccia exports, states the joint model with PyMC's
distributions, samples it with PyMC's NUTS, and compares means, standard deviations and quantiles with breccia's draws in
`posterior.csv`. Both standard errors are Monte Carlo standard errors, from the effective sample sizes of ArviZ.

Needs PyMC; with NumPyro (`pip install pymc numpyro`), PyMC uses the NUTS of NumPyro, which compiles sooner. The likelihood
is not breccia's: breccia integrates the shared error analytically and uses sums over specimens, and this program has the
shared error as an unknown and one normal density for each specimen.
"""

import csv
import importlib.util
import json
import sys

import arviz as az
import numpy as np
import pymc as pm
import pytensor.tensor as pt

ETA = 3.0  # concentration of the LKJ prior of the correlations
SD_MEAN, SD_SD = 0.15, 0.25  # normal prior of the relative scatter, truncated at zero
CHAINS, WARMUP = 4, 1500


def legendre(order, t):
    """Legendre polynomials of orders 0 to `order`, orthonormal for the density 1/2 on [-1, 1]."""
    if order == 0:
        return [1.0]
    values = [1.0, t]
    for n in range(2, order + 1):
        values.append((t * values[n - 1] * (2 * n - 1) - values[n - 2] * (n - 1)) / n)
    return [value * np.sqrt(2 * n + 1) for n, value in enumerate(values)]


def basis(file, theta):
    """Basis polynomials of a surrogate at the parameters `theta`, in the order of its terms."""
    indices = [term["index"] for term in file["terms"]]
    logarithmic = file.get("logarithmic", [])
    factors = []
    for i, entry in enumerate(file["inputs"]):
        low, high, value = entry["lower"], entry["upper"], theta[i]
        if entry["name"] in logarithmic:
            low, high, value = np.log(low), np.log(high), pt.log(value)
        position = 2.0 * (value - low) / (high - low) - 1.0
        factors.append(legendre(max(index[i] for index in indices), position))
    products = []
    for index in indices:
        product = pt.constant(1.0)
        for i, order in enumerate(index):
            product = product * factors[i][order]
        products.append(product)
    return pt.stack(products)


def outputs(file, theta):
    """Outputs of a surrogate at the parameters `theta`."""
    coefficients = np.array([term["coefficients"] for term in file["terms"]])
    values = pt.dot(basis(file, theta), coefficients)
    logarithmic = file.get("logarithmic", [])
    return pt.stack([pt.exp(values[m]) if name in logarithmic else values[m] for m, name in enumerate(file["outputs"])])


def root(covariance):
    """A matrix L with L Lᵀ = covariance, also if the covariance is singular."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.clip(values, 0.0, None))


def add_test(file, parameters, tracked):
    """Adds the likelihood of one test to the model, and its scatter and correlations to `tracked`."""
    name, surrogate = file["name"], file["surrogate"]
    assert surrogate["basis"] == "orthonormal Legendre" and not file["known_inputs"], "not in this script"
    quantities = np.array(file["quantities"], dtype=float)
    assert np.isfinite(quantities).all(), "not in this script: a specimen lacks a quantity"
    means, size = quantities.mean(axis=0), quantities.shape[1]
    theta = [parameters[entry["name"], name] for entry in surrogate["inputs"]]

    scale = pm.TruncatedNormal.dist(mu=SD_MEAN, sigma=SD_SD, lower=0.0, shape=size)
    chol, correlation, sds = pm.LKJCholeskyCov(f"scatter {name}", n=size, eta=ETA, sd_dist=scale, compute_corr=True)
    tracked += [sds[i] for i in range(size)]
    tracked += [correlation[i, j] for i in range(size) for j in range(i)]

    # the error that all specimens of the test share: of the mesh and of each surrogate
    shared = np.array(file["shared_covariance"])
    error = pt.dot(root(shared), pm.Normal(f"shared {name}", shape=size))
    for k, entry in enumerate(file["errors_of_surrogate"]):
        estimate = entry["estimate"]
        # the covariance of a logarithm is relative already
        relative = [1.0 if output in estimate["logarithmic"] else 1.0 / mean
                    for output, mean in zip(estimate["outputs"], means)]
        scatter = np.array(entry["scatter"]) * np.outer(relative, relative)
        leverage = pt.sqrt(pt.sum(pt.dot(basis(estimate, theta), np.array(entry["factor"])) ** 2))
        error = error + leverage * pt.dot(root(scatter), pm.Normal(f"surrogate {k} {name}", shape=size))
    mean = outputs(surrogate, theta) / means + error
    pm.MvNormal(f"specimens {name}", mu=mean, chol=chol, observed=quantities / means)


def joint_model(file):
    """The model, and the names of its values in the order of `tracked`."""
    between = file["between_tests"]
    assert file.get("covariance", "independent") == "independent", "not in this script: a pooled covariance"
    with pm.Model() as model:
        parameters, tracked, names = {}, [], []
        for test in file["tests"]:
            for entry in test["surrogate"]["inputs"]:
                name, prior = entry["name"], test["priors"][entry["name"]]
                assert isinstance(prior, list), "not in this script: a prior that is not uniform"
                relation = between.get(name, "shared")
                assert relation in ("shared", "own"), f"not in this script: {relation}"
                full = f"{name} ({test['name']})" if relation == "own" or name in test["own"] else name
                if full not in names:
                    names.append(full)
                    tracked.append(pm.Uniform(full, *prior))
                parameters[name, test["name"]] = tracked[names.index(full)]
        for test in file["tests"]:
            add_test(test, parameters, tracked)
        pm.Deterministic("tracked", pt.stack(tracked))
    return model, names


def read_draws(path):
    """Names of the columns of posterior.csv, and the draws (chains x draws x columns)."""
    with open(path) as file:
        rows = list(csv.reader(file))
    header, values = rows[0], np.array(rows[1:], dtype=float)
    chains = [values[values[:, 0] == chain][:, 2:] for chain in np.unique(values[:, 0])]
    return header[2:], np.stack(chains)


def ordered_names(file, names):
    """Names of breccia's columns in the order of the tracked values."""
    names = list(names)
    for test in file["tests"]:
        # posterior.csv has short names of quantities, in the order of the surrogate's outputs
        quantities = [output.rsplit("_N_per_mm", 1)[0].rsplit("_N", 1)[0].rsplit("_mm", 1)[0].replace("_", "-")
                      for output in test["surrogate"]["outputs"]]
        names += [f"sd[{quantity} ({test['name']})]" for quantity in quantities]
        names += [f"correlation[{quantities[i]} {quantities[j]} ({test['name']})]"
                  for i in range(len(quantities)) for j in range(i)]
    return names


def error_of_mean(draws):
    """Monte Carlo standard error of the mean of draws (chains x draws)."""
    return np.std(draws, ddof=1) / np.sqrt(float(az.ess(draws, method="mean")))


def statistics(draws):
    """Mean, standard deviation and quantiles of draws (chains x draws), each with its Monte Carlo standard error."""
    mean, sd = np.mean(draws), np.std(draws, ddof=1)
    quantiles = [(np.quantile(draws, p), float(az.mcse(draws, method="quantile", prob=p))) for p in (0.05, 0.95)]
    # the error of the variance is the error of a mean of squares
    of_sd = error_of_mean((draws - mean) ** 2) / (2.0 * sd)
    return np.array([(mean, error_of_mean(draws)), (sd, of_sd)] + quantiles, dtype=float)


def main(model_file, results, draws="4000"):
    with open(model_file) as file:
        file = json.load(file)
    model, names = joint_model(file)
    names = ordered_names(file, names)
    # compiled by JAX, the model samples much sooner than as several hundred C functions
    sampler = "numpyro" if importlib.util.find_spec("numpyro") else "pymc"
    with model:
        trace = pm.sample(
            int(draws), tune=WARMUP, chains=CHAINS, cores=2, target_accept=0.95, random_seed=1, progressbar=False,
            compute_convergence_checks=False, nuts_sampler=sampler,
        )
    here = np.asarray(trace["posterior"]["tracked"])
    columns, there = read_draws(f"{results}/posterior.csv")
    assert here.shape[2] == len(names), (here.shape, names)
    divergent = int(np.asarray(trace["sample_stats"]["diverging"]).sum())
    print(f"PyMC {pm.__version__}: {here.shape[0]} chains of {here.shape[1]} draws, {divergent} divergent")
    print("z of mean, sd, 5 % and 95 % quantile")
    scores = []
    for k, name in enumerate(names):
        own, other = statistics(here[:, :, k]), statistics(there[:, :, columns.index(name)])
        z = (own[:, 0] - other[:, 0]) / np.hypot(own[:, 1], other[:, 1])
        rhat = float(az.rhat(here[:, :, k]))
        print(f"{name}: {own[0, 0]:.5g} +- {own[1, 0]:.3g} here, {other[0, 0]:.5g} +- {other[1, 0]:.3g}; z "
              + ", ".join(f"{score:.2f}" for score in z) + f"; R-hat {rhat:.3f}")
        assert rhat < 1.02, f"{name}: the chains of PyMC differ"
        for statistic in (own, other):
            assert statistic[0, 1] < 0.05 * statistic[1, 0], f"{name}: too few draws for a comparison"
        scores.append(z)
    worst = np.abs(scores).max()
    print(f"largest |z| of {np.size(scores)} statistics: {worst:.2f}")
    sys.exit("the posteriors differ by more than 4 standard errors" if worst > 4.0 else 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
