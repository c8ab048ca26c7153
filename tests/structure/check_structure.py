#!/usr/bin/env python3
"""Checks rules of the source tree that no compiler checks.

Usage: check_structure.py ROOT RULE

RULE is one of
  includes  a folder includes only what its README lets it include, a room only earlier ones
  headers   headers outside services/ keep OpenCV, gRPC, protobuf and the like out
  first     a source file includes its own header first, which shows that the header compiles alone
  names     a type has one definition: two of one name would be merged silently by the linker
  length    no source file is longer than 400 lines
  unnamed   names in unnamed namespaces are unique within a library, which may be compiled as one file, and within the
            tests of a folder
  links     links between the Markdown files lead to files, and to headings that these have
"""

import functools
import os
import re
import sys

NO_STAGES = ["clients", "tests"]

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
ANY_INCLUDE = re.compile(r'^\s*#\s*include\s+[<"]([^">]+)[">]', re.MULTILINE)
HEAVY = re.compile(
    r'^\s*#\s*include\s+[<"]((?:opencv2|grpc|grpcpp|google/protobuf|pcl|assimp|embree3|ceres|spdlog|CLI|torch|onnx)[/.]|sqlite3)',
    re.MULTILINE)
TYPE = re.compile(r"^(?:struct|class|enum class|enum) (\w+)(?![\w:]*::)[^;()]*\{", re.MULTILINE)
LINK = re.compile(r"\]\(([^)#:\s]*)(?:#([^)\s]*))?\)")
HEADING = re.compile(r"^ {0,3}#{1,6}[ \t]+(.*?)[ \t]*#*[ \t]*$", re.MULTILINE)
CODE_BLOCK = re.compile(r"^ {0,3}(```|~~~).*?^ {0,3}\1[^\n]*$", re.MULTILINE | re.DOTALL)
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


def stages(root):
    """The top folders of the source tree: those whose README says what they may include."""
    return [name for name in sorted(os.listdir(root)) if rules_of(root, name).may_include is not None]


def stage_files(root, endings):
    for stage in stages(root):
        for path in files(os.path.join(root, stage), endings):
            yield stage, os.path.join(stage, path)


class Rules:
    """What the README of a folder says of includes, in two sentences: `May include` with paths, and `Order:` with its rooms,
    folders or files of which each uses itself and earlier ones. Generated code is `proto`. Within services/, the first is
    about services/ alone."""

    MAY_INCLUDE = re.compile(r"^May include (nothing of Weft|(?:`[^`]+`(?:,|\s|and)*)+)\.", re.MULTILINE)
    ORDER = re.compile(r"^Order: ((?:`[^`]+`(?:,|\s|and)*)+)\.", re.MULTILINE)

    def __init__(self, readme):
        may_include, order = self.MAY_INCLUDE.search(readme), self.ORDER.search(readme)
        self.may_include = re.findall("`([^`]+?)/?`", may_include.group(1)) if may_include else None
        self.order = re.findall("`([^`]+?)/?`", order.group(1)) if order else []

    def room(self, path):
        """Position of a path within the folder; what is in no room may use all."""
        places = [i for i, room in enumerate(self.order) if is_below(path, room)]
        return places[0] if places else len(self.order)


def is_below(path, folder):
    return path == folder or path.startswith(folder + "/")


@functools.lru_cache(maxsize=None)
def rules_of(root, folder):
    readme = os.path.join(root, folder, "README.md")
    return Rules(text(root, os.path.join(folder, "README.md")) if os.path.isfile(readme) else "")


def check_includes(root):
    tops = stages(root)
    for folder in sorted({path.split(os.sep)[0] for path in files(root, (".h", ".cpp")) if os.sep in path}):
        if folder not in tops + NO_STAGES:
            yield f"{folder}/README.md: says not what its sources may include; write \"May include `base`.\" or the like"
    for stage, path in stage_files(root, (".h", ".cpp")):
        path = path.replace(os.sep, "/")
        folders = ["/".join(path.split("/")[: i + 1]) for i in range(path.count("/"))]
        for include in INCLUDE.findall(text(root, path)):
            target = "proto" + include[len("weft"):] if include.startswith("weft/") else include
            if "/" not in include:
                yield f'{path}: include "{include}" by its path from the root'
            elif target.split("/")[0] in tops + ["proto"]:
                yield from (f'{path}: {folder}/ may not include "{include}"{why}'
                            for folder in folders for why in broken_rules(root, folder, path, target))


def broken_rules(root, folder, path, target):
    rules = rules_of(root, folder)
    if is_below(target, folder):
        ours, theirs = (rules.room(of[len(folder) + 1 :]) for of in (path, target))
        if theirs > ours:
            yield ", which comes later in the order of its README"
        return
    is_about = "/" not in folder or is_below(target, folder.split("/")[0])
    if rules.may_include is not None and is_about and not any(is_below(target, allowed) for allowed in rules.may_include):
        yield "; its README says what it may"


def check_headers(root):
    for folder, path in stage_files(root, (".h",)):
        if folder in ("services", "learning"):  # the programs
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


def anchors(markdown):
    """What links to headings of a page are called, as GitHub makes it: lower case, hyphens for spaces, letters, digits, `_`
    and `-` alone. A second heading of the same name gets `-1`."""
    found = set()
    for heading in HEADING.findall(CODE_BLOCK.sub("", markdown)):
        shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        repeated = sum(1 for other in found if other == anchor or re.fullmatch(re.escape(anchor) + r"-\d+", other))
        found.add(f"{anchor}-{repeated}" if repeated else anchor)
    return found


def check_links(root):
    for path in files(root, (".md",)):
        for link, anchor in LINK.findall(text(root, path)):
            target = os.path.normpath(os.path.join(os.path.dirname(path), link)) if link else path
            if not os.path.exists(os.path.join(root, target)):
                yield f"{path}: link to {link} leads nowhere"
            elif anchor and target.endswith(".md") and anchor not in anchors(text(root, target)):
                yield f"{path}: {link or 'the page'} has no heading for #{anchor}"


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
    depth = 3 if parts[at] == "services" else 2 if parts[at + 1] in ("calibration", "gige_emulator") else 1
    return "/".join(parts[: at + depth])


# Macros of GoogleTest, and the function that it finds by the type of its argument.
OF_GOOGLETEST = re.compile(r"(TYPED_)?TEST(_[FP]|_SUITE)?$|INSTANTIATE_|MATCHER|PrintTo$")


def check_unnamed(root):
    defined = {}
    tops = stages(root)
    for path in files(root, (".cpp",)):
        folder = path.split(os.sep)[0]
        if folder not in tops + ["tests"] or not library(path):
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
