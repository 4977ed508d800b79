from vidtrack.command import main


def experiment(folder):
    (folder / "config.yaml").write_text("units: m\ncameras: {cam1: }\nexperiment: lab\n")
    (folder / "lab/results").mkdir(parents=True)


def test_the_path_of_the_report_is_printed(tmp_path, capsys):
    experiment(tmp_path)
    (tmp_path / "lab/results/report.html").write_text("<p>")
    assert main(["report", str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{tmp_path}/lab/results/report.html\n"


def test_a_report_that_is_not_written_yet_is_said_to_be_so(tmp_path, capsys):
    experiment(tmp_path)
    assert main(["report", str(tmp_path)]) == 1
    assert "not written yet. Call vidtrack run" in capsys.readouterr().err


def test_on_a_terminal_the_report_opens_in_the_browser(tmp_path, capsys, monkeypatch):
    experiment(tmp_path)
    path = tmp_path / "lab/results/report.html"
    path.write_text("<p>")
    opened = []
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    assert main(["report", str(tmp_path)]) == 0
    assert opened == [path.as_uri()]
    assert capsys.readouterr().out == ""


def test_where_no_browser_opens_the_path_is_printed(tmp_path, capsys, monkeypatch):
    experiment(tmp_path)
    path = tmp_path / "lab/results/report.html"
    path.write_text("<p>")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    assert main(["report", str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
