"""The page of validation, from the answer of the program:

    signorini validate --json | python3 validate/page.py > docs/reference/validation.md
"""

import json
import sys
import textwrap


def number(x):
    if x == round(x) and abs(x) < 1e6:
        return f"{x:.0f}"
    # what is at the level of rounding has no second digit
    digits = 1 if abs(x) < 1e-11 else 3
    text = f"{x:.{digits}g}"
    return text.replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def accepted(low, high):
    if low is None:
        return f"≤ {number(high)}"
    if high is None:
        return f"≥ {number(low)}"
    return number(low) if low == high else f"{number(low)} to {number(high)}"


def row(check):
    what = check["what"].replace("|", "\\|")
    measured = "none" if check["measured"] is None else number(check["measured"])
    mark = "" if check["passes"] else " **(not accepted)**"
    return f"| {what} | {measured}{mark} | {accepted(*check['accepted'])} |"


def paragraph(text):
    print(textwrap.fill(text, 118, break_long_words=False, break_on_hyphens=False) + "\n")


def seconds(x):
    return f"{x:.0f}" if x >= 100 else f"{x:.2g}"


def main():
    cases = json.load(sys.stdin)["cases"]
    checks = sum(len(c["checks"]) for c in cases)
    passed = sum(k["passes"] for c in cases for k in c["checks"])
    print("# Validation\n")
    paragraph(
        f"What `signorini validate` prints on one machine: {checks} checks in {len(cases)} cases, {passed} accepted. Each case is computed anew and compared with a reference "
        "that this program did not produce (`validate/NAME/case.rs`); `make validation` writes this page. More measurements, with the tests that give them: [How good it is](../validation.md)."
    )
    for case in cases:
        print(f"## {case['name']}\n")
        title = case["title"]
        paragraph(f"{title[0].upper()}{title[1:]}. Against: {case['source']}. (`signorini validate {case['name']}`, {seconds(case['wall_s'])} s)")
        if case["error"]:
            print(f"**Failed**: {case['error']}")
            continue
        print("| what | measured | accepted |\n| --- | --- | --- |")
        print("\n".join(row(check) for check in case["checks"]) + ("\n" if case is not cases[-1] else ""))


main()
