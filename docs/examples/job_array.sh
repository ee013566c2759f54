#!/bin/bash
# A study as a SLURM job array, each task one of PARTS parts of its runs:
#   sbatch job_array.sh sweep omni_static --set "boundary.wall_speed=1 cm/s,2 cm/s,5 cm/s,10 cm/s"
#   sbatch job_array.sh collide collide.yaml
#   PARTS=8 sbatch --array=0-7 job_array.sh collide collide.yaml    eight parts instead of four
#   sbatch --array=2 job_array.sh collide collide.yaml              task 2 again
#SBATCH --job-name=dust
#SBATCH --array=0-3
#SBATCH --output=%x-%A_%a.log
#SBATCH --cpus-per-task=2
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
# Two minutes before that the runs write their checkpoints. Without "B:" SLURM signals the steps of
# srun only; with it, this shell only, which "exec" below replaces by dust.
#SBATCH --signal=B:TERM@120
# What your cluster may need (remove the first #):
##SBATCH --account=PROJECT
##SBATCH --partition=QUEUE
set -euo pipefail

# The environment in which dusttaichi is installed, such as:
# module load python
# source "$HOME/dust/bin/activate"

PARTS=${PARTS:-4} # at least as many as the array has tasks
if ((SLURM_ARRAY_TASK_MAX - SLURM_ARRAY_TASK_MIN >= PARTS)); then
    echo "tasks $SLURM_ARRAY_TASK_MIN to $SLURM_ARRAY_TASK_MAX need PARTS=$((SLURM_ARRAY_TASK_MAX - SLURM_ARRAY_TASK_MIN + 1)) sbatch ... (now $PARTS)" >&2
    exit 2
fi
# task 0, 1, ... or 1, 2, ...: each has a part of its own, which is the same when it runs alone
exec dust "$@" --part "$((SLURM_ARRAY_TASK_ID % PARTS + 1))/$PARTS" --resume --quiet
