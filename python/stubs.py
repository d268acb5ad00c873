# SPDX-License-Identifier: Apache-2.0
"""Writes the type stub of an installation: that of the sources, with the texts of the compiled module.

    stubs.py SOURCE.pyi PACKAGE_FOLDER

The signatures are written by hand in the source stub, the texts in the bindings; editors show both from the stub.
"""
import ast
import pathlib
import sys

KINDS = (ast.ClassDef, ast.FunctionDef)


def text_of(thing):
    """The text of a docstring without the signature that pybind11 puts in front; empty: none."""
    lines = (thing.__doc__ or "").strip().splitlines()
    if lines and "(" in lines[0] and "->" in lines[0]:
        lines = lines[1:]
    return "\n".join(lines).strip()


def add_texts(nodes, owner, own):
    """Puts the text of each member of `owner` into its node. @param own  only what is in the class itself"""
    for node in nodes:
        if not isinstance(node, KINDS) or not (node.name in vars(owner) if own else hasattr(owner, node.name)):
            continue
        thing = getattr(owner, node.name)
        text = text_of(thing)
        if text and not (isinstance(node, ast.FunctionDef) and text == (object.__init__.__doc__ or "")):
            body = node.body if isinstance(node, ast.ClassDef) else []
            node.body = [ast.Expr(ast.Constant(text)), *body] or node.body
            if isinstance(node, ast.ClassDef):
                node.body = [each for each in node.body if not is_ellipsis(each)] or node.body
        if isinstance(node, ast.ClassDef):
            add_texts(node.body, thing, True)


def is_ellipsis(node):
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and node.value.value is ...


def main(source, package):
    sys.path.insert(0, str(package.parent))
    import tandem  # pylint: disable=import-outside-toplevel
    tree = ast.parse(source.read_text(encoding="utf-8"))
    add_texts(tree.body, tandem, False)
    text = "# SPDX-License-Identifier: Apache-2.0\n" + ast.unparse(ast.fix_missing_locations(tree)) + "\n"
    (package / "__init__.pyi").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
