"""Beds."""

import numpy as np

from vlnhijack.scenes.procedural.furniture.piece import Part, Piece, assemble
from vlnhijack.scenes.procedural.furniture.seating import legs, upholstery
from vlnhijack.scenes.procedural.materials import fabric, pick, wood
from vlnhijack.scenes.procedural.shapes import box, cushion, join


def bed(rng: np.random.Generator, large: bool) -> Piece:
    """A single or double bed: headboard at -y, pillows, duvet and a folded blanket."""
    double = large or rng.random() < 0.6
    width, length = rng.uniform(1.4, 1.8) if double else rng.uniform(0.9, 1.1), 2.0
    timber, head = wood(rng, axis=0), rng.uniform(0.85, 1.2)
    rail = box(width + 0.06, length + 0.04, 0.2, (0.0, 0.0, 0.16))
    feet = legs(width, length, 0.2, 0.08)
    if rng.random() < 0.5:
        board = Part(box(width + 0.1, 0.05, head, (0.0, -length / 2 - 0.02, 0.0)), timber)
    else:
        panel = cushion(width + 0.1, 0.12, head - 0.1, 0.05, (0.0, -length / 2 - 0.02, 0.1))
        board = Part(panel, upholstery(rng))
    foot = box(width + 0.08, 0.04, rng.uniform(0.38, 0.6), (0.0, length / 2 + 0.02, 0.05))
    mattress = cushion(width - 0.02, length - 0.04, 0.24, 0.06, (0.0, 0.0, 0.3))
    white = (0.90, 0.89, 0.86)
    duvet = cushion(width + 0.06, 1.3, 0.24, 0.07, (0.0, 0.31, 0.36), 0.03)
    fold = cushion(width + 0.07, 0.28, 0.25, 0.06, (0.0, -0.25, 0.365), 0.02)
    count = 2 if double else 1
    pillows = [
        cushion(0.62, 0.4, 0.17, 0.08, crown=0.02)
        .turned("x", 0.25)
        .moved((i - (count - 1) / 2) * width / 2, -length / 2 + 0.3, 0.55)
        for i in range(count)
    ]
    throw = cushion(width + 0.09, 0.5, 0.26, 0.06, (0.0, 0.62, 0.365), 0.03)
    parts = [
        Part(join([rail, feet, foot]), timber),
        board,
        Part(mattress, fabric(rng, white, "plain")),
        Part(duvet, fabric(rng)),
        Part(fold, fabric(rng, white, "plain")),
        Part(join(pillows), fabric(rng, pick(rng, [white, (0.7, 0.75, 0.85)]), "plain")),
    ]
    if rng.random() < 0.5:
        parts.append(Part(throw, fabric(rng)))
    return assemble("bed", *parts)
