"""Fits the weights of the decision with depth: fit_depth_weights.py FILE...

A FILE is what the example `candidates` of plumb-bench prints. The weights are those of a logistic
regression whose squared weights are penalised; none may be negative. They are printed as
`DepthWeights` and `FreeFitWeights` of the detector call them.
"""

import sys

import numpy as np
from scipy.optimize import minimize

from candidates import read

# Limits of the features, as in the detector (`parameters/weights.rs`).
MIN_JUDGED, MAX_JUDGED = -4.0, 8.0
LIKENESS, CURVED, MAX_FLAT, ON_SPHERE, MAX_OFF = 0.55, 0.8, 0.5, 0.6, 0.2
MAX_ROUND, MAX_SQUARE, RMS_FREE, MAX_RMS_SQUARE = 0.8, 40.0, 0.7, 4.0
SPHERE_ROUND, SPHERE_ON, SPHERE_OFF, SPHERE_DISCOUNT = 0.8, 0.85, 0.04, 0.8
# Weight of a squared weight, over the largest value of its feature.
PENALTY = 0.1


def terms(features):
    """Returns by name what each weight of a candidate is multiplied with."""
    least, most = features.get("least", 0.0), features.get("most", CURVED)
    roundness = min(max(least, 0.0), MAX_ROUND)
    on, off, rms = features["on"], features["off"], features["rms"]
    is_sphere = least > SPHERE_ROUND and on > SPHERE_ON and off < SPHERE_OFF
    free = 1 - SPHERE_DISCOUNT * features["behind"] * is_sphere
    excess = max(rms - RMS_FREE, 0.0)
    square = min(excess**2, MAX_RMS_SQUARE)
    return {
        "intercept": 1.0,
        "judged": min(max(features["judged"], MIN_JUDGED), MAX_JUDGED),
        "attached": -features["attached"],
        "continued": -features["continued"],
        "covered_alike": -features["covered_alike"],
        "continues": -features["continues"],
        "likeness": -max(LIKENESS - features["likeness"], 0.0),
        "flat": -min(max(CURVED - most, 0.0), MAX_FLAT),
        "on_sphere": -max(ON_SPHERE - on, 0.0),
        "off_sphere": -min(off, MAX_OFF),
        "size": -free * min(features["size"], MAX_SQUARE),
        "place": -free * min(features["place"], MAX_SQUARE),
        "rms": -free * square,
        "rms_round": free * square * roundness,
        "uneven": -free * excess,
    }


def fit(values, labels):
    """Returns the weights of a logistic regression without negative weights."""
    sizes = np.abs(values).max(axis=0) + 1e-9
    scaled, signs = values / sizes, 2 * labels - 1

    def cost(weights):
        margins = signs * (scaled @ weights)
        odds = 1 / (1 + np.exp(np.clip(margins, -50, 50)))
        gradient = -(scaled * (signs * odds)[:, None]).sum(axis=0) + PENALTY * weights
        return np.logaddexp(0, -margins).sum() + PENALTY / 2 * weights @ weights, gradient

    bounds = [(0, None)] * values.shape[1]
    bounds[0] = (None, None)
    start = np.zeros(values.shape[1])
    return minimize(cost, start, jac=True, bounds=bounds, method="L-BFGS-B").x / sizes


def main():
    found = [
        (terms(features), features["on_ball"])
        for _, _, candidates in read(sys.argv[1:])
        for kind, features in candidates
        if kind == "depth"
    ]
    names = list(found[0][0])
    values = np.array([[each[name] for name in names] for each, _ in found])
    labels = np.array([on_ball for _, on_ball in found])
    weights = fit(values, labels)
    odds = values @ weights
    print(f"{int(labels.sum())} discs on the ball, {len(labels) - int(labels.sum())} others;")
    print(f"{int(((odds > 0) != labels).sum())} of them on the wrong side")
    for name, weight in zip(names, weights):
        print(f"{name}: {weight:.3g}")


if __name__ == "__main__":
    main()
