"""The disk as a crash may leave it, rebuilt from the log of disk_faults.cpp.

What a program wrote reaches the disk for certain when the file was flushed; a name (a new file, a rename, a removal)
when its folder was. Before that anything may be there: every sector of a write, every write, every name on its own.
"""

import os
import random
import shutil

SECTOR_BYTES = 512


class Call:
    def __init__(self, name, process, offset, size, path, second, data):
        self.name, self.process, self.offset, self.size = name, process, offset, size
        self.path, self.second, self.data = path, second, data


def read_log(path):
    """The calls in their order. A record that was cut off is left out."""
    with open(path, "rb") as file:
        log = file.read()
    calls, at = [], 0
    while (end := log.find(b"\n", at)) >= 0:
        name, process, offset, size, first, second = log[at:end].decode().split("\t")
        bytes_after = int(size) if name in ("write", "said") else 0
        data = log[end + 1:end + 1 + bytes_after]
        if len(data) < bytes_after:
            break
        calls.append(Call(name, int(process), int(offset), int(size), first, second, data))
        at = end + 1 + bytes_after
    return calls


def said(calls):
    """What the program had written to standard output."""
    return b"".join(call.data for call in calls if call.name == "said").decode()


class _File:
    def __init__(self, content=b""):
        self.durable, self.pending = bytearray(content), []


class Disk:
    """Follows the calls; `crash` leaves one of the states that were possible then."""

    def __init__(self, root, before=None):
        """`root`: the folder that the calls speak of. `before`: a copy of what stood there; without it, nothing."""
        self.root = root.rstrip("/")
        self.names = {self.root: None}  # as the program sees them: path to file, None for a folder
        self.durable = {self.root: None}  # as the disk has them for certain
        self.pending = []  # (folder, {path: file, None for a folder, KeyError for a removal}): all of it or nothing
        for base, folders, files in os.walk(before or os.devnull):
            inside = self.root + base[len(before):].rstrip("/") if base != before else self.root
            for name in folders:
                self.names[f"{inside}/{name}"] = None
            for name in files:
                with open(os.path.join(base, name), "rb") as file:
                    self.names[f"{inside}/{name}"] = _File(file.read())
        self.durable.update(self.names)

    def _name(self, change, path):
        self._apply(self.names, change)
        self.pending.append((os.path.dirname(path), change))

    def _file(self, path):
        if self.names.get(path) is None:
            self._name({path: _File()}, path)
        return self.names[path]

    def do(self, call):
        if not call.path.startswith(self.root + "/") and call.path != self.root:
            return
        if call.name == "open":
            self._file(call.path)
        elif call.name == "mkdir":
            self._name({call.path: None}, call.path)
        elif call.name == "unlink":
            self._name({call.path: KeyError}, call.path)
        elif call.name == "rename":
            moved = {p: n for p, n in self.names.items() if p == call.path or p.startswith(call.path + "/")}
            change = {path: KeyError for path in moved}
            change.update({call.second + path[len(call.path):]: node for path, node in moved.items()})
            self._name(change, call.second)
        elif call.name == "sync" and self.names.get(call.path, KeyError) is None:
            for change in [c for c in self.pending if c[0] == call.path]:
                self._apply(self.durable, change[1])
                self.pending.remove(change)
        elif call.name == "sync":
            file = self._file(call.path)
            for change in file.pending:
                _write(file.durable, change)
            file.pending = []
        elif call.name in ("write", "truncate", "fallocate"):
            self._file(call.path).pending.append(call)

    @staticmethod
    def _apply(names, change):
        for path, node in change.items():
            if node is KeyError:
                names.pop(path, None)
            else:
                names[path] = node

    def crash(self, chance, out, kept=None):
        """Writes one possible state to the new folder `out`. `kept`: the share of what was not flushed that got
        through, 0 to 1; without it, by chance, and torn at sectors in half of all cases."""
        share = chance.choice([0, 1, 0.5, chance.random()]) if kept is None else kept
        torn = chance.random() < 0.5
        names = dict(self.durable)
        for change in self.pending:
            if chance.random() < share:
                self._apply(names, change[1])
        os.makedirs(out)
        for path, node in sorted(names.items()):
            parents = [path[:i] for i in range(len(self.root), len(path)) if path[i] == "/"]
            if any(names.get(parent, KeyError) is not None for parent in parents):
                continue  # its folder is not there
            target = out + path[len(self.root):]
            if node is None:
                os.makedirs(target, exist_ok=True)
                continue
            content = bytearray(node.durable)
            for call in node.pending:
                for part in _parts(call, torn):
                    if chance.random() < share:
                        _write(content, part)
            with open(target, "wb") as file:
                file.write(content)


def _parts(call, torn):
    if call.name != "write" or not torn:
        return [call]
    parts, at = [], 0
    while at < call.size:  # a sector is written whole, or not at all
        size = min(call.size - at, SECTOR_BYTES - (call.offset + at) % SECTOR_BYTES)
        parts.append(Call("write", 0, call.offset + at, size, call.path, "", call.data[at:at + size]))
        at += size
    return parts


def _write(content, call):
    if call.name == "truncate":
        content[:] = content[:call.size].ljust(call.size, b"\0")
        return
    if len(content) < call.offset + call.size:
        content.extend(bytes(call.offset + call.size - len(content)))
    if call.name == "write":
        content[call.offset:call.offset + call.size] = call.data


def crash_states(log, root, folder, states, seed=1, before=None):
    """Yields, `states` times, (what the program had said by then, folder with what is left)."""
    calls = read_log(log)
    chance = random.Random(seed)
    ends = sorted(chance.randrange(len(calls) + 1) for _ in range(states))
    disk, done = Disk(root, before), 0
    for number, end in enumerate(ends):
        while done < end:
            disk.do(calls[done])
            done += 1
        out = os.path.join(folder, f"crash{number}")
        disk.crash(chance, out)
        yield said(calls[:done]), out
        shutil.rmtree(out, ignore_errors=True)
