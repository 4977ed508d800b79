from vidtrack.command import main


def test_the_facts_of_a_bug_report_are_printed(capsys):
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    for part in ("python: 3.", "snakemake: 9", "cores: ", "memory: ", "decoders: h264", "workflow: "):
        assert part in said


def test_a_stale_lock_is_trouble(tmp_path, capsys):
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / ".snakemake/locks/0.lock").write_text("x")
    assert main(["doctor", str(tmp_path)]) == 1
    assert "vidtrack unlock" in capsys.readouterr().out


def test_a_missing_decoder_is_trouble(monkeypatch, capsys):
    monkeypatch.setattr("vidtrack.commands.doctor.CODECS", ("h264", "no_such_codec"))
    assert main(["doctor"]) == 1
    assert "decoders missing: no_such_codec" in capsys.readouterr().out
