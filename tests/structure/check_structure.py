#!/usr/bin/env python3
"""Checks rules of the source tree that no compiler checks.

Usage: check_structure.py ROOT RULE

RULE is one of
  includes  a folder includes only what docs/architecture.md lets it include, a room only earlier ones
  headers   headers outside services/ keep OpenCV, gRPC, protobuf and the like out
  first     a source file includes its own header first, which shows that the header compiles alone
  names     a type has one definition: two of one name would be merged silently by the linker
  length    no source file is longer than 400 lines
  unnamed   names in unnamed namespaces are unique within a library, which may be compiled as one file, and within the
            tests of a folder
  links     links between the Markdown files lead somewhere
"""

import os
import re
import sys

# Each folder may include itself and those before it; simulation, evaluation and services are no part of the flow.
FLOW = ["base", "simd", "capture", "pattern", "triangulation", "alignment", "figure", "nets", "animation"]
MAY_INCLUDE = {folder: set(FLOW[: i + 1]) for i, folder in enumerate(FLOW)}
MAY_INCLUDE["nets"] = {"nets"}
MAY_INCLUDE["learning"] = {"learning"}  # nobody else includes it
MAY_INCLUDE["simulation"] = set(FLOW) | {"simulation"}
MAY_INCLUDE["evaluation"] = set(FLOW) | {"simulation", "evaluation"}
MAY_INCLUDE["services"] = set(FLOW) | {"simulation", "evaluation", "services", "weft"}  # weft/v1: generated code

# Rooms within a folder, in the order of the flow; a room uses itself and earlier ones. Files outside of rooms may use all.
ROOMS = {
    "capture": ["file", "image", "rig", "camera", "sync", "take"],
    "pattern": ["board", "image", "fit", "seeds", "surface"],
    # As in services/CMakeLists.txt and services/README.md.
    "services": ["process", "verdict", "files", "confinement", "rpc", "callers", "pcd", "options", "print", "report", "preview", "figure", "synthetic",
                 "calibration", "evaluation", "recording", "recorder", "video", "pipeline", "export", "job", "animation", "library", "catalogue", "access", "http", "console", "reading", "worker",
                 "executor", "plan", "slurm", "notice", "retention", "daemon", "client", "installation", "cli"],
}
# Below the rooms of their folder: what a node of the board is.
GROUND = {"pattern/observation.h"}

# Folders of services/ that use no other one, or only those named.
SERVICES_MAY_INCLUDE = {
    "process": {"process"},
    "rpc": {"rpc", "files"},
    "callers": {"callers", "rpc"},
    "files": {"files"},
}
# The daemon and the worker are programs of their own: neither links the command line nor a client.
SERVICES_MAY_NOT_INCLUDE = {"daemon": {"cli", "client"}, "worker": {"cli", "client", "daemon"}, "client": {"cli", "daemon"}}

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
ANY_INCLUDE = re.compile(r'^\s*#\s*include\s+[<"]([^">]+)[">]', re.MULTILINE)
HEAVY = re.compile(
    r'^\s*#\s*include\s+[<"]((?:opencv2|grpc|grpcpp|google/protobuf|pcl|assimp|embree3|ceres|spdlog|CLI|torch|onnx)[/.]|sqlite3)',
    re.MULTILINE)
TYPE = re.compile(r"^(?:struct|class|enum class|enum) (\w+)(?![\w:]*::)[^;()]*\{", re.MULTILINE)
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
MAX_LINES = 400
SOURCE_ENDINGS = (".h", ".cpp", ".proto", ".py", ".sh")


def files(root, endings):
    """Paths relative to `root`, build trees and hidden folders left out."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(f for f in folders if not f.startswith((".", "build")) and f != "node_modules")
        for name in sorted(names):
            if name.endswith(endings):
                yield os.path.relpath(os.path.join(folder, name), root)


def text(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        return file.read()


def stage_files(root, endings):
    for path in files(root, endings):
        folder = path.split(os.sep)[0]
        if folder in MAY_INCLUDE:
            yield folder, path


def room(path):
    """Position of a file's room in its folder; ground files come first, those of no room last. None: no rooms here."""
    parts = path.replace(os.sep, "/").split("/")
    rooms = ROOMS.get(parts[0])
    if rooms is None:
        return None
    if "/".join(parts) in GROUND:
        return -1
    return rooms.index(parts[1]) if parts[1] in rooms else len(rooms)


def services_break(path, include):
    """Whether a file of services/ includes a folder of services/ that it may not."""
    ours, theirs = path.replace(os.sep, "/").split("/")[1], include.split("/")[1]
    if ours in SERVICES_MAY_INCLUDE:
        return theirs not in SERVICES_MAY_INCLUDE[ours]
    return theirs in SERVICES_MAY_NOT_INCLUDE.get(ours, set())


def check_includes(root):
    for folder, path in stage_files(root, (".h", ".cpp")):
        for include in INCLUDE.findall(text(root, path)):
            target = include.split("/")[0]
            if "/" not in include:
                yield f'{path}: include "{include}" by its path from the root'
            elif (target in MAY_INCLUDE or target == "weft") and target not in MAY_INCLUDE[folder]:
                yield f'{path}: {folder}/ may not include "{include}"'
            elif target == folder and folder in ROOMS and room(include) > room(path):
                yield f'{path}: {os.path.dirname(path)}/ may not include "{include}", which is a later step'
            elif target == folder == "services" and services_break(path, include):
                yield f'{path}: {os.path.dirname(path)}/ may not include "{include}"'


def check_headers(root):
    for folder, path in stage_files(root, (".h",)):
        if folder in ("services", "learning"):
            continue
        for include in HEAVY.findall(text(root, path)):
            yield f"{path}: includes {include}; keep it in the .cpp"


def check_first(root):
    for _, path in stage_files(root, (".cpp",)):
        own = path.replace(os.sep, "/")[: -len(".cpp")] + ".h"
        if not os.path.exists(os.path.join(root, own)):
            continue
        first = ANY_INCLUDE.search(text(root, path))
        if not first or first.group(1) != own:
            yield f'{path}: include "{own}" before anything else'


def check_names(root):
    defined = {}
    for _, path in stage_files(root, (".h",)):
        for name in TYPE.findall(text(root, path)):
            if name in defined:
                yield f"{path}: {name} is already defined in {defined[name]}"
            defined.setdefault(name, path)


def check_length(root):
    for path in files(root, SOURCE_ENDINGS):
        lines = text(root, path).count("\n")
        if lines > MAX_LINES:
            yield f"{path}: {lines} lines, at most {MAX_LINES}; split it by reason to change"


def check_links(root):
    for path in files(root, (".md",)):
        for link in LINK.findall(text(root, path)):
            if not os.path.exists(os.path.join(root, os.path.dirname(path), link)):
                yield f"{path}: link to {link} leads nowhere"


def unnamed_names(source):
    """Functions, types and constants at the top of a file's unnamed namespace. Members and what lies deeper do not count."""
    source = re.sub(r"//[^\n]*", "", source)
    source = re.sub(r'"(\\.|[^"\\\n])*"', '""', source)
    start = source.find("namespace {")
    if start < 0:
        return set()
    found, depth, head = set(), 0, ""
    for character in source[start + len("namespace {") :]:
        if character == "{":
            if depth == 0:
                found |= declared_name(head)
                head = ""
            depth += 1
        elif character == "}":
            depth -= 1
            if depth < 0:
                break
        elif depth == 0 and character == ";":
            found |= declared_name(head)
            head = ""
        elif depth == 0:
            head += character
    return found


def declared_name(head):
    head = " ".join(head.split())
    declared = re.match(r"(?:template ?<[^>]*> )?(?:struct|class|enum class|enum|union) (\w+)", head)
    if declared or head.startswith(("using ", "namespace ")):
        return {declared.group(1)} if declared else set()
    before = head.split("=")[0].strip()
    function = re.match(r"[\w:<>,&*\[\] ]*?[\w>&*\]] [&*]?(\w+) ?\(", before)
    if function:
        return {function.group(1)}
    if not re.match(r"(?:static )?const(?:expr)? ", before):
        return set()
    constant = re.search(r"(\w+)(?:\[\w*\])?$", before)
    # And further ones of the same statement.
    return ({constant.group(1)} if constant else set()) | set(re.findall(r", \*?(\w+)(?:\[\w*\])? = ", head))


def library(path):
    """The library of a source file, or the folder of a test; empty where each file is compiled alone."""
    parts = path.replace(os.sep, "/").split("/")
    if parts[0] in ("pattern", "simd") or (parts[0] == "tests" and parts[1] in ("benchmark", "fuzz", "system")):
        return ""
    at = 1 if parts[0] == "tests" else 0
    depth = 2 if parts[at] == "services" or parts[at + 1] in ("calibration", "gige_emulator") else 1
    return "/".join(parts[: at + depth])


# Macros of GoogleTest, and the function that it finds by the type of its argument.
OF_GOOGLETEST = re.compile(r"(TYPED_)?TEST(_[FP]|_SUITE)?$|INSTANTIATE_|MATCHER|PrintTo$")


def check_unnamed(root):
    defined = {}
    for path in files(root, (".cpp",)):
        folder = path.split(os.sep)[0]
        if (folder not in MAY_INCLUDE and folder != "tests") or not library(path):
            continue
        for name in sorted(unnamed_names(text(root, path))):
            other = defined.setdefault((library(path), name), path)
            if other != path and not OF_GOOGLETEST.match(name):
                yield f"{path}: {name} is a name in {other}, too; a release compiles both as one file, where overloads mix"


RULES = {"includes": check_includes, "headers": check_headers, "first": check_first, "names": check_names, "length": check_length, "unnamed": check_unnamed, "links": check_links}


def main():
    if len(sys.argv) != 3 or sys.argv[2] not in RULES:
        sys.exit(__doc__)
    if not any(True for _ in stage_files(sys.argv[1], (".h",))):
        sys.exit(f"{sys.argv[1]}: holds no headers of the project; is it the root of the source tree?")
    found = list(RULES[sys.argv[2]](sys.argv[1]))
    for line in found:
        print(line)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
