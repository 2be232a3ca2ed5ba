"""Reads what the example `candidates` of plumb-bench prints."""

# Least score of a ball, as in the detector (`min_score` in `parameters.rs`).
MIN_SCORE = 0.52


def read(paths):
    """Returns (name of the frame, whether there is a ball, candidates) of each frame. A candidate
    is its kind (`colour` or `depth`) and its features by name."""
    frames = []
    for path in paths:
        with open(path, encoding="utf-8") as lines:
            for line in lines:
                kind, *words = line.split()
                if kind in ("ball", "empty"):
                    frames.append((" ".join(words), kind == "ball", []))
                else:
                    features = dict(zip(words[::2], map(float, words[1::2])))
                    frames[-1][2].append((kind, features))
    return frames
