"""Prints 'PASSED FAILED SKIPPED' of a ctest report, then a line for each failed test: its name and
the beginning of what it said; for tests/run.
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
        kept = [failure.get("message", ""), *said[-2:]]
    # Paths of the machine say nothing: the file's name does.
    return re.sub(r"(?:[\w.+-]*/)+(?=[\w.+-]+:\d)", "", " | ".join(kept))[:_LONGEST]


def main(path):
    counts = {"run": 0, "fail": 0, "notrun": 0, "disabled": 0}
    failures = []
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        status = case.get("status", "fail")
        counts[status if status in counts else "fail"] += 1
        if status not in ("run", "notrun", "disabled"):
            failures.append(f"{case.get('name')}: {reason(case)}")
    print(counts["run"], counts["fail"], counts["notrun"] + counts["disabled"])
    for line in failures:
        print(line)


if __name__ == "__main__":
    main(sys.argv[1])
