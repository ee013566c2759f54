#!/bin/bash
# A sweep as a SLURM job array, each task a share of its runs:
#   sbatch --array=1-4 sweep_array.sh omni_static --set "boundary.wall_speed=1 cm/s,2 cm/s,5 cm/s,10 cm/s"
#SBATCH --job-name=dust
#SBATCH --cpus-per-task=2
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --signal=TERM@120    # two minutes before the end every run writes its checkpoint
set -euo pipefail

exec dust sweep "$@" --part "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --resume --quiet
