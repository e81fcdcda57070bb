#!/bin/sh
# Prints the path of a Python that Blender's module (bpy) has wheels for.
#   tools/find_python.sh            3.13 (Blender 5.2 LTS) if there is one, else 3.11 (Blender 4.5 LTS)
#   tools/find_python.sh 3.11       that version only
[ $# -gt 0 ] || set -- 3.13 3.11
wanted=$*
for version; do
  for python in "python$version" python3 \
      "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$version".*/bin/python \
      "${UV_PYTHON_INSTALL_DIR:-$HOME/.local/share/uv/python}"/cpython-"$version".*/bin/python3; do
    # A free-threaded build ("t") takes other wheels; a Python without ensurepip cannot make a virtual environment.
    found=$("$python" -c "
import sys, ensurepip, venv
if '%d.%d' % sys.version_info[:2] == '$version' and 't' not in sys.abiflags:
    print(sys.executable)" 2>/dev/null) && [ -n "$found" ] && { echo "$found"; exit 0; }
  done
done
echo "No Python of version $wanted (with its venv module) on PATH, in ~/.pyenv or in uv's folder. Install one of them," \
     "for example with: uv python install 3.13, or name one: make PYTHON=/path/to/python3.13" >&2
exit 1
