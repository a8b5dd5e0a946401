# Everything that has to be on the machine before Pharos renders or is tested; sourced by
# scenes/render, scenes/build, tests/run and tests/benchmark/run, never run by itself.
#
# Each step looks first and does nothing when its result is there already.

# PHAROS_ROOT: the project's folder. PHAROS_CACHE: what survives a new clone.
PHAROS_ROOT=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
PHAROS_CACHE=${XDG_CACHE_HOME:-$HOME/.cache}/pharos
export BLENDER=${BLENDER:-blender}

# Another Python's modules must not get into Blender or the virtual environment.
unset PYTHONPATH PYTHONHOME
export PYTHONDONTWRITEBYTECODE=1

# One compiler cache for all clones: paths inside the project do not count.
export CCACHE_DIR=$PHAROS_CACHE/ccache CCACHE_BASEDIR=$PHAROS_ROOT CCACHE_NOHASHDIR=1

PACKAGES_RENDER=(
    g++ cmake ninja-build ccache pkg-config
    libembree-dev libopenimageio-dev libglm-dev libhwy-dev
    python3 python3-dev python3-numpy pybind11-dev openimageio-tools
)
PACKAGES_TEST=(
    git python3-venv libgtest-dev libbenchmark-dev clang clang-format clang-tidy
    libclang-rt-14-dev xvfb xauth xdotool imagemagick libgl1-mesa-dri binutils
    libxkbcommon0 libsm6 libxi6 libxxf86vm1 libxfixes3 libxrender1 libegl1
)

fail() {
    printf '%s: %s\n' "${0##*/}" "$*" >&2
    exit 1
}

say() {
    printf '%s\n' "$*" >&2
}

# Runs a command quietly: it is announced when it takes longer than a moment, and what it said is
# shown only when it fails.
quietly() {
    local what=$1 log status announcer
    shift
    log=$(mktemp)
    {
        trap 'kill "$!" 2>/dev/null; exit' TERM
        sleep 3 >/dev/null 2>&1 &
        wait "$!"
        say "$what ..."
    } &
    announcer=$!
    if "$@" >"$log" 2>&1 </dev/null; then
        status=0
    else
        status=$?
        tail -n 60 "$log" >&2
        say "$what failed ($status)"
    fi
    kill "$announcer" 2>/dev/null
    wait "$announcer" 2>/dev/null
    rm -f "$log"
    return "$status"
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    else
        command -v sudo >/dev/null || fail "needs root or sudo to install packages: $*"
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    fi
}

# Installs those of the packages that are missing.
need_packages() {
    local present missing=() package
    command -v dpkg-query >/dev/null || { say "not a Debian system: packages are not looked at"; return; }
    present=$(dpkg-query -W -f='${db:Status-Abbrev}${Package}\n' "$@" 2>/dev/null | sed -n 's/^ii *//p')
    for package in "$@"; do
        grep -qxF -- "$package" <<<"$present" || missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    quietly "Looking for packages" as_root apt-get update -q || return
    quietly "Installing ${missing[*]}" as_root apt-get install -qy --no-install-recommends "${missing[@]}"
}

need_render_packages() {
    local packages=("${PACKAGES_RENDER[@]}")
    [ "$BLENDER" != blender ] || packages+=(blender)
    need_packages "${packages[@]}" || fail "packages could not be installed"
    command -v "$BLENDER" >/dev/null || fail "no Blender at '$BLENDER'"
}

# Configures a preset once and builds the targets; without work to do this takes a moment.
build_preset() {
    local preset=$1 folder=$PHAROS_ROOT/build/$1
    shift
    if [ ! -f "$folder/build.ninja" ]; then
        quietly "Configuring $preset" cmake -S "$PHAROS_ROOT" --preset "$preset" || return
    fi
    quietly "Building $preset" ninja -C "$folder" "$@" || return
}

# The add-on as Blender loads it: Python files and the native module side by side.
assemble_addon() {
    local addons=$PHAROS_ROOT/build/blender/addons fresh module
    module=$(compgen -G "$PHAROS_ROOT/build/release/native/_native.*.so") || fail "the native module is missing"
    mkdir -p "$addons"
    fresh=$(mktemp -d "$addons/.fresh.XXXXXX")
    cp -r "$PHAROS_ROOT/addon/pharos" "$fresh/pharos"
    find "$fresh" -name __pycache__ -prune -exec rm -rf {} +
    cp "$module" "$fresh/pharos/"
    if ! diff -rq -x __pycache__ "$fresh/pharos" "$addons/pharos" >/dev/null 2>&1; then
        rm -rf "$addons/pharos"
        mv "$fresh/pharos" "$addons/pharos"
    fi
    rm -rf "$fresh"
}

# Packages, native code and add-on for rendering in Blender. One set-up at a time.
set_up_render() {
    mkdir -p "$PHAROS_ROOT/build" "$CCACHE_DIR"
    {
        flock 9
        need_render_packages 9>&-
        build_preset release _native pharos-cli 9>&- || fail "the build failed"
        assemble_addon
    } 9>"$PHAROS_ROOT/build/.setup.lock"
    export BLENDER_USER_SCRIPTS=$PHAROS_ROOT/build/blender
}

# bpy 4.5 and the Python test tools in a virtual environment of the system's Python.
set_up_bpy() {
    local folder=$PHAROS_ROOT/build/bpy wanted=("bpy==4.5.*" "numpy<2" "pytest" "ruff")
    [ "$(cat "$folder/.wanted" 2>/dev/null)" != "${wanted[*]}" ] || return 0
    quietly "Making the virtual environment" /usr/bin/python3 -m venv "$folder" || return
    quietly "Installing bpy 4.5 and test tools" "$folder/bin/pip" install -q "${wanted[@]}" || return
    printf '%s\n' "${wanted[*]}" >"$folder/.wanted"
}

set_up_tests() {
    need_packages "${PACKAGES_TEST[@]}" || fail "packages could not be installed"
    set_up_render
    set_up_bpy || fail "bpy 4.5 could not be installed"
}
