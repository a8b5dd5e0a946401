"""A room lit only through a door that stands ajar; the lamp is in the room behind it.

Almost nothing the camera sees is lit directly: nearly every path has to find the gap.
"""

from builders import kit

DOOR_ANGLE = 25.0


def _walls_with_doorway(plaster, frame):
    """The wall between the rooms, 12 cm thick, with a doorway 0.9 x 2.1 m, and its frame.

    The frame stands 3 mm proud of the reveal: of coincident faces Cycles loses light, Pharos not.
    """
    kit.box("wall left of the door", (-2, 2.5, 0), (0.35, 2.62, 3), plaster)
    kit.box("wall right of the door", (1.25, 2.5, 0), (2, 2.62, 3), plaster)
    kit.box("wall above the door", (0.35, 2.5, 2.1), (1.25, 2.62, 3), plaster)
    kit.box("frame left", (0.29, 2.47, 0), (0.353, 2.65, 2.097), frame)
    kit.box("frame right", (1.247, 2.47, 0), (1.31, 2.65, 2.097), frame)
    kit.box("frame top", (0.29, 2.47, 2.097), (1.31, 2.65, 2.16), frame)


def _door(wood, brass):
    """A leaf hinged at the right post that opens into the bright room."""
    leaf = kit.box("door", (-0.9, 0, 0.01), (0, 0.045, 2.09), wood)
    knob = kit.sphere("knob", 0.035, (0, 0, 0), brass)
    plate = kit.box("plate", (-0.86, -0.006, 0.95), (-0.80, 0.0, 1.15), brass)
    hinge = kit.bpy.data.objects.new("hinge", None)
    hinge.location = (1.25, 2.56, 0)
    hinge.rotation_euler = (0, 0, -kit.math.radians(DOOR_ANGLE))
    kit.bpy.context.scene.collection.objects.link(hinge)
    knob.location = (-0.83, -0.05, 1.05)
    for part in (leaf, knob, plate):
        part.parent = hinge


def build():
    plaster = kit.diffuse("plaster", 0.74, 0.70, 0.64)
    ceiling = kit.diffuse("ceiling", 0.80, 0.80, 0.80)
    blue = kit.diffuse("blue", 0.40, 0.52, 0.68)
    floor = kit.glossy("floor", 0.60, 0.50, 0.40, 0.35)
    wood = kit.diffuse("wood", 0.50, 0.30, 0.15)
    white = kit.diffuse("lacquer", 0.78, 0.78, 0.76)
    brass = kit.glossy("brass", 0.85, 0.65, 0.30, 0.2)
    steel = kit.glossy("steel", 0.75, 0.76, 0.78, 0.15)

    walls = {"floor": floor, "ceiling": ceiling, "left": blue, "right": plaster,
             "front": plaster, "back": plaster}
    kit.room("room", (-2, -2.5, 0), (2, 2.5, 3), walls, openings=("back",))
    kit.room("next room", (-2, 2.62, 0), (2, 5.62, 3), walls, openings=("front",))
    _walls_with_doorway(plaster, white)
    _door(wood, brass)

    kit.box("table top", (-1.5, 0.35, 0.68), (-0.3, 1.15, 0.73), wood)
    for i, (x, y) in enumerate(((-1.45, 0.4), (-0.4, 0.4), (-1.45, 1.05), (-0.4, 1.05))):
        kit.box(f"table leg {i}", (x, y, 0), (x + 0.05, y + 0.05, 0.68), wood)
    kit.monkey("head", 0.24, (-1.05, 0.72, 0.96), white, turn=25)
    kit.sphere("steel ball", 0.14, (-0.55, 0.62, 0.87), steel, subdivisions=5)
    kit.sphere("ball", 0.26, (0.35, 0.4, 0.26), blue, subdivisions=5)

    kit.area_lamp("lamp in the next room", 2200.0, (0.8, 0.8), (0.9, 4.8, 2.7))
    kit.world((0, 0, 0), 0)
    kit.camera((0.25, -2.35, 1.5), (-0.1, 1.6, 0.95), 24)
