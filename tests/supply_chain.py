"""Known weaknesses of what visup depends on, by pip-audit; skipped where no advisories can be reached."""

from __future__ import annotations

import json
import subprocess
import sys

from tests.paths import ROOT

WAIT_S = 120


def main() -> int:
    """Exit code 1 when a dependency has a known weakness."""
    command = [sys.executable, "-m", "pip_audit", "--no-deps", "--disable-pip", "--format", "json"]
    command += ["--progress-spinner", "off", "-r", str(ROOT / "constraints.txt")]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=WAIT_S, check=False)
        found = json.loads(done.stdout)["dependencies"]
    except (OSError, ValueError, KeyError, subprocess.TimeoutExpired):
        found = []
    looked = [d for d in found if "vulns" in d]
    if not looked:
        print("pip-audit: skipped, no advisories can be reached from here")
        return 0
    weak = [f"{d['name']} {d['version']}: {v['id']}" for d in looked for v in d["vulns"]]
    print(
        "\n".join(weak)
        or f"pip-audit: {len(looked)} of {len(found)} dependencies, no known weakness"
    )
    return 1 if weak else 0


if __name__ == "__main__":
    sys.exit(main())
