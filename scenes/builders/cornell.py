"""The Cornell box: the easy scene, where a good engine needs no guide."""

from builders import kit


def build():
    white = kit.diffuse("white", 0.73, 0.73, 0.73)
    red = kit.diffuse("red", 0.63, 0.065, 0.05)
    green = kit.diffuse("green", 0.14, 0.45, 0.09)
    walls = {"floor": white, "ceiling": white, "left": red, "right": green, "back": white}
    kit.room("box", (-1, -1, 0), (1, 1, 2), walls, openings=("front",))
    kit.box("tall", (-0.65, 0.0, 0), (-0.05, 0.6, 1.2), white, turn=17)
    kit.box("short", (0.1, -0.6, 0), (0.7, 0.0, 0.6), white, turn=-17)
    kit.area_lamp("lamp", 66.0, (0.5, 0.4), (0, 0, 1.98))
    kit.world((0, 0, 0), 0)
    kit.camera((0, -3.7, 1), (0, 0, 1), 50)
