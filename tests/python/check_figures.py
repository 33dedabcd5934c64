"""Compares the figures of README.md and docs with the results of a calibration; runs nothing.

    breccia run --out breccia-out                           # the default case
    breccia init --own-data own && breccia run own/case.toml --out own-out
    python3 tests/python/check_figures.py breccia-out [own-out]

Needs Python only. Reads summary.csv, map.csv, confirm.csv, uncertainty.csv and next-test.csv of the folder of the default case, and
summary.csv of the folder of the example of `breccia init --own-data`. A figure agrees if it is the rounded value. Prints each figure
that differs, with its file; exits with 1 if a figure differs or if a page no longer has the figure.
"""
import csv
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).parents[2]
PARAMETERS = {"E": "matrix.young_mpa", "ξ": "matrix.viscosity_mpa_s", "Gc": "matrix.toughness_n_per_mm"}
QUANTITIES = ["slope_N_per_mm", "peak_force_N", "displacement_at_peak_mm"]
NUMBER = r"([+−-]?\d+(?:\.\d+)?)"


def table(folder, name, *keys):
    """Rows of a table by their keys; a key of one column is a text, of several columns a tuple."""
    with open(folder / name, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {(row[keys[0]] if len(keys) == 1 else tuple(row[k] for k in keys)): row for row in rows}


class Pages:
    """Figures of pages, compared with values."""

    def __init__(self):
        self.compared, self.wrong = 0, []

    def check(self, page, pattern, values):
        """Compares the numbers that a pattern finds in a page with values, in this order."""
        text = (ROOT / page).read_text(encoding="utf-8")
        found = re.search(pattern, text)
        if found is None:
            self.wrong.append(f"{page}: no text matches {pattern}")
            return
        for written, value in zip(found.groups(), values, strict=True):
            self.compared += 1
            decimals = len(written.partition(".")[2])
            number = float(written.replace("−", "-"))
            if abs(number - value) > 0.501 * 10.0**-decimals:
                self.wrong.append(f"{page}: {written}, now {value:.6g} ({found.group(0)})")


def default_case(pages, folder):
    """Figures of the default case."""
    summary, modes = table(folder, "summary.csv", "parameter"), table(folder, "map.csv", "parameter")
    confirm = table(folder, "confirm.csv", "qoi")
    shares = table(folder, "uncertainty.csv", "parameter", "source")
    design = table(folder, "next-test.csv", "candidate", "parameter", "specimens")
    tutorial = "docs/tutorials/default-case.md"
    for short, name in PARAMETERS.items():
        values = [float(summary[name][column]) for column in ("mean", "sd", "q05", "q95")]
        interval = rf"{NUMBER} ± {NUMBER}[^|\n]*?[| ]+{NUMBER} … {NUMBER}"
        pages.check("README.md", rf"\| {short} \| {interval}", values)
        mode = float(modes[name]["map"])
        pages.check(tutorial, rf"{re.escape(name)} +{NUMBER} +{interval}", [mode, *values])
    errors = [float(confirm[quantity]["mesh_error_percent"]) for quantity in QUANTITIES]
    pages.check("README.md", rf"estimated as {NUMBER} % of the peak force", [errors[1]])
    cells = r" % \| ".join([NUMBER] * 3)
    pages.check(tutorial, rf"`mesh_error_percent`\) \| {cells} %", errors)
    percent = max(float(confirm[quantity]["percent_error"]) for quantity in QUANTITIES)
    pages.check(tutorial, rf"are within {NUMBER} % of the means", [percent])
    for source in ["specimens", "discrepancy", "mesh", "geometry", "surrogate"]:
        values = [100.0 * float(shares[PARAMETERS[p], source]["share"]) for p in ("E", "ξ")]
        pages.check(tutorial, rf"\| `{source}`[^|]*\| {NUMBER} % \| {NUMBER} %", values)
    toughness = PARAMETERS["Gc"]
    slower = float(design["30 times slower", toughness, "1"]["contraction"])
    pages.check("README.md", rf"{NUMBER} % with one specimen that is tested 30 times", [100.0 * slower])
    more = float(design["more specimens", toughness, "32"]["contraction"])
    if more >= 0.01:
        pages.wrong.append(f"README.md: less than 1 % with 32 more specimens, now {more:.4f}")


def own_data(pages, folder):
    """Figures of the example of `breccia init --own-data`."""
    summary = table(folder, "summary.csv", "parameter")
    values = [float(summary[PARAMETERS[p]][column]) for p in ("E", "ξ") for column in ("mean", "sd")]
    pattern = rf"finds E = {NUMBER} ± {NUMBER} MPa and ξ = {NUMBER} ± {NUMBER} MPa s"
    pages.check("README.md", pattern, values)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    pages = Pages()
    default_case(pages, pathlib.Path(sys.argv[1]))
    if len(sys.argv) == 3:
        own_data(pages, pathlib.Path(sys.argv[2]))
    print(*pages.wrong, f"{pages.compared} figures compared, {len(pages.wrong)} differ", sep="\n")
    sys.exit(bool(pages.wrong))


if __name__ == "__main__":
    main()
