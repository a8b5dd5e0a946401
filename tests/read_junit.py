"""Prints "PASSED FAILED SKIPPED" of reports by ctest or GoogleTest, then a line a failed test:
its name and the beginning of what it said; for tests/run.
"""

import re
import sys
import xml.etree.ElementTree as ElementTree

_TELLING = re.compile(
    r": Failure$|runtime error:|Sanitizer: |terminate called|what\(\):|Timeout|SEGFAULT|Exception"
)
_LINES_AFTER = 4
_LONGEST = 300


def reason(case):
    """The telling lines of a failed test and what follows them, as one short line."""
    said = (case.findtext("system-out") or "").splitlines()
    kept = []
    for i, line in enumerate(said):
        if _TELLING.search(line):
            kept = [part.strip() for part in said[i : i + 1 + _LINES_AFTER] if part.strip()]
            break
    failure = case.find("failure")
    if failure is not None and not kept:
        kept = [*failure.get("message", "").splitlines()[: 1 + _LINES_AFTER], *said[-2:]]
    # Paths of the machine say nothing: the file's name does.
    return re.sub(r"(?:[\w.+-]*/)+(?=[\w.+-]+:\d)", "", " | ".join(kept))[:_LONGEST]


def title(case):
    group = case.get("classname")
    name = case.get("name")
    return name if group in (None, name) else f"{group}.{name}"


def main(paths):
    passed, failed, skipped = 0, 0, 0
    failures = []
    for path in paths:
        for case in ElementTree.parse(path).getroot().iter("testcase"):
            status = case.get("status", "fail")
            if case.find("failure") is not None or status not in ("run", "notrun", "disabled"):
                failed += 1
                failures.append(f"{title(case)}: {reason(case)}")
            elif status == "run" and case.get("result") != "skipped":
                passed += 1
            else:
                skipped += 1
    print(passed, failed, skipped)
    for line in failures:
        print(line)


if __name__ == "__main__":
    main(sys.argv[1:])
