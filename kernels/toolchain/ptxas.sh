#!/bin/sh
# Fetches NVIDIA's PTX assembler from PyPI and prints its path. Usage: ptxas.sh [DIR]
#
# DIR  target folder (default: ~/.cache/trisect/ptxas)
#
# The package is under NVIDIA's licence. It needs no GPU and no driver.
# For `cargo kernels` to use it: export TRISECT_PTXAS=$(kernels/toolchain/ptxas.sh)
set -eu
dir=${1:-$HOME/.cache/trisect/ptxas}
version=13.0.88

fail() {
  echo "ptxas: $*" >&2
  exit 1
}

works() {
  "$dir/ptxas" --version 2>/dev/null | grep -qF "V$version"
}

if ! works; then
  python3 -m pip --version > /dev/null 2>&1 || fail 'python3 with pip is missing (Debian: python3-pip)'
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  python3 -m pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: --dest "$work" \
    "nvidia-cuda-nvcc==$version" >&2 || fail "pip could not download nvidia-cuda-nvcc $version: no network?"
  mkdir -p "$dir"
  python3 - "$work" "$dir/ptxas" <<'PY' || fail "the package nvidia-cuda-nvcc $version holds no bin/ptxas"
import glob, os, shutil, sys, zipfile
wheel = zipfile.ZipFile(glob.glob(os.path.join(sys.argv[1], "*.whl"))[0])
names = [name for name in wheel.namelist() if name.endswith("/bin/ptxas")]
if len(names) != 1:
    sys.exit(1)
new = sys.argv[2] + ".new"
with wheel.open(names[0]) as source, open(new, "wb") as target:
    shutil.copyfileobj(source, target)
os.chmod(new, 0o755)
os.replace(new, sys.argv[2])
PY
  works || fail "$dir/ptxas does not run here, or is not version $version"
fi
readlink -f "$dir/ptxas"
