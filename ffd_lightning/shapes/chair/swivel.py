"""Office chairs."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.boards import beam, pad
from ffd_lightning.shapes.kit.paths import bend, circle
from ffd_lightning.shapes.kit.upholstery import draw_cover
from ffd_lightning.shapes.kit.vectors import UP, lean, vec


def _star_base(b: Builder, rng: Rng, material: Material, height: float) -> None:
    """Add four or five feet on casters below a gas column that ends at `height`."""
    count, reach = int(rng.integers(4, 6)), rng.uniform(0.25, 0.34)
    rubber, hub = pick_material(rng, "rubber"), rng.uniform(0.08, 0.13)
    for end in circle(count=count, radius=reach, height=0.055, degrees=90.0):
        path = [(0, hub, 0), 0.5 * end + 0.6 * hub * UP, end]
        b.tube("leg", material, path, (0.028, 0.022, 0.016), segments=8)
        out = end * vec(1, 0, 1) / reach
        axle = vec(-out[2], 0, out[0]) * 0.02
        wheel = end * vec(1, 0, 1) + 0.03 * UP
        b.cylinder("leg", rubber, wheel - axle, wheel + axle, 0.03, segments=12)
        b.cylinder("leg", rubber, wheel, end, 0.012, segments=8)
    rows = [(0.035, hub - 0.03), (0.035, 0.6 * height), (0.02, 0.6 * height), (0.02, height)]
    b.lathe("leg", material, rows, segments=12)


def swivel(rng: Rng) -> Builder:
    """Build an office chair: star base, padded seat and back, with or without arms."""
    b = Builder()
    metal = pick_material(rng, draw(rng, ["metal", "rubber"]))
    cover, height = draw_cover(rng), rng.uniform(0.42, 0.54)
    width, depth = rng.uniform(0.44, 0.56), rng.uniform(0.42, 0.52)
    soft, rise = rng.uniform(0.05, 0.11), rng.uniform(0.35, 0.8)
    _star_base(b, rng, metal, height - 0.02)
    b.box("seat", metal, (0, height - 0.02, 0), (0.22, 0.03, 0.25))
    seat = (width, soft, depth)
    b.rounded_box("seat", cover, (0, height + 0.4 * soft, 0), seat, rng.uniform(0.05, 0.16))
    turn, degrees = lean(10), 10.0
    gap = rng.uniform(0.0, 0.12)
    origin = vec(0, height + soft * 0.5, depth / 2)
    pads = 1 if rise < 0.6 or rng.random() < 0.5 else int(rng.integers(2, 5))
    tall = (rise - gap) / pads
    for i in range(pads):
        center = turn @ vec(0, gap + (i + 0.5) * tall, 0) + origin
        size = (width * rng.uniform(0.85, 0.95), tall + 0.01, rng.uniform(0.05, 0.08))
        pad(b, "back", cover, center, size, min(0.4 * tall, rng.uniform(0.04, 0.15)), degrees)
    spine = [(0, height - 0.02, 0.1), (0, height - 0.02, depth / 2 + 0.05)]
    spine += [tuple(turn @ vec(0, gap + 0.4 * tall, 0.03) + origin)]
    b.tube("back", metal, bend(spine, 0.1), 0.016, segments=8)
    kind = draw(rng, ["none", "t", "loop"], [0.3, 0.35, 0.35])
    level = height + rng.uniform(0.2, 0.26)
    for side in (-1, 1) if kind != "none" else ():
        x = side * (width / 2 + 0.035)
        rest = (0.07, 0.025, rng.uniform(0.22, 0.3))
        b.rounded_box("arm", metal, (x, level, 0.03), rest, 0.03)
        ends = [(x, level, -0.06), (x, height - 0.01, -0.06)] if kind == "loop" else []
        path = [*ends[::1], (x, height - 0.01, 0.06), (x, level, 0.06)]
        path = path if kind == "loop" else [(0, height - 0.02, 0.06), *path]
        b.tube("arm", metal, bend(path, 0.05), 0.013, segments=8)
        if kind == "loop":
            start = (0, height - 0.02, 0)
            beam(b, "arm", metal, start, (x, height - 0.01, 0), width=0.05, height=0.012)
    return b
