"""Trajectories of the overhung rotor with scipy.integrate.solve_ivp.

usage: ensemble.py METHOD TIME TOLERANCE KAPPA each|together < STARTS

STARTS has one initial state u v u' v' per line. With `each`, every trajectory is a separate problem; with `together`, all of
them form one problem with a common step. Prints the processor time in seconds, the number of evaluations of the right-hand side
per trajectory, and the final states, one per line.
"""

import math
import sys
import time

import numpy as np
from scipy.integrate import solve_ivp

OMEGA, ZETA, EPSILON, GAMMA, BETA, K, J_P, M = 5.0, 0.01, 0.353, 0.25, 10.0, 150.0, 0.143, 0.9
FORCING = M * EPSILON * OMEGA * OMEGA
GYROSCOPIC = (2 - J_P) * OMEGA
DAMPING = 2 * ZETA
CIRCULATORY = 2 * ZETA * OMEGA
LINEAR = 1 - (1 - J_P) * OMEGA * OMEGA


def plain(kappa):
    """Right-hand side of one trajectory in plain numbers, which Python computes faster than arrays of four."""
    cubic, ring = (1 - kappa) * GAMMA, 0.5 * kappa * BETA

    def f(_, state):
        u, v, du, dv = state.tolist()
        square = u * u + v * v
        r = math.sqrt(square)
        stiffness = LINEAR + cubic * square + ring * (math.tanh(K * (r - 1)) + 1) * (1 - 1 / r)
        return (
            du,
            dv,
            FORCING + GYROSCOPIC * dv - DAMPING * du - stiffness * u + CIRCULATORY * v,
            -GYROSCOPIC * du - DAMPING * dv - stiffness * v - CIRCULATORY * u,
        )

    return f


def stacked(kappa):
    """Right-hand side of all trajectories, stacked by component: u of all, v of all, and so on."""
    cubic, ring = (1 - kappa) * GAMMA, 0.5 * kappa * BETA

    def f(_, state):
        u, v, du, dv = state.reshape(4, -1)
        square = u * u + v * v
        r = np.sqrt(square)
        stiffness = LINEAR + cubic * square + ring * (np.tanh(K * (r - 1)) + 1) * (1 - 1 / r)
        return np.concatenate(
            (
                du,
                dv,
                FORCING + GYROSCOPIC * dv - DAMPING * du - stiffness * u + CIRCULATORY * v,
                -GYROSCOPIC * du - DAMPING * dv - stiffness * v - CIRCULATORY * u,
            )
        )

    return f


def main():
    method, end, tolerance, kappa, way = sys.argv[1:]
    end, tolerance, kappa = float(end), float(tolerance), float(kappa)
    starts = np.loadtxt(sys.stdin, ndmin=2)
    options = dict(method=method, rtol=tolerance, atol=tolerance)
    clock = time.process_time()
    if way == "each":
        f = plain(kappa)
        found = [solve_ivp(f, (0, end), start, **options) for start in starts]
        ends, calls = [s.y[:, -1] for s in found], sum(s.nfev for s in found) / len(starts)
    else:
        found = solve_ivp(stacked(kappa), (0, end), starts.T.reshape(-1), **options)
        ends, calls = found.y[:, -1].reshape(4, -1).T, found.nfev
    print(time.process_time() - clock, calls)
    for state in ends:
        print(*(repr(float(x)) for x in state))


main()
