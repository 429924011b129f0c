"""Pairs of speakers, and subwoofers with their satellites."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.speaker.drivers import draw_finish
from ffd_lightning.shapes.speaker.enclosure import (
    Cabinet,
    Units,
    add_cabinet,
    draw_cabinet,
    row_of_bays,
    two_way,
)
from ffd_lightning.shapes.speaker.fittings import add_feet
from ffd_lightning.shapes.speaker.pod import add_pod


def speaker_set(rng: Rng) -> Builder:
    """Build a pair of equal boxes, or a subwoofer with two or four satellites around it."""
    b, finish = Builder(), draw_finish(rng)
    if rng.random() < 0.35:
        cabinet = draw_cabinet(rng, width=(0.15, 0.26), height=(0.25, 0.75), depth=(0.16, 0.3))
        bays = row_of_bays(cabinet.face, two_way(rng, cabinet.width), rng.uniform(0, 0.5))
        apart, yaw = cabinet.width * rng.uniform(0.65, 1.4), rng.uniform(0, 15)
        for side in (-1, 1):
            one = replace(cabinet, foot=(side * apart, 0.0, 0.0), yaw=side * yaw)
            add_cabinet(b, one, finish, bays)
        return b
    width, depth = (0.18, 0.3), (0.2, 0.32)
    cabinet = draw_cabinet(rng, width=width, height=(0.22, 0.36), depth=depth, foot=(0, 0.02, 0))
    big: Units = [("woofer", cabinet.width * rng.uniform(0.32, 0.45))]
    if rng.random() < 0.4:
        big.append(("port", 0.12 * cabinet.width))
    add_cabinet(b, cabinet, finish, row_of_bays(cabinet.face, big, 0.1))
    add_feet(b, finish.rim, cabinet.back * cabinet.width, cabinet.depth, 0.02)
    size, pairs = rng.uniform(0.07, 0.12), 1 if rng.random() < 0.7 else 2
    pods, state = pairs == 1 and rng.random() < 0.5, int(rng.integers(1 << 30))
    tall = size * rng.uniform(1.2, 2.6)
    for pair in range(pairs):
        x = cabinet.width / 2 + size * (1.1 + 1.6 * pair)
        for side in (-1, 1):
            same = np.random.default_rng(state)  # so that all satellites match
            foot = (side * x, 0.0, -0.6 * size * pair)
            if pods:
                add_pod(b, same, finish, 0.5 * size, np.array(foot), side * 10.0)
                continue
            one = Cabinet(
                width=size,
                height=tall,
                depth=0.9 * size,
                foot=foot,
                tilt=8.0,
                yaw=side * 10.0,
                bevel=0.06 * size,
            )
            units: Units = [("woofer", 0.4 * size), ("tweeter", 0.2 * size)]
            bays = row_of_bays(one.face, units[: 1 if pairs == 2 or tall < 1.6 * size else 2])
            add_cabinet(b, one, finish, bays)
    return b
