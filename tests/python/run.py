"""Runs the tests of the Python package: run.py [--output FILE.json] [PATTERN...]

--output writes the results as GoogleTest does, so that scripts/count-tests counts them. A PATTERN names tests
as unittest's -k does.
"""

import argparse
import json
import pathlib
import sys
import time
import unittest


class Results(unittest.TextTestResult):
    def startTestRun(self):
        self.cases = []
        super().startTestRun()

    def startTest(self, test):
        self.begun = time.monotonic()
        self.failed_parts = []
        super().startTest(test)

    def addSubTest(self, test, subtest, error):
        if error is not None:
            self.failed_parts.append(self._exc_info_to_string(error, test))
        super().addSubTest(test, subtest, error)

    def note(self, test, failures=(), skipped=False):
        suite, _, name = test.id().rpartition(".")
        self.cases.append((suite.rpartition(".")[2], name, time.monotonic() - self.begun, list(failures), skipped))

    def addSuccess(self, test):
        self.note(test, self.failed_parts)
        super().addSuccess(test)

    def addSkip(self, test, reason):
        self.begun = getattr(self, "begun", time.monotonic())
        self.note(test, skipped=True)
        super().addSkip(test, reason)

    def addFailure(self, test, error):
        self.note(test, [self._exc_info_to_string(error, test)])
        super().addFailure(test, error)

    def addError(self, test, error):
        self.begun = getattr(self, "begun", time.monotonic())
        self.note(test, [self._exc_info_to_string(error, test)])
        super().addError(test, error)

    def stopTest(self, test):
        if self.failed_parts and not any(case[1] == test.id().rpartition(".")[2] for case in self.cases[-1:]):
            self.note(test, self.failed_parts)
        super().stopTest(test)


def as_google_test(cases):
    suites = {}
    for suite, name, seconds, failures, skipped in cases:
        suites.setdefault(suite, []).append({
            "name": name, "status": "RUN", "result": "SKIPPED" if skipped else "COMPLETED",
            "time": f"{seconds:.3f}s", "classname": suite,
            **({"failures": [{"failure": text, "type": ""} for text in failures]} if failures else {})})
    return {"tests": len(cases), "name": "AllTests",
            "testsuites": [{"name": name, "testsuite": rows} for name, rows in suites.items()]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("patterns", nargs="*")
    arguments = parser.parse_args()
    here = pathlib.Path(__file__).resolve().parent
    sys.path.insert(0, str(here))
    loader = unittest.TestLoader()
    if arguments.patterns:
        loader.testNamePatterns = [p if "*" in p else f"*{p}*" for p in arguments.patterns]
    suite = loader.discover(str(here), pattern="test_*.py")
    result = unittest.TextTestRunner(resultclass=Results, verbosity=2).run(suite)
    if arguments.output:
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
        arguments.output.write_text(json.dumps(as_google_test(result.cases)))
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
