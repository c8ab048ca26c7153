#!/usr/bin/env python3
"""Refits a tuned constant of the decoder: films the takes that it is fitted to, fits, and puts what comes out into the source.

    refit_constants.py confidence --takes /data/refit                  films what is missing, and prints the constants
    refit_constants.py confidence --takes /data/refit --build build/dev --apply
                                                                       puts them into the source, builds refit_decode alone, and
                                                                       goes on until it prints what it was built with
    refit_constants.py confidence --list                               the commands of all takes

Takes are made once and serve all constants: 21 for the confidence, and 10 that are held out. Programs are those of --programs,
else of --build, else of the PATH.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
JPEG = "--image-format jpg --jpeg-quality"
# The 13 takes of the comments in the code: options of `weft simulate`.
TAKES = {
    "pleats": "--preset pleats --seed 1",
    "gathers": "--preset gathers --seed 1",
    "curls": "--preset curls --seed 1",
    "tube": "--preset quickstart --seed 11 --frames 2 --cameras 8",
    "t-shirt": "--preset tshirt-24 --seed 12 --frames 1 --cameras 6 --width-px 1600 --height-px 1200",
    "skirt": "--preset quickstart --garment skirt --seed 13 --frames 2 --cameras 8 --blur-px 0.9 --readout color --width-px 1000 "
             "--height-px 800",
    "large-cells": "--preset quickstart --seed 14 --cell-mm 7 --frames 1 --cameras 6 --image-format png",
    "soft-tube": f"--preset quickstart --seed 21 --frames 2 --cameras 8 --blur-px 1.1 --readout color {JPEG} 85 --gain 0.6",
    "soft-t-shirt": f"--preset tshirt-24 --seed 22 --frames 1 --cameras 6 --width-px 1600 --height-px 1200 --blur-px 1.0 "
                    f"--readout color {JPEG} 80",
    "soft-pleats": "--preset pleats --seed 23 --frames 2 --blur-px 1.0 --readout color --width-px 1800 --height-px 1500",
    "dark-gathers": f"--preset gathers --seed 24 --frames 2 --gain 0.35 --full-well 4000 --read-noise 8 {JPEG} 80",
    "soft-skirt": f"--preset quickstart --garment skirt --seed 25 --frames 2 --cameras 8 --blur-px 1.2 --readout color "
                  f"--width-px 1000 --height-px 800 {JPEG} 75",
    "soft-curls": "--preset curls --seed 26 --frames 2 --blur-px 0.9 --readout color --width-px 1600 --height-px 1300",
}
SHIRT = "--preset tshirt-24 --frames 2 --readout color --image-format jpg"
SHIRTS = {
    "t-shirt-41": f"{SHIRT} --seed 41 --cameras 8 --width-px 1600 --height-px 1200 --blur-px 0.8 --jpeg-quality 95",
    "t-shirt-43": f"{SHIRT} --seed 43 --cameras 8 --width-px 1600 --height-px 1200 --blur-px 0.7 --jpeg-quality 90",
    "t-shirt-44": f"{SHIRT} --seed 44 --cameras 12 --width-px 1000 --height-px 750 --blur-px 0.7 --jpeg-quality 95",
    "t-shirt-45": f"{SHIRT} --seed 45 --cameras 12 --width-px 1100 --height-px 825 --blur-px 0.6 --jpeg-quality 90",
}
# Of `film_layers`.
LAYERS = {f"layers-{seed}": f"--seed {seed} --views 10" for seed in (1, 2, 3, 4)}
HELD_OUT = {
    "pleats-2": "--preset pleats --seed 2 --frames 3",
    "gathers-2": "--preset gathers --seed 2 --frames 3",
    "curls-2": "--preset curls --seed 2 --frames 3",
    "tube-31": "--preset quickstart --seed 31 --frames 2 --cameras 8 --blur-px 0.9 --readout color",
    "pleats-33": "--preset pleats --seed 33 --frames 2 --blur-px 1.0 --readout color --width-px 1800 --height-px 1500",
    "skirt-35": f"--preset quickstart --garment skirt --seed 35 --frames 2 --cameras 8 --blur-px 1.0 --readout color --width-px 1000 "
                f"--height-px 800 {JPEG} 85",
}
SHIRTS_HELD_OUT = {
    "t-shirt-46": f"{SHIRT} --seed 46 --cameras 12 --width-px 1000 --height-px 750 --blur-px 0.8 --jpeg-quality 95",
    "t-shirt-47": f"{SHIRT} --seed 47 --cameras 12 --width-px 1300 --height-px 975 --blur-px 0.8 --jpeg-quality 95",
}
LAYERS_HELD_OUT = {f"layers-{seed}": f"--seed {seed} --views 10" for seed in (101, 102)}
DRIVEN = {"drive-5": "--preset shirt-drive --seed 5 --cameras 6 --frames 2"}
DRIVEN_HELD_OUT = {"drive-6": "--preset shirt-drive-jitter --seed 6 --cameras 4 --frames 2"}

WITH_LAYERS = ({**TAKES, **SHIRTS, **LAYERS}, {**HELD_OUT, **SHIRTS_HELD_OUT, **LAYERS_HELD_OUT})
# Of each constant: the takes, those that are held out, and where it stands.
CONSTANTS = {
    "confidence": (*WITH_LAYERS, "pattern/surface/confidence.cpp", ["kConstant", "kWeights"]),
    "rejection": (*WITH_LAYERS, "pattern/fit/cell_fitter.cpp", ["kAbovePrediction"]),
    "sigma": (TAKES, HELD_OUT, "pattern/fit/cell_fitter.h", ["kSigmaFactor"]),
    "observation": (DRIVEN, DRIVEN_HELD_OUT, "simulation/observation_model.cpp", ["kFoundLogOdds", "kLogSigmaPx"]),
}


class RefitError(Exception):
    """Its text says what to do."""


def definition_of(name, text):
    """Where `constexpr TYPE name... = ...;` stands."""
    found = re.search(rf"^(?:inline )?constexpr [^;=]*?\b{name}\b[^;]*;", text, re.MULTILINE)
    if found is None:
        raise RefitError(f"{name}: is not defined there")
    return found


def numbers_in(definition):
    return [float(number) for number in re.findall(r"-?\d+\.\d*", definition.partition("=")[2])]


def differs(before, after):
    """By more than fits that are repeated do."""
    old, new = numbers_in(before), numbers_in(after)
    return len(old) != len(new) or any(abs(a - b) > 0.0101 for a, b in zip(old, new))


class Refit:
    def __init__(self, options):
        self.options = options
        self.fitted, self.held_out, source, self.names = CONSTANTS[options.constant]
        self.source = os.path.join(options.source, source)

    def program(self, name):
        folder = self.options.programs or (os.path.join(self.options.build, "bin") if self.options.build else "")
        path = os.path.join(folder, name) if folder else shutil.which(name)
        if path is None or not os.access(path, os.X_OK):
            raise RefitError(f"{path or name}: no such program; build it (cmake --build build/dev --target weft film_layers "
                             "refit_decode), or name the folder with --programs")
        return path

    def film_command(self, take, options, out):
        film = [self.program("film_layers")] if take.startswith("layers") else [self.program("weft"), "simulate", "--quiet"]
        return [*film, *shlex.split(options), "--out", out]

    def film(self):
        """Takes that are there are kept; one gets its name when it is complete."""
        os.makedirs(self.options.takes, exist_ok=True)
        takes = {**self.fitted, **self.held_out}
        for number, (take, options) in enumerate(takes.items(), 1):
            folder = os.path.join(self.options.takes, take)
            if os.path.isdir(folder):
                continue
            print(f"{number} of {len(takes)}: {take}", file=sys.stderr, flush=True)
            unfinished = f"{folder}.unfinished"
            shutil.rmtree(unfinished, ignore_errors=True)
            subprocess.run(self.film_command(take, options, unfinished), check=True, stdout=subprocess.DEVNULL)
            os.rename(unfinished, folder)

    def fit(self):
        """What refit_decode prints."""
        folder = self.options.takes
        return subprocess.run([self.program("refit_decode"), self.options.constant, *(os.path.join(folder, t) for t in self.fitted),
                               "--held-out", *(os.path.join(folder, t) for t in self.held_out)],
                              check=True, stdout=subprocess.PIPE, text=True).stdout

    def apply(self, printed):
        """Puts the constants into the source; whether one changed."""
        with open(self.source, encoding="utf-8") as file:
            text = file.read()
        changed = False
        for name in self.names:
            old, new = definition_of(name, text), definition_of(name, printed)
            if differs(old[0], new[0]):
                text = text[:old.start()] + new[0] + text[old.end():]
                changed = True
        if changed:
            with open(self.source, "w", encoding="utf-8") as file:
                file.write(text)
        return changed

    def run(self):
        self.film()
        for _ in range(self.options.rounds):
            printed = self.fit()
            print(printed, flush=True)
            if not self.options.apply or not self.apply(printed):
                return
            if not self.options.build:
                raise RefitError(f"{self.source}: has the new constants; build refit_decode and repeat the command until it prints what it "
                                 "was built with, or give the build with --build")
            subprocess.run(["cmake", "--build", self.options.build, "--target", "refit_decode"], check=True, stdout=sys.stderr)
        raise RefitError(f"{self.source}: after {self.options.rounds} rounds it still prints other constants than it was built with")


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("constant", choices=CONSTANTS)
    parser.add_argument("--takes", default="refit-takes", help="folder of the takes; those that are missing are filmed")
    parser.add_argument("--programs", default="", help="folder of weft, film_layers and refit_decode")
    parser.add_argument("--build", default="", help="build tree, e.g. build/dev, in which refit_decode is built again")
    parser.add_argument("--source", default=ROOT, help="source tree")
    parser.add_argument("--apply", action="store_true", help="put the constants into the source")
    parser.add_argument("--rounds", type=int, default=6, help="how often at most")
    parser.add_argument("--list", action="store_true", help="print the commands of all takes, and do nothing")
    return parser.parse_args(arguments)


def main():
    options = parse(sys.argv[1:])
    refit = Refit(options)
    try:
        if not options.list:
            refit.run()
            return
        for take, words in {**refit.fitted, **refit.held_out}.items():
            print("film_layers" if take.startswith("layers") else "weft simulate", words, "--out", os.path.join(options.takes, take))
    except (RefitError, OSError) as error:
        sys.exit(f"refit_constants: {error}")
    except subprocess.CalledProcessError as error:
        sys.exit(f"refit_constants: {shlex.join(error.cmd)}: exit status {error.returncode}")


if __name__ == "__main__":
    main()
