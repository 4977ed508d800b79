from vidtrack.report.addresses import addresses, run_file


def test_names_with_spaces_and_signs_are_written_as_addresses_are():
    found = addresses(["50 %", "a#1"], ["cam 1"], calibration=True, folder="report/")
    assert found["run-50 %"] == "report/run_50%20%25.html"
    assert found["run-a#1"] == "report/run_a%231.html"
    assert found["camera-cam 1"] == "report/calibration.html#camera-cam%201"
    assert run_file("50 %") == "run_50 %.html"


def test_without_a_calibration_nothing_leads_to_its_page():
    assert addresses(["r"], ["cam1"], calibration=False) == {"run-r": "run_r.html"}
