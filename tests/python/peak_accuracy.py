"""Accuracy of peak force and displacement at peak of noisy curves, compared with smoothing splines and local polynomials.

    cargo build --release -p breccia-calibration --example peaks
    python3 tests/python/peak_accuracy.py target/release/examples/peaks [REPLICATES] [SHAPE,SHAPE] [READINGS,READINGS]

Needs numpy and scipy. Each line is a condition: shape of the curve, number of readings, noise of the force as a fraction of the peak force,
noise of the displacement in um; then bias and rms error (%) of displacement at peak and of peak force; then the ratios
of these rms errors to the rms errors of other methods:
- a cubic smoothing spline whose smoothing minimises generalised cross-validation (on means of at most 400 blocks),
- a local quadratic within 0.2 of the displacement at peak, centred on its own vertex,
- a local cubic within 0.4 of the displacement at peak, centred on its own maximum.
All methods use only the readings. The last line counts the conditions with noise in which the rms error of the
displacement or of the force exceeds 1.05 times the error of the spline or of the quadratic. Exits with 1 if a bias exceeds
0.3 % of the peak or 1 % of the displacement by more than three standard errors.
"""
import struct
import subprocess
import sys

import numpy as np
from scipy.interpolate import make_smoothing_spline

PEAK_N, PEAK_MM = 150.0, 0.12


def viscous(x):
    """Curve in the viscous limit; displacement and force are divided by their values at the peak."""
    return x * np.exp((1 - x**3) / 3)


def lopsided(x):
    """Viscous curve with the largest cubic term that was observed in simulations."""
    return viscous(x) - 0.5 * (x - 1) ** 3 * np.exp(-(((x - 1) / 0.5) ** 2))


def broad(x):
    """Broad peak: curvature -1 instead of -3."""
    return x * np.exp(1 - x)


def sharp(x):
    """Sharp peak: curvature -12; the force falls to a quarter within a fifth of the displacement at peak."""
    return x * np.exp((1 - x**12) / 12)


SHAPES = {"viscous": viscous, "lopsided": lopsided, "broad": broad, "sharp": sharp}


def own(program, curves):
    n = len(curves[0][0])
    data = [struct.pack("<QQ", n, len(curves))]
    for u, force in curves:
        data += [u.astype("<f8").tobytes(), force.astype("<f8").tobytes()]
    lines = subprocess.run([program], input=b"".join(data), capture_output=True, check=True).stdout.decode().split("\n")
    return [[np.nan] * 2 if line.startswith("error") else [float(v) for v in line.split(",")] for line in lines[:-1]]


def blocks(u, force, most=400):
    if len(u) <= most:
        return u, force
    block = np.arange(len(u)) * most // len(u)
    count = np.bincount(block)
    return np.bincount(block, u) / count, np.bincount(block, force) / count


def spline(u, force):
    u, force = blocks(u, force)
    unit = u[-1] / len(u)
    found = make_smoothing_spline(u / unit, force)
    grid = np.linspace(u[0], u[-1], 4001)
    values = found(grid / unit)
    k = np.argmax(values[1:-1]) + 1
    a = np.polyfit(grid[k - 1 : k + 2] - grid[k], values[k - 1 : k + 2], 2)
    shift = -a[1] / (2 * a[0])
    return grid[k] + shift, np.polyval(a, shift)


def local(u, force, degree, width):
    means = np.convolve(force, np.ones(max(1, len(u) // 15)) / max(1, len(u) // 15), "same")
    centre = u[np.argmax(means)]
    for _ in range(12):
        half = width * centre
        inside = abs(u - centre) <= half
        a = np.polynomial.polynomial.polyfit((u[inside] - centre) / half, force[inside], degree)
        fit = np.polynomial.Polynomial(a)
        first, second = fit.deriv(), fit.deriv(2)
        x = 0.0
        for _ in range(30):
            if second(x) >= 0 or abs(x) > 1:
                return np.nan, np.nan
            step = np.clip(-first(x) / second(x), -0.3, 0.3) if degree > 2 else -first(x) / second(x)
            x += step
            if abs(step) < 1e-10:
                break
        centre += x * half
        if abs(x) < 1e-3:
            break
    return centre, fit(x)


def main():
    program = sys.argv[1]
    replicates = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    shapes = sys.argv[3].split(",") if len(sys.argv) > 3 else list(SHAPES)
    counts = [int(n) for n in sys.argv[4].split(",")] if len(sys.argv) > 4 else [45, 200, 1000, 4000, 20000]
    rng = np.random.default_rng(1)
    beaten = {name: np.zeros(2, int) for name in ["spline", "quadratic"]}
    conditions = 0
    others = {
        "spline": spline,
        "quadratic": lambda u, f: local(u, f, 2, 0.2),
        "cubic": lambda u, f: local(u, f, 3, 0.4),
    }
    print(f"{'shape':9s}{'n':>6s}{'noise':>7s}{'um':>4s} | bias d, F % | rms d, F % | rms over that of: " + ", ".join(others))
    wrong = 0
    for shape in shapes:
        for n in counts:
            exact = np.linspace(0, 1.45 * PEAK_MM, n)
            for noise, noise_um in [(0.0, 0), (0.002, 0), (0.01, 0), (0.02, 0), (0.01, 1)]:
                curves = []
                for _ in range(replicates if noise else 1):
                    force = PEAK_N * (SHAPES[shape](exact / PEAK_MM) + noise * rng.standard_normal(n))
                    curves.append((exact + 1e-3 * noise_um * rng.standard_normal(n), force))
                relative = lambda found: 100 * (np.array(found) / [PEAK_MM, PEAK_N] - 1)
                errors = relative(own(program, curves))
                failed = int(np.isnan(errors).any(axis=1).sum())
                bias, rms = np.nanmean(errors, axis=0), np.sqrt(np.nanmean(errors**2, axis=0))
                error = rms / np.sqrt(len(curves))
                if failed or (abs(bias) - 3 * error > [1.0, 0.3]).any():
                    wrong += 1
                line = f"{shape:9s}{n:6d}{noise:7.3f}{noise_um:4d} | {bias[0]:+.3f} {bias[1]:+.3f} | {rms[0]:.3f} {rms[1]:.3f} |"
                conditions += noise > 0
                for name, method in others.items():
                    if not noise:
                        continue
                    sorted_curves = [(u[k := np.argsort(u, kind="stable")], f[k]) for u, f in curves]
                    other = relative([method(u, f) for u, f in sorted_curves])
                    ratio = rms / np.sqrt(np.nanmean(other**2, axis=0))
                    if name in beaten:
                        beaten[name] += ratio > 1.05
                    lost = int(np.isnan(other).any(axis=1).sum())
                    line += f" {ratio[0]:.2f} {ratio[1]:.2f}" + (f" ({lost} without)" if lost else "") + ";"
                print(line + (f" {failed} FAILED" if failed else ""), flush=True)
    for name, (displacement, force) in beaten.items():
        print(f"rms above 1.05 times that of the {name}: displacement in {displacement}, force in {force} of {conditions}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
