"""JSON files of Weft as messages of weft.v1."""

from __future__ import annotations

import os
from typing import TypeVar

from google.protobuf import json_format
from google.protobuf.message import Message

from weft import v1
from weft.errors import FormatError
from weft.formats.columns import read_bytes

M = TypeVar("M", bound=Message)


def parse_message(data: bytes, file: str, kind: type[M]) -> M:
    """FormatError names file and field, also of an unknown one."""
    try:
        message: M = kind()
        json_format.Parse(data.decode("utf-8"), message)
        return message
    except (json_format.ParseError, ValueError) as error:
        raise FormatError(file, "", f"is no {kind.DESCRIPTOR.full_name}: {error}") from error


def read_message(path: str | os.PathLike[str], kind: type[M], name: str) -> M:
    """Of a folder the file `name` in it. NotFound, PermissionDenied, FormatError."""
    file = os.path.join(path, name) if os.path.isdir(path) else os.fspath(path)
    return parse_message(read_bytes(file), file, kind)


def read_report(path: str | os.PathLike[str]) -> v1.FrameReport:
    """<frame>/report.json, or the folder it is in."""
    return read_message(path, v1.FrameReport, "report.json")


def read_job(path: str | os.PathLike[str]) -> v1.Job:
    """job.json, or the result that it is in."""
    return read_message(path, v1.Job, "job.json")


def read_evaluation(path: str | os.PathLike[str]) -> v1.Evaluation:
    """evaluation.json, or its folder."""
    return read_message(path, v1.Evaluation, "evaluation.json")


def read_export(path: str | os.PathLike[str]) -> v1.Export:
    """export.json of `weft export`, or its folder."""
    return read_message(path, v1.Export, "export.json")
