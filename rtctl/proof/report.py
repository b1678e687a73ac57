"""Markdown report of scores: main table, failures, confusion matrix, reliability, smallest size that was found."""

from typing import Any

Json = dict[str, Any]


def table(head: list[str], rows: list[list[Any]]) -> str:
    """Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(_cell(x) for x in row) + " |" for row in rows])


def _cell(x: Any) -> str:
    if x is None:
        return "-"
    return f"{x:.3g}" if isinstance(x, float) else str(x).replace("|", "/")


def summary(R: Json) -> list[list[Any]]:
    """Rows (quantity, value, number of cases) of the main table."""
    single, null, unknown = R["single"], R["null"], R["unknown"]
    rows: list[list[Any]] = [["single effects: right name", single["top1"], single["cases"]]]
    rows += [[f"- at size {s}", x["top1"], x["cases"]] for s, x in single["by_size"].items()]
    rows += [
        ["- macro recall over names", single["macro_recall"], len(R["recall_by_name"])],
        ["- invisible effects: acceptable answers", single["invisible_fine"], single["invisible_cases"]],
        ["right node", R["node_accuracy"], None], ["right axis", R["axis_accuracy"], None],
        ["precision of given names", R["named_precision"], R["names_given"]],
        [f"false alarms without missing physics, 95 % {null['wilson95']}", null["false_alarm_rate"], null["cases"]],
        [f"unknown physics with a name, 95 % {unknown['wilson95']}", unknown["false_name_rate"], unknown["cases"]],
        ["- noticed", unknown["noticed"], None], ["- right node", unknown["located_node"], None],
    ]  # fmt: skip
    for kind in ("pair", "triple"):
        x = R[kind]
        rows.append([f"{kind}s: all effects and no other", x["exactly"], x["cases"]])
        rows.append([f"- all effects, at least one: {_cell(x['all_found'])}, {_cell(x['at_least_one'])}", None, None])
    gap, ci, cal = R["heldout_gap_closed"], R["intervals"], R["calibration"]
    rows += [["held-out gap closed, median", gap["median"], gap["cases"]]]
    for name in ("base", "effects"):
        share = ci[name]["held"] / ci[name]["of"] if ci[name]["of"] else None
        rows.append([f"90 % intervals that contain the true value, {name}", share, ci[name]["of"]])
    rows += [["Brier score of the confidence", cal["brier"], cal["names"]],
             ["expected calibration error", cal["ece"], cal["names"]]]  # fmt: skip
    rows.append(["null cases: p-value of an excess of evidence", R["nulls"]["p_value"], R["nulls"]["cases"]])
    if R.get("seconds"):
        rows.append(
            ["seconds a case, median (longest)", f"{R['seconds']['median']:.1f} ({R['seconds']['longest']:.1f})", None]
        )
    rows.append(["cases without an answer", R["missing"], R["cases"]])
    return rows


def by_plant(R: Json) -> list[list[Any]]:
    """Rows of the table by plant or topology: shares with numbers of cases."""
    return [
        [name, x["cases"], f"{_cell(x['single'])} ({x['singles']})", f"{_cell(x['typical'])} ({x['typicals']})",
         x["node"], f"{x['false_alarms']} of {x['nulls']}", f"{x['false_names']} of {x['unknowns']}",
         f"{_cell(x['pairs_found'])} ({x['pairs']})"]
        for name, x in R["by_plant"].items()
    ]  # fmt: skip


def confusion(R: Json) -> str:
    """Confusion matrix as a list of its non-empty cells."""
    rows = []
    for truth, columns in R["confusion"].items():
        ordered = sorted(columns.items(), key=lambda x: -x[1])
        rows.append([truth, sum(columns.values()), ", ".join(f"{name} {n}" for name, n in ordered)])
    return table(["truth", "cases", "answers"], rows)


def markdown(R: Json, title: str = "Concealed cases") -> str:
    """Complete report as Markdown."""
    parts = [f"## {title}", table(["quantity", "value", "cases"], summary(R))]
    if R.get("by_plant"):
        parts += ["### By machine", table(["machine", "cases", "right name", "at typical size", "right node",
                                           "false alarms", "unknown with a name", "pairs"], by_plant(R))]  # fmt: skip
    smallest = [[n, x["ratio"], x["found"], x["of"]] for n, x in R["smallest_ratio_found"].items()]
    parts += ["### Smallest size found", "Change in the recording over the noise floor, for correctly named effects.",
              table(["effect", "smallest ratio", "named", "cases"], smallest)]  # fmt: skip
    bins = [[f"{b['from']:.1f} to {b['to']:.1f}", b["names"], b["confidence"], b["right"]]
            for b in R["calibration"]["table"]]  # fmt: skip
    parts += ["### Reliability", table(["confidence", "names", "mean confidence", "share of right names"], bins)]
    parts += ["### Answers to each truth", confusion(R)]
    failed = [[f["case"], f["plant"], f["kind"], f["truth"], f["size"], f["ratio"], f["verdict"], ", ".join(f["names"])]
              for f in R["failures"]]  # fmt: skip
    parts += ["### Failures", table(["case", "plant", "kind", "truth", "size", "ratio", "verdict", "names"], failed)]
    return "\n\n".join(parts) + "\n"
