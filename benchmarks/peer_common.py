"""What the processes of peers.py share: problems, regular grids, timing, questions and answers.

Imported in the environments of the peers too, so it needs nothing but numpy.
"""

import json
import os
import sys
from collections.abc import Callable
from time import perf_counter, process_time

import numpy as np

#: force, and exact settlement or approach under it, for E* = 1: flat punches of radius or half
#: side 1, and a sphere of radius 1 whose contact has the radius 1 (K. L. Johnson, Contact
#: Mechanics, 1985, chapters 3 and 4; the square is known from elsewhere to these digits)
PROBLEMS = {
    "disc": (1.0, 1 / 2),
    "square": (1.0, 1 / (np.pi * 0.733576)),
    "Hertz": (4 / 3, 1.0),
}


def heights(plan: str, n: int, margin: float) -> tuple[float, np.ndarray]:
    """Side of a square of n x n points, and the punch over them: heights of shape (n, n).

    A flat punch fills the square up to the rim of points that the methods need outside of
    contact; what is around it lies lower by more than the settlement. That of the sphere has a
    half side of ``margin`` times the radius of contact.
    """
    side = {"disc": 2.0, "square": 2.0 * n / (n - 2), "Hertz": 2.0 * margin}[plan]
    x = (np.arange(n) + 0.5) * side / n - side / 2
    x, y = x[:, None], x
    if plan == "Hertz":
        return side, -(x**2 + y**2) / 2
    inside = x**2 + y**2 < 1 if plan == "disc" else np.maximum(abs(x), abs(y)) < 1
    return side, np.where(inside, 0.0, -1.0)


def rough(n: int) -> np.ndarray:
    """Heights of a random surface on n x n points of a unit square, with a mean slope of 1.

    Self-affine with a Hurst exponent of 0.8, waves of 1/4 to 1/64 of the side, none shorter than
    8 points; the same every time.
    """
    k = np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    inside = (k >= 4) & (k <= min(64, n / 8))
    amplitudes = np.where(inside, np.maximum(k, 1) ** -1.8, 0)
    phases = np.random.default_rng(0).random(k.shape)
    surface = np.fft.irfft2(amplitudes * np.exp(2j * np.pi * phases), (n, n))
    slope = [np.diff(surface, axis=axis, append=surface.take([0], axis)) * n for axis in (0, 1)]
    return surface / np.sqrt(np.mean(slope[0] ** 2 + slope[1] ** 2))


def best(work: Callable, seconds: float, most: int = 5):
    """The quickest of runs in some seconds: its result, time, and processor time over time."""
    begin, runs = perf_counter(), []
    while not runs or (len(runs) < most and perf_counter() - begin < seconds):
        start, processor = perf_counter(), process_time()
        result = work()
        taken = perf_counter() - start
        runs.append((taken, (process_time() - processor) / taken, result))
    taken, parallel, result = min(runs, key=lambda run: run[0])
    return result, taken, parallel


def contact(solve: Callable) -> Callable:
    """Answer of ``solve(plan, n, **setting) -> (cells, seconds for the mesh, approach)``."""

    def answer(plan: str, n: int, repeat: float, **setting) -> dict:
        (cells, mesh, approach), seconds, parallel = best(
            lambda: solve(plan, n, **setting), repeat
        )
        return {
            "cells": cells,
            "error": approach / PROBLEMS[plan][1] - 1,
            "mesh": mesh,
            "seconds": seconds,
            "parallel": parallel,
        }

    return answer


def roughness(solve: Callable) -> Callable:
    """Answer of ``solve(n, force, tolerance, periodic) -> pressures``, saved at ``path``."""

    def answer(path: str, repeat: float, **setting) -> dict:
        pressures, seconds, parallel = best(lambda: solve(**setting), repeat, 3)
        np.save(path, pressures)
        share = float(np.mean(np.asarray(pressures) > 0))
        return {"seconds": seconds, "parallel": parallel, "contact": share}

    return answer


def serve(**tasks: Callable) -> None:
    """Answer questions from the standard input, one line of JSON each, until it ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever else is printed must not come between the answers
    print(json.dumps({"ready": True}), file=answers, flush=True)
    for line in sys.stdin:
        question = json.loads(line)
        answer = tasks[question.pop("task")](**question)
        print(json.dumps(answer), file=answers, flush=True)
