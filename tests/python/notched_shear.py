"""Independent solution of the single-edge notched shear test, without `fem`: triangles, small strain, plane strain,
consistent damage terms, and alternate minimisation until the fields converge. AT2, spectral split of the
stress, history of the driving energy. `fem/tests/notched_plate.rs` contains the results.
`fem/src/equations.md` compares them with `cargo bench -p fem --bench notched_plate -- shear`.

    python3 notched_shear.py SIZE_MM

Needs numpy and scipy; a size of 0.03 takes half a minute, 0.0075 half an hour.
"""
import sys
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

LAME, SHEAR, TOUGHNESS, LENGTH, RESIDUAL = 121.15, 80.77, 2.7e-3, 0.015, 1e-7  # kN, mm
H = float(sys.argv[1]) if len(sys.argv) > 1 else 0.015
STEPS = np.concatenate([np.linspace(0.001, 0.008, 8), np.linspace(0.0082, 0.02, 60)])


def axis(h):
    """Grid points in (0, 1): the spacing is h from 0.5 to 1, and grows by a factor of 1.3 per point towards 0."""
    points, x, step = [0.5], 0.5, h
    while x > 1e-9:
        if 0.5 - x > max(0.03, 2 * h):
            step = min(1.3 * step, 0.06)
        x = max(0.0, x - step)
        if x < 0.5 * step:
            x = 0.0
        points.append(x)
    fine = np.linspace(0.5, 1.0, round(0.5 / h) + 1)
    return np.concatenate([points[::-1], fine[1:]])


xs = axis(H)
ys = 1.0 - xs[::-1]
nx, ny = len(xs), len(ys)
middle = int(np.argmin(abs(ys - 0.5)))
slit = int(np.sum(xs < 0.5 - 1e-9))
X, Y = np.meshgrid(xs, ys)
nodes = np.concatenate([np.stack([X.ravel(), Y.ravel()], 1),
                        np.stack([xs[:slit], np.full(slit, 0.5)], 1)])
triangles = []
for j in range(ny - 1):
    for i in range(nx - 1):
        def at(a, b):
            return nx * ny + i + a if j >= middle and j + b == middle and i + a < slit else i + a + nx * (j + b)
        triangles += [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
T = np.array(triangles)
n, m = len(nodes), len(T)
p = nodes[T]
d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
area = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
assert area.min() > 0
G = np.zeros((m, 3, 2))
for a in range(3):
    b, c = (a + 1) % 3, (a + 2) % 3
    G[:, a, 0] = (p[:, b, 1] - p[:, c, 1]) / (2 * area)
    G[:, a, 1] = (p[:, c, 0] - p[:, b, 0]) / (2 * area)
B = np.zeros((m, 3, 6))
B[:, 0, 0::2] = G[:, :, 0]
B[:, 1, 1::2] = G[:, :, 1]
B[:, 2, 0::2] = G[:, :, 1]
B[:, 2, 1::2] = G[:, :, 0]
dofs = np.stack([2 * T, 2 * T + 1], 2).reshape(m, 6)
rows, cols = np.repeat(dofs, 6, 1).ravel(), np.tile(dofs, (1, 6)).ravel()
rows_d, cols_d = np.repeat(T, 3, 1).ravel(), np.tile(T, (1, 3)).ravel()
laplace = np.einsum("eak,ebk,e->eab", G, G, area)
mass = np.einsum("ab,e->eab", (np.ones((3, 3)) + np.eye(3)) / 12, area)


def split(u):
    """Plane-strain stresses and tangents of the tensile and the compressive part, and the tensile energy."""
    e = np.einsum("eij,ej->ei", B, u[dofs])
    tr, mean = e[:, 0] + e[:, 1], 0.5 * (e[:, 0] + e[:, 1])
    half, shear = 0.5 * (e[:, 0] - e[:, 1]), 0.5 * e[:, 2]
    r = np.hypot(half, shear)
    lam = np.stack([mean + r, mean - r], 1)
    safe = np.where(r > 0, r, 1.0)
    c, s = np.where(r > 0, half / safe, 1.0), np.where(r > 0, shear / safe, 0.0)  # cosine and sine of twice the angle
    # projections n (x) n in Voigt form (xx, yy, xy) and the strain vector that gives n.e.n
    N = [np.stack([0.5 * (1 + k * c), 0.5 * (1 - k * c), 0.5 * k * s], 1) for k in (1, -1)]
    M = np.stack([-0.5 * s, 0.5 * s, 0.5 * c], 1)  # symmetric part of n1 (x) n2
    out = []
    for sign in (1, -1):
        on = [((lam[:, k] > 0) == (sign > 0)).astype(float) for k in (0, 1)]
        on_tr = ((tr > 0) == (sign > 0)).astype(float)
        kept = [lam[:, k] * on[k] for k in (0, 1)]
        one = np.array([1.0, 1.0, 0.0])
        stress = (LAME * tr * on_tr)[:, None] * one + 2 * SHEAR * sum(kept[k][:, None] * N[k] for k in (0, 1))
        D = (LAME * on_tr)[:, None, None] * np.outer(one, one)
        for k in (0, 1):
            D = D + (2 * SHEAR * on[k])[:, None, None] * np.einsum("ei,ej->eij", N[k], N[k])
        ratio = np.where(r > 1e-14, (kept[0] - kept[1]) / (2 * safe), on[0])
        D = D + (4 * SHEAR * ratio)[:, None, None] * np.einsum("ei,ej->eij", M, M)
        energy = 0.5 * LAME * tr**2 * on_tr + SHEAR * (kept[0] ** 2 + kept[1] ** 2)
        out.append((stress, D, energy))
    return out


low = np.flatnonzero(nodes[:, 1] < 1e-12)
top = np.flatnonzero(nodes[:, 1] > 1 - 1e-12)
held = np.concatenate([2 * low, 2 * low + 1, 2 * top, 2 * top + 1])
free = np.setdiff1d(np.arange(2 * n), held)
u, phi, history = np.zeros(2 * n), np.zeros(n), np.zeros(m)
print("displacement_mm,force_kN,fracture_kN_mm,phi_max,turns", flush=True)
for step in STEPS:
    u[2 * top] = step
    for turn in range(1, 3001):
        g = ((1 - RESIDUAL) * (1 - phi[T]) ** 2).mean(1) + RESIDUAL
        for newton in range(30):
            (sp_, Dp, plus), (sm, Dm, _) = split(u)
            force = np.zeros(2 * n)
            np.add.at(force, dofs, np.einsum("eij,ei,e->ej", B, g[:, None] * sp_ + sm, area))
            scale = np.linalg.norm(force[held])
            if newton and np.linalg.norm(force[free]) < 1e-6 * scale:
                break
            D = g[:, None, None] * Dp + Dm
            K = np.einsum("eki,ekl,elj,e->eij", B, D, B, area)
            K = sp.csc_matrix((K.ravel(), (rows, cols)))[free][:, free]
            u[free] -= sl.spsolve(K, force[free])
        drive = np.maximum(history, plus)
        A = TOUGHNESS * LENGTH * laplace + (TOUGHNESS / LENGTH + 2 * drive)[:, None, None] * mass
        b = np.zeros(n)
        np.add.at(b, T, np.repeat((2 * drive * area / 3)[:, None], 3, 1))
        new = sl.spsolve(sp.csc_matrix((A.ravel(), (rows_d, cols_d))), b)
        change = abs(new - phi).max()
        phi = new if turn < 4 else phi + 1.6 * (new - phi)
        if change < 2e-4:
            phi = new
            break
    history = np.maximum(history, split(u)[0][2])
    crack = TOUGHNESS / (2 * LENGTH) * np.einsum("eab,ea,eb->", mass + LENGTH**2 * laplace, phi[T], phi[T])
    print(f"{step:.5f},{force[2 * top].sum():.5f},{crack:.5e},{phi.max():.3f},{turn}", flush=True)
