"""A small U-Net (Ronneberger, Fischer and Brox, MICCAI 2015) that tells for each pixel how likely it is in a furrow.

It sees pictures of data sets with light, color, blur, noise, place and background varied anew each time, so that what
it learns carries over to photographs (domain randomization: Tobin et al., IROS 2017). Needs PyTorch.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import torch
import torch.nn.functional as nf
from torch import Tensor, nn

from facewrinkle.progress import bar

RATE, BATCH = 2e-3, 32
"""Largest learning rate (AdamW), and pictures in a batch."""


class UNet(nn.Module):
    """Convolutions at halved resolutions, and back, each level beside what was known at its resolution.

    Parameters
    ----------
    widths : sequence of int
        Channels at each resolution, from the full one.

    Examples
    --------
    >>> UNet((8, 16))(torch.zeros(2, 3, 32, 48)).shape
    torch.Size([2, 32, 48])
    """

    def __init__(self, widths: tuple[int, ...] = (32, 64, 128, 256)) -> None:
        super().__init__()
        self.down = nn.ModuleList(_block(before, after) for before, after in pairwise((3, *widths)))
        self.up = nn.ModuleList(_block(coarse + fine, fine) for fine, coarse in pairwise(widths))
        self.odds = nn.Conv2d(widths[0], 1, 1)

    def forward(self, pictures: Tensor) -> Tensor:
        """Return the logarithms of the odds (n, h, w) of pictures (n, 3, h, w); sides are multiples of 2^(levels-1)."""
        kept: list[Tensor] = []
        found = pictures
        for k, block in enumerate(self.down):
            found = block(found if k == 0 else nf.max_pool2d(found, 2))
            kept.append(found)
        for block, beside in zip(reversed(self.up), reversed(kept[:-1]), strict=True):
            found = block(torch.cat([nf.interpolate(found, scale_factor=2, mode="bilinear"), beside], 1))
        return self.odds(found)[:, 0]


def _block(before: int, after: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in (before, after):
        layers += [nn.Conv2d(width, after, 3, padding=1, bias=False), nn.GroupNorm(8, after), nn.SiLU()]
    return nn.Sequential(*layers)


def varied(pictures: Tensor, masks: Tensor, random: torch.Generator) -> tuple[Tensor, Tensor]:
    """Return pictures (n, 3, h, w) in [0, 1] turned, scaled, mirrored and lit anew, and the furrows in them (n, h, w).

    The masks (n, 2, h, w) tell where furrows are, and the background, which another one replaces.
    """
    device, (n, _, h, w) = pictures.device, pictures.shape

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(n, *shape, generator=random, device=device)

    angle, scale, mirror = uniform(-0.35, 0.35), uniform(-0.45, 0.25).exp(), torch.sign(uniform(-1.0, 1.0))
    turn = torch.stack(
        [
            torch.stack([mirror * scale * angle.cos(), -scale * angle.sin(), uniform(-0.2, 0.2)], 1),
            torch.stack([mirror * scale * angle.sin(), scale * angle.cos(), uniform(-0.2, 0.2)], 1),
        ],
        1,
    )
    grid = nf.affine_grid(turn, [n, 3, h, w], align_corners=False)
    pictures = nf.grid_sample(pictures, grid, padding_mode="border", align_corners=False)
    masks = nf.grid_sample(masks, grid, mode="nearest", padding_mode="border", align_corners=False)

    def smooth(cells: int) -> Tensor:
        coarse = uniform(-1.0, 1.0, 3, cells, cells)
        return nf.interpolate(coarse, (h, w), mode="bicubic", align_corners=False)

    behind = (0.5 + uniform(0.1, 0.6, 1, 1, 1) * smooth(3) + uniform(0.0, 0.5, 1, 1, 1) * smooth(24)).clamp(0.0, 1.0)
    pictures = torch.where(masks[:, 1:] > 0.5, behind, pictures)
    light = uniform(0.0, 0.6, 1, 1, 1) * smooth(3)[:, :1] + uniform(-0.5, 0.5, 1, 1, 1) + uniform(-0.15, 0.15, 3, 1, 1)
    pictures = (pictures.clamp(1e-3) ** uniform(0.7, 1.4, 1, 1, 1) * light.exp()).clamp(0.0, 1.0)
    spots = (uniform(0.0, 0.12, 1, 1, 1) * smooth(96) + uniform(0.0, 0.12, 1, 1, 1) * smooth(40)).mean(1, keepdim=True)
    pictures = pictures * (1.0 + spots)
    sharp = uniform(0.0, 1.0, 1, 1, 1)
    pictures = sharp * pictures + (1.0 - sharp) * nf.avg_pool2d(pictures, 3, 1, 1, count_include_pad=False)
    noise = torch.randn(pictures.shape, generator=random, device=device) * uniform(0.0, 0.04, 1, 1, 1)
    return (pictures + noise).clamp(0.0, 1.0), masks[:, 0]


def train(
    pictures: npt.NDArray[np.uint8],
    furrow: npt.NDArray[np.bool_],
    background: npt.NDArray[np.bool_],
    steps: int,
    seed: int = 0,
) -> UNet:
    """Return a network that has learnt from pictures.

    Parameters
    ----------
    pictures : ndarray of uint8, shape (n, h, w, 3)
    furrow, background : ndarray of bool, shape (n, h, w)
        Where each is.
    steps : int
        Batches that are learnt from.
    seed : int
    """
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    torch.manual_seed(seed)
    random = torch.Generator(device).manual_seed(seed)
    network = UNet().to(device)
    optimizer = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-2)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
    all_pictures = torch.from_numpy(pictures).to(device)
    all_masks = torch.from_numpy(np.stack([furrow, background], 1)).to(device)
    for _ in bar(range(steps), "Batches", steps):
        chosen = torch.randint(len(pictures), (BATCH,), generator=random, device=device)
        some = all_pictures[chosen].permute(0, 3, 1, 2).float() / 255.0
        seen, inside = varied(some, all_masks[chosen].float(), random)
        with torch.autocast(device.type, torch.bfloat16, enabled=device.type == "cuda"):
            odds = network(2.0 * seen - 1.0)
        found = torch.sigmoid(odds.float())
        overlap = (2.0 * (found * inside).sum() + 1.0) / (found.sum() + inside.sum() + 1.0)  # Dice
        loss = nf.binary_cross_entropy_with_logits(odds.float(), inside) + 0.2 * (1.0 - overlap)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
    return network.eval()


def save(network: UNet, path: Path) -> None:
    """Write a network's weights in half precision."""
    widths = [block[0].out_channels for block in network.down]
    torch.save({"widths": widths, "weights": {k: w.half().cpu() for k, w in network.state_dict().items()}}, path)


def load(path: Path) -> UNet:
    """Return the network of a file by `save`."""
    content = torch.load(path, weights_only=True)
    network = UNet(tuple(content["widths"]))
    network.load_state_dict(content["weights"])
    return network.eval()


def probabilities(network: UNet, picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.float64]:
    """Return how likely each pixel (h, w) of a picture (h, w, 3) is in a furrow; mirrored pictures give the same."""
    device = next(network.parameters()).device
    h, w = picture.shape[:2]
    around = 2 ** (len(network.down) - 1)
    seen = torch.from_numpy(picture.copy()).to(device).permute(2, 0, 1)[None].float() / 127.5 - 1.0
    seen = nf.pad(seen, (0, -w % around, 0, -h % around), mode="replicate")
    with torch.no_grad():
        odds = network(torch.cat([seen, seen.flip(3)]))
    return np.asarray(torch.sigmoid(0.5 * (odds[0] + odds[1].flip(1)))[:h, :w].double().cpu())
