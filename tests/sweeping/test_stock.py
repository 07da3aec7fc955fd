"""What a run finds in its folder: damage is reported and mended, nothing is lost or doubled."""

import shutil
import zlib

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fastncm.errors import SweepError
from fastncm.scene import load_scene
from fastncm.sweeping import Study, load, store, sweep
from fastncm.sweeping.manifest import read_manifest, write_manifest
from fastncm.sweeping.status import describe
from fastncm.sweeping.storage import Storage

CIRCLE = load_scene("snapfit-circle").replace({"path.steps": 10})
STUDY = Study(CIRCLE, {"jaw.height": np.linspace(0.0069, 0.0109, 70)}, curves=True)


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """A sweep of several parts, as it is before they are joined."""
    out = tmp_path_factory.mktemp("complete") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "PART_BYTES", 1)
        patch.setattr(store, "compact", lambda _: [])
        sweep(STUDY, out, jobs=1)
    assert len(list((out / "cases").iterdir())) >= 3
    return out


@pytest.fixture
def broken(complete, tmp_path):
    """A copy of it whose run was killed before it could say so."""
    out = tmp_path / "out"
    shutil.copytree(complete, out)
    storage = Storage(out)
    manifest = read_manifest(storage)
    manifest.state = "running"
    write_manifest(storage, manifest)
    return out


def largest(folder):
    """The part with the most rows."""
    return max(folder.glob("part-*"), key=lambda path: pq.read_metadata(path).num_rows)


def truncate(out):
    path = largest(out / "cases")
    path.write_bytes(path.read_bytes()[:-100])


def truncate_curves(out):
    path = largest(out / "curves")
    path.write_bytes(path.read_bytes()[:-100])


def empty(out):
    largest(out / "cases").write_bytes(b"")


def spoil_inside(out):
    """One byte of a data page, which the footer does not notice."""
    path = largest(out / "cases")
    data = bytearray(path.read_bytes())
    data[200] ^= 1
    path.write_bytes(bytes(data))


def spoil_curves(out):
    path = largest(out / "curves")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))


def lose_curves(out):
    largest(out / "curves").unlink()


def lose_cases(out):
    largest(out / "cases").unlink()


def double(out):
    shutil.copy(largest(out / "cases"), out / "cases" / "part-00077.parquet")


def leave_half_a_file(out):
    (out / "cases" / ".part-00078.parquet.tmp").write_bytes(b"PAR1")


def put_foreign_rows(out):
    """A part of the same form, whose parameters are not the study's."""
    path = largest(out / "cases")
    table = pq.read_table(path)
    keys = pa.array(table["case_key"].to_numpy() + 1)
    index = table.schema.get_field_index("case_key")
    pq.write_table(table.set_column(index, table.schema.field(index), keys), path)


def put_any_parquet(out):
    pd.DataFrame({"case_id": [1]}).to_parquet(out / "cases" / "part-00099.parquet")


@pytest.mark.parametrize(
    ("damage", "report"),
    [
        (truncate, "cases/part-.* is not a whole Parquet file"),
        (truncate_curves, "curves/part-.* has .* of its .* bytes"),
        (spoil_curves, "curves/part-.* is damaged inside"),
        (empty, "cases/part-.* is not a whole Parquet file"),
        (spoil_inside, "cases/part-.* is damaged inside"),
        (lose_curves, "curves/part-.* is missing"),
        (lose_cases, "removed 1 files of curves whose cases are not in a part"),
        (double, "cases/part-00077.parquet repeats cases"),
        (leave_half_a_file, "removed 1 half-written files"),
        (put_foreign_rows, "cases/part-.* holds rows of another study or solver"),
        (put_any_parquet, "cases/part-00099.parquet was not written by a sweep"),
    ],
)
def test_damage_is_reported_and_mended(complete, broken, damage, report, capsys):
    damage(broken)
    run = sweep(STUDY, broken, jobs=1)
    assert any(pd.Series(run.found).str.contains(report))
    assert run.found[0] in capsys.readouterr().err
    assert any(run.found[0] in line for line in describe(Storage(broken)))
    assert run.rows == 70
    for table in ("cases", "curves"):
        pd.testing.assert_frame_equal(load(broken, table), load(complete, table), check_exact=True)
    assert len(pd.read_parquet(broken / "cases")) == 70
    assert len(pd.read_parquet(broken / "curves")) == 700


def test_damage_to_a_complete_table_is_mended_too(complete, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(complete, out)
    assert not sweep(STUDY, out, jobs=1).fresh
    spoil_inside(out)
    with pytest.raises(SweepError, match="run again"):
        load(out)
    assert sweep(STUDY, out, jobs=1).fresh
    pd.testing.assert_frame_equal(load(out), load(complete), check_exact=True)
    assert not sweep(STUDY, out, jobs=1).fresh


def test_parts_whose_checksum_nobody_knows_are_looked_through(complete, broken):
    """A run that was killed before the manifest named its last part."""
    storage = Storage(broken)
    manifest = read_manifest(storage)
    assert len(manifest.checksums) == len(list((broken / "cases").iterdir()))
    manifest.checksums = {}
    write_manifest(storage, manifest)
    run = sweep(STUDY, broken, jobs=1)
    assert (run.resumed, run.rows, run.found) == (70, 70, ())
    (part,) = (broken / "cases").iterdir()
    assert read_manifest(storage).checksums == {part.name: zlib.crc32(part.read_bytes())}
    pd.testing.assert_frame_equal(load(broken), load(complete), check_exact=True)


def test_only_missing_cases_are_solved(broken, monkeypatch):
    lost = pq.read_metadata(largest(broken / "cases")).num_rows
    truncate(broken)
    solved = []
    add = store.Store.add

    def counting(self, finished):
        solved.extend(finished.case_ids)
        add(self, finished)

    monkeypatch.setattr(store.Store, "add", counting)
    run = sweep(STUDY, broken, jobs=1)
    assert len(solved) == len(set(solved)) == 70 - run.resumed == lost


def test_a_damaged_table_is_not_read_in_silence(broken):
    truncate(broken)
    with pytest.raises(SweepError, match="not a whole Parquet file.*run again"):
        load(broken)
    lines = describe(Storage(broken))
    assert "died" in lines[0]
    assert any(line.startswith("  damaged: cases/part-") for line in lines)


def test_parts_are_joined_at_the_end(complete, tmp_path):
    before = [len(list((complete / table).iterdir())) for table in ("cases", "curves")]
    out = sweep(STUDY, tmp_path / "out", jobs=1).out
    after = [len(list((out / table).iterdir())) for table in ("cases", "curves")]
    assert min(before) > 2
    assert after == [1, 1]
    for table in ("cases", "curves"):
        pd.testing.assert_frame_equal(load(out, table), load(complete, table), check_exact=True)
    schema = pq.read_schema(next((out / "cases").iterdir()))
    assert schema.field("peak_force_N").metadata == {b"unit": b"N"}
    assert {b"study", b"versions"} <= set(schema.metadata)


def test_columns_that_only_some_parts_have_are_empty_in_the_others(broken):
    """As with results that only some kinds of case have."""
    path = largest(broken / "cases")
    table = pq.read_table(path)
    extra = pa.field("extra_N", pa.float64(), metadata={"unit": "N"})
    pq.write_table(table.append_column(extra, pa.array(np.ones(len(table)))), path)
    expected = len(table)
    assert load(broken)["extra_N"].sum() == expected
    sweep(STUDY, broken, jobs=1)
    assert len(list((broken / "cases").iterdir())) == 1
    frame = load(broken)
    assert frame["extra_N"].sum() == expected
    assert frame["extra_N"].isna().sum() == 70 - expected
