"""Prints 'PASSED FAILED SKIPPED' of a ctest report, for tests/run."""

import sys
import xml.etree.ElementTree as ElementTree


def main(path):
    counts = {"run": 0, "fail": 0, "notrun": 0, "disabled": 0}
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        status = case.get("status", "fail")
        counts[status if status in counts else "fail"] += 1
    print(counts["run"], counts["fail"], counts["notrun"] + counts["disabled"])


if __name__ == "__main__":
    main(sys.argv[1])
