"""The scenes of the project, small and of few samples: no sample is dropped as no number."""
# hosts: blender bpy

from pathlib import Path

import bpy
import harness

SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.blend"))
GUIDES = ("OFF", "NEURAL", "SLIDES")


def test_no_sample_of_our_scenes_is_dropped():
    dropped = 0
    for path in SCENES:
        bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
        scene = bpy.context.scene
        scene.render.engine = "PHAROS"
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = 48, 48, 100
        scene.pharos.follow_cycles = False
        scene.pharos.samples = 16
        for guide in GUIDES:
            scene.pharos.guiding = guide
            session = harness.native().RenderSession(harness.exported(), 2, keeps_field=True)
            assert session.wait(120.0), path
            progress = session.progress()
            assert progress.state == harness.native().SessionState.Finished, progress.error
            assert progress.samples == 16, path
            dropped += progress.nonfinite_samples
    harness.say(f"STRESS samples of our scenes that are no numbers|{len(SCENES) * 3}|{dropped}|0")
    assert len(SCENES) >= 6
    assert dropped == 0, dropped


harness.main(globals())
