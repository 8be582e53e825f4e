"""A short part of the campaign of benchmarks/campaign.py: no answer wrong, errors that help."""

from collections import Counter
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from skfem_dual import HalfSpace, MeshError

FOLDER = Path(__file__).parents[1] / "benchmarks"
#: few cells are quick, and their contact is rough
pytestmark = pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")


def counts(trials):
    """How trials ended, and those that ended badly."""
    found = [(label, *run()) for label, run in trials]
    bad = [row for row in found if row[1] in ("wrong", "unclear")]
    return Counter(outcome for _, outcome, _ in found), bad


def test_wrong_arguments_of_grids_and_ground(load):
    campaign = load("campaign_arguments")
    names = ("check_mesh", "relocate", "general_triangulation", "rectangular_couple", "Layer")
    names += ("smooth_couple", "marked", "GridCouple", "HalfSpace", "grids.generate.disc")
    trials = [t for t in campaign.trials() if t[0].split("(")[0] in names]
    found, bad = counts(trials[::18])
    assert not bad
    assert found["clear"] > 50
    assert found["fine"] > 10


def test_random_meshes(load):
    found, bad = counts(islice(load("campaign_meshes").trials(seed=7), 8))
    assert not bad
    assert found["fine"] > 3
    assert found["clear"] > 1


def test_random_problems(load):
    campaign = load("campaign_problems")
    names = ("balance", "scaled", "moved", "renumbered")
    trials = (t for t in campaign.trials(seed=3) if t[0].split()[0] in names)
    found, bad = counts(islice(trials, 5))
    assert not bad
    assert found["fine"] > 2


def test_damaged_files(load):
    campaign = load("campaign_files")
    found, bad = counts(islice(campaign.ground_trials(0), 30))
    assert not [row for row in bad if row[1] == "wrong"]
    assert found["clear"] > 10
    found, bad = counts(islice(campaign.record_trials(0), 4))
    assert not bad


def test_the_campaign_sees_faults(load):
    """It tells an error from inside, one that names the argument and another answer apart."""
    campaign = load("campaign_arguments")

    def inside(x):
        return x.shape

    def named(x):
        raise ValueError("x is no good")

    def of_bytes(x):
        return float(np.frombuffer(np.asarray(x).tobytes()).sum())

    right = np.ones(3)
    for function, value, expected, outcome in (
        (inside, None, None, "unclear"),
        (named, None, None, "clear"),
        (of_bytes, right.astype(">f8"), right, "wrong"),
        (of_bytes, right.tolist(), right, "fine"),
    ):
        call = campaign.Call("it", function, {"x": right})
        assert campaign.judged(call, "x", value, expected)[0] == outcome
    assert campaign.clarity(KeyError("x"), "x") == "unclear"
    for error in (MeshError, ValueError):
        with pytest.raises(error) as caught:
            raise error("expected something else")
        assert campaign.clarity(caught.value, "x") == "unclear"  # not raised by the package
    with pytest.raises(ValueError, match="expected") as caught:
        HalfSpace(-1.0, 0.0)
    assert campaign.clarity(caught.value, "stiffness") == "clear"


def test_processes_that_hang_or_crash_are_told(load, monkeypatch, tmp_path):
    """Of four trials one hangs and one ends the process; the others are judged."""
    campaign = load("campaign")
    (tmp_path / "campaign_bad.py").write_text(
        "import os, time\n"
        "def trials(seed=0):\n"
        "    yield 'good', lambda: ('fine', '')\n"
        "    yield 'slow', lambda: time.sleep(60)\n"
        "    yield 'dead', lambda: os._exit(3)\n"
        "    yield 'last', lambda: ('clear', 'said')\n"
    )
    driver = tmp_path / "campaign.py"
    text = (FOLDER / "campaign.py").read_text(encoding="utf-8")
    driver.write_text(text.replace("KINDS = {", 'KINDS = {"bad": ("campaign_bad", {}),'))
    monkeypatch.setattr(campaign, "__file__", str(driver))
    monkeypatch.setattr(campaign, "PATIENCE", 3.0)
    monkeypatch.setattr(campaign, "START", 60.0)
    found = list(campaign.found_in("bad"))
    assert [(outcome, label) for outcome, label, _ in found] == [
        ("fine", "good"),
        ("hang", "slow"),
        ("crash", "dead"),
        ("clear", "last"),
    ]
