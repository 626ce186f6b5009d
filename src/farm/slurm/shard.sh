#!/bin/bash
# A task is a shard of the plan. Submit: sbatch --array=INDICES shard.sh [OFFSET]; shard = OFFSET + index.
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

# Slurm takes the node back by SIGTERM, to this shell alone or to nimbus as well. nimbus counts two signals
# within a second as one, finishes its frame, keeps what it has and exits with 75.
is_told=0 child=
trap 'is_told=1; [ -z "$child" ] || kill -TERM "$child" 2> /dev/null' TERM
@run@ &
child=$!
[ "$is_told" -eq 0 ] || kill -TERM "$child" 2> /dev/null
wait "$child"
code=$?
# A signal ends the wait, but not nimbus.
while [ "$is_told" -eq 1 ]; do
    is_told=0
    wait "$child"
    code=$?
done
# 75: another try may succeed, and nimbus has not given up yet.
[ "$code" -ne 75 ] || requeue
exit "$code"
