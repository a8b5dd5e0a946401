"""A room whose only light is a small lamp outside, behind a pane of frosted glass.

Shadow rays end at the pane: the lamp is found through two rough refractions, by who aims at the
pane, and at the lamp from within it.
"""

from builders import kit

LOW, HIGH = (-1.6, -2.0, 0.0), (1.6, 2.0, 2.6)
PANE = (-0.45, 0.45, 1.1, 2.0)  # x from, to; z from, to


def _pierced_wall(material):
    """The back wall around the pane."""
    (x0, _, z0), (x1, y, z1) = LOW, HIGH
    left, right, low, high = PANE
    for name, a, b, c, d in (("below", x0, x1, z0, low), ("above", x0, x1, high, z1),
                             ("left of", x0, left, low, high), ("right of", right, x1, low, high)):
        kit.quad(f"wall {name} the pane", [(a, y, c), (a, y, d), (b, y, d), (b, y, c)], material)


def build():
    plaster = kit.diffuse("plaster", 0.74, 0.72, 0.68)
    blue = kit.diffuse("blue", 0.16, 0.28, 0.52)
    oak = kit.diffuse("oak", 0.46, 0.30, 0.18)
    black = kit.diffuse("black", 0.02, 0.02, 0.02)
    frosted = kit.glass("frosted glass", ior=1.5, roughness=0.3)

    walls = {"floor": oak, "ceiling": plaster, "left": blue, "right": plaster, "front": plaster}
    kit.room("room", LOW, HIGH, walls, openings=("back",))
    _pierced_wall(plaster)
    left, right, low, high = PANE
    kit.box("pane", (left - 0.02, 2.001, low - 0.02), (right + 0.02, 2.013, high + 0.02), frosted)
    kit.room("shaft", (left - 0.1, 2.0, low - 0.1), (right + 0.1, 3.4, high + 0.1),
             dict.fromkeys(("floor", "ceiling", "left", "right", "back"), black),
             openings=("front",))
    kit.area_lamp("lamp", 260.0, (0.12, 0.12), (0.1, 3.2, 1.7), rotation=(-84, 0, 0))

    kit.monkey("head", 0.3, (-0.5, 0.5, 0.42), plaster, turn=25)
    kit.box("table", (0.4, -0.2, 0.0), (1.3, 0.9, 0.7), oak)
    kit.sphere("ball", 0.2, (0.85, 0.4, 0.901), blue)
    kit.world((0, 0, 0), 0)
    kit.camera((0.0, -1.85, 1.4), (0.0, 1.0, 0.95), 22)
