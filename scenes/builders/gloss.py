"""Brushed metal all around, lit by a screened lamp: each surface mirrors a narrow cone of the room.

Where the light comes from says little without the lobe that it has to meet.
"""

from builders import kit


def build():
    steel = kit.glossy("steel", 0.72, 0.72, 0.75, 0.22)
    brass = kit.glossy("brass", 0.72, 0.56, 0.28, 0.2)
    copper = kit.glossy("copper", 0.72, 0.42, 0.30, 0.24)
    plaster = kit.diffuse("plaster", 0.7, 0.7, 0.7)

    walls = {"floor": steel, "ceiling": plaster, "left": brass, "right": copper, "front": plaster,
             "back": steel}
    kit.room("room", (-2, -2.5, 0), (2, 2.5, 2.8), walls)
    kit.box("screen", (0.35, 0.2, 2.0), (1.35, 1.2, 2.05), plaster)
    kit.area_lamp("lamp", 400.0, (0.25, 0.25), (0.85, 0.7, 2.2), rotation=(180, 0, 0))
    kit.sphere("ball", 0.45, (-0.7, 0.6, 0.451), copper, subdivisions=5)
    kit.monkey("head", 0.42, (0.7, 0.3, 0.5), brass, turn=-20)
    kit.box("block", (-1.7, 1.4, 0.0), (-0.9, 2.2, 1.1), steel, turn=15)
    kit.world((0, 0, 0), 0)
    kit.camera((0.0, -2.3, 1.3), (0.0, 0.8, 0.8), 24)
