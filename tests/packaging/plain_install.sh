#!/usr/bin/env bash
# A plain (not editable) installation, used from the root of the clone: there the folders rtctl, drivers, plants and configs
# lie beside the command, and none of them may be imported. No network: other libraries are those of the given Python.
set -euo pipefail
python=$(realpath -s "${1:?the Python that has the libraries and setuptools}")
source=$(realpath "$(dirname "$0")/../..")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_RUNTIME_DIR=$work/sockets RTCTL_CACHE_DIR=${RTCTL_CACHE_DIR:-$source/build/tests/rtctl}
mkdir -m 700 "$XDG_RUNTIME_DIR" "$work/clone"
mkdir -p "$RTCTL_CACHE_DIR"

# a clone as git would make it, with what is not committed yet
cd "$source"
git ls-files -z --cached --others --exclude-standard | while IFS= read -r -d '' name; do
  [ ! -e "$name" ] || printf '%s\0' "$name"
done | xargs -0 cp --parents -P -t "$work/clone"

"$python" -m venv --without-pip "$work/env"
packages=$(echo "$work"/env/lib/python*/site-packages)
"$python" - > "$packages/zz_shared.pth" << 'END'
import site, sys
folders = sorted({path for path in (*site.getsitepackages(), *sys.path) if path.endswith("site-packages")})
print(f"import sys; sys.path += {folders!r}")  # not by name: a .pth file there would show the editable installation
END

cd "$work/clone"
"$python" -m pip --python "$work/env/bin/python" install . --no-deps --no-build-isolation --no-index --no-compile \
  --disable-pip-version-check --ignore-installed --verbose > "$work/pip.txt" 2>&1 || { cat "$work/pip.txt"; exit 1; }
if grep -nE "rtctl\.(configs|drivers|plants).*(absent|ambigu)|Package .* is absent|_Warning|DeprecationWarning" "$work/pip.txt"; then
  echo "setuptools warns"; exit 1
fi
for name in $(cd configs && find . -name '*.yaml'); do
  [ -f "$packages/rtctl/configs/$name" ] || { echo "configs/$name is not installed"; exit 1; }
done

rtctl=$work/env/bin/rtctl
where=$("$work/env/bin/python" -P -c 'import rtctl, rtctl.drivers; print(rtctl.__file__, *rtctl.drivers.__path__)')
[ "$where" = "$packages/rtctl/__init__.py $packages/rtctl/drivers" ] || { echo "imported from $where"; exit 1; }
"$rtctl" run ivu --mode fused --for 1s --no-plot --set name=plain -o "$work/run"
"$rtctl" replay "$work/run"
echo "a plain installation works in the root of the clone"
