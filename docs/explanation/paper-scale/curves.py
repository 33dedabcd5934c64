"""Draws curves.svg from the curves of this folder: `python3 curves.py`."""

import csv
from pathlib import Path

HERE = Path(__file__).parent
RUNS = [("20k", "20 000", "#b8b2a6"), ("100k", "100 000", "#e2703a"), ("500k", "500 000", "#a01e34"),
        ("2400k", "2.4 million", "#340c28")]
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 640, 400, 56, 44, 14
X_MAX, Y_MAX = 0.16, 160.0


def place(x, y):
    width, height = WIDTH - LEFT - 16, HEIGHT - BOTTOM - TOP
    return f"{LEFT + width * x / X_MAX:.1f},{HEIGHT - BOTTOM - height * y / Y_MAX:.1f}"


def text(at, words, anchor="middle"):
    x, y = at.split(",")
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}">{words}</text>'


def below(at, by):
    x, y = map(float, at.split(","))
    return f"{x},{y + by}"


def left(at, by):
    x, y = map(float, at.split(","))
    return f"{x - by},{y + 4}"


parts = []
for i in range(9):
    x = 0.02 * i
    parts.append(f'<path d="M{place(x, 0)} L{place(x, Y_MAX)}" stroke="#ddd"/>')
    parts.append(text(below(place(x, 0), 16), f"{x:.2f}"))
    y = 20.0 * i
    parts.append(f'<path d="M{place(0, y)} L{place(X_MAX, y)}" stroke="#ddd"/>')
    parts.append(text(left(place(0, y), 6), f"{y:.0f}", "end"))
parts.append(text(below(place(X_MAX / 2, 0), 36), "displacement, mm"))
parts.append(f'<g transform="rotate(-90 14 {HEIGHT / 2})">{text(f"14,{HEIGHT / 2}", "force, N")}</g>')
row = 0
for name, words, colour in RUNS:
    path = HERE / f"curve-{name}.csv"
    if not path.exists():
        continue
    with path.open() as file:
        points = [(float(r["displacement_mm"]), float(r["force_N"])) for r in csv.DictReader(file)]
    line = " L".join(place(x, y) for x, y in [(0.0, 0.0), *points])
    parts.append(f'<path d="M{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
    key = 34.0 - 9.0 * row
    parts.append(f'<path d="M{place(0.105, key)} L{place(0.115, key)}" stroke="{colour}" stroke-width="2"/>')
    parts.append(text(below(place(0.118, key), 4), f"{words} tetrahedra", "start"))
    row += 1
body = "\n".join(parts)
svg = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
       f'font-size="12">\n<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>\n{body}\n</svg>\n')
(HERE / "curves.svg").write_text(svg)
