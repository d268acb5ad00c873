# SPDX-License-Identifier: Apache-2.0
"""An independent validator accepts every preset under its schema and refuses each of them with one key misspelt or repeated in another
unit, or one number replaced by a text. Usage: schema_peer.py CONFIG_FOLDER"""
import copy
import json
import pathlib
import re
import sys

import jsonschema
import yaml


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
    """Every copy of a document with one defect, and a description of the defect."""
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


def sectioned(document):
    """A copy of a robot file with tubes in sections, and copies with both notations or with neither."""
    good = copy.deepcopy(document)
    bad = []
    for index, mapping in enumerate(mappings(document)):
        if "straight_length_mm" not in mapping:
            continue
        tube = list(mappings(good))[index]
        straight, curved = tube.pop("straight_length_mm"), tube.pop("curved_length_mm")
        curvature = {key: tube.pop(key) for key in list(tube) if key.startswith("curvature_")}
        tube["sections"] = [{"length_mm": straight, "curvature_per_mm": 0, "bending_stiffness_Nm2": 0.01},
                            {"length_mm": curved, "torsional_stiffness_Nm2": 0.01, **curvature}]
        both, neither, too_many = copy.deepcopy(good), copy.deepcopy(good), copy.deepcopy(good)
        list(mappings(both))[index].update(curvature)
        list(mappings(neither))[index].pop("sections")
        list(mappings(too_many))[index]["sections"] *= 5
        bad += [(both, "both"), (neither, "neither"), (too_many, "ten sections")]
        break
    return good, bad


def main():
    config = pathlib.Path(sys.argv[1])
    presets = sorted((config / "presets").glob("*/*.yaml"))
    refused = 0
    for preset in presets:
        document = yaml.safe_load(preset.read_text())
        kind = document["tandem"].split("/")[0]
        # The line by which editors find the schema.
        link = re.search(r"^# yaml-language-server: \$schema=(\S+)$", preset.read_text(), re.MULTILINE)[1]
        assert pathlib.Path(link).name == f"{kind}.schema.json", preset
        schema = json.loads((preset.parent / link).read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        validator = jsonschema.Draft202012Validator(schema)
        validator.validate(document)
        defects = list(spoilt(document))
        if kind == "robot":
            with_sections, more = sectioned(document)
            validator.validate(with_sections)
            defects += [*spoilt(with_sections), *more]
        for bad, defect in defects:
            assert not validator.is_valid(bad), f"{preset}: accepted with {defect}"
            refused += 1
    assert presets and refused > 100, "too few files or defects"
    print(f"{len(presets)} presets accepted, {refused} spoilt copies refused")


main()
