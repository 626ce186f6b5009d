#!/bin/bash
# Merges the results of all shards. ARRAY is the id of the shards' job array.
# Submit with: sbatch --dependency=afterany:ARRAY merge.sh
#SBATCH --job-name=nimbus-merge
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=@log@
@options@
set -u
job=${SLURM_JOB_ID}
@requeue@

@merge@
code=$?
[ "$code" -ne 75 ] || [ "${SLURM_RESTART_COUNT:-0}" -ge @restarts@ ] || requeue
exit "$code"
