#!/usr/bin/env python3
"""Runs clang-tidy (14) with the rules of .clang-tidy, several at once.

  run_tidy.py BUILD_FOLDER           all headers, and the source files changed since the last commit on the main branch
  run_tidy.py BUILD_FOLDER --all     all headers and all source files (some minutes)

Headers are checked in one go per module, so that the libraries behind them are parsed once. Exit code 1 on findings, 77
where clang-tidy is not installed."""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "semvslam"
IS_TEST = re.compile(r"(_(test|bench)|test_support)\.(cc|h)$")


def flags_of(entry):
    """The include folders and definitions of a compile command; the rest is GCC's own business."""
    words, out = shlex.split(entry["command"]), ["-std=c++20", "-w"]
    for position, word in enumerate(words):
        if word in ("-isystem", "-I"):
            out += [word, words[position + 1]]
        elif word.startswith(("-I", "-D")):
            out.append(word)
    return out


def compiled_files(build):
    """(source file, flags) of everything that is compiled; a unity file stands for those that it includes."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        file, flags = pathlib.Path(entry["file"]), flags_of(entry)
        if file.parent.name == "Unity":
            for name in re.findall(r'^#include "(.*)"$', file.read_text(), re.MULTILINE):
                yield pathlib.Path(name), flags
        else:
            yield file, flags


def changed_files():
    for base in ("origin/main", "HEAD~1"):
        done = subprocess.run(["git", "-C", str(ROOT), "diff", "--name-only", base], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True)
        names = [ROOT / name for name in done.stdout.splitlines()]
        if done.returncode == 0 and names:
            return set(names)
    return set()


def work_list(build, everything):
    """(file, flags) for each run of clang-tidy."""
    changed, modules, work = changed_files(), {}, []
    for file, flags in compiled_files(build):
        if not file.is_relative_to(SOURCE) or IS_TEST.search(file.name):
            continue
        modules.setdefault(file.relative_to(SOURCE).parts[0], flags)
        if everything or file in changed:
            work.append((file, flags))
    folder = build / "tidy"
    folder.mkdir(exist_ok=True)
    for module, flags in sorted(modules.items()):
        headers = sorted(h for h in (SOURCE / module).glob("*.h") if not IS_TEST.search(h.name))
        collected = folder / f"{module}_headers.cc"
        collected.write_text("".join(f'#include "{h.relative_to(ROOT / "src")}"\n' for h in headers))
        work.append((collected, flags))
    return work


def check(tool, file, flags):
    done = subprocess.run([tool, "--quiet", f"--config-file={ROOT / '.clang-tidy'}", str(file), "--", *flags],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stdout or done.stderr


def main():
    tool = shutil.which("clang-tidy-14")
    if not tool:
        print("skipped: clang-tidy-14 is not installed")
        return 77
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    work = work_list(pathlib.Path(sys.argv[1]).resolve(), "--all" in sys.argv)
    seen, failed = set(), 0  # a finding in a header comes once for every file that includes it
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for code, output in pool.map(lambda item: check(tool, *item), work):
            failed += code != 0
            for finding in re.split(r"\n(?=\S+:\d+:\d+: )", output):
                if code != 0 and finding.strip() and finding not in seen:
                    seen.add(finding)
                    print(finding)
    print(f"clang-tidy: {len(work)} runs, {failed} with findings")
    return 1 if failed or not work else 0


if __name__ == "__main__":
    sys.exit(main())
