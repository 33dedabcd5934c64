"""Golden numbers for ppl's diagnostics, from ArviZ.

    python3 diagnostics.py > diagnostics.json

The data are made by a rule that the Rust test repeats bit for bit (SplitMix64, sums of twelve
uniforms), so that only the numbers of ArviZ have to be stored.
"""

import json

import arviz
import arviz_stats
import numpy as np
import scipy
from arviz_stats.base import array_stats

MASK = (1 << 64) - 1


def splitmix(seed):
    state = seed
    while True:
        state = (state + 0x9E3779B97F4A7C15) & MASK
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        yield (z ^ (z >> 31)) >> 11


def normals(seed):
    bits = splitmix(seed)
    while True:
        total = 0.0
        for _ in range(12):
            total += next(bits) * 2.0**-53
        yield total - 6.0


def chains(seed, count, draws, rho, shift, cubed, rounded):
    noise = normals(seed)
    out = []
    for c in range(count):
        x = next(noise)
        chain = []
        for _ in range(draws):
            x = rho * x + next(noise)
            y = x + shift * c
            if cubed:
                y = y * y * y
            chain.append(float(np.floor(y)) if rounded else y)
        out.append(chain)
    return np.array(out)


def describe(case):
    x = chains(**case)
    stats = {
        "rhat": array_stats.rhat(x) if len(x) > 1 else None,
        "ess_bulk": array_stats.ess(x, method="bulk"),
        "ess_tail": array_stats.ess(x, method="tail", prob=(0.05, 0.95)),
        "ess_mean": array_stats.ess(x, method="mean"),
        "ess_sd": array_stats.ess(x, method="sd"),
        "mcse_mean": array_stats.mcse(x, method="mean"),
        "mcse_sd": array_stats.mcse(x, method="sd"),
        "mcse_q05": array_stats.mcse(x, method="quantile", prob=0.05),
        "mcse_median": array_stats.mcse(x, method="median"),
        "bfmi": list(map(float, array_stats.bfmi(x))),
    }
    numbers = {k: v if v is None or isinstance(v, list) else float(v) for k, v in stats.items()}
    return {"case": case, **numbers}


def psis(seed, sharpness):
    """log-likelihood of y = 1 … 5 times sharpness at draws x, as importance ratios."""
    x = chains(seed, 4, 250, 0.3, 0.0, False, False).reshape(-1)
    points = []
    for y in range(1, 6):
        d = x - sharpness * y
        log_likelihood = -0.5 * d * d
        for r_eff in (1.0, 0.6):
            elpd, k, p_loo = array_stats.loo(log_likelihood.reshape(4, -1), r_eff=r_eff)
            points.append([float(y), r_eff, float(elpd), float(k), float(p_loo)])
    return {"seed": seed, "sharpness": sharpness, "points": points}


CASES = [
    dict(seed=1, count=4, draws=500, rho=0.0, shift=0.0, cubed=False, rounded=False),
    dict(seed=2, count=4, draws=501, rho=0.8, shift=0.0, cubed=False, rounded=False),
    dict(seed=3, count=3, draws=200, rho=0.3, shift=0.7, cubed=False, rounded=False),
    dict(seed=4, count=2, draws=250, rho=-0.6, shift=0.0, cubed=False, rounded=False),
    dict(seed=5, count=4, draws=300, rho=0.5, shift=0.0, cubed=True, rounded=False),
    dict(seed=6, count=4, draws=300, rho=0.5, shift=0.0, cubed=False, rounded=True),
    dict(seed=7, count=1, draws=400, rho=0.9, shift=0.0, cubed=False, rounded=False),
]

print(
    json.dumps(
        {
            "made_by": {
                "arviz": arviz.__version__,
                "arviz_stats": arviz_stats.__version__,
                "numpy": np.__version__,
                "scipy": scipy.__version__,
            },
            "chains": [describe(case) for case in CASES],
            "psis": [psis(11, 0.4), psis(12, 1.0)],
        },
        indent=1,
    )
)
