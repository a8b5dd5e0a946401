#!/usr/bin/env bash
# scenes/render as a user meets it: two pictures, a second run without building, both signals, and
# an exit code for each way to fail.
# Ends with a line 'N passed, N failed'.
set -u
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
renders=$root/build/renders
export BLENDER=${BLENDER:-blender} BLENDER_USER_SCRIPTS=$root/build/blender
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
passed=0 failed=0

# expect WHAT COMMAND...
expect() {
    local what=$1 said=""
    shift
    if "$@"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAILED: $what${said:+ ($said)}"
        tail -n 20 "$scratch"/*.err 2>/dev/null
    fi
}

# The mean of a picture's channels is a finite number above zero.
has_light() {
    oiiotool --stats "$1" 2>/dev/null |
        awk '/Stats Avg/ { for (i = 3; i <= 5; i++) if ($i > 0 && $i < 1e6) n++ } END { exit n < 3 }'
}

finishes() {
    "$root/scenes/render" "$root/scenes/cornell.blend" -s 8 >"$scratch/paths" 2>"$scratch/finish.err"
}

names_both_files() {
    [ "$(cat "$scratch/paths")" = "$renders/cornell.png
$renders/cornell.exr" ]
}

builds_nothing() {
    ! grep -qE '^(Building|Configuring|Installing|Looking)' "$scratch/finish.err"
}

# Ends with the code and leaves both pictures; `took` is the time from the signal to the end.
stops_once() {
    local signal=$1 code=$2 pid status asked
    rm -f "$renders/door.png" "$renders/door.exr"
    # A shell starts background jobs with SIGINT ignored; here it has to arrive.
    env --default-signal=INT,TERM "$root/scenes/render" "$root/scenes/door.blend" -s 100000 \
        >"$scratch/paths.$signal" 2>"$scratch/$signal.err" </dev/null &
    pid=$!
    for _ in $(seq 600); do
        ! grep -qE '[1-9][0-9]*/100000 samples' "$scratch/$signal.err" || break
        sleep 0.2
    done
    asked=$SECONDS
    kill -"$signal" "$pid"
    wait "$pid"
    status=$?
    took=$((SECONDS - asked))
    said="status $status after $took s"
    [ "$status" = "$code" ] && has_light "$renders/door.exr" && has_light "$renders/door.png"
}

# Within ten seconds; a machine may stall, so that the best of three counts.
stops_on() {
    local took
    for _ in 1 2 3; do
        stops_once "$@" || return
        [ "$took" -gt 10 ] || return 0
    done
    return 1
}

expect "scenes/render ends well" finishes
expect "it prints the two paths and nothing else" names_both_files
expect "a warm call builds nothing" builds_nothing
expect "the EXR has light" has_light "$renders/cornell.exr"
expect "the PNG has light" has_light "$renders/cornell.png"
expect "SIGINT keeps the picture and ends with 130" stops_on INT 130
expect "SIGTERM keeps the picture and ends with 143" stops_on TERM 143

# ends_with CODE ARGUMENTS...: without a path on stdout, but with a reason.
ends_with() {
    local code=$1 status
    shift
    "$root/scenes/render" "$@" >"$scratch/said" 2>"$scratch/reason.err" </dev/null
    status=$?
    said="status $status"
    [ "$status" = "$code" ] && [ ! -s "$scratch/said" ] && [ -s "$scratch/reason.err" ]
}

# make_scene NAME: the Cornell box, changed by the Python on stdin, as a file of its own.
make_scene() {
    { printf 'import bpy, os\nscene, scratch = bpy.context.scene, os.environ["SCRATCH"]\n' && cat &&
        printf '\nbpy.ops.wm.save_as_mainfile(filepath=f"{scratch}/%s.blend")\n' "$1"; } >"$scratch/make.py"
    SCRATCH=$scratch "$BLENDER" -b --factory-startup -Y --addons pharos "$root/scenes/cornell.blend" \
        --python-exit-code 3 -P "$scratch/make.py" >"$scratch/$1.err" 2>&1
}

without_memory() {
    (ulimit -v 6000000 && ends_with 4 "$@") && grep -q "Out of memory" "$scratch/reason.err"
}

# Where the picture goes there is something that cannot be replaced.
unwritable() {
    local status
    mkdir -p "$renders/blocked.exr/something"
    ends_with 5 "$@"
    status=$?
    rm -rf "$renders/blocked.exr"
    return "$status"
}

# A scene that tries to run code when it is opened, and to write files elsewhere when it is rendered.
mkdir -p "$scratch/elsewhere"
make_scene hostile <<'END'
code = f"import pathlib; pathlib.Path('{scratch}/elsewhere/ran').touch()"
text = bpy.data.texts.new("start.py")
text.write(code)
text.use_module = True
scene.use_nodes = True
output = scene.node_tree.nodes.new("CompositorNodeOutputFile")
output.base_path = f"{scratch}/elsewhere"
layers = next(n for n in scene.node_tree.nodes if n.bl_idname == "CompositorNodeRLayers")
scene.node_tree.links.new(layers.outputs[0], output.inputs[0])
scene.render.filepath = f"{scratch}/elsewhere/frame_"
scene.pharos.samples = 2
scene.pharos.use_checkpoint = True
scene.pharos.guiding, scene.pharos.guide_memory = "NEURAL", "FILE"
END

# The scene as a Blender opens it that trusts it: what is looked for below does happen there.
is_hostile() {
    rm -f "$scratch"/elsewhere/* "$scratch"/hostile*.pharos_guide
    "$BLENDER" -b --factory-startup -y --addons pharos "$scratch/hostile.blend" -E PHAROS -f 1 \
        >"$scratch/trusted.err" 2>&1
    [ -e "$scratch/elsewhere/ran" ] && ls "$scratch"/hostile*.pharos_guide >/dev/null &&
        [ "$(find "$scratch/elsewhere" -type f | wc -l)" -ge 2 ]
}

does_no_harm() {
    rm -f "$scratch"/elsewhere/* "$scratch"/hostile*.pharos_guide
    "$root/scenes/render" "$scratch/hostile.blend" -s 2 >"$scratch/paths" 2>"$scratch/hostile.err" &&
        [ -z "$(find "$scratch/elsewhere" -type f)" ] &&
        [ -z "$(find "$scratch" -name 'hostile*.pharos_guide')" ] &&
        [ -z "$(find "$renders" -name 'hostile*checkpoint*')" ]
}

expect "a scene that runs code and writes files, where it is trusted" is_hostile
expect "runs no code and writes nothing outside of the folder here" does_no_harm

expect "a missing file is an error" ends_with 1 "$scratch/none.blend"
head -c 20000 "$root/scenes/cornell.blend" >"$scratch/torn.blend"
expect "a torn file is an error" ends_with 1 "$scratch/torn.blend"
make_scene blind <<<"scene.camera = None"
expect "a scene without a camera is an error" ends_with 1 "$scratch/blind.blend"
expect "an unknown option is a wrong argument" ends_with 2 --no-such-option
expect "a number that is none is a wrong argument" ends_with 2 -s many
expect "no samples are a wrong argument" ends_with 2 -s 0
make_scene lost <<'END'
image = bpy.data.images.new("Lost", 4, 4)
image.source, image.filepath = "FILE", f"{scratch}/nowhere.png"
for tree in (m.node_tree for m in bpy.data.materials if m.use_nodes):
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    for socket in [s for n in tree.nodes for s in n.inputs if s.name in ("Base Color", "Color")]:
        tree.links.new(texture.outputs[0], socket)
END
expect "a missing image is an error when asked for" ends_with 3 "$scratch/lost.blend" -s 1 --strict
renders_anyway() {
    "$root/scenes/render" "$@" >"$scratch/said" 2>"$scratch/anyway.err"
}
expect "and none otherwise" renders_anyway "$scratch/lost.blend" -s 1
make_scene huge <<'END'
scene.render.resolution_x = scene.render.resolution_y = 16384
scene.render.resolution_percentage = 100
END
expect "what does not fit is out of memory" without_memory "$scratch/huge.blend" -s 1
make_scene blocked <<<""
expect "a picture that cannot be written says so" unwritable "$scratch/blocked.blend" -s 1
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
