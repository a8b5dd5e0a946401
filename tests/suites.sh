# The suites of tests/run; sourced. Each adds to suite_passed, suite_failed and suite_skipped, keeps
# what its program said in build/tests/NAME.log, and tells blame what failed.

LOGS=$PHAROS_ROOT/build/tests
PYTHON=$PHAROS_ROOT/build/bpy/bin/python

describe_suites() {
    cat <<'END'
python   ruff; pytest of tests/python: layering, hygiene, benchmark metric, README commands
format   clang-format of native/ and tests/native/
native   the C++ unit tests (ctest without the label slow)
blender  tests/blender in Blender 3.4.1, with and without a window, and in bpy 4.5
render   scenes/render: two pictures, a second run without building, Ctrl-C and SIGTERM
slurm    a Slurm of two slots renders shards of a picture; skipped where it is not installed
fuzz     libFuzzer on scenes as handed over, dumps, node programs, images, weights and checkpoints, 30 s each
tidy     clang-tidy; files seen before are not looked at again, within a budget of time
asan     unit tests under the address and undefined-behaviour sanitizers
tsan     unit tests under the thread sanitizer, with two threads and with eight
blasan   renders and a viewport in Blender 3.4.1 with the address sanitizer in it
END
}

# count PASSED FAILED [SKIPPED]
count() {
    suite_passed=$((suite_passed + $1))
    suite_failed=$((suite_failed + $2))
    suite_skipped=$((suite_skipped + ${3:-0}))
}

# blame TEXT: a failed test's name and the beginning of what it said, repeated by tests/run at its end.
blame() {
    blamed+=("$(tr -s '\n\t ' ' ' <<<"$suite: $1" | cut -c 1-320)")
}

# Reads one such text a line.
blame_lines() {
    local line
    while IFS= read -r line; do
        [ -z "$line" ] || blame "$line"
    done
}

# logged NAME SECONDS COMMAND...: runs it within the time, all it says goes to build/tests/NAME.log.
logged() {
    local name=$1 seconds=$2
    shift 2
    mkdir -p "$LOGS"
    timeout -k 10 "$seconds" "$@" >"$LOGS/$name.log" 2>&1 </dev/null
}

# check NAME SECONDS COMMAND...: one test, passed when the command succeeds.
check() {
    if logged "$@"; then
        count 1 0
    else
        count 0 1
        printf -- '--- %s failed:\n' "$1"
        tail -n 25 "$LOGS/$1.log"
        blame "$1: $(grep -aE 'error|Error|warning' "$LOGS/$1.log" | head -n 3)"
    fi
}

# The number before a word in a line like '12 passed, 1 failed, 2 skipped'; 0 without it.
number_before() {
    sed -n "s/.*\b\([0-9][0-9]*\) $1.*/\1/p" <<<"$2" | tail -n 1 | grep . || echo 0
}

# counted NAME SECONDS COMMAND...: a program whose last line of the above form counts.
counted() {
    local name=$1 status line bad
    logged "$@"
    status=$?
    line=$(grep -aE '\b[0-9]+ (passed|failed)\b' "$LOGS/$name.log" | tail -n 1)
    bad=$(number_before 'failed' "$line")
    bad=$((bad + $(number_before 'errors\?' "$line")))
    # A program that ended badly without saying what failed has failed once.
    [ "$status" = 0 ] || [ "$bad" -gt 0 ] || bad=1
    [ -n "$line" ] || bad=$((bad > 0 ? bad : 1))
    count "$(number_before passed "$line")" "$bad" "$(number_before skipped "$line")"
    if [ "$bad" -gt 0 ]; then
        printf -- '--- %s (status %s):\n' "$name" "$status"
        grep -aE 'FAIL|Error|error:|assert' "$LOGS/$name.log" | head -n 25
        tail -n 10 "$LOGS/$name.log"
        blame_lines < <(grep -aE '^ *FAIL(ED)?\b' "$LOGS/$name.log" | sort -u |
            grep . || echo "$name: status $status, $(tail -n 2 "$LOGS/$name.log")")
    fi
}

# run_ctest NAME SECONDS PRESET [ctest options]: the unit tests of a preset, two at a time.
run_ctest() {
    local name=$1 seconds=$2 preset=$3 report=$LOGS/$1.xml status
    shift 3
    mkdir -p "$LOGS"
    rm -f "$report"
    (cd "$PHAROS_ROOT" && logged "$name" "$seconds" ctest --preset "$preset" -j 2 --output-junit "$report" "$@")
    status=$?
    if [ -f "$report" ]; then
        local read_report
        read_report=$("$PYTHON" "$PHAROS_ROOT/tests/read_junit.py" "$report")
        count $(head -n 1 <<<"$read_report")
        blame_lines < <(tail -n +2 <<<"$read_report")
    else
        count 0 1
        blame "ctest ended without a report (status $status)"
        printf -- '--- %s ended without a report (status %s):\n' "$name" "$status"
        tail -n 25 "$LOGS/$name.log"
    fi
    [ "$status" = 0 ] || grep -aE 'Failure|ERROR:|WARNING: ThreadSanitizer|runtime error|\(Failed\)|\(Timeout\)' \
        "$LOGS/$name.log" | head -n 30
}

# run_programs NAME SECONDS PRESET MODULES...: the unit tests of some modules under a sanitizer, two
# programs at a time. Not by ctest: a sanitized process takes seconds to start and to end.
run_programs() {
    local name=$1 seconds=$2 folder=$PHAROS_ROOT/build/$3/tests/native reports=$LOGS/$1 status read_report module
    local log=$LOGS/$1.log telling='ERROR: [A-Za-z]*Sanitizer|WARNING: ThreadSanitizer|runtime error|terminate called'
    shift 3
    rm -rf "$reports"
    mkdir -p "$reports"
    printf '%s_test\n' "$@" >"$reports/programs"
    logged "$name" "$seconds" xargs -a "$reports/programs" -P 2 -I{} env "$folder/{}" --gtest_brief=1 \
        "--gtest_filter=-$STATISTICAL" "--gtest_output=xml:$reports/{}.xml"
    status=$?
    for module in "$@"; do
        if [ -f "$reports/${module}_test.xml" ]; then
            read_report=$("$PYTHON" "$PHAROS_ROOT/tests/read_junit.py" "$reports/${module}_test.xml")
            count $(head -n 1 <<<"$read_report")
            blame_lines < <(tail -n +2 <<<"$read_report")
        else
            count 0 1
            blame "${module}_test ended without a report (status $status)"
        fi
    done
    # What a sanitizer says need not be a test's failure.
    if [ "$status" != 0 ]; then
        [ "$suite_failed" -gt 0 ] || count 0 1
        blame_lines < <(grep -aE "$telling|^SUMMARY:" "$log" | sort -u | head -n 6)
        grep -aE "$telling|Failure" -A 12 "$log" | head -n 80
    fi
}

# build_or_fail PRESET TARGETS...: counts a failure where the build breaks.
build_or_fail() {
    build_preset "$@" && return
    count 0 1
    blame "the build of $1 broke"
    return 1
}

suite_python() {
    check ruff 120 "$PHAROS_ROOT/build/bpy/bin/ruff" check --no-cache "$PHAROS_ROOT"
    counted pytest 600 "$PYTHON" -m pytest "$PHAROS_ROOT/tests/python" -c "$PHAROS_ROOT/pyproject.toml"
}

suite_format() {
    local sources
    mapfile -d '' -t sources < <(find "$PHAROS_ROOT/native" "$PHAROS_ROOT/tests" \
        \( -name '*.h' -o -name '*.cpp' \) -print0 | sort -z)
    check clang-format 120 clang-format --dry-run -Werror --style=file "${sources[@]}"
}

suite_native() {
    build_or_fail release all || return
    run_ctest native 720 release
}

suite_blender() {
    counted blender 1200 /usr/bin/python3 "$PHAROS_ROOT/tests/blender/run_all.py"
}

suite_render() {
    counted render 900 "$PHAROS_ROOT/tests/render_command.sh"
}

suite_slurm() {
    build_or_fail release session_test pharos-cli || return
    counted slurm 300 bash "$PHAROS_ROOT/tests/slurm.sh"
}

# What a fuzzer finds lies in build/tests, to be run again by the same program.
suite_fuzz() {
    local target targets=(dump scene program image state)
    build_or_fail fuzz "${targets[@]/#/fuzz_}" || return
    for target in "${targets[@]}"; do
        rm -rf "$LOGS/corpus_$target"
        mkdir -p "$LOGS/corpus_$target"
        ASAN_OPTIONS=detect_leaks=0 check "fuzz_$target" 180 \
            "$PHAROS_ROOT/build/fuzz/tests/fuzz/fuzz_$target" "-max_total_time=${PHAROS_FUZZ_SECONDS:-30}" \
            -len_control=0 -rss_limit_mb=4096 -timeout=25 "-artifact_prefix=$LOGS/${target}_" "$LOGS/corpus_$target"
    done
}

suite_tidy() {
    build_or_fail release all || return
    counted tidy 1000 "$PYTHON" "$PHAROS_ROOT/tests/tidy.py" --budget "${PHAROS_TIDY_SECONDS:-420}" \
        --cache "$PHAROS_CACHE/tidy"
}

# Sanitized programs are several times slower: tests that count many random numbers take part only
# in the plain build (their names say so).
STATISTICAL='*ChiSquare*:*chi_square*:*Statistic*:*Random*Bound*:*Long*'

# The modules that have unit tests, those of the longest tests first.
tested_modules() {
    local module
    for module in session guiding materials lights scene geometry image core sampling camera film integrator; do
        ! compgen -G "$PHAROS_ROOT/tests/native/$module/*_test.cpp" >/dev/null || printf '%s\n' "$module"
    done
}

suite_asan() {
    local modules
    mapfile -t modules < <(tested_modules)
    build_or_fail asan native_tests || return
    ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:fast_unwind_on_malloc=0:malloc_context_size=12 \
        LSAN_OPTIONS=suppressions=$PHAROS_ROOT/tests/suppressions/leaks.txt:print_suppressions=0 \
        UBSAN_OPTIONS=print_stacktrace=1 \
        run_programs asan 900 asan "${modules[@]}"
}

# assemble_sanitized: an add-on whose native part is the sanitized one, and a Blender that can load it.
assemble_sanitized() {
    local folder=$PHAROS_ROOT/build/asan/blender module
    module=$(compgen -G "$PHAROS_ROOT/build/asan/native/_native.*.so") || return
    rm -rf "$folder"
    mkdir -p "$folder/addons"
    cp -r "$PHAROS_ROOT/addon/pharos" "$folder/addons/pharos"
    cp "$module" "$folder/addons/pharos/"
    printf '#!/bin/sh\nLD_PRELOAD=%s exec "%s" "$@"\n' "$(g++ -print-file-name=libasan.so)" \
        "$(command -v "$BLENDER")" >"$folder/blender"
    chmod +x "$folder/blender"
}

# Blender itself loses memory at its end: what is looked for are accesses that are wrong.
suite_blasan() {
    local folder=$PHAROS_ROOT/build/asan/blender
    build_or_fail asan _native || return
    assemble_sanitized || { count 0 1; blame "no sanitized add-on"; return; }
    BLENDER=$folder/blender BLENDER_USER_SCRIPTS=$folder PHAROS_TEST_HOSTS="blender window" \
        PHAROS_TEST_TIMEOUT=900 PHAROS_RESTARTS=20 UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 \
        ASAN_OPTIONS=detect_leaks=0:halt_on_error=1:exitcode=99 \
        counted blasan 2400 /usr/bin/python3 "$PHAROS_ROOT/tests/blender/run_all.py" \
        test_robustness test_interruptions test_restarts test_viewport.py
}

# What our suppressions must not hide: succeeds when the race is reported.
report_planted_race() {
    local program=$LOGS/planted_race
    g++ -std=c++20 -fsanitize=thread -g -O1 "$PHAROS_ROOT/tests/suppressions/planted_race.cpp" -o "$program" || return
    TSAN_OPTIONS=suppressions=$PHAROS_ROOT/tests/suppressions/threads.txt:exitcode=66 "$program"
    [ $? = 66 ]
}

suite_tsan() {
    local modules
    export -f report_planted_race
    export LOGS PHAROS_ROOT
    check planted_race 120 bash -c report_planted_race
    local options=suppressions=$PHAROS_ROOT/tests/suppressions/threads.txt:halt_on_error=0
    mapfile -t modules < <(tested_modules | grep -vx image)
    build_or_fail tsan image_test "${modules[@]/%/_test}" || return
    TSAN_OPTIONS=$options run_programs tsan 2400 tsan "${modules[@]}"
    # An image's library holds more locks at once than the search for deadlocks can follow.
    TSAN_OPTIONS=$options:detect_deadlocks=0 run_programs tsan_image 600 tsan image
    # Where threads work on one picture, once more with eight of them.
    PHAROS_TEST_THREADS=8 TSAN_OPTIONS=$options run_programs tsan_eight 2400 tsan session core film
}
