"""Chains that every language makes bit for bit: SplitMix64, sums of twelve uniforms.

    python3 draws.py SEED COUNT DRAWS RHO SHIFT CUBED ROUNDED

prints one line a draw, one column a chain, in digits that round-trip.
"""

import math
import sys

MASK = (1 << 64) - 1


def normals(state):
    while True:
        total = 0.0
        for _ in range(12):
            state = (state + 0x9E3779B97F4A7C15) & MASK
            z = state
            z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
            z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
            total += ((z ^ (z >> 31)) >> 11) * 2.0**-53
        yield total - 6.0


seed, count, draws = (int(a) for a in sys.argv[1:4])
rho, shift = (float(a) for a in sys.argv[4:6])
cubed, rounded = (a == "true" for a in sys.argv[6:8])
noise = normals(seed)
chains = []
for c in range(count):
    x = next(noise)
    chain = []
    for _ in range(draws):
        x = rho * x + next(noise)
        y = x + shift * c
        y = y * y * y if cubed else y
        chain.append(float(math.floor(y)) if rounded else y)
    chains.append(chain)
for row in zip(*chains):
    print(*map(repr, row))
