"""Generates the messages and stubs of weft.v1 from proto/ when the package is built; pyproject.toml says the rest."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist
from setuptools.errors import SetupError

HERE = os.path.dirname(os.path.abspath(__file__))
PACKAGES = "install the Debian packages protobuf-compiler and protobuf-compiler-grpc"


def proto_folder():
    """That of the source tree, or the copy in a source distribution."""
    for folder in (os.path.join(HERE, "proto"), os.path.join(HERE, "..", "..", "proto")):
        if os.path.isdir(os.path.join(folder, "weft", "v1")):
            return os.path.normpath(folder)
    raise SetupError(f"{HERE}: no proto/weft/v1 here, nor two folders up; install from a source tree of Weft")


def program(name):
    path = shutil.which(name)
    if path is None:
        raise SetupError(f"{name} is missing, which generates the client's stubs: {PACKAGES}")
    return path


def schema_names(folder):
    return sorted(name for name in os.listdir(os.path.join(folder, "weft", "v1")) if name.endswith(".proto"))


def generate(out):
    """Writes out/weft/v1."""
    folder = proto_folder()
    names = schema_names(folder)
    os.makedirs(out, exist_ok=True)
    done = subprocess.run([program("protoc"), f"-I{folder}", f"--python_out={out}", f"--pyi_out={out}",
                           f"--plugin=protoc-gen-grpc_python={program('grpc_python_plugin')}", f"--grpc_python_out={out}",
                           *(f"weft/v1/{name}" for name in names)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SetupError(f"protoc failed on {folder}: {done.stderr.strip()}; {PACKAGES} of Debian 12 or later")
    with open(os.path.join(out, "weft", "v1", "__init__.py"), "w", encoding="utf-8") as init:
        init.write('"""Messages of the API, generated from proto/weft/v1; the comments stand there."""\n\n')
        for name in names:
            init.write(f"from weft.v1.{name.removesuffix('.proto')}_pb2 import *  # noqa: F403\n")


class BuildPackage(build_py):
    def run(self):
        super().run()
        generate(self.build_lib)


class SourceDistribution(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        folder = proto_folder()
        copy = os.path.join(base_dir, "proto", "weft", "v1")
        os.makedirs(copy, exist_ok=True)
        for name in schema_names(folder):
            shutil.copy(os.path.join(folder, "weft", "v1", name), copy)


def check_wheel():
    """Wheels need the package `wheel`, or setuptools from 70.1 on; without them pip says only "invalid command 'bdist_wheel'"."""
    if {"bdist_wheel", "dist_info"}.isdisjoint(sys.argv):
        return
    if find_spec("wheel") is None and find_spec("setuptools.command.bdist_wheel") is None:
        sys.exit("weft: error: the Python package wheel is missing, which pip builds with: install python3-wheel of Debian and "
                 "make the environment with `python3 -m venv --system-site-packages`, or `pip install wheel` in it first")


check_wheel()
# Nothing is left in the source tree, which may belong to somebody else.
scratch = tempfile.mkdtemp(prefix="weft-python-")
atexit.register(shutil.rmtree, scratch, ignore_errors=True)
setup(cmdclass={"build_py": BuildPackage, "sdist": SourceDistribution},
      options={"build": {"build_base": os.path.join(scratch, "build")}, "egg_info": {"egg_base": scratch}})
