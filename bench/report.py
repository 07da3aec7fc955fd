"""Puts the studies' sections together: bench/REPORT.md, from the tables in results/ alone.

Nothing in the report is typed by hand: `make bench` runs the studies and then this file. A study
that has not been run here is named as missing.
"""

import importlib

from support import ROOT, machine

STUDIES = (
    "work_precision",
    "profiles",
    "profiles_direct",
    "throughput",
    "ipopt",
    "convergence",
    "direct_contact",
    "finite_elements",
    "calculix",
    "friction",
    "atlas",
    "leaving_out",
    "scaling",
    "sweeping",
    "million",
    "first_use",
)
"""In the order of the report."""


def main() -> None:
    headlines, sections = [], []
    for name in STUDIES:
        study = importlib.import_module(name)
        try:
            said, section = study.headlines(), study.section()
        except FileNotFoundError as missing:
            said = [f"not run here: `bench/{name}.py` (no {missing.filename})"]
            section = ""
        headlines += [f"- {sentence}" for sentence in said]
        sections.append(section)
    here = ", ".join(f"{key} {value}" for key, value in machine().items())
    page = [
        "# fastncm: error against run time, extreme cases, what leaving out saves",
        "Written by `bench/report.py` from `bench/results/`; `make bench` makes all of it anew.",
        "## In a hurry",
        "\n".join(headlines),
        f"Put together on: {here}. Each section names the machine that its figures come from.",
        *filter(None, sections),
    ]
    file = ROOT / "bench" / "REPORT.md"
    file.write_text("\n\n".join(page) + "\n")
    print(file.relative_to(ROOT))


if __name__ == "__main__":
    main()
