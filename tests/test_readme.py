"""What the README says works as it stands there."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_its_programs_run(tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert blocks
    for folder in ("tests", "examples"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks:  # each goes on where the one before ended
        exec(compile(block, "README.md", "exec"), names)
    assert names["solution"].success
    assert "contact on" in names["lifted"].message
    assert names["p"].shape == (names["basis"].N,)
    assert (tmp_path / "isobars.png").stat().st_size > 10_000


def test_there_are_two_commands():
    commands = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    assert len(commands) == 2
    assert all("pip install" in c for c in commands)
    assert "skfem_dual solve" in commands[0]
    assert "pytest" in commands[1]


def test_architecture_names_every_package():
    for folder in (ROOT / "skfem_dual").iterdir():
        if folder.is_dir() and not folder.name.startswith("__"):
            assert f"\n{folder.name}/  " in README


def test_pictures_exist():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]*)\)", README)
    assert pictures
    for picture in pictures:
        assert (ROOT / picture).is_file()
