"""Makes references longer ahead of time: make_references.py PROGRAM SAMPLES SCENE..."""

import sys

from harness import references
from harness.scenes import all_scenes


def main(arguments):
    program, samples, names = arguments[0], int(arguments[1]), arguments[2:]
    scenes = all_scenes()
    for name in names or scenes:
        references.ensure(scenes[name], program, samples, 2,
                          log=lambda text: print(text, flush=True))


if __name__ == "__main__":
    main(sys.argv[1:])
