#!/usr/bin/env bash
# The oldest libraries that pyproject.toml allows: an environment of them in build/bounds, and a machine's whole way in it,
# from the command line to a diagnosis. `make bounds` calls it.
set -euo pipefail
cd "$(dirname "$0")/../.."
python=$PWD/${1:?the Python that has uv, relative to the project}
out=build/bounds
rm -rf "$out/work" && mkdir -p "$out/work"
export RTCTL_CACHE_DIR=$PWD/$out/cache XDG_RUNTIME_DIR PYTHONWARNINGS=ignore
XDG_RUNTIME_DIR=$(mktemp -d)
trap 'rm -rf "$XDG_RUNTIME_DIR"' EXIT
"$python" -m uv venv --quiet --clear --python "$python" "$out/venv"
"$python" -m uv pip install --quiet --python "$out/venv/bin/python" --resolution lowest-direct '.[mf4,tdms,hdf5,fmu]'
rtctl=$PWD/$out/venv/bin/rtctl
cd "$out/work"

for command in $("$python" -c "from rtctl.cli.main import COMMANDS; print(*COMMANDS)"); do
  "$rtctl" "$command" --help > help.txt || { echo "rtctl $command --help: exit code $?"; exit 1; }
  grep -q "Usage" help.txt || { echo "rtctl $command --help prints no usage"; exit 1; }
done
"$rtctl" run ldu --mode fused --for 3s --reference print_steps --set name=bounds -o run --json > run.json
"$rtctl" replay run
for form in csv mat parquet mcap mcap-json mf4 tdms; do "$rtctl" trace export run --to "$form" -o "run.$form"; done
"$rtctl" import run.mcap --plant axis --map u=u,x=position --parameter M=1.25 --case drive.newton_per_volt=10 -o imported_mcap
"$rtctl" import run.csv --plant axis --map u=u,x=position --parameter M=1.25 --case drive.newton_per_volt=10 -o imported
"$rtctl" diagnose imported --json > diagnosis.json
grep -q '"verdict"' diagnosis.json
echo "the lower bounds hold"
