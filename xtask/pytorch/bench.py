"""Throughput of the DOSE3 UNet pair in PyTorch, for comparison with the engine.

A small server, so that `cargo xtask bench --with-pytorch` can take turns with it in one run: every
line on standard input, `forward` or `train` followed by `eager` or `compiled` (torch.compile), is
answered by one line on standard output with the best time of a pass in seconds; `version` by
PyTorch's. The network is the one of the golden values, in f32.

    echo forward eager | python bench.py --width 32 --multipliers 1,2,4,8 --batch 32 --length 128

`--device cuda` runs on a GPU; a pass is over when the device is done. `--fused-attention` uses scaled_dot_product_attention instead of einsum and softmax.
"""

import argparse
import importlib.util
import sys
import time
from pathlib import Path

import torch
from torch.nn import functional as F

GOLDEN = Path(__file__).resolve().parents[2] / "crates" / "model" / "golden" / "generate.py"


def load_golden():
    spec = importlib.util.spec_from_file_location("golden", GOLDEN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def time_features_in_f32(golden):
    """The golden network computes in f64; here its time features become f32."""
    import math

    def forward(self, steps):
        half = self.linear1.in_features // 2
        frequencies = torch.exp(torch.arange(half, device=steps.device) * -(math.log(10000) / (half - 1)))
        angles = steps[:, None] * frequencies[None, :]
        features = torch.cat([angles.sin(), angles.cos()], dim=1)
        return self.linear2(F.gelu(self.linear1(features)))

    golden.TimeMlp.forward = forward


def fuse_attention(golden):
    def forward(self, x):
        q, k, v = (
            part.unflatten(1, (self.heads, -1)).mT
            for part in self.qkv(self.norm(x)).chunk(3, dim=1)
        )
        q, k = F.normalize(q, dim=-1, eps=1e-12), F.normalize(k, dim=-1, eps=1e-12)
        out = F.scaled_dot_product_attention(q, k, v, scale=10.0)
        return self.out(out.mT.flatten(1, 2))

    golden.Attention.forward = forward


def best(work, seconds, wait):
    """The shortest time of a pass among those of `seconds`."""
    times = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        wait()
        start = time.perf_counter()
        work()
        wait()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--width", type=int, default=32)
    parser.add_argument("--multipliers", default="1,2,4,8")
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--length", type=int, default=128)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--fused-attention", action="store_true")
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    torch.manual_seed(0)

    golden = load_golden()
    torch.set_default_dtype(torch.float32)
    torch.set_default_device(args.device)
    wait = torch.cuda.synchronize if args.device.startswith("cuda") else lambda: None
    time_features_in_f32(golden)
    if args.fused_attention:
        fuse_attention(golden)
    nets = []
    for channels in (3, 9):
        config = {
            "in_channels": channels,
            "out_channels": 3,
            "width": args.width,
            "multipliers": [int(m) for m in args.multipliers.split(",")],
            "heads": 4,
            "head_dim": 32,
            "groups": 8,
        }
        net = golden.UNet(config).float()
        x = torch.randn(args.batch, channels, args.length)
        steps = torch.arange(args.batch).remainder(30).float()
        # Compiles at its first call.
        calls = {"eager": net, "compiled": torch.compile(net)}
        # The fused optimiser is the fastest that PyTorch has.
        adam = torch.optim.Adam(net.parameters(), lr=1e-4, fused=True)
        nets.append((calls, x, steps, adam))

    def forward(mode):
        with torch.inference_mode():
            for calls, x, steps, _ in nets:
                calls[mode](x, steps)

    def train(mode):
        for calls, x, steps, adam in nets:
            adam.zero_grad(set_to_none=True)
            calls[mode](x, steps).square().mean().backward()
            adam.step()

    works = {"forward": forward, "train": train}
    for line in sys.stdin:
        if line.strip() == "version":
            print(torch.__version__, flush=True)
            continue
        what, mode = line.split()
        works[what](mode)
        print(f"{best(lambda: works[what](mode), args.seconds, wait):.6f}", flush=True)


if __name__ == "__main__":
    main()
