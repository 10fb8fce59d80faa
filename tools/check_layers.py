#!/usr/bin/env python3
"""Checks the shape of the source tree: which module may use which, where foreign libraries may appear, how long files are,
and that no two tests can share a temporary folder.

  check_layers.py [ROOT]     exit code 1 and one line per fault

The tables below are the only place that allows an arrow; the README shows them. Arrows are read from #include lines, and
from the LINKS of semvslam_module() in the modules' CMakeLists.txt."""
import pathlib
import re
import sys

# module -> modules it may use, beside `base`, which everything may use.
CORE = {"geometry", "data", "feature", "map", "solve", "tracking", "mapping", "place", "motion", "semantic", "dynamic", "dense"}
ALLOWED = {
    "base": set(),
    "geometry": set(),
    "feature": {"geometry"},
    "solve": {"geometry"},
    "data": {"geometry"},
    "render": {"data", "geometry"},
    "map": {"geometry", "data", "feature", "solve"},  # solve: the plain observation types that the solvers take; data: files
    "eval": {"geometry", "data"},
    "place": {"feature", "geometry"},
    "motion": {"feature", "geometry"},
    "semantic": {"geometry", "data", "feature"},
    "dynamic": {"motion", "semantic", "data", "geometry"},
    "tracking": {"data", "feature", "map", "solve", "dynamic", "geometry"},
    "mapping": {"feature", "place", "map", "solve", "geometry"},
    "dense": {"data", "geometry"},
    "pipeline": CORE,
    "web": {"eval", "data", "geometry"},
    "download": set(),
    "apps": {"pipeline", "eval", "render", "web", "download", "data"} | CORE,
    "python": {"pipeline", "eval", "data"} | CORE,
}

# library -> (how its headers begin, modules whose sources may include them). `map` and `pipeline` see frames through data.
FOREIGN = {
    "OpenCV": (re.compile(r"opencv2/"), {"geometry", "data", "feature", "render", "motion", "semantic", "dynamic", "dense", "tracking", "map", "python"}),
    "Ceres": (re.compile(r"ceres/"), {"solve"}),
    "OctoMap": (re.compile(r"octomap/"), set()),
    "OpenVINO": (re.compile(r"openvino/"), {"semantic"}),
    "ONNX Runtime": (re.compile(r"onnxruntime"), {"semantic"}),
    "CLI11": (re.compile(r"CLI/"), {"apps"}),
    "cpp-httplib": (re.compile(r"httplib\.h"), {"web"}),
    "pybind11": (re.compile(r"pybind11/"), {"python"}),
    "libcurl": (re.compile(r"curl/"), {"download"}),
    "libarchive": (re.compile(r"archive(_entry)?\.h"), {"download"}),
    "OpenSSL": (re.compile(r"openssl/"), {"download"}),
    "nlohmann-json": (re.compile(r"nlohmann/"), {"apps", "eval", "semantic", "web"}),
    "yaml-cpp": (re.compile(r"yaml-cpp/"), {"base", "data", "semantic"}),
}
# Tests and benchmarks may go further: they build their inputs and references with whatever they like.
FREE_FOR_TESTS = {"OpenCV", "OctoMap", "nlohmann-json", "yaml-cpp"}
TEST_ONLY_MODULES = {"render", "data"}  # any test may use these to make its input

MAX_FILE_LINES = 500
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')
# Tests run beside each other. Names chosen by hand met once: two tests of one fixture, one folder.
TEMPORARY_FOLDER = "base/temporary_folder_test_support.h"
NAMED_BY_HAND = re.compile(r"\b(TempDir|temp_directory_path)\s*\(|\"/tmp/")
MODULE_CALL = re.compile(r"semvslam_module\s*\(\s*(\w+)([^)]*)\)", re.DOTALL)


def is_test(path):
    return bool(re.search(r"(_test|_bench|test_support)\.(cc|h)$", path.name))


def may_use(module, used, test):
    if used in (module, "base") or used in ALLOWED.get(module, set()):
        return True
    return test and used in TEST_ONLY_MODULES


def check_source(path, module, root, faults):
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    name, test = path.relative_to(root), is_test(path)
    if len(lines) > MAX_FILE_LINES:
        faults.append(f"{name}: {len(lines)} lines; split it by subject, {MAX_FILE_LINES} are the limit")
    for number, line in enumerate(lines, 1):
        if test and NAMED_BY_HAND.search(line) and not path.match(TEMPORARY_FOLDER):
            faults.append(f"{name}:{number}: use TemporaryFolder of semvslam/{TEMPORARY_FOLDER}; tests share no folder")
        match = INCLUDE.match(line)
        if not match:
            continue
        header = match.group(1)
        if header.startswith("semvslam/"):
            used = header.split("/")[1]
            if not may_use(module, used, test):
                faults.append(f"{name}:{number}: {module} may not use {used} ({header})")
        for library, (pattern, modules) in FOREIGN.items():
            if pattern.match(header) and module not in modules and not (test and library in FREE_FOR_TESTS):
                faults.append(f"{name}:{number}: {library} may not appear in {module} ({header})")


def check_links(path, module, root, faults):
    text = re.sub(r"#[^\n]*", "", path.read_text())
    for match in MODULE_CALL.finditer(text):
        for used in re.findall(r"semvslam(?:::|_)(\w+)", match.group(2)):
            if used in ALLOWED and not may_use(module, used, test=False):
                faults.append(f"{path.relative_to(root)}: {module} may not link {used}")


def check_table(faults):
    """The table itself must be free of circles, or the order of the modules means nothing."""
    done, open_ = set(), []

    def visit(module):
        if module in open_:
            faults.append("allowed arrows run in a circle: " + " -> ".join(open_[open_.index(module):] + [module]))
        elif module not in done:
            open_.append(module)
            for used in sorted(ALLOWED.get(module, ())):
                visit(used)
            open_.pop()
            done.add(module)

    for module in ALLOWED:
        visit(module)


def check_tree(root):
    faults = []
    check_table(faults)
    source = root / "src" / "semvslam"
    for folder in sorted(p for p in source.iterdir() if p.is_dir()):
        if folder.name not in ALLOWED:
            faults.append(f"{folder.relative_to(root)}: unknown module; add it to the table in tools/check_layers.py")
            continue
        for path in sorted(folder.rglob("*")):
            if path.suffix in (".h", ".cc"):
                check_source(path, folder.name, root, faults)
            elif path.name == "CMakeLists.txt":
                check_links(path, folder.name, root, faults)
    return faults


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent).resolve()
    if not (root / "src" / "semvslam").is_dir():
        print(f"check_layers: {root} has no src/semvslam", file=sys.stderr)
        return 2
    faults = check_tree(root)
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
