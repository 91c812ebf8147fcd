"""The modules that are changed, and the tests that are meant to hold each."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PLACE = ROOT / ".mutation"

# Each module, and the files in tests that are meant to hold it.
MODULES = {
    "predprey_env/rules/torus.py": "predprey_env/test_torus",
    "predprey_env/rules/dynamics.py": "predprey_env/test_dynamics predprey_env/test_parallel_env "
    "predprey_env/test_parallel_env_turns predprey_env/test_invariants predprey_env/test_observation",
    "predprey_env/rules/fitness.py": "predprey_env/test_fitness predprey_env/test_parallel_env_rewards",
    "predprey_env/rules/observation.py": "predprey_env/test_observation predprey_env/test_parallel_env",
    "predprey_env/rules/starts.py": "predprey_env/test_dynamics predprey_env/test_parallel_env_randomness "
    "predprey_env/test_parallel_env_errors esp_trainer/evaluation/test_starts predprey_env/test_vector_env "
    "predprey_env/test_vector_env_parity",
    "esp_trainer/esp/operators.py": "esp_trainer/esp/test_operators",
    "esp_trainer/esp/subpopulations.py": "esp_trainer/esp/test_subpopulations "
    "esp_trainer/esp/test_subpopulations_of_several_kinds",
    "esp_trainer/esp/network.py": "esp_trainer/esp/test_network esp_trainer/esp/test_teams_of_every_controller "
    "esp_trainer/esp/test_controllers_of_several_networks esp_trainer/networks/test_networks",
    "esp_trainer/networks/activations.py": "esp_trainer/esp/test_network esp_trainer/networks/test_networks",
    "esp_trainer/networks/feedforward.py": "esp_trainer/esp/test_network esp_trainer/networks/test_networks "
    "esp_trainer/esp/test_controllers_of_several_networks",
    "esp_trainer/coevolution/champions.py": "esp_trainer/coevolution/test_champions "
    "esp_trainer/coevolution/test_fixed_sides",
    "esp_trainer/coevolution/sharing.py": "esp_trainer/coevolution/test_sharing",
    "esp_trainer/coevolution/opponents.py": "esp_trainer/coevolution/test_opponents",
}
NAMES = {Path(module).stem: module for module in MODULES}
# What holds the compiled faces of the world to the plain ones, beside a module's own tests.
COMPILED = "tests/esp_trainer/evaluation/test_parity.py"
