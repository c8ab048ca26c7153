#!/usr/bin/env python3
"""What a build of Weft runs with, as a bill of materials (CycloneDX 1.5, JSON).

Usage: deploy/sbom.py --version VERSION --out FILE [--npm package-lock.json] PROGRAM...

Components are the Debian packages of all shared libraries that the programs load on this machine, with version and licences as
their copyright files name them, and the packages of npm that the console's pages consist of. The same bytes for the same build:
no time and no serial number stands in it. No tool of Debian 12 writes one (syft and cyclonedx-cli are not packaged).
"""

import argparse
import json
import os
import re
import subprocess
import sys


def shared_libraries(programs):
    """Real paths of what the dynamic linker loads for the programs."""
    found = set()
    for program in programs:
        said = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
        if missing := re.findall(r"(\S+) => not found", said):
            sys.exit(f"{program}: {', '.join(missing)} is not there; install it, or name a program of this machine")
        found |= {os.path.realpath(path) for path in re.findall(r"(/\S+) \(0x", said)}
    return found


def debian_packages(paths):
    """Names of the packages that have the files, as dpkg knows them. Files of no package are left out."""
    # A merged /usr: some packages name their files below /lib.
    names = sorted({name for path in paths for name in (path, path.removeprefix("/usr"))})
    said = subprocess.run(["dpkg-query", "--search", *names], capture_output=True, text=True, check=False)
    return {owner.strip() for line in said.stdout.splitlines() if "diversion by" not in line
            for owner in line.split(": ")[0].split(",")}


def licences(package):
    """Short names of the licences in a copyright file of the machine-readable kind."""
    try:
        with open(f"/usr/share/doc/{package.split(':')[0]}/copyright", encoding="utf-8", errors="replace") as file:
            return sorted(set(re.findall(r"(?m)^License: *(\S+)", file.read())))
    except OSError:
        return []


def component(kind, name, version, url, names):
    one = {"type": kind, "bom-ref": url, "name": name, "version": version, "purl": url}
    if names:
        one["licenses"] = [{"license": {"name": licence}} for licence in names]
    return one


def of_debian(packages):
    for package in sorted(packages):
        said = subprocess.run(["dpkg-query", "--show", "--showformat", "${Package} ${Version} ${Architecture}", package],
                              capture_output=True, text=True, check=True).stdout
        name, version, architecture = said.split()
        yield component("library", name, version, f"pkg:deb/debian/{name}@{version.replace('+', '%2B')}?arch={architecture}",
                        licences(package))


def of_npm(lock_file):
    with open(lock_file, encoding="utf-8") as file:
        packages = json.load(file)["packages"]
    for place, package in sorted(packages.items()):
        if place and not package.get("dev"):
            name = place.rsplit("node_modules/", 1)[-1]
            yield component("library", name, package["version"], f"pkg:npm/{name.replace('@', '%40')}@{package['version']}",
                            [package["license"]] if "license" in package else [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--npm")
    parser.add_argument("programs", nargs="+", metavar="PROGRAM")
    options = parser.parse_args()
    components = list(of_debian(debian_packages(shared_libraries(options.programs))))
    if options.npm:
        components += of_npm(options.npm)
    weft = component("application", "weft", options.version, f"pkg:generic/weft@{options.version}", ["Apache-2.0"])
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1, "metadata": {"component": weft},
            "components": components, "dependencies": [{"ref": weft["bom-ref"], "dependsOn": [one["bom-ref"] for one in components]}]}
    temporary = options.out + ".tmp"
    with open(temporary, "w", encoding="utf-8") as file:
        json.dump(bill, file, indent=1)
        file.write("\n")
    os.replace(temporary, options.out)


if __name__ == "__main__":
    main()
