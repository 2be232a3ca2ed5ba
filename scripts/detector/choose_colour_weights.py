"""Chooses the weights of the decision without depth: choose_colour_weights.py FALSE_ALARMS FILE...

A FILE is what the example `candidates` of plumb-bench prints. The script tries all weights of a
grid, and sets each intercept to the lowest limit with at most FALSE_ALARMS false alarms. It prints
the weights with which most balls are found, with the names of `ColourWeights` of the detector.
"""

import itertools
import math
import sys

from candidates import MIN_SCORE, read

# Weights that are tried, and limits that hold for all.
JUDGED = [0.2, 0.3, 0.4, 0.5, 0.6, 0.8]
RMS = [0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8]
MISSING = [2.0, 3.0, 4.7, 5.5, 6.5, 8.0]
THROUGH, MAX_JUDGED, MAX_RMS = 16.9, 8.0, 3.5
ENOUGH_LIKENESS, LIKENESS = 0.5, 8.0
# Factor of the score of a ball without depth.
UNKNOWN_DEPTH_FACTOR = 0.9
# Distance of the limit from the last false alarm, log-odds.
MARGIN = 0.05
# Number of results that are printed.
PRINTED = 8


def without_depth(paths):
    """Returns (whether there is a ball, candidates) of each frame without depth. A candidate is
    whether it is the ball, and its features."""

    def known(features):
        judged, rms = min(features["judged"], MAX_JUDGED), min(features["rms"], MAX_RMS)
        unlike = max(ENOUGH_LIKENESS - features["likeness"], 0.0)
        fixed = THROUGH * features["through"] + LIKENESS * unlike
        return features["on_ball"] > 0, (judged, features["edges"], fixed, rms)

    return [
        (has_ball, [known(features) for _, features in candidates])
        for name, has_ball, candidates in read(paths)
        if "no depth" in name
    ]


def best(candidates, weights):
    """Returns the highest log-odds without the intercept, and whether it is the ball's."""
    judged_weight, rms_weight, missing_weight = weights
    rated = [
        (
            judged_weight * judged
            - rms_weight * rms
            - missing_weight * (1 - edges)
            - fixed,
            on_ball,
        )
        for on_ball, (judged, edges, fixed, rms) in candidates
    ]
    return max(rated, default=(-math.inf, False))


def main():
    allowed, pictures = int(sys.argv[1]), without_depth(sys.argv[2:])
    least = math.log(MIN_SCORE / (UNKNOWN_DEPTH_FACTOR - MIN_SCORE))
    results = []
    for weights in itertools.product(JUDGED, RMS, MISSING):
        rated = [(has_ball, *best(candidates, weights)) for has_ball, candidates in pictures]
        alarms = sorted((odds for has_ball, odds, _ in rated if not has_ball), reverse=True)
        limit = alarms[allowed] + MARGIN
        found = sum(has_ball and on_ball and odds > limit for has_ball, odds, on_ball in rated)
        results.append((found, *weights, least - limit))
    balls = sum(has_ball for has_ball, _ in pictures)
    print(f"{balls} balls, {len(pictures) - balls} pictures without one")
    for found, judged, rms, missing, intercept in sorted(results, reverse=True)[:PRINTED]:
        print(f"{found} found: judged {judged}, rms {rms}, missing {missing}, "
              f"intercept {intercept:.2f}")


if __name__ == "__main__":
    main()
