"""Opens a posterior store with ArviZ, without conversion, and compares the summary of ArviZ with the summary of `ppl`.

    python3 arviz_roundtrip.py posterior.zarr summary.csv sensitivity.csv

Exits with a message and status 1 at the first difference.
"""

import csv
import sys

import arviz
import numpy as np

store, table, sensitivity = sys.argv[1:]
data = arviz.from_zarr(store)


def require(holds, message):
    if not holds:
        sys.exit(f"ArviZ {arviz.__version__}: {message}")


groups = {
    "posterior",
    "unconstrained_posterior",
    "sample_stats",
    "posterior_predictive",
    "log_likelihood",
    "log_prior",
    "observed_data",
    "prior",
    "prior_predictive",
}
require(groups == set(data.children), f"groups are {sorted(data.children)}")

posterior = data["posterior"].dataset
sd = posterior["sd"]
require(sd.dims == ("chain", "draw", "sd_dim_0"), f"dimensions of sd are {sd.dims}")
labels = list(posterior["sd_dim_0"].values)
require(labels == ["slope", "peak force"], f"coordinates of sd are {labels}")
require(posterior["mu"].dims == ("chain", "draw"), "mu is not a number")

stats = data["sample_stats"].dataset
require(stats["diverging"].dtype == bool, f"diverging is {stats['diverging'].dtype}")
require(stats["tree_depth"].dtype == np.int64, "tree_depth is not an integer")
for name in ("lp", "energy", "acceptance_rate", "step_size", "n_steps"):
    require(np.isfinite(stats[name]).all(), f"{name} is not finite")

log_likelihood = data["log_likelihood"].dataset["y"]
observed = data["observed_data"].dataset["y"]
require(log_likelihood.shape[2:] == (3,), f"log-likelihood has shape {log_likelihood.shape}")
require(observed.shape == (3, 2), f"data have shape {observed.shape}")
x = observed.values[None, None] - posterior["mu"].values[..., None, None]
s = sd.values[:, :, None, :1]
expected = (-0.5 * (x / s) ** 2 - np.log(s) - 0.5 * np.log(2 * np.pi)).sum(axis=-1)
require(np.allclose(log_likelihood, expected, rtol=1e-12), "log-likelihood differs")

log_prior = data["log_prior"].dataset
m = posterior["mu"].values
expected = -0.5 * (m / 5) ** 2 - np.log(5) - 0.5 * np.log(2 * np.pi)
require(np.allclose(log_prior["mu"], expected, rtol=1e-12), "log-prior of mu differs")
of_sd = log_prior["sd"].sum(dim=[d for d in log_prior["sd"].dims if d not in ("chain", "draw")])
require(np.allclose(of_sd, -2 * np.log(2.9), rtol=1e-12), "log-prior of sd differs")

loo = arviz.loo(data)
require(np.isfinite(loo.elpd), "LOO is not finite")

# intervals from 5 % to 95 %, as in `ppl`; by default the tail ESS would be at 10 % and 90 %
arviz.rcParams["stats.ci_prob"] = 0.9
arviz.rcParams["stats.ci_kind"] = "eti"
theirs = arviz.summary(data, var_names=["mu", "sd"], kind="all", round_to="none")
tail = arviz.ess(data, method="tail", prob=(0.05, 0.95))
theirs["ess_tail"] = [float(tail["mu"]), *map(float, tail["sd"].values)]
theirs.index = [name.replace("slope", "0").replace("peak force", "1") for name in theirs.index]
with open(table, newline="", encoding="utf-8") as file:
    ours = {row["parameter"]: row for row in csv.DictReader(file)}
pairs = {
    "mean": "mean",
    "sd": "sd",
    "r_hat": "rhat",
    "ess_bulk": "ess_bulk",
    "ess_tail": "ess_tail",
    "mcse_mean": "mcse_mean",
    "eti90_lb": "q05",
    "eti90_ub": "q95",
}
for name, row in theirs.iterrows():
    for their_key, our_key in pairs.items():
        a, b = float(row[their_key]), float(ours[name][our_key])
        require(abs(a - b) <= 1e-8 * abs(a), f"{our_key} of {name}: {b}, ArviZ {a}")

theirs = arviz.psense_summary(data, var_names=["mu", "sd"], round_to=12)
theirs.index = [name.replace("slope", "0").replace("peak force", "1") for name in theirs.index]
with open(sensitivity, newline="", encoding="utf-8") as file:
    ours = {row["parameter"]: row for row in csv.DictReader(file)}
for name, row in theirs.iterrows():
    for group in ("prior", "likelihood"):
        # ArviZ uses the powers 0.99 and 1.01, `ppl` uses 1/1.01 and 1.01
        a, b = float(row[group]), float(ours[name][group])
        require(abs(a - b) <= 0.02 * a + 1e-3, f"{group} sensitivity of {name}: {b}, ArviZ {a}")

print(f"ArviZ {arviz.__version__} reads the store and agrees on {len(theirs)} rows")
