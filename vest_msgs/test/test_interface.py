#!/usr/bin/env python3
"""Protects the frozen interface: CRTK wire types keep crtk_msgs 1.3.0's MD5 sums, and every field says its unit."""
import pathlib
import re
import sys

import vest_msgs.msg
import vest_msgs.srv

CRTK_MD5 = {  # crtk_msgs 1.3.0
    vest_msgs.msg.OperatingState: "b1bd4021639d9d9c5fbfff78d6ff3158",
    vest_msgs.msg.StringStamped: "5e3e46086181199270f1ac3a28a5977f",
    vest_msgs.srv.TriggerOperatingState: "d941a2d049e2c9ac5773fc4a3a8a892d",
    vest_msgs.srv.QueryForwardKinematics: "787c6da7a75e9886573c4af11f1a381f",
    vest_msgs.srv.QueryInverseKinematics: "ce8dbc3b4384e2f7567488e7e75496d8",
}
UNIT = re.compile(
    r"no unit|scaled|units inside|unit of|stamp|time (of|at)|bit mask|quaternion|"
    r"\b(rad|m|m2|m3|m/s|s|Hz|Pa|K|N|J|V|kg|pixel|byte|N/m|kg/m2|kg/m3|m3/s|rad/s|N·m|N·s|N·s/m|m3/s)\b")


def main():
    failed = 0
    for kind, md5 in CRTK_MD5.items():
        if kind._md5sum != md5:
            print(f"{kind._type}: MD5 {kind._md5sum}, crtk_msgs 1.3.0 has {md5}")
            failed += 1
    fields = 0
    for path in sorted(pathlib.Path(sys.argv[1]).glob("*/*")):
        if path.suffix not in (".msg", ".srv", ".action"):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            code, _, comment = line.partition("#")
            if not code.strip() or code.strip() == "---" or "=" in code:
                continue
            fields += 1
            if not UNIT.search(comment):
                print(f"{path}:{number}: field without a unit: {line.strip()}")
                failed += 1
    if fields < 200:
        print(f"only {fields} fields found: the check looked at the wrong folder")
        failed += 1
    print(f"{fields + len(CRTK_MD5) - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
