#!/usr/bin/env bash
# scenes/render as a user meets it: two pictures, a second run without building, both signals.
# Ends with a line 'N passed, N failed'.
set -u
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
renders=$root/build/renders
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
expect "a missing file is an error" bash -c "! '$root/scenes/render' '$scratch/none.blend' >/dev/null 2>&1"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
