"""Cars: what they are for, a body, a cabin, nose and tail, lights, wheels and what is added."""

from ffd_lightning.shapes.car import racer
from ffd_lightning.shapes.car.bodies import BODIES, shell
from ffd_lightning.shapes.car.cabins import CABINS, cockpit, doors, greenhouse
from ffd_lightning.shapes.car.ends import FACES, NOSES, TAILS
from ffd_lightning.shapes.car.extras import REARS, ROOFS, WHEELS
from ffd_lightning.shapes.car.plan import USES
from ffd_lightning.shapes.kit import Builder, Chosen, Product, Rng


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a car of its components."""
    b, plan = Builder(), chosen["use"].build(rng)
    if chosen["use"].name == "racer":
        for slot in ("body", "cabin", "nose", "tail", "wheels"):
            chosen[slot].build(b, rng, plan)
        return b
    cabin = chosen["cabin"].build(rng, plan)
    plan = chosen["nose"].build(rng, plan, cabin)
    plan = chosen["tail"].build(rng, plan, cabin)
    shell(b, plan, cabin.feet[0])
    chosen["body"].build(b, rng, plan)
    if chosen["cabin"].name == "open":
        cockpit(b, rng, plan, cabin)
    else:
        greenhouse(b, plan, cabin)
        doors(b, plan, cabin)
    for slot in ("face", "wheels"):
        chosen[slot].build(b, rng, plan)
    for slot in ("roof", "rear"):
        chosen[slot].build(b, rng, plan, cabin)
    return b


CATEGORY = Product(
    parts=("body", "roof", "hood", "window", "wheel", "light", "trim", "seat"),
    slots={
        "use": USES, "body": (*BODIES, racer.BODY), "cabin": (*CABINS, racer.CABIN),
        "nose": (*NOSES, racer.NOSE), "tail": (*TAILS, racer.TAIL),
        "face": FACES, "wheels": WHEELS, "roof": ROOFS, "rear": REARS,
    },
    family=("use", "cabin"),
    assemble=assemble,
)  # fmt: skip
