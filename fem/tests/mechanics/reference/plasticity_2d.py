"""Finite-strain J2 plasticity in two dimensions: reference values of `necking.rs` and `cook_plasticity.rs`.

An independent program: quadrilaterals with eight nodes and 2 x 2 Gauss points (no volumetric locking), plane strain or
axial symmetry, Hencky's law and the exponential return of Simo (CMAME 99 (1992) 61), tangents by differences of the
stress. It shares neither code, nor elements, nor dimension with Breccia. Needs numpy and scipy.

    python3 plasticity_2d.py cook 32     # deflection of the upper corner, mm, with 32 x 32 elements
    python3 plasticity_2d.py bar 12      # half of the elongation (mm), radius of the neck (mm), force (kN)
"""

import sys

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu


def voce_linear(alpha):
    """Yield stress and its slope of Simo and Armero (IJNME 33 (1992) 1413), MPa."""
    saturation = (715.0 - 450.0) * np.exp(-16.93 * alpha)
    return 715.0 - saturation + 129.24 * alpha, 16.93 * saturation + 129.24


class Law:
    def __init__(self, young, poisson, yields):
        self.bulk = young / (3 * (1 - 2 * poisson))
        self.shear = young / (2 * (1 + poisson))
        self.yields = yields

    def __call__(self, f, plastic, alpha):
        """First Piola-Kirchhoff stress [11, 12, 21, 22, 33], inverse plastic metric and plastic strain."""
        grad = np.zeros((len(f), 3, 3))
        grad[:, 0, 0], grad[:, 0, 1], grad[:, 1, 0], grad[:, 1, 1], grad[:, 2, 2] = f.T
        trial = grad @ plastic @ grad.transpose(0, 2, 1)
        squares, axes = np.linalg.eigh(trial)
        strain = 0.5 * np.log(squares)
        mean = strain.mean(axis=1, keepdims=True)
        dev = 2 * self.shear * (strain - mean)
        size = np.sqrt(1.5 * (dev**2).sum(axis=1))
        step = np.zeros_like(alpha)
        flows = size > self.yields(alpha)[0]
        for _ in range(50):
            stress, slope = self.yields(alpha + step)
            defect = np.where(flows, size - 3 * self.shear * step - stress, 0.0)
            step = np.maximum(step + defect / (3 * self.shear + slope), 0.0)
            if np.abs(defect).max() < 1e-9:
                break
        scale = 1 - 3 * self.shear * step / np.maximum(size, 1e-30)
        dev = dev * scale[:, None]
        tau = dev + 3 * self.bulk * mean
        elastic = dev / (2 * self.shear) + mean
        kirchhoff = (axes * tau[:, None, :]) @ axes.transpose(0, 2, 1)
        left = (axes * np.exp(2 * elastic)[:, None, :]) @ axes.transpose(0, 2, 1)
        inverse = np.linalg.inv(grad)
        piola = kirchhoff @ inverse.transpose(0, 2, 1)
        metric = inverse @ left @ inverse.transpose(0, 2, 1)
        components = [piola[:, 0, 0], piola[:, 0, 1], piola[:, 1, 0], piola[:, 1, 1], piola[:, 2, 2]]
        return np.stack(components, axis=1), metric, alpha + step


class Body:
    """Grid of n x m quadrilaterals with eight nodes, mapped from the unit square."""

    def __init__(self, n, m, position, axial, law):
        number, self.nodes = {}, []

        def node(i, j):
            if (i, j) not in number:
                number[i, j] = len(self.nodes)
                self.nodes.append(position(i / (2 * n), j / (2 * m)))
            return number[i, j]

        corners = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        cells = [[node(2 * i + a, 2 * j + b) for a, b in corners] for i in range(n) for j in range(m)]
        self.number, self.law = number, law
        self.nodes, self.cells = np.array(self.nodes), np.array(cells)
        operators, weights = [], []
        for s in (-(3**-0.5), 3**-0.5):
            for t in (-(3**-0.5), 3**-0.5):
                shape, slopes = self.shape(s, t)
                x = self.nodes[self.cells]
                jacobian = np.einsum("cai,aj->cij", x, slopes)
                gradient = np.einsum("aj,cjk->cak", slopes, np.linalg.inv(jacobian))
                radius = x[:, :, 0] @ shape
                g = np.zeros((len(x), 5, 16))
                g[:, 0, 0::2], g[:, 1, 0::2] = gradient[:, :, 0], gradient[:, :, 1]
                g[:, 2, 1::2], g[:, 3, 1::2] = gradient[:, :, 0], gradient[:, :, 1]
                weight = np.linalg.det(jacobian)
                if axial:
                    g[:, 4, 0::2] = shape / radius[:, None]
                    weight = weight * 2 * np.pi * radius
                operators.append(g)
                weights.append(weight)
        self.g, self.w = np.concatenate(operators), np.concatenate(weights)
        freedoms = np.stack([2 * self.cells, 2 * self.cells + 1], axis=2).reshape(len(cells), 16)
        self.freedoms = np.concatenate([freedoms] * 4)
        self.u, self.increment = np.zeros((2, 2 * len(self.nodes)))
        self.plastic = np.tile(np.eye(3), (len(self.w), 1, 1))
        self.alpha = np.zeros(len(self.w))

    @staticmethod
    def shape(s, t):
        def values(s, t):
            n = [0.25 * (1 + s * a) * (1 + t * b) * (s * a + t * b - 1) for a, b in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
            return np.array(n + [
                0.5 * (1 - s * s) * (1 - t), 0.5 * (1 + s) * (1 - t * t),
                0.5 * (1 - s * s) * (1 + t), 0.5 * (1 - s) * (1 - t * t),
            ])

        h = 1e-20
        slopes = [values(s + 1j * h, t).imag / h, values(s, t + 1j * h).imag / h]
        return values(s, t), np.stack(slopes, axis=1)

    def gradients(self, u):
        f = np.einsum("pij,pj->pi", self.g, u[self.freedoms])
        return f + np.array([1.0, 0.0, 0.0, 1.0, 1.0])

    def forces(self, u):
        piola, *state = self.law(self.gradients(u), self.plastic, self.alpha)
        nodal = np.einsum("pij,pi,p->pj", self.g, piola, self.w)
        return np.bincount(self.freedoms.ravel(), nodal.ravel(), len(u)), piola, state

    def tangent(self, u, piola):
        f, h = self.gradients(u), 1e-7
        moduli = np.zeros((len(f), 5, 5))
        for k in range(5):
            moved = f.copy()
            moved[:, k] += h
            moduli[:, :, k] = (self.law(moved, self.plastic, self.alpha)[0] - piola) / h
        blocks = np.einsum("pij,pik,pkl,p->pjl", self.g, moduli, self.g, self.w, optimize=True)
        rows = np.repeat(self.freedoms, 16, axis=1).ravel()
        columns = np.tile(self.freedoms, (1, 16)).ravel()
        return coo_matrix((blocks.ravel(), (rows, columns)), shape=(len(u), len(u))).tocsr()

    def step(self, load, prescribed):
        """One increment. `prescribed` maps freedoms to displacements. Returns the reactions."""
        fixed = np.array(list(prescribed))
        free = np.setdiff1d(np.arange(len(self.u)), fixed)
        goal = np.array(list(prescribed.values()))
        # continue the previous increment
        u = self.u + self.increment
        for iteration in range(40):
            inner, piola, state = self.forces(u)
            residual = load - inner
            rest = goal - u[fixed]
            if iteration and np.abs(residual[free]).max() < 1e-8 * np.abs(inner).max() and np.abs(rest).max() < 1e-12:
                self.increment, self.u, (self.plastic, self.alpha) = u - self.u, u, state
                return inner - load
            matrix = self.tangent(u, piola)
            right = residual[free] - matrix[free][:, fixed] @ rest
            change = splu(matrix[free][:, free].tocsc()).solve(right)
            u[free] += change
            u[fixed] = goal
        raise RuntimeError("no equilibrium")


def cook(n, law, steps=40):
    """Deflection of the upper corner of Cook's membrane, mm."""
    body = Body(n, n, lambda s, t: [48 * s, 44 * s + t * (44 - 28 * s)], False, law)
    held = {}
    for (i, _), node in body.number.items():
        if i == 0:
            held[2 * node] = held[2 * node + 1] = 0.0
    right = np.zeros(len(body.u))
    for j in range(n):
        # 312.5 MPa x 16 mm = 5 kN/mm, consistent forces of a quadratic edge
        for k, share in zip((0, 1, 2), (1 / 6, 4 / 6, 1 / 6)):
            right[2 * body.number[2 * n, 2 * j + k] + 1] += 5000.0 / n * share
    for k in range(1, steps + 1):
        body.step(right * k / steps, held)
    return body.u[2 * body.number[2 * n, 2 * n] + 1]


def bar(n, law, steps=400, half=7.0):
    """Half of the bar of Simo; yields half the elongation (mm), the radius of the neck (mm) and the force (kN)."""
    radius, length, m = 6.413, 53.334 / 2, 3 * n

    def position(s, t):
        z = length * t**1.5
        return [radius * s * (0.99 + 0.01 * z / length), z]

    body = Body(n, m, position, True, law)
    for k in range(1, steps + 1):
        held = {}
        top = [node for (_, j), node in body.number.items() if j == 2 * m]
        for (i, j), node in body.number.items():
            if i == 0:
                held[2 * node] = 0.0
            if j in (0, 2 * m):
                held[2 * node + 1] = half * k / steps if j else 0.0
        reaction = body.step(np.zeros(len(body.u)), held)
        force = sum(reaction[2 * node + 1] for node in top) / 1000
        neck = body.number[2 * n, 0]
        yield half * k / steps, body.nodes[neck, 0] + body.u[2 * neck], force


if __name__ == "__main__":
    problem, n = sys.argv[1], int(sys.argv[2])
    steel = Law(206.9e3, 0.29, voce_linear)
    if problem == "cook":
        print(cook(n, steel))
    else:
        for k, (elongation, neck, force) in enumerate(bar(n, steel), 1):
            if k % 20 == 0:
                print(f"{elongation:.3f} {neck:.4f} {force:.3f}", flush=True)
