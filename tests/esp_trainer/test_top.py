"""What the package offers at its top."""

import subprocess
import sys

import pytest

import esp_trainer


def test_every_name_of_the_top_is_there() -> None:
    assert set(esp_trainer.__all__) <= set(dir(esp_trainer))
    for name in esp_trainer.__all__:
        assert getattr(esp_trainer, name) is not None
        assert getattr(esp_trainer, name).__class__.__name__ != "module"


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = esp_trainer.nothing


def test_the_former_name_of_the_worlds_warns() -> None:
    with pytest.warns(DeprecationWarning, match=r"^esp_trainer.TASKS is now esp_trainer.WORLDS, and goes in 0.4.0$"):
        assert esp_trainer.TASKS is esp_trainer.WORLDS


def test_to_load_a_team_does_not_import_the_kernel_and_the_analysis() -> None:
    later = ["esp_trainer.evaluation.kernel", "esp_trainer.analysis.games", "choix"]
    code = f"import sys, esp_trainer; esp_trainer.load_team; print([name for name in {later} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
