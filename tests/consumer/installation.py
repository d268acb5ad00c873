# SPDX-License-Identifier: Apache-2.0
"""An installation of a build in a folder, and projects that see nothing else."""
import pathlib
import re
import subprocess

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def run(*words, fails=False, **more):
    answer = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=200, check=False, **more)
    if (answer.returncode != 0) != fails:
        raise AssertionError(f"{' '.join(map(str, words))}: exit code {answer.returncode}\n{answer.stdout}{answer.stderr}")
    return answer.stdout + (answer.stderr if fails else "")


def project_of(page, **names):
    """Files of a project from a page of docs/: for each kind of code block the name of the file that the first one is."""
    text = (SOURCE / "docs" / page).read_text()
    return {name: re.search(rf"```{kind}\n(.*?)```", text, re.DOTALL).group(1) for kind, name in names.items()}


class Installation:
    """Components of a build below `folder`/prefix."""

    def __init__(self, cmake, compiler, build, folder, *components):
        self.cmake, self.compiler, self.folder = cmake, compiler, pathlib.Path(folder)
        self.prefix = self.folder / "prefix"
        for component in components:
            run(cmake, "--install", build, "--component", component, "--prefix", self.prefix)

    def configure(self, name, files, flags, fails=False):
        """Configures a project that sees the installation alone. @return its build folder, output"""
        folder = self.folder / name
        folder.mkdir()
        for file, text in files.items():
            (folder / file).write_text(text)
        output = run(self.cmake, "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
                     f"-DCMAKE_CXX_COMPILER={self.compiler}", f"-DCMAKE_CXX_FLAGS={flags}", fails=fails)
        return folder / "build", output

    def build(self, folder):
        run(self.cmake, "--build", folder, "--parallel", 2)
