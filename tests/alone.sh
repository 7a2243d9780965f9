# The wheel in build/dist by itself, through the tests of the unpacked source: sh tests/alone.sh PYTHON [options of pip]
set -e
python=$1
shift
folder=build/alone/$python
rm -rf "$folder" && mkdir -p "$folder"
tar -xzf build/dist/twindisc-*.tar.gz -C "$folder" --strip-components=1
find "$folder/twindisc_cli" -name '*.py' -delete
"$python" -m venv "$folder/.venv"
"$folder/.venv/bin/python" -m pip install --quiet --disable-pip-version-check "$@" \
  "$(ls build/dist/*.whl)[test,cluster,rigs]"
"$folder/.venv/bin/python" -m pip check
cd "$folder" && .venv/bin/python -m pytest -n 2 --dist worksteal -m ""
