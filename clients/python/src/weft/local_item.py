"""The files on this machine that make an item of the library, as the C++ client chooses them (services/server/library)."""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
from dataclasses import dataclass
from typing import Iterator

from weft import v1
from weft.errors import FormatError, InvalidArgument, NotFound

_MAX_NAME = 100
_MAX_FILES = 100_000


@dataclass(frozen=True)
class LocalItem:
    manifest: v1.ItemManifest
    paths: list[str]  # where each file of the manifest lies

    @property
    def bytes(self) -> int:
        return sum(file.bytes for file in self.manifest.files)


def name_of_path(path: str) -> str:
    """The name of an item that gets none: that of the file or folder, with what no name may hold replaced."""
    whole = os.path.normpath(os.path.abspath(path))
    name = os.path.basename(whole)
    if not os.path.isdir(whole):
        name = os.path.splitext(name)[0]
    name = re.sub(r"[^A-Za-z0-9._-]", "-", name)[:_MAX_NAME]
    return name if re.match("[A-Za-z0-9]", name) else "item" + name[:_MAX_NAME - 4]


def has_hash(path: str, sha256: str) -> bool:
    try:
        return not os.path.islink(path) and _sha256_of(path) == sha256
    except OSError:
        return False


def _sha256_of(path: str) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _files_below(folder: str) -> Iterator[str]:
    def fail(error: OSError) -> None:
        raise InvalidArgument(f"{error.filename}: cannot be listed ({error.strerror})")

    for base, folders, names in os.walk(folder, onerror=fail):
        for name in names + [name for name in folders if os.path.islink(os.path.join(base, name))]:
            path = os.path.join(base, name)
            if not stat.S_ISREG(os.lstat(path).st_mode):
                raise InvalidArgument(f"{path}: is no plain file, and links are not uploaded; put a copy of the file there")
            yield os.path.relpath(path, folder)


def _names_of_board(path: str) -> list[str]:
    """board.json and the images that it names."""
    try:
        with open(path, encoding="utf-8") as file:
            board = json.load(file)
    except ValueError as error:
        raise FormatError(path, "", f"is no JSON ({error})") from error
    if not isinstance(board, dict) or not all(isinstance(board.get(key, ""), str) for key in ("image", "panels")):
        raise FormatError(path, "image", "is no name of a file; give a board.json as weft writes it")
    return [os.path.basename(path), board.get("image") or "board.png", *([board["panels"]] if board.get("panels") else [])]


def _chosen_names(kind: v1.ItemKind, path: str) -> tuple[str, list[str]]:
    """The item's folder, and its files below it."""
    is_folder = os.path.isdir(path)
    folder = path if is_folder else os.path.dirname(path)
    if kind == v1.ITEM_KIND_BOARD and is_folder:
        return folder, _names_of_board(os.path.join(path, "board.json"))
    if kind == v1.ITEM_KIND_BOARD and path.endswith(".json"):
        return folder, _names_of_board(path)
    if kind == v1.ITEM_KIND_RIG and is_folder:
        raise InvalidArgument(f"{path}: is a folder; give the rig.json in it")
    if kind == v1.ITEM_KIND_DUMP and not is_folder:
        raise InvalidArgument(f"{path}: is a file; give the folder of the dump")
    if kind == v1.ITEM_KIND_AVATAR and not is_folder:
        raise InvalidArgument(f"{path}: is a file; give the folder of the avatar")
    if kind == v1.ITEM_KIND_GARMENT and is_folder:
        meshes = [name for name in _files_below(folder) if name.lower().endswith((".obj", ".ply"))]
        if not meshes:
            raise InvalidArgument(f"{path}: holds no .obj or .ply; give the mesh of a garment, or a folder of them")
        return folder, meshes
    if is_folder or kind == v1.ITEM_KIND_TEMPLATE:
        return folder, list(_files_below(folder))
    return folder, [os.path.basename(path)]


def list_local_item(kind: v1.ItemKind, path: str) -> LocalItem:
    """Lists and hashes what `path` holds. NotFound, InvalidArgument, FormatError; the file is named."""
    whole = os.path.normpath(os.path.abspath(path))
    if not os.path.exists(whole):
        raise NotFound(f"{path}: no such file")
    item = LocalItem(v1.ItemManifest(), [])
    try:
        folder, names = _chosen_names(kind, whole)
        if not 0 < len(names) <= _MAX_FILES:
            raise InvalidArgument(f"{path}: holds {len(names)} files; an item has 1 to {_MAX_FILES:,}")
        for name in sorted(names):
            file = os.path.join(folder, name)
            item.paths.append(file)
            item.manifest.files.append(v1.ItemFile(path=name, bytes=os.path.getsize(file), sha256=_sha256_of(file)))
    except FileNotFoundError as error:
        raise NotFound(f"{error.filename}: no such file") from error
    except UnicodeEncodeError as error:
        raise InvalidArgument(f"{path}: a name below it is not UTF-8; rename it") from error
    return item
