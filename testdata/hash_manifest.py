#!/usr/bin/env python3
"""Rewrites the [sha256] table of MANIFEST.toml from the files in this folder.

Run it after adding or removing a file, and add a [[source]] entry for a new origin by hand."""

import hashlib
import pathlib

HERE = pathlib.Path(__file__).parent
MANIFEST = HERE / "MANIFEST.toml"
NOT_DATA = {"MANIFEST.toml", "README.md"}

head = MANIFEST.read_text().split("[sha256]")[0]
lines = [head + "[sha256]"]
for path in sorted(p for p in HERE.rglob("*") if p.is_file() and "__pycache__" not in p.parts):
    name = path.relative_to(HERE).as_posix()
    if name in NOT_DATA or path.suffix == ".py" or path.name.startswith("."):
        continue
    lines.append(f'"{name}" = "{hashlib.sha256(path.read_bytes()).hexdigest()}"')
MANIFEST.write_text("\n".join(lines) + "\n")
