"""From Blender's evaluated scene to a native scene description."""
