"""Glass things on a table under a broad lamp: many bounces, caustics, light found through glass."""

from builders import kit

BOWL = [(0.0, 0.0), (0.16, 0.0), (0.16, 0.015), (0.02, 0.03), (0.02, 0.26), (0.10, 0.30),
        (0.17, 0.40), (0.185, 0.52), (0.17, 0.64), (0.162, 0.64), (0.176, 0.52), (0.16, 0.40),
        (0.09, 0.31), (0.0, 0.285)]


def build():
    table = kit.diffuse("table", 0.60, 0.52, 0.44)
    wall = kit.diffuse("wall", 0.56, 0.60, 0.64)
    red = kit.diffuse("red", 0.65, 0.10, 0.08)
    clear = kit.glass("clear glass", ior=1.5)
    green = kit.glass("green glass", ior=1.5, tint=(0.70, 0.95, 0.80))
    frosted = kit.glass("frosted glass", ior=1.45, roughness=0.25)

    kit.quad("table", [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], table)
    kit.quad("wall", [(-3, 1.5, 0), (3, 1.5, 0), (3, 1.5, 4), (-3, 1.5, 4)], wall)
    kit.lathe("goblet", BOWL, clear, (-0.62, 0.1, 0.001))
    kit.sphere("ball", 0.24, (0.0, -0.15, 0.2401), clear, subdivisions=5)
    kit.monkey("head", 0.26, (0.62, 0.15, 0.27), green, turn=-25, levels=2)
    kit.box("block", (-0.30, 0.55, 0.0005), (0.25, 0.75, 0.5), frosted, turn=12)
    kit.sphere("red ball", 0.1, (0.33, -0.45, 0.1), red)
    kit.area_lamp("lamp", 70.0, (1.4, 1.4), (-1.2, -0.6, 2.4), rotation=(0, -28, 0))
    kit.world((0.75, 0.85, 1.0), 0.15)
    kit.camera((0.0, -2.7, 1.05), (0.0, 0.1, 0.28), 50)
