"""Rows of a benchmark that never ran."""


def row(system, subject, dice=None, status="done", views="2x30", **more):
    """One row; hd95, folds: scores, other keywords are the row's fields."""
    hd95, folds = more.pop("hd95", None), more.pop("folds", 0.0)
    scores = {
        "structures": {"femur": {"dice": dice, "hd95_mm": hd95, "lost": False, "cut_off": False}},
        "groups": {"bones": {"dice": dice, "hd95_mm": hd95, "structures": 1}},
        "folds_percent": folds,
        "sd_log_jacobian": 0.1,
    }
    return {
        "case": f"{subject}-{views}",
        "dataset": "drawn",
        "subject": subject,
        "views": views,
        "system": system,
        "status": status,
        "reason": more.pop("reason", ""),
        "seconds": 1.0,
        "cpu_seconds": 1.0,
        "peak_memory_mib": 100.0,
        "notes": [],
        "scores": scores if status == "done" else {},
        **more,
    }
