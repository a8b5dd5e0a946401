"""A small lamp under an opaque shade, over a glossy floor.

The shade lets light out through a narrow opening onto one bright patch; the room is lit by that
patch alone, much of it by way of the glossy floor.
"""

from builders import kit


def build():
    plaster = kit.diffuse("plaster", 0.75, 0.73, 0.70)
    orange = kit.diffuse("orange", 0.70, 0.36, 0.14)
    teal = kit.diffuse("teal", 0.14, 0.42, 0.44)
    floor = kit.glossy("floor", 0.62, 0.58, 0.55, 0.3)
    shade = kit.diffuse("shade", 0.55, 0.52, 0.48)
    steel = kit.glossy("steel", 0.78, 0.78, 0.80, 0.2)

    walls = {"floor": floor, "ceiling": plaster, "left": teal, "right": orange,
             "front": plaster, "back": plaster}
    kit.room("room", (-2, -2.5, 0), (2, 2.5, 3), walls)

    # A thick-walled bell, closed above, 24 cm wide below; the lamp sits deep inside.
    outside = [(0.0, 0.34), (0.06, 0.33), (0.10, 0.28), (0.13, 0.0)]
    inside = [(0.12, 0.0), (0.09, 0.27), (0.05, 0.315), (0.0, 0.32)]
    kit.lathe("shade", outside + inside, shade, (0.75, 0.9, 1.05))
    kit.lathe("stem", [(0.0, 1.61), (0.012, 1.61), (0.012, 0.0), (0.0, 0.0)], steel,
              (0.75, 0.9, 1.39), steps=24)
    kit.area_lamp("lamp", 900.0, (0.06, 0.06), (0.75, 0.9, 1.28))

    kit.monkey("head", 0.34, (-0.75, 0.7, 0.42), plaster, turn=20)
    kit.sphere("steel ball", 0.22, (0.05, -0.1, 0.22), steel, subdivisions=5)
    kit.box("chest", (-1.9, 1.6, 0), (-0.6, 2.3, 0.8), orange)
    kit.box("crate", (1.15, 1.5, 0), (1.7, 2.05, 0.55), plaster, turn=25)
    kit.world((0, 0, 0), 0)
    kit.camera((-0.2, -2.35, 1.4), (0.1, 0.8, 0.8), 24)
