"""Fits the weights of the decision with depth: fit_depth_weights.py FILE...

A FILE is what the example `candidates` of plumb-bench prints. The best candidate of a picture
decides whether a ball is found, so the script fits the highest log-odds of each picture: over the
limit for the ball's candidates, under it for the others. The fit is a logistic regression of these
maxima. Squared weights are penalised, and no weight is negative. The weights are printed with the
names of `DepthWeights` of the detector.
"""

import math
import sys

import numpy as np
from scipy.optimize import minimize

from candidates import MIN_SCORE, read

# Limits of the features, as in the detector (`parameters/weights.rs`).
MIN_JUDGED, MAX_JUDGED = -4.0, 8.0
LIKENESS, CURVED, MAX_FLAT, MAX_OFF = 0.55, 0.8, 0.5, 0.2
MAX_SIZE, MAX_RMS = 40.0, 2.0
# Least score of a ball, as log-odds.
LIMIT = math.log(MIN_SCORE / (1 - MIN_SCORE))
# Factor of the log-odds in the regression. With it the weights are of the size of those without
# depth, with whose scores the detector compares them.
STEEPNESS = 2.0
# Weight of a squared weight, over the largest value of its feature.
PENALTY = 0.02
# A fit changes which candidate is the best one, so it starts again from its result.
FITS = 4


def terms(features):
    """Returns by name what each weight of a candidate is multiplied with."""
    least, most = features.get("least", 0.0), features.get("most", CURVED)
    rms = min(features["rms"], MAX_RMS)
    return {
        "intercept": 1.0,
        "judged": min(max(features["judged"], MIN_JUDGED), MAX_JUDGED),
        "attached": -features["attached"],
        "continued": -features["continued"],
        "likeness": -max(LIKENESS - features["likeness"], 0.0),
        "flat": -min(max(CURVED - most, 0.0), MAX_FLAT),
        "off_sphere": -min(features["off_sphere"], MAX_OFF),
        "size": -min(features["size"], MAX_SIZE),
        "rms": -rms,
        "rms_round": rms * min(max(least, 0.0), 1.0),
    }


def groups_with_depth(paths):
    """Returns (1 for a ball, -1 for something else; terms) of the candidates with depth of each
    picture: those of the ball and the others are two groups."""
    groups = []
    for name, _, candidates in read(paths):
        if "no depth" in name:
            continue
        for sign, on_ball in [(1, 1), (-1, 0)]:
            group = [
                terms(features)
                for kind, features in candidates
                if kind == "depth" and features["on_ball"] == on_ball
            ]
            if group:
                groups.append((sign, group))
    return groups


class Pictures:
    """The candidates of all pictures, in groups of which the best one counts."""

    def __init__(self, groups):
        self.signs = np.array([sign for sign, _ in groups])
        rows = [list(each.values()) for _, group in groups for each in group]
        self.sizes = np.abs(rows).max(axis=0) + 1e-9
        self.scaled = rows / self.sizes
        self.starts = np.cumsum([0] + [len(group) for _, group in groups])

    def best(self, weights):
        """Returns the terms of the best candidate of each group."""
        odds = self.scaled @ weights
        spans = zip(self.starts, self.starts[1:])
        return self.scaled[[start + np.argmax(odds[start:end]) for start, end in spans]]

    def margins(self, best, weights):
        """Returns by how much the `best` of each group is on its side of the limit, log-odds."""
        return self.signs * (best @ weights - LIMIT)

    def cost(self, weights):
        """Returns what is minimised, and its gradient."""
        best = self.best(weights)
        margins = STEEPNESS * self.margins(best, weights)
        wrong = 1 / (1 + np.exp(np.clip(margins, -50, 50)))
        gradient = -(best * (self.signs * wrong)[:, None]).sum(axis=0) + PENALTY * weights
        cost = np.logaddexp(0, -margins).sum() / STEEPNESS
        return cost + PENALTY / 2 * weights @ weights, gradient

    def fit(self):
        """Returns the weights, for terms over `sizes`."""
        weights = np.ones(self.scaled.shape[1])
        bounds = [(0, None)] * len(weights)
        for _ in range(FITS):
            weights = minimize(
                self.cost, weights, jac=True, bounds=bounds, method="L-BFGS-B"
            ).x
        return weights


def main():
    groups = groups_with_depth(sys.argv[1:])
    pictures = Pictures(groups)
    weights = pictures.fit()
    is_wrong = pictures.margins(pictures.best(weights), weights) < 0
    is_ball = pictures.signs > 0
    print(f"{is_ball.sum()} balls, {(is_ball & is_wrong).sum()} of them under the limit")
    print(f"{(~is_ball).sum()} groups of others, {(~is_ball & is_wrong).sum()} over it")
    for name, weight in zip(groups[0][1][0], weights / pictures.sizes):
        print(f"{name}: {weight:.3g}")


if __name__ == "__main__":
    main()
