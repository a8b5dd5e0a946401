"""Glass in front of a small lamp: most of what one sees on the table is focused light."""

from builders import kit


def build():
    table = kit.diffuse("table", 0.62, 0.58, 0.54)
    wall = kit.diffuse("wall", 0.50, 0.54, 0.60)
    clear = kit.glass("clear glass", ior=1.5)

    kit.quad("table", [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], table)
    kit.quad("wall", [(-3, 1.6, 0), (3, 1.6, 0), (3, 1.6, 4), (-3, 1.6, 4)], wall)
    kit.sphere("large ball", 0.34, (-0.15, 0.1, 0.36), clear, subdivisions=5)
    kit.sphere("small ball", 0.18, (0.5, -0.3, 0.19), clear, subdivisions=5)
    kit.box("bar", (-0.95, -0.5, 0.001), (-0.75, 0.6, 0.22), clear, turn=20)
    kit.area_lamp("lamp", 60.0, (0.12, 0.12), (-1.3, -0.4, 1.9), rotation=(0, -36, 0))
    kit.world((0, 0, 0), 0)
    kit.camera((0.0, -2.6, 1.3), (0.0, 0.0, 0.25), 45)
