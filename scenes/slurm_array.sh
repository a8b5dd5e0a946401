#!/usr/bin/env bash
# Renders one frame as a Slurm job array and merges it: scenes/slurm_array.sh SCENE.pharos OUT.exr
#     SAMPLES=256 SHARDS=8 FIELD=guide.field scenes/slurm_array.sh door.pharos door.exr
#
# Each task takes its own range of every pixel's samples and keeps a checkpoint, so that a task that
# is requeued goes on where it was. The merge runs when all tasks have ended well. Samples are split
# unevenly where SHARDS does not divide them: files carry their true counts. FIELD (optional) is what
# `pharos-cli render --save-field` has written; without it all tasks render unguided.
# PHAROS_CLI: the program, where it is not at its usual place in this repository's build.
set -eu

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
cli=${PHAROS_CLI:-$root/build/release/native/pharos-cli}

if [ "${1-}" = --task ]; then
    # Inside a task of the array: its range, from the number of samples and of shards.
    shift
    scene=$1 out=$2 samples=$3 shards=$4 field=$5 i=$SLURM_ARRAY_TASK_ID
    first=$((samples * i / shards)) next=$((samples * (i + 1) / shards))
    guide=(--guiding off)
    [ -z "$field" ] || guide=(--guiding neural --field "$field")
    exec "$cli" render "$scene" -o "$out.$i.exr" "${guide[@]}" \
        --sample-offset "$first" --sample-count $((next - first)) \
        --threads "${SLURM_CPUS_PER_TASK:-1}" --checkpoint "$out.$i.checkpoint" --resume
fi

[ $# = 2 ] || { sed -n '2,3s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
scene=$(realpath -- "$1") out=$(realpath -m -- "$2")
samples=${SAMPLES:-128} shards=${SHARDS:-4} field=${FIELD:-}
[ -z "$field" ] || field=$(realpath -- "$field")
[ "$shards" -ge 1 ] && [ "$shards" -le "$samples" ] || { echo "SHARDS: 1 to SAMPLES" >&2; exit 2; }

# --wrap takes a line for the shell: every word is quoted for it.
task=$(printf '%q ' bash "$root/scenes/slurm_array.sh" --task "$scene" "$out" "$samples" "$shards" "$field")
array=$(sbatch --parsable --requeue --array="0-$((shards - 1))" --cpus-per-task="${CPUS:-1}" \
    --output="$out.%a.log" --wrap "$task")
parts=()
for ((i = 0; i < shards; ++i)); do parts+=("$out.$i.exr"); done
merge=$(printf '%q ' "$cli" merge "${parts[@]}" -o "$out")
merged=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$out.merge.log" \
    --wrap "PHAROS_CLI=$(printf %q "$cli") $merge && rm -f $(printf '%q ' "${parts[@]/%.exr/.checkpoint}")")
echo "array $array, merge $merged: $out"
