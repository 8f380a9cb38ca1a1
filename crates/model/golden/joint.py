"""Golden values of the joint network from an independent implementation in NumPy.

Run `python joint.py` in this folder (numpy is all it needs); it rewrites joint.json. Everything is computed in f64 from
inputs that f32 holds exactly. The gradient is taken by central differences, so that no chain rule is written twice.
README.md describes the file.
"""

import json
from pathlib import Path

import numpy as np

CONFIG = {"width": 6, "embedding": 5, "dilations": [1, 3]}
BATCH, LENGTH, AXES, CONDITIONS, FREQUENCIES = 2, 11, 6, 7, 4
SEEDS = {"parameters": 4, "input": 5, "upstream": 6, "conditions": 7}


def signed(seed, index):
    """Value number `index` of stream `seed`: SplitMix64's output, 24 bits of it, in [-1, 1)."""
    mask = (1 << 64) - 1
    z = ((seed << 32) + index + 1) * 0x9E3779B97F4A7C15 & mask
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & mask
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & mask
    z ^= z >> 31
    return (z >> 40) / 2**23 - 1.0


def stream(seed, count):
    return np.float64(np.float32([signed(seed, i) for i in range(count)]))


def layout():
    width, size, blocks = CONFIG["width"], CONFIG["embedding"], len(CONFIG["dilations"])
    features = 2 * FREQUENCIES * CONDITIONS
    shapes = [("condition.linear1", [size, features], True), ("condition.linear2", [size, size], True)]
    shapes += [("film", [2 * width * blocks, size], True), ("stem", [width, AXES, 3], True)]
    for i in range(blocks):
        shapes += [(f"blocks.{i}.conv", [width, width, 3], False), (f"blocks.{i}.out", [width, width], True)]
    shapes += [("last", [AXES, width], True)]
    named = []
    for name, shape, bias in shapes:
        fan_in = int(np.prod(shape[1:]))
        named.append((name + ".weight", shape, fan_in))
        if bias:
            named.append((name + ".bias", shape[:1], fan_in))
    return named


def parameters():
    values, at = {}, 0
    for name, shape, fan_in in layout():
        count = int(np.prod(shape))
        flat = [signed(SEEDS["parameters"], at + i) / fan_in**0.5 for i in range(count)]
        values[name] = np.float64(np.float32(flat)).reshape(shape)
        at += count
    return values


def silu(x):
    return x / (1.0 + np.exp(-x))


def convolution(x, weight, dilation):
    """x [length, in], weight [out, in, 3]; zeros beyond both ends."""
    out = np.zeros((len(x), len(weight)))
    for tap in range(3):
        for t in range(len(x)):
            source = t + (tap - 1) * dilation
            if 0 <= source < len(x):
                out[t] += weight[:, :, tap] @ x[source]
    return out


def network(p, x, conditions):
    angles = conditions[:, None] * np.pi / 4 * 2.0 ** np.arange(FREQUENCIES)
    features = np.stack([np.sin(angles), np.cos(angles)], axis=-1).reshape(-1)
    e = silu(p["condition.linear1.weight"] @ features + p["condition.linear1.bias"])
    e = silu(p["condition.linear2.weight"] @ e + p["condition.linear2.bias"])
    film = (p["film.weight"] @ e + p["film.bias"]).reshape(len(CONFIG["dilations"]), 2, CONFIG["width"])
    h = convolution(x, p["stem.weight"], 1) + p["stem.bias"]
    for i, dilation in enumerate(CONFIG["dilations"]):
        u = convolution(h, p[f"blocks.{i}.conv.weight"], dilation)
        v = silu(u * (1.0 + film[i, 0]) + film[i, 1])
        h = h + v @ p[f"blocks.{i}.out.weight"].T + p[f"blocks.{i}.out.bias"]
    return silu(h) @ p["last.weight"].T + p["last.bias"]


def main():
    p = parameters()
    x = 1.5 * stream(SEEDS["input"], BATCH * LENGTH * AXES).reshape(BATCH, LENGTH, AXES)
    upstream = stream(SEEDS["upstream"], BATCH * LENGTH * AXES).reshape(BATCH, LENGTH, AXES)
    conditions = 2.0 * stream(SEEDS["conditions"], BATCH * CONDITIONS).reshape(BATCH, CONDITIONS)

    def output():
        return np.stack([network(p, x[b], conditions[b]) for b in range(BATCH)])

    gradient = []
    for name, _, _ in layout():
        flat = p[name].reshape(-1)
        for i in range(len(flat)):
            kept, step = flat[i], 1e-5
            sums = []
            for sign in (1.0, -1.0):
                flat[i] = kept + sign * step
                sums.append(float((output() * upstream).sum()))
            flat[i] = kept
            gradient.append((sums[0] - sums[1]) / (2.0 * step))
    numbers = lambda values: [float(f"{v:.9g}") for v in np.asarray(values).reshape(-1)]
    golden = {
        "config": CONFIG,
        "batch": BATCH,
        "length": LENGTH,
        "layout": [[name, list(shape)] for name, shape, _ in layout()],
        "parameters": numbers(np.concatenate([p[name].reshape(-1) for name, _, _ in layout()])),
        "conditions": numbers(conditions),
        "input": numbers(x),
        "upstream": numbers(upstream),
        "output": numbers(output()),
        "gradient": numbers(gradient),
    }
    Path(__file__).with_name("joint.json").write_text(json.dumps(golden) + "\n")


main()
