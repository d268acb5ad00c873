# SPDX-License-Identifier: Apache-2.0
"""Every key that YAML files may have, with what it may hold: `keys.py FOLDER` prints those of a folder of schemas, a line each."""
import json
import pathlib
import sys


def walk(schema, node, path, seen=()):
    """(path, what it holds) of all keys below a mapping or a list of them."""
    if "$ref" in node:
        name = node["$ref"].rsplit("/", 1)[1]
        if name not in seen:
            yield from walk(schema, schema["$defs"][name], path, (*seen, name))
        return
    for part in [*([node["items"]] if "items" in node else []), *node.get("anyOf", []), *node.get("oneOf", [])]:
        yield from walk(schema, part, path, seen)
    for key, value in node.get("properties", {}).items():
        yield f"{path}.{key}", {word: what for word, what in value.items() if word not in ("description", "$ref", "items", "anyOf")}
        yield from walk(schema, value, f"{path}.{key}", seen)


def keys(folder):
    """What each key may hold, by its path: "robot.arms.tubes.poisson_ratio"."""
    found = {}
    for file in sorted(pathlib.Path(folder).glob("*.schema.json")):
        schema = json.loads(file.read_text())
        found.update(walk(schema, schema, file.name.split(".")[0]))
    return found


if __name__ == "__main__":
    for place, holds in keys(sys.argv[1]).items():
        print(place, json.dumps(holds, sort_keys=True))
