#!/bin/bash
# Runs one shard of the plan in each task of a job array. The shard is OFFSET + the task's index.
# Submit with: sbatch --array=INDICES shard.sh [OFFSET]
#SBATCH --job-name=nimbus-farm
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=@log@
@options@
set -u
@export@
shard=$((${1:-0} + SLURM_ARRAY_TASK_ID))
job=${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}
@requeue@

# Slurm sends SIGTERM when it needs the node, to this shell only or to nimbus too. This shell passes
# the signal on. nimbus counts two signals within a second as one signal. It finishes its frame,
# keeps its results and exits with code 75.
is_told=0 child=
trap 'is_told=1; [ -z "$child" ] || kill -TERM "$child" 2> /dev/null' TERM
@run@ &
child=$!
[ "$is_told" -eq 0 ] || kill -TERM "$child" 2> /dev/null
wait "$child"
code=$?
# A signal ends `wait` but not nimbus, so this shell waits again.
while [ "$is_told" -eq 1 ]; do
    is_told=0
    wait "$child"
    code=$?
done
# With code 75 another try may succeed, and the number of tries is below its limit.
[ "$code" -ne 75 ] || requeue
exit "$code"
