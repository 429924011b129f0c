"""Early, thick handsets."""

from __future__ import annotations

from ffd_lightning.shapes.cellphone.body import Body, lid_at, shell, tile, upright
from ffd_lightning.shapes.cellphone.edges import aerial, side_buttons
from ffd_lightning.shapes.cellphone.finish import Finish, draw_finish
from ffd_lightning.shapes.cellphone.front import display, earpiece, keypad
from ffd_lightning.shapes.kit import Builder, Rng
from ffd_lightning.shapes.kit.vectors import UP, lean, vec


def brick(rng: Rng) -> Builder:
    """Build an early, thick handset: a row of keys, a tiny screen, an aerial, some with a flap."""
    b = Builder()
    finish = draw_finish(rng)
    width = rng.uniform(0.3, 0.42)
    body = upright(width, 1.0, width * rng.uniform(0.6, 1.1))
    squareness = rng.uniform(5, 9)
    shell(b, rng, "body", finish.body, body, rng.uniform(-0.04, 0.1), squareness)
    pack = upright(0.92 * width, rng.uniform(0.5, 0.85), 0.4 * body.depth)
    back = body.behind(0, 0, 0.05 * body.depth)
    back = back * vec(1, 0, 1) + pack.center * UP + 0.04 * UP
    tile(b, "body", finish.back, pack, back, (pack.width, pack.height, pack.depth), 0.06, edge=0.03)
    top = rng.uniform(0.0, 0.12)
    rows = int(rng.integers(4, 7))
    display(b, rng, finish, body, low=top + 0.03, high=top + rng.uniform(0.1, 0.2), share=0.72)
    keypad(b, rng, finish, body, low=-0.36, high=top - 0.02, share=0.76, rows=rows, columns=3)
    earpiece(b, rng, body, 0.4)
    earpiece(b, rng, body, -0.43)
    aerial(b, rng, finish, body, int(rng.choice([-1, 1])))
    side_buttons(b, rng, finish, body)
    if rng.random() < 0.35:
        _flap(b, rng, finish, body)
    return b


def _flap(b: Builder, rng: Rng, finish: Finish, body: Body) -> None:
    """Hang a mouthpiece flap, turned forward and down, from the lower edge of a body."""
    tall, deep = rng.uniform(0.22, 0.34), 0.035
    hinge = body.at(0, -0.44)
    tip = lean(rng.uniform(200, 240))
    flap = lid_at(hinge, tip, 0.86 * body.width, tall, deep)
    tile(b, "body", finish.back, flap, flap.center, (flap.width, tall, deep), 0.05, edge=0.012)
    reach = vec(0.36 * body.width, 0, 0)
    b.cylinder("body", finish.trim, hinge - reach, hinge + reach, 0.03)
    earpiece(b, rng, flap, 0.3)
