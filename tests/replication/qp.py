# SPDX-License-Identifier: Apache-2.0
"""Strictly convex quadratic programmes by scipy's non-negative least squares, with a check of the optimality conditions.

    min over x   1/2 x^T H x + c^T x      s.t.   E x = e,   G x <= g

Lawson and Hanson, "Solving Least Squares Problems" (1974), chapter 23: x = x_0 + Z y with E Z = 0 leaves the inequalities; the Cholesky
factor of Z^T H Z turns the problem into that of the shortest vector under inequalities (LDP), whose dual is non-negative least squares
(Fortran code of the same book, in scipy). The solution is then computed again from its active set, and `solve` raises Unsolved unless
it satisfies the Karush-Kuhn-Tucker conditions, which for a convex problem prove it optimal.
"""
import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

TOLERANCE = 1e-8


class Infeasible(ValueError):
    """No x satisfies the constraints."""


class Unsolved(ArithmeticError):
    """The answer does not satisfy the optimality conditions."""


def solve(hessian, gradient, equal, value, rows, bound):
    """x (n) and the multipliers of the inequalities. Infinite entries of `bound` are no constraints."""
    finite = np.isfinite(bound)
    lam = np.zeros(len(bound))
    x, lam[finite], nu = _solve(hessian, gradient, equal, value, rows[finite], bound[finite])
    residual = kkt_residual(hessian, gradient, equal, value, rows[finite], bound[finite], x, lam[finite], nu)
    if not residual < TOLERANCE:
        raise Unsolved(f"optimality conditions of a QP: residual {residual:.2g}, expected less than {TOLERANCE:.0g}")
    return x, lam


def _solve(hessian, gradient, equal, value, rows, bound):
    left, sigma, right = np.linalg.svd(equal)
    rank = int((sigma > 1e-9 * sigma[0]).sum())
    start = right[:rank].T @ ((left[:, :rank].T @ value) / sigma[:rank])
    if np.abs(equal @ start - value).max() > 1e-9 * (1e-6 + np.abs(value).max()):
        raise Infeasible("the equations contradict each other")
    null = right[rank:].T
    factor = np.linalg.cholesky(null.T @ hessian @ null)
    shift = solve_triangular(factor, null.T @ (hessian @ start + gradient), lower=True)
    a = solve_triangular(factor, (rows @ null).T, lower=True).T
    b = bound - rows @ start + a @ shift
    # Shortest z with a z <= b. Rows of unit length, and b of the size of one.
    norm = np.maximum(np.linalg.norm(a, axis=1), 1e-300)
    a, b = a / norm[:, None], b / norm
    size = max(np.abs(b[b < 0]).max(initial=0), 1e-300)
    u, _ = nnls(np.vstack([-a.T, -b / size]), np.append(np.zeros(a.shape[1]), 1.0))
    if 1 + b @ u / size < 1e-12:
        raise Infeasible("the limits forbid the equations")
    return _finish(hessian, gradient, equal, value, rows, bound, list(np.flatnonzero(u > 0)))


def _finish(hessian, gradient, equal, value, rows, bound, active):
    """Solution on the active set, to full precision: [H E^T A^T; E 0 0; A 0 0] with A the active rows.

    Where limits are met almost at once, least squares in single steps may take the wrong one of them: at most ten exchanges.
    """
    n, m = len(gradient), len(value)
    for _ in range(10):
        held = np.vstack([equal, rows[active]])
        kkt = np.block([[hessian, held.T], [held, np.zeros((len(held), len(held)))]])
        answer = np.linalg.lstsq(kkt, np.concatenate([-gradient, value, bound[active]]), rcond=1e-15)[0]
        x, nu, lam = answer[:n], answer[n:n + m], np.zeros(len(bound))
        lam[active] = answer[n + m:]
        excess = rows @ x - bound
        excess[active] = 0
        if excess.max(initial=0) > 1e-12:
            active.append(int(excess.argmax()))
        elif lam.min(initial=0) < 0:
            active.remove(int(lam.argmin()))
        else:
            break
    return x, lam, nu


def kkt_residual(hessian, gradient, equal, value, rows, bound, x, lam, nu):
    """Largest violation of stationarity, of the constraints, of the multipliers' signs and of complementarity, each relative."""
    slack = bound - rows @ x
    force = np.abs(gradient).max() + np.abs(hessian @ x).max() + 1e-300
    length = np.abs(x).max() + 1e-300
    return max(np.abs(hessian @ x + gradient + equal.T @ nu + rows.T @ lam).max() / force,
               np.abs(equal @ x - value).max(initial=0) / length,
               max(-slack.min(initial=0), 0) / length,
               max(-lam.min(initial=0), 0) / force,
               np.abs(lam * slack).max(initial=0) / (force * length))
