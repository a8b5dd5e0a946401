"""White furnace: things that absorb nothing under a sky of one colour. The picture is that colour.

Any engine that gains or loses energy shows the objects.
"""

from builders import kit

RADIANCE = 0.5


def build():
    white = kit.diffuse("white", 1, 1, 1)
    mirror = kit.glossy("mirror", 1, 1, 1, 0.0)
    clear = kit.glass("glass", ior=1.5)
    kit.sphere("white ball", 0.5, (-1.15, 0, 0), white)
    kit.sphere("mirror ball", 0.5, (0, 0, 0), mirror)
    kit.sphere("glass ball", 0.5, (1.15, 0, 0), clear)
    kit.world((1, 1, 1), RADIANCE)
    kit.camera((0, -6, 0), (0, 0, 0), 60)
