# SPDX-License-Identifier: Apache-2.0
"""An independent validator accepts every preset under its schema and refuses each of them with one key misspelt or
repeated in another unit, or one number replaced by a text. Usage: schema_peer.py CONFIG_FOLDER"""
import copy
import json
import pathlib
import sys

try:
    import jsonschema
    import yaml
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)


def mappings(node):
    """Every mapping of a tree."""
    if isinstance(node, dict):
        yield node
        for value in node.values():
            yield from mappings(value)
    elif isinstance(node, list):
        for value in node:
            yield from mappings(value)


def spoilt(document):
    """Every copy of a document with one defect, and what the defect is."""
    for index, mapping in enumerate(mappings(document)):
        for key, value in mapping.items():
            copies = [copy.deepcopy(document) for _ in range(3)]
            misspelt, doubled, texted = (list(mappings(c))[index] for c in copies)
            misspelt[key + "x"] = misspelt.pop(key)
            yield copies[0], f"{key} misspelt"
            if key.endswith("_mm"):
                doubled[key[:-2] + "m"] = value
                yield copies[1], f"{key} in two units"
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                texted[key] = "some text"
                yield copies[2], f"{key} a text"


def main():
    config = pathlib.Path(sys.argv[1])
    presets = sorted((config / "presets").glob("*/*.yaml"))
    refused = 0
    for preset in presets:
        document = yaml.safe_load(preset.read_text())
        kind = document["tandem"].split("/")[0]
        schema = json.loads((config / "schemas" / f"{kind}.schema.json").read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        validator = jsonschema.Draft202012Validator(schema)
        validator.validate(document)
        for bad, defect in spoilt(document):
            assert not validator.is_valid(bad), f"{preset}: accepted with {defect}"
            refused += 1
    assert presets and refused > 100, "too few files or defects"
    print(f"{len(presets)} presets accepted, {refused} spoilt copies refused")


main()
