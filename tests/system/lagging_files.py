"""A file system whose names and attributes are seen late, as on a network: a mirror of a folder, in the foreground.

   /usr/bin/python3 tests/system/lagging_files.py FOLDER MOUNT_POINT LAG_S

What a path is, or that it is not there, is remembered for LAG_S seconds, so that changes that are made in FOLDER itself show
late at MOUNT_POINT: new files are missing, and files that grew end where they ended. Changes through MOUNT_POINT show at once.
Needs the Debian packages python3-fusepy and fuse.
"""

import errno
import os
import stat
import sys
import time

import fusepy as fuse

ATTRIBUTES = ("st_atime", "st_ctime", "st_gid", "st_mode", "st_mtime", "st_nlink", "st_size", "st_uid", "st_ino", "st_blocks")


class LaggingFiles(fuse.Operations):
    def __init__(self, folder, lag_s):
        self.folder, self.lag_s = folder, lag_s
        self.known = {}  # path: (when, attributes or None)

    def real(self, path):
        return self.folder + path

    def forget(self, *paths):
        for path in paths:
            self.known.pop(path, None)
            self.known.pop(os.path.dirname(path), None)

    def look(self, path):
        when, attributes = self.known.get(path, (0, None))
        if not when or time.monotonic() - when >= self.lag_s:
            try:
                info = os.lstat(self.real(path))
                attributes = {name: getattr(info, name) for name in ATTRIBUTES}
            except FileNotFoundError:
                attributes = None
            self.known[path] = (time.monotonic(), attributes)
        return attributes

    def getattr(self, path, fh=None):
        attributes = self.look(path)
        if attributes is None:
            raise fuse.FuseOSError(errno.ENOENT)
        return attributes

    def access(self, path, mode):
        self.getattr(path)

    def readdir(self, path, fh):
        names = [name for name in os.listdir(self.real(path)) if self.look(os.path.join(path, name)) is not None]
        return [".", "..", *names]

    def open(self, path, flags):
        self.getattr(path)
        if flags & os.O_TRUNC:
            self.forget(path)
        return os.open(self.real(path), flags)

    def create(self, path, mode, fi=None):
        self.forget(path)
        return os.open(self.real(path), os.O_RDWR | os.O_CREAT | os.O_TRUNC, mode)

    def read(self, path, size, offset, fh):
        attributes = self.look(path)
        known = attributes["st_size"] if attributes else os.fstat(fh).st_size
        return os.pread(fh, max(0, min(size, known - offset)), offset)

    def write(self, path, data, offset, fh):
        self.forget(path)
        return os.pwrite(fh, data, offset)

    def truncate(self, path, length, fh=None):
        self.forget(path)
        os.truncate(self.real(path), length)

    def flush(self, path, fh):
        return 0

    def fsync(self, path, datasync, fh):
        os.fsync(fh)

    def fsyncdir(self, path, datasync, fh):
        return 0

    def release(self, path, fh):
        os.close(fh)

    def rename(self, old, new):
        self.forget(old, new)
        os.rename(self.real(old), self.real(new))
        self.forget(old, new)

    def unlink(self, path):
        self.forget(path)
        os.unlink(self.real(path))

    def mkdir(self, path, mode):
        self.forget(path)
        os.mkdir(self.real(path), mode)

    def rmdir(self, path):
        self.forget(path)
        os.rmdir(self.real(path))

    def chmod(self, path, mode):
        self.forget(path)
        os.chmod(self.real(path), stat.S_IMODE(mode))

    def chown(self, path, uid, gid):
        self.forget(path)
        os.chown(self.real(path), uid, gid)

    def utimens(self, path, times=None):
        self.forget(path)
        os.utime(self.real(path), times)

    def statfs(self, path):
        info = os.statvfs(self.folder)
        return {name: getattr(info, name) for name in ("f_bavail", "f_bfree", "f_blocks", "f_bsize", "f_files", "f_ffree",
                                                       "f_frsize", "f_namemax")}


if __name__ == "__main__":
    fuse.FUSE(LaggingFiles(os.path.realpath(sys.argv[1]), float(sys.argv[3])), sys.argv[2], foreground=True, attr_timeout=0,
              entry_timeout=0, negative_timeout=0, direct_io=True, default_permissions=False)
