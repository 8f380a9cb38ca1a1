"""Golden values of the DOSE3 UNet from an independent implementation in PyTorch.

Run `python generate.py` in this folder (torch is all it needs); it rewrites golden.json.
Everything is computed in f64 on one thread from inputs that f32 holds exactly, so an f32
implementation is compared with the true values. README.md describes the file.
"""

import json
import math
from pathlib import Path

import torch
from torch import nn
from torch.nn import functional as F

CONFIG = {
    "in_channels": 9,
    "out_channels": 3,
    "width": 8,
    "multipliers": [1, 2],
    "heads": 2,
    "head_dim": 4,
    "groups": 4,
}
BATCH, LENGTH = 2, 64
STEPS = [3.0, 17.0]
SEEDS = {"parameters": 1, "input": 2, "upstream": 3}


class Conv(nn.Conv1d):
    """Convolution with weights standardised per output channel."""

    def forward(self, x):
        mean = self.weight.mean(dim=(1, 2), keepdim=True)
        var = self.weight.var(dim=(1, 2), unbiased=False, keepdim=True)
        return self._conv_forward(x, (self.weight - mean) * (var + 1e-5).rsqrt(), self.bias)


class Block(nn.Module):
    def __init__(self, cin, cout, time, groups):
        super().__init__()
        self.time = nn.Linear(time, 2 * cout)
        self.conv1 = Conv(cin, cout, 3, padding=1)
        self.norm1 = nn.GroupNorm(groups, cout, eps=1e-5)
        self.conv2 = Conv(cout, cout, 3, padding=1)
        self.norm2 = nn.GroupNorm(groups, cout, eps=1e-5)
        self.residual = nn.Conv1d(cin, cout, 1) if cin != cout else nn.Identity()

    def forward(self, x, e):
        scale, shift = self.time(F.silu(e))[:, :, None].chunk(2, dim=1)
        h = F.silu(self.norm1(self.conv1(x)) * (scale + 1) + shift)
        return F.silu(self.norm2(self.conv2(h))) + self.residual(x)


class Gain(nn.Module):
    """Layer norm over channels without offset."""

    def __init__(self, channels):
        super().__init__()
        self.weight = nn.Parameter(torch.ones(channels))

    def forward(self, x):
        return F.layer_norm(x.mT, x.shape[1:2], self.weight, None, 1e-5).mT


class Attention(nn.Module):
    """What is added to x: attention over the length axis."""

    def __init__(self, channels, heads, head_dim):
        super().__init__()
        self.heads = heads
        self.norm = Gain(channels)
        self.qkv = nn.Conv1d(channels, 3 * heads * head_dim, 1, bias=False)
        self.out = nn.Conv1d(heads * head_dim, channels, 1)

    def forward(self, x):
        q, k, v = (
            part.unflatten(1, (self.heads, -1)) for part in self.qkv(self.norm(x)).chunk(3, dim=1)
        )
        q, k = F.normalize(q, dim=2, eps=1e-12), F.normalize(k, dim=2, eps=1e-12)
        a = (10 * torch.einsum("bhdi,bhdj->bhij", q, k)).softmax(dim=-1)
        return self.out(torch.einsum("bhij,bhdj->bhdi", a, v).flatten(1, 2))


class Level(nn.Module):
    def __init__(self, block_in, channels, resample, config, time):
        super().__init__()
        self.block1 = Block(block_in, channels, time, config["groups"])
        self.block2 = Block(block_in, channels, time, config["groups"])
        self.attention = Attention(channels, config["heads"], config["head_dim"])
        self.resample = resample


class TimeMlp(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.linear1 = nn.Linear(width, 4 * width)
        self.linear2 = nn.Linear(4 * width, 4 * width)

    def forward(self, steps):
        half = self.linear1.in_features // 2
        frequencies = torch.exp(torch.arange(half).double() * -(math.log(10000) / (half - 1)))
        angles = steps[:, None] * frequencies[None, :]
        # The network is defined on features rounded to f32.
        features = torch.cat([angles.sin(), angles.cos()], dim=1).float().double()
        return self.linear2(F.gelu(self.linear1(features), approximate="none"))


class Middle(nn.Module):
    def __init__(self, channels, config, time):
        super().__init__()
        self.block1 = Block(channels, channels, time, config["groups"])
        self.attention = Attention(channels, config["heads"], config["head_dim"])
        self.block2 = Block(channels, channels, time, config["groups"])


class UNet(nn.Module):
    def __init__(self, config):
        super().__init__()
        width, time = config["width"], 4 * config["width"]
        dims = [width] + [width * m for m in config["multipliers"]]
        pairs = list(zip(dims[:-1], dims[1:]))
        self.time_mlp = TimeMlp(width)
        self.init_conv = nn.Conv1d(config["in_channels"], width, 7, padding=3)
        self.downs = nn.ModuleList()
        for i, (cin, cout) in enumerate(pairs):
            if i < len(pairs) - 1:
                resample = nn.Conv1d(cin, cout, 4, stride=2, padding=1)
            else:
                resample = nn.Conv1d(cin, cout, 3, padding=1)
            self.downs.append(Level(cin, cin, resample, config, time))
        self.mid = Middle(dims[-1], config, time)
        self.ups = nn.ModuleList()
        for cin, cout in reversed(pairs):
            resample = nn.Conv1d(cout, cin, 3, padding=1)
            self.ups.append(Level(cout + cin, cout, resample, config, time))
        self.final_block = Block(2 * width, width, time, config["groups"])
        self.final_conv = nn.Conv1d(width, config["out_channels"], 1)

    def forward(self, x, steps):
        e = self.time_mlp(steps)
        x = self.init_conv(x)
        r, skips = x, []
        for level in self.downs:
            x = level.block1(x, e)
            skips.append(x)
            x = level.block2(x, e)
            x = x + level.attention(x)
            skips.append(x)
            x = level.resample(x)
        x = self.mid.block1(x, e)
        x = x + self.mid.attention(x)
        x = self.mid.block2(x, e)
        for j, level in enumerate(self.ups):
            x = level.block1(torch.cat([x, skips.pop()], dim=1), e)
            x = level.block2(torch.cat([x, skips.pop()], dim=1), e)
            x = x + level.attention(x)
            if j < len(self.ups) - 1:
                x = F.interpolate(x, scale_factor=2, mode="nearest")
            x = level.resample(x)
        return self.final_conv(self.final_block(torch.cat([x, r], dim=1), e))


def signed(seed, index):
    """Value number `index` of stream `seed`: SplitMix64's output, 24 bits of it, in [-1, 1)."""
    mask = (1 << 64) - 1
    z = ((seed << 32) + index + 1) * 0x9E3779B97F4A7C15 & mask
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & mask
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & mask
    z ^= z >> 31
    return (z >> 40) / 2**23 - 1.0


def rounded(values):
    """f64 values that f32 holds exactly."""
    return torch.tensor(values, dtype=torch.float64).float().double()


def fill(network):
    """Sets every parameter from the formula in README.md and returns the layout."""
    modules, layout, offset = dict(network.named_modules()), [], 0
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            owner, kind = name.rsplit(".", 1)
            module, size = modules[owner], parameter.numel()
            draws = [signed(SEEDS["parameters"], offset + i) for i in range(size)]
            if isinstance(module, (nn.GroupNorm, Gain)):
                values = [(1.0 if kind == "weight" else 0.0) + 0.2 * u for u in draws]
            else:
                fan_in = module.weight[0].numel()
                values = [u / math.sqrt(fan_in) for u in draws]
            parameter.copy_(rounded(values).reshape(parameter.shape))
            layout.append([name, list(parameter.shape)])
            offset += size
    return layout


def main():
    torch.set_num_threads(1)
    torch.set_default_dtype(torch.float64)
    network = UNet(CONFIG)
    layout = fill(network)
    cin, cout = CONFIG["in_channels"], CONFIG["out_channels"]
    x = rounded([signed(SEEDS["input"], i) for i in range(BATCH * LENGTH * cin)])
    upstream = rounded([signed(SEEDS["upstream"], i) for i in range(BATCH * LENGTH * cout)])
    out = network(x.reshape(BATCH, LENGTH, cin).mT, torch.tensor(STEPS)).mT
    (out * upstream.reshape(BATCH, LENGTH, cout)).sum().backward()
    gradient = torch.cat([p.grad.flatten() for p in network.parameters()])
    parameters = torch.cat([p.detach().flatten() for p in network.parameters()])

    def digits(values):
        return [float(f"{v:.9g}") for v in values.flatten().tolist()]

    golden = {
        "config": CONFIG,
        "batch": BATCH,
        "length": LENGTH,
        "seeds": SEEDS,
        "layout": layout,
        "parameter_sum": float(f"{parameters.sum().item():.9g}"),
        "steps": STEPS,
        "input": digits(x),
        "upstream": digits(upstream),
        "output": digits(out),
        "gradient": digits(gradient),
    }
    text = json.dumps(golden, separators=(",", ":"))
    Path(__file__).with_name("golden.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
