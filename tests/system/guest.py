"""A machine with V4L2 cameras: the kernel's virtual video driver (vivid) in a guest that sees this machine's files.

The guest runs Debian's kernel in qemu by pure emulation, so it works everywhere and is slow. Its root is this machine's
`/`, read-only; `/mnt` is a folder shared with the host. There is no init but a list of commands.
"""

import functools
import glob
import os
import re
import shutil
import subprocess
import unittest

from studio import BIN, read

PROGRAMS = ("qemu-system-x86_64", "busybox", "cpio", "depmod", "modprobe", "dpkg-deb", "apt-get", "strip")
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "vivid")
BOOT = """#!/bin/busybox sh
busybox mkdir -p /proc /sys /dev /host
busybox mount -t proc none /proc
busybox mount -t sysfs none /sys
busybox mount -t devtmpfs none /dev
for module in {modules}; do busybox insmod $module; done
busybox insmod {vivid} n_devs={devices} node_types={types} num_inputs={inputs} input_types={kinds}
share="-t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose"
busybox mount $share,ro root /host
for folder in proc sys dev; do busybox mount --move /$folder /host/$folder; done
for folder in tmp run; do busybox mount -t tmpfs none /host/$folder; done
busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 share /host/mnt
busybox chroot /host /bin/sh -c 'ip link set lo up; cd /mnt; sh ./commands > output 2>&1; echo $? > status; sync'
busybox poweroff -f
"""


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options).stdout


@functools.cache
def kernel():
    """Folder with Debian's kernel and its modules, fetched once per build folder."""
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    if missing:
        raise unittest.SkipTest(f"no guest without {', '.join(missing)}")
    folder = os.path.join(BIN, "..", "guest")
    unpacked = os.path.join(folder, "kernel")
    if not os.path.isdir(unpacked):
        os.makedirs(folder, exist_ok=True)
        try:
            depends = run("apt-cache", "depends", "linux-image-amd64")
            package = re.search(r"Depends: (linux-image-\S+)", depends).group(1)
            if not glob.glob(os.path.join(folder, "*.deb")):
                run("apt-get", "download", package, cwd=folder)
        except (subprocess.CalledProcessError, AttributeError) as error:
            raise unittest.SkipTest(f"Debian's kernel cannot be fetched: {error}") from error
        run("dpkg-deb", "-x", glob.glob(os.path.join(folder, "*.deb"))[0], unpacked + ".part")
        version = os.listdir(os.path.join(unpacked + ".part", "lib/modules"))[0]
        run("depmod", "-b", unpacked + ".part", version)
        os.rename(unpacked + ".part", unpacked)
    return unpacked


def module_files(name):
    """The module's file and those of the modules that it needs, in the order in which they are to be loaded."""
    version = os.listdir(os.path.join(kernel(), "lib/modules"))[0]
    shown = run("modprobe", "-d", kernel(), "-S", version, "--show-depends", name)
    return re.findall(r"^insmod (.+\.ko\S*)", shown, re.MULTILINE)


def build_initramfs(path, devices):
    root = path + ".root"
    os.makedirs(os.path.join(root, "bin"))
    shutil.copy(shutil.which("busybox"), os.path.join(root, "bin/busybox"))
    files = []
    for name in MODULES:
        files += [file for file in module_files(name) if file not in files]
    for file in files:
        shutil.copy(file, root)
    names = ["/" + os.path.basename(file) for file in files]
    boot = BOOT.format(modules=" ".join(names[:-1]), vivid=names[-1], devices=devices, types=",".join(["1"] * devices),
                       inputs=",".join(["1"] * devices), kinds=",".join(["0"] * devices))
    with open(os.path.join(root, "init"), "w") as file:
        file.write(boot)
    os.chmod(os.path.join(root, "init"), 0o755)
    listing = "\n".join(os.path.relpath(os.path.join(base, name), root)
                        for base, folders, found in os.walk(root) for name in folders + found)
    with open(path, "wb") as out:
        subprocess.run(["cpio", "-o", "-H", "newc", "--quiet"], input=listing.encode(), stdout=out, cwd=root, check=True)
    shutil.rmtree(root)


def run_in_guest(folder, commands, devices=2, limit_s=540, memory_mib=1024):
    """Runs shell commands in a guest with this many vivid cameras; `folder` is their working directory, /mnt.

    Returns their output; an exit status other than 0, or no end within the limit, is an AssertionError."""
    for name in ("output", "status"):
        if os.path.exists(os.path.join(folder, name)):
            os.unlink(os.path.join(folder, name))
    initramfs = os.path.join(folder, "initramfs")
    build_initramfs(initramfs, devices)
    with open(os.path.join(folder, "commands"), "w") as file:
        file.write(commands)
    image = glob.glob(os.path.join(kernel(), "boot/vmlinuz-*"))[0]
    command = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "2", "-m", str(memory_mib), "-nographic",
               "-no-reboot", "-net", "none", "-kernel", image, "-initrd", initramfs,
               "-append", "console=ttyS0 quiet panic=-1",
               "-virtfs", "local,path=/,mount_tag=root,security_model=none,readonly=on,multidevs=remap",
               "-virtfs", f"local,path={folder},mount_tag=share,security_model=none"]
    for _ in range(3):
        console = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=limit_s,
                                 check=False)
        # The kernel gives up at its start where a busy host keeps the emulated timer from it.
        if "Kernel panic" not in console.stdout:
            break
    texts = {}
    for name in ("output", "status"):
        path = os.path.join(folder, name)
        texts[name] = read(path) if os.path.exists(path) else None
    if texts["status"] is None or texts["status"].strip() != "0":
        raise AssertionError(f"in the guest: exit status {texts['status']}\n{texts['output']}\n{console.stdout}{console.stderr}")
    return texts["output"]
